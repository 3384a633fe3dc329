//! `mrol-lab experiment mapping`: measures time and growth scan by scan, by hash tables and by Bloom filters (paper
//! IV-C).

use std::fmt::{self, Display};
use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::cli::bench::workload::MapOptions;
use crate::cli::sequence;
use crate::experiment::drift::drifting;
use crate::experiment::mapping::{Mapped, Mapping as Growing, OwnMap};
use crate::report::chart::{Axis, Curve, Panel, Scale, Style, panels};
use crate::report::{Table, folder};
use crate::rivals::{HashTables, WeightedSum};
use crate::workload::Scan;
use mrol::console::error::CliError;
use mrol::console::map_report::count;
use mrol::console::output::Output;
use mrol::console::statistics::Statistics;
use mrol::console::truth::true_poses;
use mrol::offline::{ErrorSummary, TruthErrors};
use mrol_map::align::{AlignmentSettings, Method, align, ascend};
use mrol_map::geometry::Pose;
use mrol_map::map::{MultiResolutionMap, RobotName};

const EXAMPLES: &str = "\
EXAMPLES:
  mrol-lab experiment mapping scans/ --resolution 0.05 --out results/ --truth poses.txt
  mrol-lab experiment mapping scans/ --resolution 0.05 --out results/ --odometry poses_odometry.txt --json

Fig. 5 of the paper. The same scans go into three maps by the paper's method, each from the last pose: look-ups by Bloom
filters, by hash tables (a set of packed keys a level, as before the paper), and, with the method of today, refined; into a
fourth, by the older objective, a weighted sum of the hits at all levels. Each
scan goes into every map, wherever it was found to be. A fifth map takes them where odometry says: --odometry, or a file
poses_odometry.txt beside the scans, or the truth with a seeded drift of 2 % of the way and half a degree a meter. Our
own map's updates are those of its moments too, which the refinement needs. On one core. Writes mapping.svg, mapping.csv
(every scan) and mapping.md.";

/// File with the poses by odometry that is looked for in the folder of the scans.
const ODOMETRY_FILE: &str = "poses_odometry.txt";

/// Experiment 3 of the paper: time a scan, and growth of the map, by hash tables and by Bloom filters
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Mapping {
    /// Scan files, or folders of them: .ply .pcd .xyz .npy .bin .f32 .3d
    #[arg(required = true, value_name = "DIR_OR_FILES")]
    scans: Vec<PathBuf>,
    /// Where to write the results; made if it is not there
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Side of a finest voxel, meters
    #[arg(long, value_name = "METERS", default_value_t = 0.05)]
    resolution: f64,
    /// True poses of the scans, a TUM file: report the errors
    #[arg(long, value_name = "FILE")]
    truth: Option<PathBuf>,
    /// Poses of the scans by odometry, a TUM file
    #[arg(long, value_name = "FILE")]
    odometry: Option<PathBuf>,
    /// Largest number of scans
    #[arg(long, value_name = "N", default_value_t = 30, value_parser = clap::value_parser!(u16).range(2..=10_000))]
    scans_max: u16,
    /// Seed of the odometry's drift, where it is simulated from the truth
    #[arg(long, default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    map: MapOptions,
}

impl Mapping {
    pub(super) fn run(self, output: &Output) -> Result<(), CliError> {
        let scans = sequence::read(&self.scans, self.truth.as_deref(), self.scans_max.into(), output)?;
        let truth: Option<Vec<Pose>> = scans.iter().map(|scan| scan.map_from_sensor).collect();
        let odometry = self.odometry(scans.len(), truth.as_deref(), output)?;
        folder(&self.out)?;
        let series = self.map(&scans, odometry.as_deref(), output)?;
        output.say(Line::HEAD)?;
        let errors = |series: &Series| truth.as_ref().map(|truth| series.errors(truth));
        for series in &series {
            output.print(&Line::of(series, errors(series)))?;
        }
        write_scans(&series, truth.as_deref(), &self.out.join("mapping.csv"))?;
        write_maps(&series, errors, &self.out.join("mapping.md"))?;
        Ok(panels(&self.out.join("mapping.svg"), &[times(&series), growth(&series)])?)
    }

    /// Poses of the scans by odometry, in the frame of the first.
    fn odometry(
        &self,
        scans: usize,
        truth: Option<&[Pose]>,
        output: &Output,
    ) -> Result<Option<Vec<Pose>>, CliError> {
        let beside = self.scans.iter().map(|path| path.join(ODOMETRY_FILE)).find(|path| path.is_file());
        let poses = match (self.odometry.clone().or(beside), truth) {
            (Some(file), _) => true_poses(&file, scans, output)?,
            (None, Some(truth)) => drifting(truth, self.seed),
            (None, None) => {
                output.note("odometry alone is left out: there is neither --odometry nor --truth");
                return Ok(None);
            }
        };
        Ok(Some(poses.iter().map(|pose| poses[0].inv_mul(pose)).collect()))
    }

    /// Maps scan by scan into all maps in turn, so that other load of the machine affects all of them.
    fn map(
        &self,
        scans: &[Scan],
        odometry: Option<&[Pose]>,
        output: &Output,
    ) -> Result<Vec<Series>, CliError> {
        let overlap = AlignmentSettings { method: Method::Overlap, ..AlignmentSettings::default() };
        let refined = AlignmentSettings::default();
        let (mut bloom, mut refining, mut by_odometry) = (self.own_map()?, self.own_map()?, self.own_map()?);
        let mut by_sum = self.own_map()?;
        let lattice = *bloom.map().map.lattice();
        let mut hash_tables = Growing::new(HashTables::new(lattice));
        let mut series = ["bloom", "hash table", "bloom, refined", "weighted sum"].map(Series::new);
        let mut odometry_alone = Series::new("odometry");
        let bar = output.clone().with_bar(scans.len());
        for (k, scan) in scans.iter().enumerate() {
            let points = &scan.points;
            let mapped = [
                bloom.add(points, |own, points, guess| ascend(&own.map, points, guess, &overlap)),
                hash_tables.add(points, |tables, points, guess| ascend(tables, points, guess, &overlap)),
                refining.add(points, |own, points, guess| {
                    align(&own.map, points, guess, &refined).map_from_sensor
                }),
                by_sum.add(points, |own, points, guess| {
                    ascend(&WeightedSum(&own.map), points, guess, &overlap)
                }),
            ];
            series.iter_mut().zip(mapped).for_each(|(series, mapped)| series.scans.push(mapped));
            odometry_alone.scans.extend(odometry.map(|poses| by_odometry.add(points, |_, _, _| poses[k])));
            bar.step();
        }
        bar.clear_bar();
        let with_scans = |series: &Series| !series.scans.is_empty();
        Ok(series.into_iter().chain([odometry_alone]).filter(with_scans).collect())
    }

    fn own_map(&self) -> Result<Growing<OwnMap>, CliError> {
        let settings = self.map.settings(self.resolution)?;
        let map = MultiResolutionMap::new(settings).map_err(CliError::usage)?;
        let robot = RobotName::new("experiment").map_err(CliError::failed)?;
        Ok(Growing::new(OwnMap { map, robot }))
    }
}

/// Results of all scans in one map.
struct Series {
    map: &'static str,
    scans: Vec<Mapped>,
}

const ODOMETRY: &str = "odometry";

impl Series {
    fn new(map: &'static str) -> Self {
        Self { map, scans: Vec::new() }
    }

    /// Errors against `truth`, meters and degrees, with their summary.
    fn errors(&self, truth: &[Pose]) -> (Vec<(f64, f64)>, Option<ErrorSummary>) {
        let mut errors = TruthErrors::new(truth.to_vec());
        let of_scans =
            self.scans.iter().enumerate().map(|(k, mapped)| errors.add(k, &mapped.map_from_sensor)).collect();
        (of_scans, errors.summary())
    }

    fn aligns(&self) -> bool {
        self.map != ODOMETRY
    }

    /// The median over every scan but the first, which is aligned to nothing.
    fn median(&self, of: fn(&Mapped) -> f64) -> f64 {
        let values = self.scans.iter().skip(1).map(of).collect();
        Statistics::of(values).map_or(0.0, |statistics| statistics.median)
    }

    fn curve(&self, name: String, color: usize, style: Style, of: fn(&Mapped) -> f64) -> Curve {
        let points = self.scans.iter().enumerate().map(|(k, mapped)| (k as f64, of(mapped))).collect();
        Curve { name, color, style, points }
    }
}

/// The first panel of Fig. 5.
fn times(series: &[Series]) -> Panel {
    let aligned = series.iter().enumerate().filter(|(_, series)| series.aligns());
    let curves = aligned.flat_map(|(color, series)| {
        let mut alignment =
            series.curve(format!("{}: alignment", series.map), color, Style::Solid, |mapped| mapped.align_ms);
        alignment.points.remove(0);
        let update =
            series.curve(format!("{}: update", series.map), color, Style::Dashed, |mapped| mapped.update_ms);
        [alignment, update]
    });
    Panel {
        title: "Time a scan, one core".into(),
        x: Axis { name: "scan", scale: Scale::Linear },
        y: Axis { name: "ms", scale: Scale::Logarithmic },
        curves: curves.collect(),
    }
}

/// The second panel of Fig. 5.
fn growth(series: &[Series]) -> Panel {
    let curve = |(color, series): (usize, &Series)| {
        // Drawn on top of the curve of the Bloom filters, which a solid curve would hide.
        let style = if series.map == "hash table" { Style::Dashed } else { Style::Solid };
        series.curve(series.map.to_owned(), color, style, |mapped| mapped.voxels as f64)
    };
    Panel {
        title: "Growth of the map".into(),
        x: Axis { name: "scan", scale: Scale::Linear },
        y: Axis { name: "occupied voxels", scale: Scale::Linear },
        curves: series.iter().enumerate().map(curve).collect(),
    }
}

fn write_scans(series: &[Series], truth: Option<&[Pose]>, path: &Path) -> Result<(), CliError> {
    let head = ["scan", "map", "align_ms", "update_ms", "voxels", "error_m", "error_deg"];
    let mut table = Table::new(&head[..if truth.is_some() { 7 } else { 5 }]);
    for series in series {
        let errors = truth.map(|truth| series.errors(truth).0);
        for (k, mapped) in series.scans.iter().enumerate() {
            let times = [mapped.align_ms, mapped.update_ms].map(|ms| format!("{ms:.3}"));
            let error =
                errors.as_ref().map(|errors| [format!("{:.5}", errors[k].0), format!("{:.4}", errors[k].1)]);
            let cells = [k.to_string(), series.map.replace(',', "")].into_iter().chain(times);
            table.push(cells.chain([mapped.voxels.to_string()]).chain(error.into_iter().flatten()));
        }
    }
    Ok(table.write_csv(path)?)
}

type Errors = (Vec<(f64, f64)>, Option<ErrorSummary>);

fn write_maps(
    series: &[Series],
    errors: impl Fn(&Series) -> Option<Errors>,
    path: &Path,
) -> Result<(), CliError> {
    let mut table = Table::new([
        "map",
        "median ms to align",
        "median ms to update",
        "voxels",
        "median error",
        "largest error",
    ]);
    for series in series {
        let Line { map, align_ms, update_ms, voxels, error_m, error_deg, .. } =
            Line::of(series, errors(series));
        let error = |of: fn(&Statistics) -> f64| match (&error_m, &error_deg) {
            (Some(meters), Some(degrees)) => format!("{:.4} m {:.3} deg", of(meters), of(degrees)),
            _ => "-".to_owned(),
        };
        let align = align_ms.map_or("-".to_owned(), |ms| format!("{ms:.2}"));
        let update = format!("{update_ms:.2}");
        table.push([map.to_owned(), align, update, count(voxels), error(|s| s.median), error(|s| s.max)]);
    }
    Ok(table.write_markdown(path)?)
}

/// The result of one map.
#[derive(Serialize)]
struct Line {
    map: &'static str,
    scans: usize,
    /// Median over every scan but the first, milliseconds.
    #[serde(skip_serializing_if = "Option::is_none")]
    align_ms: Option<f64>,
    update_ms: f64,
    voxels: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    error_m: Option<Statistics>,
    #[serde(skip_serializing_if = "Option::is_none")]
    error_deg: Option<Statistics>,
}

impl Line {
    const HEAD: &str = "map             scans  align ms  update ms      voxels  median error";

    fn of(series: &Series, errors: Option<Errors>) -> Self {
        let error = errors.and_then(|(_, summary)| summary);
        Self {
            map: series.map,
            scans: series.scans.len(),
            align_ms: series.aligns().then(|| series.median(|mapped| mapped.align_ms)),
            update_ms: series.median(|mapped| mapped.update_ms),
            voxels: series.scans.last().map_or(0, |mapped| mapped.voxels),
            error_m: error.map(|error| error.meters),
            error_deg: error.map(|error| error.degrees),
        }
    }
}

impl Display for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { map, scans, update_ms, .. } = self;
        let align = self.align_ms.map_or("-".to_owned(), |ms| format!("{ms:.2}"));
        write!(f, "{map:<15} {scans:>5}  {align:>8}  {update_ms:>9.2}  {:>10}", count(self.voxels))?;
        match (&self.error_m, &self.error_deg) {
            (Some(meters), Some(degrees)) => write!(f, "  {:.4} m {:.3} deg", meters.median, degrees.median),
            _ => Ok(()),
        }
    }
}
