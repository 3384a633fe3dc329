//! The command `mrol insert`.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use super::plan::Plan;
use super::sending::{Answers, Sending};
use crate::cli::alignment_options::{AlignmentOptions, GuessName, PointOptions};
#[cfg(feature = "logs")]
use crate::cli::log::LogOptions;
use crate::cli::maps::OptionalSettings;
use crate::cli::remote::MapOptions;
use crate::cli::scan_file_options::ScanFileOptions;
use crate::cli::scan_report::tell_order;
use mrol::console::{CliError, OriginChoice, Output, Survey, parse, poses_of_scans};
use mrol_client::{Client, NewMap, new_session};
use mrol_map::geometry::Pose;
use mrol_map::map::{MapOrigin, RobotName, SessionName};
use mrol_map::mapping::Guess;

/// Side of the voxels of a map that does not tell, meters: points that f32 rounds by more than 1/16 of it are refused.
const RESOLUTION_UNKNOWN_M: f64 = 0.1;

const EXAMPLES: &str = "\
EXAMPLES:
  mrol insert scans/ --map office --create --resolution 0.05 --levels 5
  mrol insert new/*.ply --map office --robot r2 --guess \"3.1 0.4 0 0 0 0.7071 0.7071\"
  mrol insert scans/ --map office --poses poses.txt         at known poses, without aligning
  mrol insert scans/ --map office --json | jq .verdict
  mrol insert run.mcap --map office --robot r1              a log of ROS 2: `mrol log run.mcap` says what it has

Each scan is aligned to the map from the robot's last accepted pose; the first from --guess. The first scan of
an empty map goes in at its guess, or at the origin. A scan that does not align is reported, and left out; the
other scans are sent all the same, and the exit code is then 3. It is 1 where scans were not answered: the error
then has the --session and --first-scan-id with which the same command goes on, and adds no scan twice.";

/// Send scans to a map on a server, which aligns and adds them
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Insert {
    /// Scan files, or folders of them in the natural order of names (scan2 before scan10): .ply .pcd .xyz .npy .bin
    /// .f32 .3d; with --camera .png; or one log of a robot: .mcap, .db3, or the folder that ros2 bag recorded
    #[arg(required = true)]
    scans: Vec<PathBuf>,
    #[command(flatten)]
    pub(super) map: MapOptions,
    /// Name of the robot that sends the scans
    #[arg(long, value_name = "NAME", default_value = "mrol", value_parser = parse::robot_name)]
    pub(super) robot: RobotName,
    /// Where the first scan was taken: "x y z qx qy qz qw"
    #[arg(long, value_name = "POSE", allow_hyphen_values = true, value_parser = parse::pose)]
    pub(super) guess: Option<Pose>,
    /// Take --guess as it is, without aligning the first scan
    #[arg(long, requires = "guess")]
    pub(super) at_guess: bool,
    /// Add scans where they were found even if their verdict is not accepted
    #[arg(long)]
    pub(super) force: bool,
    /// Look for the robot where a scan is refused, whatever the server is set to [default: as the server is set]
    #[arg(long, value_name = "BOOL", num_args = 0..=1, default_missing_value = "true", require_equals = true)]
    pub(super) recover: Option<bool>,
    /// Take out of the map what the scans saw through, whatever the server is set to [default: as the server is set]
    #[arg(long, value_name = "BOOL", num_args = 0..=1, default_missing_value = "true", require_equals = true)]
    pub(super) carve: Option<bool>,
    /// Guess of every scan but the first: the last accepted pose, or one as far on as that is from the pose before
    /// [default: previous; of a log without odometry constant-velocity]
    #[arg(long, value_enum, value_name = "GUESS")]
    pub(super) next_guess: Option<GuessName>,
    #[command(flatten)]
    pub(super) alignment: AlignmentOptions,
    #[command(flatten)]
    pub(super) points: PointOptions,
    /// Put every scan at its pose, without aligning: a file of TUM (8 numbers a line) or of KITTI (12), line k for scan
    /// k, or a folder with the .pose file of 3DTK for each scan
    #[arg(long, value_name = "FILE_OR_DIR", visible_alias = "poses", conflicts_with = "guess")]
    pub(super) truth: Option<PathBuf>,
    /// Number the scans from N on, so that a scan that is sent again in the same session is not added twice [default:
    /// from 0, in a new session]
    #[arg(long, value_name = "N")]
    pub(super) first_scan_id: Option<u64>,
    /// Session of the scans' numbers; with --first-scan-id alone, that of clients that name none; of a log, one that
    /// follows from its first cloud
    #[arg(long, value_name = "NAME", value_parser = parse::session_name)]
    pub(super) session: Option<SessionName>,
    /// For how long scans that were not answered are sent again where the connection breaks or the server restarts,
    /// seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 15, value_parser = clap::value_parser!(u32).range(0..=86_400))]
    pub(super) patience: u32,
    #[command(flatten)]
    pub(super) scan_files: ScanFileOptions,
    /// Where the map's origin lies in the coordinates of the scans and poses: "x y z", or auto for that of the map or,
    /// with --create, the first point. It is subtracted from them in double precision
    #[arg(long, value_name = "ORIGIN", allow_hyphen_values = true, value_parser = parse::origin)]
    pub(super) origin: Option<OriginChoice>,
    /// Make the map first
    #[arg(long, requires = "resolution")]
    create: bool,
    /// With --create: side of a finest voxel, meters
    #[arg(long, value_name = "METERS", requires = "create")]
    resolution: Option<f64>,
    #[command(flatten)]
    settings: OptionalSettings,
    #[cfg(feature = "logs")]
    #[command(flatten)]
    pub(super) log: LogOptions,
    /// Send the clouds of a log when their stamps say, as a robot does [default: as fast as they are answered]
    #[cfg(feature = "logs")]
    #[arg(long, help_heading = "Options of logs")]
    pub(super) real_time: bool,
}

impl Insert {
    pub(crate) async fn run(self, output: Output) -> Result<(), CliError> {
        if !self.create && self.settings.is_any() {
            return Err(CliError::usage("settings of a map to make are given: say --create too"));
        }
        #[cfg(feature = "logs")]
        if let Some(path) = self.log.path_among(&self.scans)? {
            return self.run_log(path, output).await;
        }
        #[cfg(feature = "logs")]
        if self.real_time {
            return Err(CliError::usage("--real-time is for a log, such as run.mcap"));
        }
        if self.session.is_some() && self.first_scan_id.is_none() {
            return Err(CliError::usage("--session of scan files needs --first-scan-id"));
        }
        let files = self.scan_files.reader().files(&self.scans)?;
        let poses = self.truth.as_ref().map(|path| poses_of_scans(path, &files, &output)).transpose()?;
        let client = self.map.server.connect().await?;
        tell_order(&files, &output)?;
        let survey = self.survey(&client, &files, &output).await?;

        let plan = Plan {
            robot: self.robot.clone(),
            survey,
            first: self.first_guess(&survey),
            poses: poses.map(|poses| poses.iter().map(|pose| survey.to_map(pose)).collect()),
            session: match self.first_scan_id {
                Some(_) => self.session.clone().unwrap_or_default(),
                None => new_session(),
            },
            first_scan_id: self.first_scan_id.unwrap_or(0),
            next: self.next_guess.unwrap_or_default().into(),
            method: self.alignment.method(),
            filter: self.points.filter().map_err(CliError::usage)?,
            sensor: self.points.sensor(),
            force: self.force,
            recover: self.recover,
            carve: self.carve,
        };
        let (plan, map) = (Arc::new(plan), &self.map.name);
        let output = &output.with_bar(files.len());
        let (client, files, counted) = (&client, &files[..], Answers::default());
        let sending = Sending { client, map, files, plan, output, counted };
        let answers = sending.run(Duration::from_secs(self.patience.into())).await?;
        output.clear_bar();
        let (answered, all) = (answers.answered, files.len());
        if answered != all {
            return Err(CliError::failed(format!("the server answered {answered} of {all} scans")));
        }
        answers.result()
    }

    /// How the scans lie to the map, which is made first where that is wanted.
    pub(super) async fn survey(
        &self,
        client: &Client,
        files: &[PathBuf],
        output: &Output,
    ) -> Result<Survey, CliError> {
        let name = &self.map.name;
        // Who may only insert is not told, and neither is anybody of a map that is not there.
        let there = client.map_info(name).await.ok().map(|info| info.settings);
        let reader = self.scan_files.reader();
        let first = files.first().map(|file| reader.read(file).map(|points| (file, points))).transpose()?;
        let origin = match (self.origin, &first, there.and_then(|settings| settings.origin)) {
            (None, ..) | (_, None, _) => None,
            (Some(OriginChoice::Auto), _, Some(of_map)) => Some(of_map),
            (Some(choice), Some((file, points)), _) => Some(choice.origin(file, points)?),
        };
        let settings = match self.resolution {
            Some(resolution_m) => {
                let origin = origin.or(there.and_then(|settings| settings.origin));
                let new = NewMap { origin, ..self.settings.with_resolution(resolution_m) };
                Some(client.create_map(name, new).await?.0.settings)
            }
            None => there,
        };
        let of_map = settings.and_then(|settings| settings.origin);
        if let Some(MapOrigin { position_m }) = origin.filter(|origin| of_map != Some(*origin)) {
            let of_map = of_map.map_or("none".to_owned(), |of_map| format!("{:?}", of_map.position_m));
            return Err(CliError::failed(format!(
                "the origin of map {name} is {of_map}, not {position_m:?}: --origin auto takes that of the map"
            )));
        }
        if let Some(MapOrigin { position_m: [x, y, z] }) = origin {
            output.note(format!("origin of the map: {x} {y} {z}"));
        }
        let has_poses = self.truth.is_some() || self.guess.is_some();
        let resolution_m = settings.map_or(RESOLUTION_UNKNOWN_M, |settings| settings.resolution_m);
        let points = first.as_ref().map_or(&[][..], |(_, points)| points);
        let survey = Survey::of(points, origin, has_poses, resolution_m).with_reader(reader);
        if let Some((file, points)) = &first {
            survey.note_unit(file, points, output);
        }
        Ok(survey)
    }

    fn first_guess(&self, survey: &Survey) -> (Guess, bool) {
        (self.guess.map_or(Guess::Last, |pose| Guess::Pose(survey.to_map(&pose))), self.at_guess)
    }
}
