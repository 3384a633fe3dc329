//! `mrol-lab experiment carving`: what a map loses of what is taken away, and what it keeps of what stands.

use std::collections::BTreeSet;
use std::fmt::{self, Display};
use std::path::{Path, PathBuf};
use std::time::Duration;

use serde::Serialize;

use crate::experiment::carving::{CarvingFigures, CarvingMapper, CarvingTrial};
use crate::experiment::exact_rays::ExactRays;
use crate::report::folder;
use crate::workload::Scan;
use mrol::console::error::CliError;
use mrol::console::output::Output;
use mrol::console::truth::true_poses;
use mrol::console::{PlanLayer, plan};
use mrol_map::map::{LEVELS_DEFAULT, MapSettings};
use mrol_map::mapping::CarvingSettings;
use mrol_map::scan::{read_points, scan_files};
use mrol_map::visibility::{SensorModel, Thresholds};
use mrol_map::voxel::VoxelKey;
use mrol_simulate::SpinningLidar;

const EXAMPLES: &str = "\
EXAMPLES:
  mrol-lab experiment carving
  mrol-lab experiment carving --sensor \"spinning 64 1024 -21.65625 21.65625\"      the simulated lidar, as a known sensor
  mrol-lab experiment carving --scans street/ --resolution 0.2 --out results/
  mrol-lab experiment carving --sensitivity --count 60                            does it matter what each threshold is?

Without --scans a robot with a lidar (64 rings of 1024 points, noise of 1 cm) drives rounds in a hall in which a person walks to
and fro and a box is taken away; each scan is aligned and carves. Prints which share of the box was gone after the next scan,
which share of the walker's trail at the end, and which share of walls, floor, ceiling and furniture was kept, against a map of
the same scans that does not carve.

With --scans the scans of a folder with poses.txt (a TUM file, line k for scan k) are mapped with carving and without, each from
constant velocity. Writes carving.svg: the map from above, with what was carved and did not come back.";

/// What a map loses of what is taken away, and what it keeps of what stands
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Carving {
    /// Map the scans of this folder instead of simulated ones
    #[arg(long = "scans", value_name = "DIR", requires = "out")]
    folder: Option<PathBuf>,
    /// Simulated scans
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = clap::value_parser!(u16).range(10..=2000))]
    count: u16,
    /// Side of a finest voxel, meters
    #[arg(long, value_name = "METERS", default_value_t = 0.05)]
    resolution: f64,
    /// Voxels around the surface that a scan shows that it never carves
    #[arg(long, value_name = "VOXELS", default_value_t = CarvingSettings::default().margin_voxels)]
    margin: u32,
    /// A surface that is seen at a smaller angle is not told from a rim
    #[arg(long, value_name = "DEGREES", default_value_t = CarvingSettings::default().grazing_deg)]
    grazing: f64,
    /// Voxels farther away are not carved
    #[arg(long, value_name = "METERS", default_value_t = CarvingSettings::default().range_max_m)]
    range: f64,
    /// How the rays of the sensor lie: "spinning RINGS COLUMNS LOWEST_DEG HIGHEST_DEG" or "pinhole WIDTH HEIGHT FX FY"
    #[arg(long, value_name = "MODEL")]
    sensor: Option<SensorModel>,
    /// Map the simulated scans, at their true poses, once for each threshold that is 0.7 and 1.4 times as large, and
    /// once each with voxels carved that so many exact rays crossed
    #[arg(long, conflicts_with = "folder")]
    sensitivity: bool,
    /// Seed of the hall and of the noise
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Where to write the picture; made if it is not there
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

impl Carving {
    pub(super) fn run(self, output: &Output) -> Result<(), CliError> {
        let carving = CarvingSettings {
            margin_voxels: self.margin,
            grazing_deg: self.grazing,
            range_max_m: self.range,
            ..CarvingSettings::default()
        };
        let carving = carving.checked().map_err(CliError::usage)?;
        match (&self.folder, &self.out) {
            (Some(scans), Some(out)) => self.map_scans(scans, out, carving, output),
            _ if self.sensitivity => self.vary_thresholds(carving, output),
            _ => self.simulate(carving, output),
        }
    }

    fn trial(&self, carving: CarvingSettings, at_true_poses: bool) -> CarvingTrial {
        CarvingTrial {
            scans: self.count.into(),
            scans_a_round: 50,
            resolution_m: self.resolution,
            lidar: SpinningLidar { rings: 64, azimuths: 1024, ..SpinningLidar::default() },
            sensor: self.sensor,
            carving,
            at_true_poses,
            seed: self.seed,
        }
    }

    fn vary_thresholds(&self, carving: CarvingSettings, output: &Output) -> Result<(), CliError> {
        let usual = Thresholds::DEFAULT;
        let mut rows = vec![("as they are", "", 1.0, usual)];
        for (name, unit, _) in usual.rows() {
            let scaled = FACTORS.map(|factor| Some((name, unit, factor, usual.scaled(name, factor)?)));
            rows.extend(scaled.into_iter().flatten());
        }
        let by = |thresholds| (CarvingSettings { thresholds, ..carving }, None);
        let mut ways: Vec<_> = rows.iter().map(|(.., thresholds)| by(*thresholds)).collect();
        for rays_min in EXACT_RAYS {
            let margin_voxels = self.margin as i32;
            let exact = ExactRays { rays_min, margin_voxels, range_max_m: self.range };
            rows.push(("exact rays, at least", "rays", rays_min as f32, usual));
            ways.push((carving, Some(exact)));
        }
        let trial = self.trial(carving, true);
        let bar = output.clone().with_bar(trial.scans);
        let figures = trial.run_with(&ways, || bar.step()).map_err(CliError::failed)?;
        bar.clear_bar();
        for ((name, unit, factor, _), figures) in rows.iter().zip(&figures) {
            output.print(&Varied::of(name, unit, *factor, figures))?;
        }
        Ok(())
    }

    fn simulate(&self, carving: CarvingSettings, output: &Output) -> Result<(), CliError> {
        let trial = self.trial(carving, false);
        let bar = output.clone().with_bar(trial.scans);
        let figures = trial.run(|| bar.step()).map_err(CliError::failed)?;
        bar.clear_bar();
        output.print(&Simulated::of(trial.scans, &figures))
    }

    fn map_scans(
        &self,
        scans: &Path,
        out: &Path,
        carving: CarvingSettings,
        output: &Output,
    ) -> Result<(), CliError> {
        folder(out)?;
        let files = scan_files(std::slice::from_ref(&scans.to_owned()))?;
        let poses = true_poses(&scans.join("poses.txt"), files.len(), output)?;
        let mapper = |carving| {
            let settings = MapSettings::new(self.resolution, LEVELS_DEFAULT);
            CarvingMapper::new(settings, carving, false, self.sensor).map_err(CliError::failed)
        };
        let (mut with, mut without) = (mapper(Some(carving))?, mapper(None)?);
        let bar = output.clone().with_bar(files.len());
        for (step, (file, truth)) in files.iter().zip(&poses).enumerate() {
            let points = Scan::of_finite(read_points(file)?, None).points;
            with.add(step, &points, truth).map_err(CliError::failed)?;
            without.add(step, &points, truth).map_err(CliError::failed)?;
            bar.step();
        }
        bar.clear_bar();
        let kept = with.voxels();
        let gone: BTreeSet<VoxelKey> = with.carved.difference(&kept).copied().collect();
        let layers = [
            PlanLayer { name: "in the map", color: "#9a9a9a", voxels: &kept },
            PlanLayer { name: "carved", color: "#d55e00", voxels: &gone },
        ];
        plan(&out.join("carving.svg"), &layers)?;
        output.print(&Mapped {
            scans: files.len(),
            accepted: [with.errors_m.len(), without.errors_m.len()],
            median_m: [&with, &without].map(|mapper| middle(&mapper.errors_m)),
            max_m: [&with, &without].map(|mapper| mapper.errors_m.iter().copied().fold(0.0, f64::max)),
            voxels: [kept.len(), without.voxels().len()],
            carved: gone.len(),
            carve_ms: milliseconds(&with.carve_times),
        })
    }
}

/// The median.
fn middle(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN)
}

/// The median of times.
fn milliseconds(times: &[Duration]) -> f64 {
    middle(&times.iter().map(|time| time.as_secs_f64() * 1e3).collect::<Vec<_>>())
}

/// How many times as large each threshold is tried.
const FACTORS: [f32; 2] = [0.7, 1.4];
/// How many exact rays carve a voxel, beside them.
const EXACT_RAYS: [u32; 3] = [1, 3, 10];

/// What came of the simulated scans with one threshold changed: shares.
#[derive(Serialize)]
struct Varied {
    threshold: &'static str,
    unit: &'static str,
    factor: f32,
    box_gone: f64,
    trail_gone: f64,
    still_kept: f64,
    free: f64,
    seen_through: f64,
}

impl Varied {
    fn of(threshold: &'static str, unit: &'static str, factor: f32, figures: &CarvingFigures) -> Self {
        let share = |(all, of): (usize, usize)| of as f64 / all.max(1) as f64;
        Self {
            threshold,
            unit,
            factor,
            box_gone: 1.0 - share(figures.box_voxels),
            trail_gone: 1.0 - share(figures.trail_voxels),
            still_kept: share(figures.still_voxels),
            free: share(figures.free),
            seen_through: share(figures.seen_through),
        }
    }
}

impl Display for Varied {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { threshold, factor, .. } = self;
        let [gone, trail, kept, free, through] =
            [self.box_gone, self.trail_gone, self.still_kept, self.free, self.seen_through]
                .map(|share| share * 100.0);
        write!(
            f,
            "{threshold:<22} x {factor:.1}: box gone {gone:6.2} %, trail gone {trail:6.2} %, kept {kept:7.3} %, free {free:6.2} %, \
             seen through what stands {through:6.3} %"
        )
    }
}

/// What came of the simulated scans; of pairs, with carving first.
#[derive(Serialize)]
struct Simulated {
    scans: usize,
    box_voxels: usize,
    box_gone: f64,
    trail_voxels: usize,
    trail_gone: f64,
    still_voxels: usize,
    still_kept: f64,
    accepted: [usize; 2],
    median_m: [f64; 2],
    carve_ms: f64,
}

impl Simulated {
    fn of(scans: usize, figures: &CarvingFigures) -> Self {
        let left = |(all, left): (usize, usize)| left as f64 / all.max(1) as f64;
        Self {
            scans,
            box_voxels: figures.box_voxels.0,
            box_gone: 1.0 - left(figures.box_voxels),
            trail_voxels: figures.trail_voxels.0,
            trail_gone: 1.0 - left(figures.trail_voxels),
            still_voxels: figures.still_voxels.0,
            still_kept: left(figures.still_voxels),
            accepted: [figures.accepted.0, figures.accepted.1],
            median_m: [&figures.errors_m.0, &figures.errors_m.1].map(|errors| middle(errors)),
            carve_ms: milliseconds(&figures.carve_times),
        }
    }
}

impl Display for Simulated {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { scans, box_voxels, trail_voxels, still_voxels, accepted, median_m, carve_ms, .. } = self;
        let percent = |share: f64| share * 100.0;
        writeln!(f, "{scans} scans, {} accepted, {} without carving", accepted[0], accepted[1])?;
        let [with, without] = median_m.map(|meters| meters * 1e3);
        writeln!(f, "poses off by {with:.2} mm in the median, {without:.2} mm without carving")?;
        let (gone, trail, kept) =
            (percent(self.box_gone), percent(self.trail_gone), percent(self.still_kept));
        writeln!(f, "the box: {gone:.2} % of {box_voxels} voxels gone after the next scan")?;
        writeln!(f, "the walker's trail: {trail:.2} % of {trail_voxels} voxels gone")?;
        writeln!(f, "walls, floor, ceiling, furniture: {kept:.3} % of {still_voxels} voxels kept")?;
        write!(f, "carving took {carve_ms:.2} ms a scan in the median")
    }
}

/// What came of the scans of a folder; of pairs, with carving first.
#[derive(Serialize)]
struct Mapped {
    scans: usize,
    accepted: [usize; 2],
    median_m: [f64; 2],
    max_m: [f64; 2],
    voxels: [usize; 2],
    carved: usize,
    carve_ms: f64,
}

impl Display for Mapped {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { scans, accepted, median_m, max_m, voxels, carved, carve_ms } = self;
        writeln!(f, "{scans} scans, {} accepted, {} without carving", accepted[0], accepted[1])?;
        for (name, i) in [("with carving", 0), ("without", 1)] {
            let (median, max) = (median_m[i] * 1e3, max_m[i] * 1e3);
            writeln!(
                f,
                "{name}: poses off by {median:.1} mm in the median, {max:.1} at most; {} voxels",
                voxels[i]
            )?;
        }
        write!(f, "{carved} voxels were carved and did not come back; {carve_ms:.2} ms a scan in the median")
    }
}
