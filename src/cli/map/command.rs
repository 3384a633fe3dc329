//! The command `mrol map`.

use std::path::{Path, PathBuf};

use nalgebra::Point3;
use uuid::Uuid;

use super::run::{KnownPoses, Run, Usable, in_file};
use crate::cli::alignment_options::{AlignmentOptions, GuessName, PointOptions};
#[cfg(feature = "logs")]
use crate::cli::log::LogOptions;
use crate::cli::scan_file_options::ScanFileOptions;
use crate::cli::scan_report::{name_of, name_width, tell_order};
use mrol::console::CliError;
use mrol::console::Output;
use mrol::console::parse;
use mrol::console::poses_of_scans;
use mrol::console::{NewFile, OriginChoice, Survey, check_is_no_input, place_of_map_file};
use mrol::offline::{KnownScan, Mapper};
use mrol_map::align::AlignmentSettings;
use mrol_map::bloom::FilterSettings;
use mrol_map::geometry::{Point, Pose};
use mrol_map::map::{LEVELS_DEFAULT, Lookup, MapOrigin, MapSettings};
use mrol_map::mapping::{Guess, SensorAxes, SensorMount};
use mrol_map::scan::{PointFilter, write_trajectory};
use mrol_store::{Disk, Snapshot};

const EXAMPLES: &str = "\
EXAMPLES:
  mrol map scans/ --resolution 0.05 --levels 5
  mrol map scans/ --resolution 0.1 --levels 6 --trajectory-out poses.txt --out hall.mrol
  mrol map scans/ --resolution 0.1 --truth true.txt          errors against known poses
  mrol map scans/ --resolution 0.1 --poses poses.txt --out hall.mrol      at known poses, without aligning
  mrol map dat/ --resolution 0.1 --poses dat/ --out dat.mrol              scan000.3d with scan000.pose, as 3DTK has them
  mrol map depth/ --camera \"525 525 319.5 239.5\" --depth-scale 5000 --resolution 0.05 --poses groundtruth.txt
                                                             depth images and poses, as the RGB-D sets of TUM have them
  mrol map scans/ --resolution 0.1 --lookup bloom --filter-hashes 10 --filter-bits-per-key 4096
                                                             are the filters ample? (last line)
  mrol map scans/ --resolution 0.1 --no-filter --no-moments --out yard.mrol
                                                             a map for queries, in a small part of the memory
  mrol map scans/ --resolution 0.1 --carve --out office.mrol     without those who walked by
  mrol map run.mcap --resolution 0.1 --out hall.mrol         a log of ROS 2: `mrol log run.mcap` says what it has
  mrol map utm/*.pcd --resolution 0.1 --origin auto --out site.mrol     scans in the coordinates of a survey
  mkdir -p mrol-data/maps && mrol map scans/ --resolution 0.1 --out mrol-data/maps/hall.mrol && mrol serve
                                                             serve the map

The first scan goes in at the origin (or --first-pose; or upright, by --axes and --sensor-height), each other one is
aligned from the last accepted pose; one that does not align is left out, and one without a return is skipped. With --truth
errors are those of inv(E_0) E_k against inv(T_0) T_k, where 0 is the first accepted scan. With --json a last object \"summary\" is printed when --truth, --poses or --lookup is given. Whether the filters are ample is said
when --lookup is given.";

/// Make a map of scans in this process, no server needed
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Map {
    /// Scan files, or folders of them in the natural order of names (scan2 before scan10): .ply .pcd .xyz .npy .bin
    /// .f32 .3d; with --camera .png; or one log of a robot: .mcap, .db3, or the folder that ros2 bag recorded
    #[arg(required = true, value_name = "DIR_OR_FILES")]
    scans: Vec<PathBuf>,
    /// Side of a finest voxel, meters
    #[arg(long, value_name = "METERS")]
    resolution: f64,
    /// Number of levels, each twice as coarse as the one before: 1 to 12
    #[arg(long, default_value_t = LEVELS_DEFAULT)]
    levels: u32,
    /// Where the first scan was taken: "x y z qx qy qz qw" [default: the origin]
    #[arg(long, value_name = "POSE", allow_hyphen_values = true, value_parser = parse::pose)]
    pub(super) first_pose: Option<Pose>,
    /// Which way the sensor's axes point: x ahead, y left, z up (robot), or a camera's, x right, y down, z ahead
    /// (optical). The first scan is put upright in the map [default: robot; of depth images optical]
    #[arg(long, value_parser = parse::keyword::<SensorAxes>(), conflicts_with_all = ["first_pose", "at_truth", "poses"])]
    pub(super) axes: Option<SensorAxes>,
    /// Height of the sensor above the floor: the first scan is put so high above the map's origin [default: 0]
    #[arg(long, value_name = "METERS", allow_hyphen_values = true, value_parser = parse::sensor_height,
          conflicts_with_all = ["first_pose", "at_truth", "poses"])]
    pub(super) sensor_height: Option<f64>,
    /// Write the poses of accepted scans as a TUM file, a line `k x y z qx qy qz qw` for scan k
    #[arg(long, value_name = "FILE")]
    trajectory_out: Option<PathBuf>,
    /// Write the map to a file; `mrol serve` reads those in the folder maps of its data folder
    #[arg(long, value_name = "FILE.mrol")]
    out: Option<PathBuf>,
    /// True poses: report the errors. A file of TUM (8 numbers a line) or of KITTI (12), line k for scan k, or a folder
    /// with the .pose file of 3DTK for each scan
    #[arg(long, value_name = "FILE_OR_DIR")]
    truth: Option<PathBuf>,
    /// Put the scans at their true poses, without aligning
    #[arg(long, requires = "truth", conflicts_with = "first_pose")]
    at_truth: bool,
    /// Put every scan at its pose in this file or folder, without aligning: the same as --truth FILE --at-truth, and as
    /// --poses of `mrol insert`
    #[arg(long, value_name = "FILE_OR_DIR", conflicts_with_all = ["truth", "first_pose"])]
    poses: Option<PathBuf>,
    /// Share of a scan's points that must fall in occupied voxels for it to be accepted, beyond what rays say [default:
    /// 0]
    #[arg(long, value_name = "SHARE")]
    min_overlap: Option<f64>,
    /// Leave a robot lost once its scans are refused. Otherwise each refused scan is aligned from other guesses, then
    /// searched for in the whole map, where the next scan has to confirm the place
    #[arg(long)]
    no_recovery: bool,
    /// Take out of the map what the scans saw through: people who walked by, what was moved [default: maps only grow]
    #[arg(long, value_name = "BOOL", num_args = 0..=1, default_missing_value = "true", require_equals = true)]
    carve: Option<bool>,
    /// Where a scan is thought to have been taken: at the last accepted pose, or as far on as that is from the one
    /// before it [default: previous; of a log without odometry constant-velocity]
    #[arg(long, value_enum)]
    pub(super) guess: Option<GuessName>,
    #[command(flatten)]
    alignment: AlignmentOptions,
    #[command(flatten)]
    points: PointOptions,
    /// Take points at exactly 0 0 0 as any other [default: they are skipped, as drivers write them where nothing
    /// returned]
    #[arg(long)]
    keep_zeros: bool,
    #[command(flatten)]
    pub(super) scan_files: ScanFileOptions,
    /// Where the map's origin lies in the coordinates of the scans and poses: "x y z", or auto for the first point. It
    /// is subtracted from them in double precision, and kept in the map
    #[arg(long, value_name = "ORIGIN", allow_hyphen_values = true, value_parser = parse::origin)]
    pub(super) origin: Option<OriginChoice>,
    /// What the alignment asks: the exact set, or the Bloom filter alone, as in the paper [default: bloom]
    #[arg(long, value_parser = parse::keyword::<Lookup>())]
    lookup: Option<Lookup>,
    /// Hash functions of the counting Bloom filters, k of eq. (1): 1 to 10
    #[arg(long, value_name = "K", default_value_t = FilterSettings::default().hashes)]
    filter_hashes: u32,
    /// Bits of the filters' planes a voxel, m / n of eq. (1): 1 to 4096
    #[arg(long, value_name = "BITS", default_value_t = FilterSettings::default().bits_per_key)]
    filter_bits_per_key: f64,
    /// No filters: the exact set answers every look-up
    #[arg(long, conflicts_with_all = ["filter_hashes", "filter_bits_per_key"])]
    no_filter: bool,
    /// No moments of points: scans are aligned by overlap alone
    #[arg(long)]
    no_moments: bool,
    #[cfg(feature = "logs")]
    #[command(flatten)]
    pub(super) log: LogOptions,
}

impl Map {
    pub(crate) fn run(self, output: Output) -> Result<(), CliError> {
        let alignment = self.alignment_settings()?;
        self.map_settings().checked().map_err(CliError::usage)?;
        let filter = self.filter()?;
        #[cfg(feature = "logs")]
        if let Some(path) = self.log.path_among(&self.scans)? {
            return self.run_log(path, alignment, filter, output);
        }
        let files = self.scan_files.reader().files(&self.scans)?;
        let truth = self.poses_file().map(|path| poses_of_scans(path, &files, &output)).transpose()?;
        self.check_outputs(files.iter().map(PathBuf::as_path))?;

        tell_order(&files, &output)?;
        let (survey, origin) = self.survey(&files, &output)?;
        let settings = MapSettings { origin, ..self.map_settings() };
        let mut mapper = self.mapper(settings, alignment, self.guess.unwrap_or_default())?;
        if let Some(MapOrigin { position_m: [x, y, z] }) = origin {
            output.note(format!("origin of the map: {x} {y} {z}"));
        }
        let known = KnownPoses { first: self.first_pose, truth, at_truth: self.at_poses() };
        let mut run = Run::new(known, survey, name_width(&files));
        let output = output.with_bar(files.len());
        output.say(run.head())?;
        for (k, file) in files.iter().enumerate() {
            match Usable::of(survey.read(file)?, None, &filter) {
                Usable::Points { points, times_s, skipped } => {
                    let pose = run.guess(k);
                    let known = KnownScan {
                        times_s: times_s.as_deref(),
                        guess: pose.map(Guess::Pose),
                        at_guess: pose.is_some(),
                        ..KnownScan::new(k as u64, &points)
                    };
                    let mapped = mapper.add_known(known).map_err(|e| in_file(file, e))?;
                    output.print(&run.note((k, k as f64), name_of(file), &mapped, skipped))?;
                }
                Usable::Nothing(why) => output.print(&run.skip(file, name_of(file), why))?,
            }
            output.step();
        }
        self.finish(&mapper, run, &output)
    }

    fn filter(&self) -> Result<PointFilter, CliError> {
        let filter = self.points.filter().map_err(CliError::usage)?;
        Ok(PointFilter { keep_zeros: self.keep_zeros, ..filter })
    }

    /// Checks that the folders of all outputs exist, so that a long run does not fail at its end, and that none of
    /// them is among `inputs`, or what its poses are read from.
    pub(super) fn check_outputs<'a>(
        &'a self,
        inputs: impl Iterator<Item = &'a Path> + Clone,
    ) -> Result<(), CliError> {
        self.out.as_deref().map(place_of_map_file).transpose()?;
        let poses = self.poses_file().map(PathBuf::as_path);
        if self.out.is_some() && self.out == self.trajectory_out {
            return Err(CliError::usage("--out and --trajectory-out are the same file"));
        }
        // Of a folder each file of poses is read.
        let in_poses = |path: &Path| {
            let (Ok(path), Some(Ok(poses))) = (path.canonicalize(), poses.map(Path::canonicalize)) else {
                return false;
            };
            path.parent() == Some(poses.as_path())
        };
        if let Some(path) = self.trajectory_out.as_deref().filter(|path| in_poses(path)) {
            let path = path.display();
            return Err(CliError::usage(format!(
                "{path} lies in the folder of poses, and would be replaced: write another file"
            )));
        }
        self.trajectory_out.iter().chain(&self.out).try_for_each(|path| {
            check_folder(path)?;
            check_is_no_input(path, inputs.clone().chain(poses))
        })
    }

    /// A mapper of an empty map, by the options.
    pub(super) fn mapper(
        &self,
        settings: MapSettings,
        alignment: AlignmentSettings,
        guess: GuessName,
    ) -> Result<Mapper, CliError> {
        let mapper = Mapper::new(settings, alignment, guess.into())?;
        let mapper =
            mapper.recovering(!self.no_recovery).carving(self.carve == Some(true)).mounted(self.mount());
        Ok(mapper.with_sensor(self.points.sensor()))
    }

    /// Writes what is to be kept, and says what was done.
    pub(super) fn finish(&self, mapper: &Mapper, mut run: Run, output: &Output) -> Result<(), CliError> {
        output.clear_bar();
        run.check_any()?;
        self.write_results(mapper, &run)?;
        // Programs get only the scans, unless they ask for what is in the summary.
        if !output.is_json() || self.poses_file().is_some() || self.lookup.is_some() {
            output.print(&run.summary(mapper, self.lookup))?;
        }
        output.say(self.what_next())
    }

    /// How the scans lie to the map, and the map's origin, if it is to have one.
    fn survey(&self, files: &[PathBuf], output: &Output) -> Result<(Survey, Option<MapOrigin>), CliError> {
        let Some((file, first)) = self.first_with_returns(files)? else {
            return Ok((
                Survey::of(&[], None, false, self.resolution).with_reader(self.scan_files.reader()),
                None,
            ));
        };
        let origin = self.origin.map(|choice| choice.origin(file, &first)).transpose()?;
        let has_poses = self.first_pose.is_some() || self.at_poses();
        let survey = Survey::of(&first, origin, has_poses, self.resolution);
        survey.note_unit(file, &first, output);
        Ok((survey.with_reader(self.scan_files.reader()), origin))
    }

    /// The first file with a point that is a return, and its points.
    fn first_with_returns<'a>(&self, files: &'a [PathBuf]) -> Result<Option<ExactScan<'a>>, CliError> {
        let filter = PointFilter { keep_zeros: self.keep_zeros, ..PointFilter::default() };
        for file in files {
            let points = self.scan_files.reader().read(file)?;
            if points.iter().any(|point| filter.is_return(Point::from(*point))) {
                return Ok(Some((file, points)));
            }
        }
        Ok(None)
    }

    fn mount(&self) -> SensorMount {
        let axes = self.axes.or(self.scan_files.camera.map(|_| SensorAxes::Optical));
        SensorMount { axes: axes.unwrap_or_default(), height_m: self.sensor_height.unwrap_or_default() }
    }

    /// The file of poses, whatever they are for.
    pub(super) fn poses_file(&self) -> Option<&PathBuf> {
        self.truth.as_ref().or(self.poses.as_ref())
    }

    /// True where scans are put at the poses of a file.
    fn at_poses(&self) -> bool {
        self.at_truth || self.poses.is_some()
    }

    /// What was written, and what can be done with it.
    fn what_next(&self) -> String {
        let trajectory =
            self.trajectory_out.as_ref().map(|path| format!("poses written to {}", path.display()));
        let map = match &self.out {
            Some(path) => {
                let path = path.display();
                format!("map written to {path}; `mrol restore {path}` puts it on a running server")
            }
            None => "the map is not kept: --out FILE.mrol writes it".to_owned(),
        };
        trajectory.into_iter().chain([map]).collect::<Vec<_>>().join("; ")
    }

    pub(super) fn map_settings(&self) -> MapSettings {
        let filter = FilterSettings { hashes: self.filter_hashes, bits_per_key: self.filter_bits_per_key };
        MapSettings {
            filter: (!self.no_filter).then_some(filter),
            moments: !self.no_moments,
            ..MapSettings::new(self.resolution, self.levels)
        }
    }

    fn alignment_settings(&self) -> Result<AlignmentSettings, CliError> {
        let defaults = AlignmentSettings::default();
        let settings = AlignmentSettings {
            method: self.alignment.method().unwrap_or(defaults.method),
            overlap_min: self.min_overlap.unwrap_or(defaults.overlap_min),
            lookup: self.lookup.unwrap_or(defaults.lookup),
            ..defaults
        };
        settings.checked().map_err(CliError::usage)
    }

    fn write_results(&self, mapper: &Mapper, run: &Run) -> Result<(), CliError> {
        if let Some(path) = &self.trajectory_out {
            let file = NewFile::at(path)?;
            write_trajectory(file.path(), &run.trajectory).map_err(|problem| file.failed(problem))?;
            file.keep()?;
        }
        if let Some(path) = &self.out {
            Snapshot::of(mapper.map(), Uuid::new_v4()).write(&Disk::default(), &place_of_map_file(path)?)?;
        }
        Ok(())
    }
}

/// A scan file and its points, as it has them.
type ExactScan<'a> = (&'a Path, Vec<Point3<f64>>);

/// Checks that the folder of an output file exists.
fn check_folder(path: &Path) -> Result<(), CliError> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    match folder.is_dir() {
        true => Ok(()),
        false => Err(in_file(path, format!("there is no folder {}: make it first", folder.display()))),
    }
}
