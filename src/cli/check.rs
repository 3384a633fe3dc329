//! `mrol check`: asks whether a body fits, at poses or along a motion.

use std::fmt;
use std::fmt::Display;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::met::met;
use super::remote::MapOptions;
use super::scope::ScopeOptions;
use mrol::console::CliError;
use mrol::console::Output;
use mrol::console::parse;
use mrol_client::Client;
use mrol_map::geometry::{Point, Pose, rotation_xyzw, translation_m};
use mrol_map::map::MapName;
use mrol_map::planning::{Body, Link, Sphere, Surroundings, Unknown};
use mrol_map::voxel::VoxelKey;
use mrol_service::{CheckAs, Collisions, MotionCheck, PoseCheck};

const EXAMPLES: &str = "\
EXAMPLES:
  mrol check --map office --sphere \"0 0 0.2 0.3\" --pose \"1 2 0 0 0 0 1\"
  mrol check --map office --sphere \"0 0 0.2 0.3\" --pose \"1 2 0 0 0 0 1\" --clearance 1
  mrol check --map office --body arm.json --pose \"1 2 0 0 0 0 1\" --pose \"2 2 0 0 0 0 1\"
  mrol check --map office --sphere \"0 0 0 0.3\" --motion --pose \"1 2 1 0 0 0 1\" --pose \"4 2 1 0 0 0 1\"
  mrol check --map office --sphere \"0 0 0 0.3\" --pose \"1 2 1 0 0 0 1\" --unknown occupied

A body file is what HTTP takes, with one link here: {\"links\": [{\"spheres\": [[x, y, z, r], ...], \"points\": [[x, y, z], ...],
\"padding_m\": 0.05}]}. With --motion the body moves from pose to pose.";

/// Ask a server whether a body fits at poses, or along a motion
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Check {
    #[command(flatten)]
    map: MapOptions,
    /// A sphere of the body: center and radius in the body's frame, meters; may be repeated
    #[arg(long, value_name = "X Y Z R", allow_hyphen_values = true, value_parser = parse::sphere, required_unless_present = "body", conflicts_with = "body")]
    sphere: Vec<Sphere>,
    /// A file with the body, of one link
    #[arg(long, value_name = "FILE.json")]
    body: Option<PathBuf>,
    /// A pose of the body in the map; may be repeated
    #[arg(long, value_name = "POSE", allow_hyphen_values = true, value_parser = parse::pose, required = true)]
    pose: Vec<Pose>,
    /// Check the motion from pose to pose
    #[arg(long)]
    motion: bool,
    /// Tell how much room there is, up to so many meters (and to 64 voxels of the level)
    #[arg(long, value_name = "METERS")]
    clearance: Option<f32>,
    /// What voxels count as that no scan saw through: free, or occupied, so that a body fits only where all of it was
    /// seen to be free
    #[arg(long, value_parser = parse::keyword::<Unknown>(), default_value = "free")]
    unknown: Unknown,
    #[command(flatten)]
    asked: ScopeOptions,
}

impl Check {
    pub(super) async fn run(self, output: Output) -> Result<(), CliError> {
        let body = match &self.body {
            Some(path) => read_body(path)?,
            None => Body::new(vec![Link { spheres: self.sphere.clone(), ..Link::default() }])
                .map_err(CliError::failed)?,
        };
        if body.links().len() != 1 {
            let message = format!("a body of one link is checked here, this one has {}", body.links().len());
            return Err(CliError::failed(message));
        }
        let client = self.map.server.connect().await?;
        let configurations = self.pose.iter().flat_map(numbers_of).collect();
        let body = Arc::new(body);
        match (self.motion, self.clearance) {
            (true, _) => self.check_motion(&client, body, configurations, &output).await,
            (false, None) => self.check_poses(&client, body, configurations, &output).await,
            (false, most_m) => self.measure_poses(&client, body, configurations, most_m, &output).await,
        }
    }

    fn surroundings(&self) -> Surroundings {
        Surroundings { unknown: self.unknown, ..Surroundings::ALL_VOXELS }
    }

    fn map_name(&self) -> &MapName {
        &self.map.name
    }

    async fn check_poses(
        &self,
        client: &Client,
        body: Arc<Body>,
        configurations: Vec<f32>,
        output: &Output,
    ) -> Result<(), CliError> {
        let (asked, surroundings) = (self.asked.scope(), self.surroundings());
        let check = PoseCheck { asked, body, configurations, surroundings, answer: CheckAs::FirstHit };
        let answered = client.check_poses(self.map_name(), check).await?;
        let Collisions::FirstHits(hits) = answered.answer else {
            return Err(CliError::failed("the server did not say what is met first"));
        };
        hits.iter().enumerate().try_for_each(|(pose, hit)| {
            let met = hit.as_ref().map(|hit| &hit.met);
            let part = hit.as_ref().map(|hit| hit.part);
            output.print(&PoseLine {
                pose,
                fits: hit.is_none(),
                part,
                voxel: met.and_then(|met| met.voxel()).map(VoxelKey::index),
                keep_out: met.and_then(|met| met.keep_out()).map(ToString::to_string),
                revision: answered.version.revision,
            })
        })
    }

    async fn measure_poses(
        &self,
        client: &Client,
        body: Arc<Body>,
        configurations: Vec<f32>,
        most_m: Option<f32>,
        output: &Output,
    ) -> Result<(), CliError> {
        let (asked, surroundings) = (self.asked.scope(), self.surroundings());
        let answer = CheckAs::Clearance { most_m };
        let check = PoseCheck { asked, body, configurations, surroundings, answer };
        let answered = client.check_poses(self.map_name(), check).await?;
        let Collisions::Clearances(clearances) = answered.answer else {
            return Err(CliError::failed("the server did not say how much room there is"));
        };
        let revision = answered.version.revision;
        clearances.iter().enumerate().try_for_each(|(pose, clearance)| {
            let (clearance_m, is_all) = (clearance.distance_m, clearance.link.is_some());
            output.print(&RoomLine { pose, clearance_m, is_all, revision })
        })
    }

    async fn check_motion(
        &self,
        client: &Client,
        body: Arc<Body>,
        configurations: Vec<f32>,
        output: &Output,
    ) -> Result<(), CliError> {
        let check = MotionCheck {
            asked: self.asked.scope(),
            body,
            configurations,
            lengths: vec![self.pose.len() as u32],
            step_m: None,
            clearance_max_m: self.clearance,
            surroundings: self.surroundings(),
        };
        let answered = client.check_motions(self.map_name(), check).await?;
        let revision = answered.version.revision;
        answered.answer.iter().try_for_each(|motion| {
            let (is_free, first_hit, clearance_m) = (motion.is_free(), motion.first_hit, motion.clearance_m);
            output.print(&MotionLine { is_free, first_hit, clearance_m, revision })
        })
    }
}

/// The seven numbers of a pose in a configuration.
fn numbers_of(pose: &Pose) -> impl Iterator<Item = f32> + use<> {
    translation_m(pose).into_iter().chain(rotation_xyzw(pose)).map(|number| number as f32)
}

/// A body as HTTP takes it.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct BodyFile {
    links: Vec<LinkFile>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LinkFile {
    #[serde(default)]
    spheres: Vec<[f32; 4]>,
    #[serde(default)]
    points: Vec<[f32; 3]>,
    #[serde(default)]
    padding_m: f32,
}

fn read_body(path: &Path) -> Result<Body, CliError> {
    let failed = |error: &dyn Display| CliError::failed(format!("{}: {error}", path.display()));
    let text = fs::read_to_string(path).map_err(|error| failed(&error))?;
    let file: BodyFile = serde_json::from_str(&text).map_err(|error| failed(&error))?;
    let link = |link: LinkFile| Link {
        spheres: link
            .spheres
            .into_iter()
            .map(|[x, y, z, radius_m]| Sphere { center_m: [x, y, z], radius_m })
            .collect(),
        points: link.points.into_iter().map(Point::from).collect(),
        padding_m: link.padding_m,
    };
    Body::new(file.links.into_iter().map(link).collect()).map_err(|error| failed(&error))
}

#[derive(Serialize)]
struct PoseLine {
    pose: usize,
    fits: bool,
    part: Option<u32>,
    voxel: Option<[i32; 3]>,
    keep_out: Option<String>,
    revision: u64,
}

impl Display for PoseLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Some(part) = self.part else { return write!(f, "pose {} fits", self.pose) };
        write!(f, "pose {} does not fit: part {part} of the body meets ", self.pose)?;
        f.write_str(&met(self.voxel, self.keep_out.as_deref()))
    }
}

#[derive(Serialize)]
struct RoomLine {
    pose: usize,
    clearance_m: f32,
    /// False where there may be more: nobody looked further.
    is_all: bool,
    revision: u64,
}

impl Display for RoomLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let at_least = if self.is_all { "" } else { "at least " };
        write!(f, "pose {} has {at_least}{:.3} m of room", self.pose, self.clearance_m)
    }
}

#[derive(Serialize)]
struct MotionLine {
    is_free: bool,
    first_hit: Option<f32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    clearance_m: Option<f32>,
    revision: u64,
}

impl Display for MotionLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.first_hit {
            Some(share) => write!(f, "the motion meets something after {:.1} % of it", 100.0 * share),
            None => f.write_str("the motion is free"),
        }?;
        self.clearance_m.map_or(Ok(()), |m| write!(f, "; the least clearance on it is {m:.3} m"))
    }
}
