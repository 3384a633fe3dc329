//! `mrol query`: asks which points are in occupied voxels.

use std::fmt;
use std::fmt::Display;
use std::fs;
use std::path::PathBuf;
use std::time::Instant;

use serde::Serialize;

use super::remote::MapOptions;
use super::survey::{SurveyOptions, named};
use mrol::console::CliError;
use mrol::console::Output;
use mrol::console::parse;
use mrol::console::{Survey, count, percent};
use mrol_client::Client;
use mrol_map::geometry::{Point, Pose};
use mrol_map::map::Lookup;
use mrol_service::{MapVersion, PointAnswer, PointQuery};

/// Number of points of one message: a multiple of 8, so that the bitmaps of messages can be concatenated.
const BATCH_POINTS: usize = 1_000_000;

const EXAMPLES: &str = "\
EXAMPLES:
  mrol query --map office --point 1.0,2.5,0.3 --point -1,0,0
  mrol query candidates.xyz --map office                       how many of a file's points are occupied
  mrol query body.ply --map office --pose \"3 2 0.1 0 0 0 1\"     a robot's body, at a pose in the map
  mrol query candidates.f32 --map office --lookup bloom --level 1 --out occupied.bin

--out writes a bit a point: point i is bit i % 8 (lowest first) of byte i / 8.";

/// Ask a server which points are in occupied voxels
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Query {
    /// Points to ask about: .ply .pcd .xyz .npy .bin .f32 .3d
    #[arg(required_unless_present = "point", conflicts_with = "point")]
    points_file: Option<PathBuf>,
    /// A point to ask about, meters; may be repeated
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = parse::vector)]
    point: Vec<[f64; 3]>,
    #[command(flatten)]
    map: MapOptions,
    #[command(flatten)]
    survey: SurveyOptions,
    /// Level to ask: 0 is the finest
    #[arg(long, default_value_t = 0)]
    level: u32,
    /// The look-up: the exact set, or the Bloom filter alone, which may call a free voxel occupied
    #[arg(long, value_parser = parse::keyword::<Lookup>(), default_value = "exact")]
    lookup: Lookup,
    /// Where the points' frame lies in the map: "x y z qx qy qz qw" [default: the map's own frame]
    #[arg(long, value_name = "POSE", allow_hyphen_values = true, value_parser = parse::pose)]
    pose: Option<Pose>,
    /// Points in keep-outs count as occupied
    #[arg(long)]
    keep_out: bool,
    /// Write the answers as a bitmap
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

impl Query {
    pub(super) async fn run(self, output: Output) -> Result<(), CliError> {
        let client = self.map.server.connect().await?;
        let file = self.points_file.as_deref();
        let (points, survey) =
            self.survey.exact(&client, &self.map.name, file, &self.point, self.pose.is_some()).await?;
        let points = survey.near(&named(file), &points)?;
        let answer = self.ask(&client, &points, &survey).await?;
        if let Some(path) = &self.out {
            fs::write(path, &answer.bitmap).map_err(CliError::writing(path))?;
        }
        if self.point.is_empty() {
            return output.print(&answer);
        }
        points.iter().enumerate().try_for_each(|(i, point)| output.print(&answer.of_point(i, *point)))
    }

    /// Queries all points, in batches on one stream.
    async fn ask(&self, client: &Client, points: &[Point], survey: &Survey) -> Result<Answer, CliError> {
        let batches: Vec<_> = points.chunks(BATCH_POINTS).map(|points| self.query(points, survey)).collect();
        let start = Instant::now();
        let mut answers = client.query_stream(&self.map.name, tokio_stream::iter(batches)).await?;
        let mut all = Answer::default();
        while let Some(answer) = answers.next().await {
            all.add(&answer?);
        }
        if all.points != points.len() {
            let message = format!("the server answered {} of {} points: try again", all.points, points.len());
            return Err(CliError::failed(message));
        }
        all.took(start);
        Ok(all)
    }

    fn query(&self, points: &[Point], survey: &Survey) -> PointQuery {
        PointQuery {
            points: points.to_vec().into(),
            map_from_points: self.pose.map(|pose| survey.to_map(&pose)),
            level: self.level,
            lookup: self.lookup,
            min_revision: None,
            map_uuid: None,
            keep_out: self.keep_out,
        }
    }
}

/// The answers to all points.
#[derive(Default, Serialize)]
struct Answer {
    points: usize,
    occupied: usize,
    /// Share of the points that are occupied.
    share: f64,
    /// The revision of the last batch.
    revision: u64,
    map_uuid: String,
    seconds: f64,
    points_per_s: f64,
    #[serde(skip)]
    bitmap: Vec<u8>,
    #[serde(skip)]
    revision_first: Option<u64>,
}

impl Answer {
    fn add(&mut self, answer: &PointAnswer) {
        let MapVersion { revision, map_uuid, .. } = answer.version;
        self.points += answer.points;
        self.occupied += answer.points_occupied;
        self.bitmap.extend_from_slice(&answer.occupied);
        self.revision_first.get_or_insert(revision);
        self.revision = revision;
        self.map_uuid = map_uuid.to_string();
    }

    fn took(&mut self, start: Instant) {
        self.seconds = start.elapsed().as_secs_f64();
        self.points_per_s = self.points as f64 / self.seconds;
        self.share = self.occupied as f64 / self.points as f64;
    }

    fn of_point(&self, i: usize, point: Point) -> PointLine {
        let occupied = self.bitmap.get(i / 8).is_some_and(|byte| byte >> (i % 8) & 1 == 1);
        PointLine { point: point.xyz(), occupied, revision: self.revision }
    }
}

impl Display for Answer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} of {} points are occupied ({}), at revision ",
            count(self.occupied),
            count(self.points),
            percent(self.share)
        )?;
        match self.revision_first {
            Some(first) if first != self.revision => write!(f, "{first} to {}", self.revision)?,
            _ => write!(f, "{}", self.revision)?,
        }
        write!(f, "; {:.3} s, {:.1} M points/s", self.seconds, self.points_per_s / 1e6)
    }
}

/// The answer to one point of the command line.
#[derive(Serialize)]
struct PointLine {
    point: [f32; 3],
    occupied: bool,
    revision: u64,
}

impl Display for PointLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y, z] = self.point;
        let what = if self.occupied { "occupied" } else { "free" };
        write!(f, "{x:>10} {y:>10} {z:>10}   {what}")
    }
}
