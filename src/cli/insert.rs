//! `mrol insert`: sends scans to a map of a server.

use std::fmt;
use std::fmt::Display;
use std::path::PathBuf;

use serde::Serialize;
use tokio::sync::mpsc;
use tokio_stream::wrappers::ReceiverStream;

use super::alignment_options::{AlignmentOptions, GuessName, PointOptions};
use super::maps::OptionalSettings;
use super::remote::MapOptions;
use super::scan_report::{PLACE_HEAD, name_of, name_width, place};
use mrol::console::CliError;
use mrol::console::Output;
use mrol::console::count;
use mrol::console::parse;
use mrol::console::true_poses;
use mrol::console::{OriginChoice, Survey};
use mrol::json::JsonScan;
use mrol_client::{Client, ClientError, NewMap, new_session};
use mrol_map::align::Method;
use mrol_map::geometry::Pose;
use mrol_map::map::{MapOrigin, RobotName, SessionName};
use mrol_map::mapping::Guess;
use mrol_map::scan::{Columns, PointFilter, SkippedPoints, read_exact_points_by, scan_files};
use mrol_service::{ScanAnswer, ScanRequest};

/// Scans read ahead of the one that is being sent.
const SCANS_AHEAD: usize = 2;

/// Side of the voxels of a map that does not tell, meters: points that f32 rounds by more than 1/16 of it are refused.
const RESOLUTION_UNKNOWN_M: f64 = 0.1;

const EXAMPLES: &str = "\
EXAMPLES:
  mrol insert scans/ --map office --create --resolution 0.05 --levels 5
  mrol insert new/*.ply --map office --robot r2 --guess \"3.1 0.4 0 0 0 0.7071 0.7071\"
  mrol insert scans/ --map office --truth poses.txt         at known poses, without aligning
  mrol insert scans/ --map office --json | jq .verdict

Each scan is aligned to the map from the robot's last accepted pose; the first from --guess. The first scan of
an empty map goes in at its guess, or at the origin. A scan that does not align is reported, and left out; the
other scans are sent all the same, and the exit code is then 3. It is 1 where scans were not answered.";

/// Send scans to a map on a server, which aligns and adds them
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Insert {
    /// Scan files, or folders of them in the natural order of names (scan2 before scan10): .ply .pcd .xyz .npy .bin
    /// .f32
    #[arg(required = true)]
    scans: Vec<PathBuf>,
    #[command(flatten)]
    map: MapOptions,
    /// Name of the robot that sends the scans
    #[arg(long, value_name = "NAME", default_value = "mrol", value_parser = parse::robot_name)]
    robot: RobotName,
    /// Where the first scan was taken: "x y z qx qy qz qw"
    #[arg(long, value_name = "POSE", allow_hyphen_values = true, value_parser = parse::pose)]
    guess: Option<Pose>,
    /// Take --guess as it is, without aligning the first scan
    #[arg(long, requires = "guess")]
    at_guess: bool,
    /// Add scans where they were found even if their verdict is not accepted
    #[arg(long)]
    force: bool,
    /// Look for the robot where a scan is refused, whatever the server is set to [default: as the server is set]
    #[arg(long, value_name = "BOOL", num_args = 0..=1, default_missing_value = "true", require_equals = true)]
    recover: Option<bool>,
    /// Take out of the map what the scans saw through, whatever the server is set to [default: as the server is set]
    #[arg(long, value_name = "BOOL", num_args = 0..=1, default_missing_value = "true", require_equals = true)]
    carve: Option<bool>,
    /// Guess of every scan but the first: the last accepted pose, or one as far on as that is from the pose before
    #[arg(long, value_enum, value_name = "GUESS", default_value_t)]
    next_guess: GuessName,
    #[command(flatten)]
    alignment: AlignmentOptions,
    #[command(flatten)]
    points: PointOptions,
    /// Put every scan at its pose in this TUM file, line k for scan k, without aligning
    #[arg(long, value_name = "FILE", conflicts_with = "guess")]
    truth: Option<PathBuf>,
    /// Number the scans from N on, so that a scan that is sent again in the same session is not added twice [default:
    /// from 0, in a new session]
    #[arg(long, value_name = "N")]
    first_scan_id: Option<u64>,
    /// Session of the scans' numbers; with --first-scan-id alone, that of clients that name none
    #[arg(long, value_name = "NAME", requires = "first_scan_id", value_parser = parse::session_name)]
    session: Option<SessionName>,
    /// What the columns of .xyz, .npy, .bin and .f32 files hold, such as "x y z i" [default: x y z, of .bin x y z i]
    #[arg(long, value_name = "NAMES")]
    columns: Option<Columns>,
    /// Where the map's origin lies in the coordinates of the scans and poses: "x y z", or auto for that of the map or,
    /// with --create, the first point. It is subtracted from them in double precision
    #[arg(long, value_name = "ORIGIN", allow_hyphen_values = true, value_parser = parse::origin)]
    origin: Option<OriginChoice>,
    /// Make the map first
    #[arg(long, requires = "resolution")]
    create: bool,
    /// With --create: side of a finest voxel, meters
    #[arg(long, value_name = "METERS", requires = "create")]
    resolution: Option<f64>,
    #[command(flatten)]
    settings: OptionalSettings,
}

impl Insert {
    pub(super) async fn run(self, output: Output) -> Result<(), CliError> {
        if !self.create && self.settings.is_any() {
            return Err(CliError::usage("settings of a map to make are given: say --create too"));
        }
        let files = scan_files(&self.scans)?;
        let poses = self.truth.as_ref().map(|path| true_poses(path, files.len(), &output)).transpose()?;
        let client = self.map.server.connect().await?;
        let survey = self.survey(&client, &files, &output).await?;

        let (sender, scans) = mpsc::channel(SCANS_AHEAD);
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
            next: self.next_guess.into(),
            method: self.alignment.method(),
            filter: self.points.filter().map_err(CliError::usage)?,
            force: self.force,
            recover: self.recover,
            carve: self.carve,
        };
        let reader = tokio::task::spawn_blocking({
            let files = files.clone();
            move || plan.send(&files, &sender)
        });
        let output = output.with_bar(files.len());
        let Answers { answered, failed, refused } =
            self.print_answers(&client, scans, &files, &output).await?;
        reader.await.map_err(CliError::failed)??;
        if answered != files.len() {
            return Err(CliError::failed(format!("the server answered {answered} of {} scans", files.len())));
        }
        match failed {
            0 => CliError::unless_accepted(refused, answered),
            _ => Err(CliError::failed(format!(
                "{failed} of {answered} scans failed; the others were answered"
            ))),
        }
    }

    /// How the scans lie to the map, which is made first where that is wanted.
    async fn survey(&self, client: &Client, files: &[PathBuf], output: &Output) -> Result<Survey, CliError> {
        let name = &self.map.name;
        // Who may only insert is not told, and neither is anybody of a map that is not there.
        let there = client.map_info(name).await.ok().map(|info| info.settings);
        let first = files
            .first()
            .map(|file| read_exact_points_by(file, self.columns).map(|points| (file, points)))
            .transpose()?;
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
        let points = first.map(|(_, points)| points).unwrap_or_default();
        let resolution_m = settings.map_or(RESOLUTION_UNKNOWN_M, |settings| settings.resolution_m);
        Ok(Survey::of(&points, origin, has_poses, resolution_m).with_columns(self.columns))
    }

    fn first_guess(&self, survey: &Survey) -> (Guess, bool) {
        (self.guess.map_or(Guess::Last, |pose| Guess::Pose(survey.to_map(&pose))), self.at_guess)
    }

    /// Prints a line for each answer of the server, and counts the answers.
    async fn print_answers(
        &self,
        client: &Client,
        scans: mpsc::Receiver<ScanRequest>,
        files: &[PathBuf],
        output: &Output,
    ) -> Result<Answers, CliError> {
        let width = name_width(files);
        let mut answers = client.insert_scans(&self.map.name, ReceiverStream::new(scans)).await?;
        let mut counted = Answers::default();
        while let Some(answer) = answers.next().await {
            let name = files.get(counted.answered).map(|file| name_of(file)).unwrap_or_default();
            if counted.answered == 0 && answer.is_ok() {
                output.say(ScanLine::head(width))?;
            }
            match answer {
                Ok(answer) => {
                    output.print(&ScanLine::of(name, &answer, width))?;
                    counted.refused += usize::from(!answer.accepted);
                }
                Err(error @ ClientError::Refused { .. }) if !concerns_all(&error) => {
                    output.print(&FailedLine { scan: name, error: error.to_string() })?;
                    counted.failed += 1;
                }
                Err(error) => return Err(not_inserted(&name, &error)),
            }
            output.step();
            counted.answered += 1;
        }
        output.clear_bar();
        Ok(counted)
    }
}
/// Numbers of scans that the server answered.
#[derive(Default)]
struct Answers {
    /// All of them.
    answered: usize,
    /// Those that failed, and have no verdict.
    failed: usize,
    /// Those that are not in the map because their verdict is not `accepted`.
    refused: usize,
}

/// True of a failure that all scans after it would share.
fn concerns_all(error: &ClientError) -> bool {
    matches!(
        error.reason(),
        Some("guess_required" | "map_not_found" | "map_not_allowed" | "robot_not_allowed")
    )
}

fn not_inserted(name: &str, error: &ClientError) -> CliError {
    let advice = match error.reason() {
        Some("guess_required") => "; --guess says where the first scan was taken",
        Some("map_not_found") => "; --create --resolution METERS makes it",
        _ => "",
    };
    CliError::failed(format!("{name}: {error}{advice}"))
}

/// How the scans of the files are sent.
struct Plan {
    robot: RobotName,
    survey: Survey,
    /// Guess of the first scan, and whether to take it as it is.
    first: (Guess, bool),
    /// Poses of the scans, map_from_sensor, if they are known.
    poses: Option<Vec<Pose>>,
    session: SessionName,
    /// Number of the first scan.
    first_scan_id: u64,
    /// Guess of the other scans.
    next: Guess,
    method: Option<Method>,
    filter: PointFilter,
    force: bool,
    recover: Option<bool>,
    carve: Option<bool>,
}

impl Plan {
    /// Reads the files one by one and sends them, until the receiver is closed.
    fn send(&self, files: &[PathBuf], sender: &mpsc::Sender<ScanRequest>) -> Result<(), CliError> {
        for (k, file) in files.iter().enumerate() {
            let (guess, at_guess) = self.guess(k);
            let scan = ScanRequest {
                session: self.session.clone(),
                scan_id: Some(self.first_scan_id.saturating_add(k as u64)),
                guess,
                at_guess,
                force: self.force,
                recover: self.recover,
                carve: self.carve,
                method: self.method,
                filter: self.filter,
                ..ScanRequest::new(self.robot.clone(), self.survey.read(file)?.into())
            };
            if sender.blocking_send(scan).is_err() {
                break;
            }
        }
        Ok(())
    }

    fn guess(&self, k: usize) -> (Guess, bool) {
        match (&self.poses, k) {
            (Some(poses), k) => (Guess::Pose(poses[k]), true),
            (None, 0) => self.first,
            (None, _) => (self.next, false),
        }
    }
}

/// A scan that the server failed to insert.
#[derive(Serialize)]
struct FailedLine {
    scan: String,
    error: String,
}

impl Display for FailedLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}  {}", self.scan, self.error)
    }
}

#[derive(Serialize)]
struct ScanLine {
    scan: String,
    #[serde(flatten)]
    answer: JsonScan,
    #[serde(skip)]
    width: usize,
}

impl ScanLine {
    fn of(scan: String, answer: &ScanAnswer, width: usize) -> Self {
        Self { scan, answer: answer.clone().into(), width }
    }

    fn head(width: usize) -> String {
        format!("{:<width$}  verdict       overlap  {PLACE_HEAD}  new voxels  revision", "scan")
    }
}

impl Display for ScanLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{:<width$}  {:<12}  {:>7.3}  {}  {:>10}  {:>8}",
            self.scan,
            self.answer.verdict,
            self.answer.overlap,
            place(&self.answer.map_from_sensor),
            count(self.answer.new_voxels),
            self.answer.version.revision,
            width = self.width
        )?;
        match &self.answer {
            JsonScan { replayed: true, .. } => write!(f, "  (was there already)"),
            JsonScan { stationary: true, .. } => write!(f, "  (nothing new from where it stands)"),
            JsonScan { recovered: Some(how), .. } => write!(f, "  recovered: {how}"),
            JsonScan { verdict: "accepted", carved_voxels: 0, .. } => Ok(()),
            JsonScan { verdict: "accepted", carved_voxels, .. } => {
                write!(f, "  {} carved", count(*carved_voxels))
            }
            JsonScan { reason, .. } => return write!(f, "  {reason}"),
        }?;
        match &self.answer {
            JsonScan { reason, .. } if SkippedPoints::is_told_in(reason) => write!(f, "  {reason}"),
            JsonScan { points_skipped: 0, .. } => Ok(()),
            JsonScan { points_skipped, .. } => write!(f, "  {} points skipped", count(*points_skipped)),
        }
    }
}
