//! The command `mrol localize`.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::report::Localized;
use crate::cli::remote::ServerOptions;
use crate::cli::scan_report::name_of;
use crate::cli::survey::SurveyOptions;
use mrol::console::CliError;
use mrol::console::Output;
use mrol::console::parse;
use mrol_client::Client;
use mrol_map::align::AlignmentSettings;
use mrol_map::align::localize::{
    Gravity, LocalizationQuery, LocalizationSettings, SearchBox, SearchProgress, Supervision,
    localize_supervised,
};
use mrol_map::geometry::Point;
use mrol_map::map::{MapName, MapSettings, MultiResolutionMap};
use mrol_map::mapping::MappingError;
use mrol_map::scan::{PointFilter, SkippedPoints};
use mrol_map::util::StopSignal;
use mrol_service::{CANDIDATES_DEFAULT, LocalizationAnswer, LocalizationRequest, MapVersion, SEARCH_SHARE};
use mrol_store::{Disk, Snapshot};

const EXAMPLES: &str = "\
EXAMPLES:
  mrol map scans/ --resolution 0.1 --out hall.mrol            a map file to search in
  mrol localize --map hall.mrol scan.ply                      in this process, no server needed
  mrol localize --map hall.mrol scan.ply --gravity 0,0,-1     ten times as fast: the sensor's z axis points up
  mrol localize --map hall.mrol scan.ply --box \"-5 -5 0 5 5 2\" --candidates 3
  mrol localize --name hall new/*.ply --json | jq .verdict    on a server

A place is accepted only where the scan fits it and no other place is as good. A scan that fits nowhere, or in several
places, is answered with the places it fits best, and the exit code is then 3. Without --gravity, only rotations are
tried that bring surfaces of the scan parallel to the map's dominant ones, and the search is not exhaustive. --gravity
may be 2 degrees off.";

/// Find where in a map a scan was taken, with no guess
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Localize {
    /// Scan files, or folders of them in the natural order of names (scan2 before scan10): .ply .pcd .xyz .npy .bin
    /// .f32 .3d; with --camera .png
    #[arg(required = true, value_name = "SCAN")]
    scans: Vec<PathBuf>,
    /// A map file, as `mrol map --out` writes it
    #[arg(long, value_name = "FILE.mrol", required_unless_present = "name", conflicts_with = "name")]
    map: Option<PathBuf>,
    /// Instead of --map: the name of a map on a server
    #[arg(long, value_name = "NAME", value_parser = parse::map_name)]
    name: Option<MapName>,
    #[command(flatten)]
    server: ServerOptions,
    #[command(flatten)]
    survey: SurveyOptions,
    /// Direction of gravity in the sensor frame
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = parse::vector)]
    gravity: Option<[f64; 3]>,
    /// Direction of gravity in the map frame
    #[arg(
        long,
        value_name = "X,Y,Z",
        allow_hyphen_values = true,
        value_parser = parse::vector,
        requires = "gravity",
        default_value = "0,0,-1"
    )]
    map_gravity: [f64; 3],
    /// Where the sensor may be: "x y z x y z", smallest and largest corner [default: anywhere in the map]
    #[arg(long = "box", value_name = "BOX", allow_hyphen_values = true, value_parser = parse::search_box)]
    search_box: Option<SearchBox>,
    /// Answer with the best so far after this many seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 10.0)]
    time_limit: f64,
    /// Candidates to print, at most
    #[arg(long, value_name = "COUNT", default_value_t = CANDIDATES_DEFAULT)]
    candidates: usize,
    /// Seed of the choice of the scan's points
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
}

impl Localize {
    pub(crate) async fn run(self, output: Output) -> Result<(), CliError> {
        let (query, time_limit) = (self.query()?, self.time_limit()?);
        let files = self.survey.reader().files(&self.scans)?;
        let place = match (&self.map, &self.name) {
            (Some(file), _) => MapSource::open(file)?,
            (None, Some(name)) => MapSource::Server(self.server.connect().await?, name.clone()),
            (None, None) => return Err(CliError::usage("one of --map and --name is needed")),
        };
        let survey = match files.first() {
            Some(file) => {
                Some(self.survey.survey(&place.settings().await?, &self.survey.read(file)?, false)?)
            }
            None => None,
        };
        let output = output.with_spinner();
        let mut refused = 0;
        for (file, survey) in files.iter().zip(survey.iter().cycle()) {
            let request = LocalizationRequest {
                points: survey.read(file)?.into(),
                query,
                time_limit: Some(time_limit),
            };
            output.tell(format!("{}: searching", name_of(file)));
            let answer = place.find(request, &output).await?;
            output.print(&Localized::of(name_of(file), &answer))?;
            refused += usize::from(!answer.accepted());
        }
        output.clear_bar();
        CliError::unless_accepted(refused, files.len())
    }

    fn query(&self) -> Result<LocalizationQuery, CliError> {
        let gravity = self.gravity.map(|in_sensor| Gravity::new(in_sensor, self.map_gravity));
        Ok(LocalizationQuery {
            gravity: gravity.transpose().map_err(CliError::usage)?,
            search_box: self.search_box,
            candidates: self.candidates.max(1),
            seed: self.seed,
        })
    }

    fn time_limit(&self) -> Result<Duration, CliError> {
        Duration::try_from_secs_f64(self.time_limit)
            .map_err(|_| CliError::usage(format!("--time-limit must be 0 or more, got {}", self.time_limit)))
    }
}

/// Source of the map.
enum MapSource {
    File(Box<MultiResolutionMap>, MapVersion),
    Server(Client, MapName),
}

impl MapSource {
    fn open(file: &Path) -> Result<Self, CliError> {
        let snapshot = Snapshot::read(&Disk::default(), file)?;
        let version = MapVersion {
            revision: snapshot.contents.revision,
            map_uuid: snapshot.uuid,
            content_hash: Some(snapshot.contents.version().hash),
        };
        Ok(Self::File(Box::new(snapshot.restore().map_err(CliError::failed)?), version))
    }

    async fn settings(&self) -> Result<MapSettings, CliError> {
        match self {
            Self::File(map, _) => Ok(*map.settings()),
            Self::Server(client, name) => Ok(client.map_info(name).await?.settings),
        }
    }

    async fn find(
        &self,
        request: LocalizationRequest,
        output: &Output,
    ) -> Result<LocalizationAnswer, CliError> {
        match self {
            Self::File(map, version) => find_here(map, *version, &request, output),
            Self::Server(client, name) => Ok(client.localize(name, request).await?),
        }
    }
}

/// A time limit beyond any search: a year.
const LONGEST: Duration = Duration::from_secs(365 * 86_400);

/// Searches in this process, with progress reports.
fn find_here(
    map: &MultiResolutionMap,
    version: MapVersion,
    request: &LocalizationRequest,
    output: &Output,
) -> Result<LocalizationAnswer, CliError> {
    let all = request.points.as_slice();
    let skipped = SkippedPoints::of(all, &PointFilter::default());
    let points: Vec<Point> =
        all.iter().copied().filter(|point| PointFilter::default().keeps(*point)).collect();
    if points.is_empty() {
        return Err(CliError::failed(MappingError::NoReturns { points: all.len(), zeros: skipped.zeros }));
    }
    let start = Instant::now();
    let mut tell = |progress: &SearchProgress| {
        let SearchProgress { cells, waiting, best_overlap } = progress;
        output.tell(format!("{cells} cells of poses, {waiting} wait, best overlap {best_overlap:.2}"));
    };
    let within = |share: f64| match request
        .time_limit
        .and_then(|limit| start.checked_add(limit.min(LONGEST).mul_f64(share)))
    {
        Some(end) => StopSignal::NEVER.by(end),
        None => StopSignal::NEVER,
    };
    let found = localize_supervised(
        map,
        &points,
        &request.query,
        &LocalizationSettings::default(),
        &AlignmentSettings::default(),
        &mut Supervision {
            stop: within(1.0),
            search_stop: within(SEARCH_SHARE),
            progress: &mut tell,
            reserve: &mut |_| true,
        },
    )
    .map_err(CliError::failed)?;
    Ok(LocalizationAnswer::of(found, &skipped, start.elapsed(), version))
}
