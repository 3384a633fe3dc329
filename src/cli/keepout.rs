//! `mrol keepout`: puts, removes and lists keep-outs of a map.

use std::fmt;
use std::fmt::Display;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use clap::Subcommand;
use serde::Serialize;

use super::remote::MapOptions;
use mrol::access::Expiry;
use mrol::console::CliError;
use mrol::console::Output;
use mrol::console::parse;
use mrol::json::{JsonKeepOut, JsonShape};
use mrol_map::map::{KeepOutName, KeepOutShape, Prism, Region, RequestId};
use mrol_service::{DeleteKeepOut, KeepOutAnswer, PutKeepOut};

const EXAMPLES: &str = "\
EXAMPLES:
  mrol keepout put dock --map office --box \"0 0 0 2.5 2.5 2\"
  mrol keepout put spill --map office --sphere \"1.5 2 0 0.8\" --expires-in 8h
  mrol keepout put stage --map office --prism \"0 0 4 0 4 3 1 5\" --height \"0 2.5\"
  mrol keepout list --map office
  mrol keepout delete dock --map office

A keep-out is a part of space where no robot may go, whatever the map holds there. Queries and listings regard it with
--keep-out. It is put in the place of the one of its name, if there is one.";

/// Put, remove and list the keep-outs of a map on a server
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct KeepOuts {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// Put a keep-out: a new one, or in the place of the one of its name
    Put(Box<Put>),
    /// Remove a keep-out
    Delete(Delete),
    /// List the keep-outs, by name
    List(List),
}

#[derive(Debug, clap::Args)]
struct Put {
    /// Name of the keep-out: [a-z0-9][a-z0-9_-]{0,63}
    #[arg(id = "keep_out", value_name = "NAME", value_parser = parse::keep_out_name)]
    name: KeepOutName,
    #[command(flatten)]
    map: MapOptions,
    #[command(flatten)]
    shape: Shape,
    /// How long it stays: 90s, 15m, 8h or 2d [default: until it is removed]
    #[arg(long, value_name = "TIME", value_parser = parse::duration, conflicts_with = "request_id")]
    expires_in: Option<Duration>,
    /// When it ends, nanoseconds since 1970: what goes with an id, since it is the same when it is sent again
    #[arg(long, value_name = "NANOSECONDS", conflicts_with = "expires_in")]
    expires_at_ns: Option<i64>,
    /// An id of this change, which makes it safe to send again
    #[arg(long, value_name = "ID", value_parser = parse::request_id)]
    request_id: Option<RequestId>,
}

#[derive(Debug, clap::Args)]
struct Shape {
    #[command(flatten)]
    of: OneShape,
    /// The heights that a prism goes from and to, meters
    #[arg(long, value_name = "FROM TO", allow_hyphen_values = true, requires = "prism", value_parser = parse::heights)]
    height: Option<[f64; 2]>,
}

#[derive(Debug, clap::Args)]
#[group(required = true, multiple = false)]
struct OneShape {
    /// A box: smallest and largest corner, meters
    #[arg(long = "box", value_name = "X Y Z X Y Z", allow_hyphen_values = true, value_parser = parse::cuboid)]
    cuboid: Option<Region>,
    /// A sphere: center and radius, meters
    #[arg(long, value_name = "X Y Z R", allow_hyphen_values = true, value_parser = parse::ball)]
    sphere: Option<Region>,
    /// A box of any orientation: its center, its rotation as a unit quaternion, and its sides, meters
    #[arg(long, value_name = "X Y Z QX QY QZ QW SX SY SZ", allow_hyphen_values = true, value_parser = parse::oriented_box)]
    oriented_box: Option<Region>,
    /// A polygon with a height: x and y of its 3 to 64 corners, in order, meters
    #[arg(long, value_name = "X Y ...", allow_hyphen_values = true, requires = "height", value_parser = parse::polygon)]
    prism: Option<parse::Polygon>,
}

#[derive(Debug, clap::Args)]
struct Delete {
    /// Name of the keep-out
    #[arg(id = "keep_out", value_name = "NAME", value_parser = parse::keep_out_name)]
    name: KeepOutName,
    #[command(flatten)]
    map: MapOptions,
    /// An id of this change, which makes it safe to send again
    #[arg(long, value_name = "ID", value_parser = parse::request_id)]
    request_id: Option<RequestId>,
}

#[derive(Debug, clap::Args)]
pub(crate) struct List {
    #[command(flatten)]
    map: MapOptions,
}

impl KeepOuts {
    pub(super) async fn run(self, output: Output) -> Result<(), CliError> {
        match self.action {
            Action::Put(put) => put.run(output).await,
            Action::Delete(delete) => delete.run(output).await,
            Action::List(list) => list.run(output).await,
        }
    }
}

impl Put {
    async fn run(self, output: Output) -> Result<(), CliError> {
        let Self { name, map, shape, expires_in, expires_at_ns, request_id } = self;
        let from_now = expires_in.map(|rest| unix_time_ns(SystemTime::now() + rest)).transpose()?;
        let expires_at_ns = from_now.or(expires_at_ns);
        let put = PutKeepOut { name: name.clone(), shape: shape.resolve()?, expires_at_ns, request_id };
        let client = map.server.connect().await?;
        let answer = client.put_keep_out(&map.name, put).await?;
        output.print(&Changed::of(&name, "put", &answer))
    }
}

impl Shape {
    fn resolve(self) -> Result<KeepOutShape, CliError> {
        let OneShape { cuboid, sphere, oriented_box, prism } = self.of;
        let shape = match (cuboid.or(sphere).or(oriented_box), prism, self.height) {
            (Some(region), _, _) => KeepOutShape::of_region(region),
            (None, Some(corners), Some(height)) => {
                Prism::new(&corners.0, height).map(KeepOutShape::Prism).map_err(Into::into)
            }
            _ => {
                return Err(CliError::usage(
                    "give --box, --sphere, --oriented-box, or --prism with --height",
                ));
            }
        };
        shape.map_err(|error| CliError::usage(error.to_string()))
    }
}

impl Delete {
    async fn run(self, output: Output) -> Result<(), CliError> {
        let Self { name, map, request_id } = self;
        let client = map.server.connect().await?;
        let deletion = DeleteKeepOut { name: name.clone(), request_id };
        let answer = client.delete_keep_out(&map.name, deletion).await?;
        output.print(&Changed::of(&name, "removed", &answer))
    }
}

impl List {
    async fn run(self, output: Output) -> Result<(), CliError> {
        let client = self.map.server.connect().await?;
        let listing = client.list_keep_outs(&self.map.name).await?;
        listing.keep_outs.iter().try_for_each(|keep_out| output.print(&Listed(keep_out.into())))
    }
}

/// Nanoseconds since the Unix epoch.
fn unix_time_ns(time: SystemTime) -> Result<i64, CliError> {
    let since_epoch = time.duration_since(UNIX_EPOCH).unwrap_or_default();
    i64::try_from(since_epoch.as_nanos()).map_err(|_| CliError::usage("--expires-in is too long"))
}

#[derive(Serialize)]
struct Changed {
    keep_out: String,
    done: &'static str,
    replayed: bool,
    revision: u64,
    map_uuid: String,
}

impl Changed {
    fn of(name: &KeepOutName, done: &'static str, answer: &KeepOutAnswer) -> Self {
        let (revision, map_uuid) = (answer.version.revision, answer.version.map_uuid.to_string());
        Self { keep_out: name.to_string(), done, replayed: answer.replayed, revision, map_uuid }
    }
}

impl Display for Changed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { keep_out, done, revision, .. } = self;
        write!(f, "keep-out {keep_out} {done}; revision {revision}")
    }
}

#[derive(Serialize)]
#[serde(transparent)]
struct Listed(JsonKeepOut);

impl Display for Listed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let JsonKeepOut { name, shape, made_by, made_revision, expires_at_ns } = &self.0;
        write!(f, "{name:<24} ")?;
        match shape {
            JsonShape::Box { min_m, max_m } => write!(f, "box {min_m:?} to {max_m:?} m")?,
            JsonShape::Sphere { center_m, radius_m } => {
                write!(f, "sphere about {center_m:?} m, radius {radius_m} m")?
            }
            JsonShape::OrientedBox { map_from_box, size_m } => {
                write!(f, "box of {size_m:?} m about {:?} m", map_from_box.translation_m)?;
            }
            JsonShape::Prism { corners_m, z_from_m, z_to_m } => {
                write!(f, "prism of {} corners, {z_from_m} to {z_to_m} m high", corners_m.len())?;
            }
        }
        write!(f, "; revision {made_revision}")?;
        if let Some(caller) = made_by {
            write!(f, ", by {caller}")?;
        }
        let until = expires_at_ns.and_then(|at| u64::try_from(at).ok()).map(Duration::from_nanos);
        match until.and_then(|until| Expiry::after(UNIX_EPOCH, until)) {
            Some(until) => write!(f, ", until {until}"),
            None => Ok(()),
        }
    }
}
