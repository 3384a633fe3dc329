//! The answer to a scan in JSON.

use serde::Serialize;
use utoipa::ToSchema;

use super::agreement::{JsonRayAgreement, JsonRival};
use super::described;
use super::pose::JsonPose;
use super::vectors::{PoseMatrix, PoseVector};
use super::version::JsonVersion;
use mrol_map::align::Direction;
use mrol_map::util::Keyword;
use mrol_service::ScanAnswer;

/// What became of a scan.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = Scan)]
pub struct JsonScan {
    /// True where the map took the scan, or would.
    pub accepted: bool,
    /// The alignment's verdict.
    #[schema(value_type = described::Verdict)]
    pub verdict: &'static str,
    /// Why, in a sentence.
    pub reason: String,
    /// The pose of the sensor in the map.
    pub map_from_sensor: JsonPose,
    /// Fraction of the points in occupied voxels of the finest level.
    pub overlap: f64,
    /// Fraction of the points in occupied voxels, level by level, finest first.
    pub level_overlaps: Vec<f64>,
    /// Fraction of a sample of the points that lie on the map's surfaces.
    pub inliers: f64,
    /// How closely they do, 0 to 1.
    pub fitness: f64,
    /// Rows of the information matrix; null of an answer that is given again.
    #[schema(value_type = Option<PoseMatrix>)]
    pub information: Option<[[f64; 6]; 6]>,
    /// Directions of the pose that the map's surfaces leave open.
    pub undetermined: Vec<JsonDirection>,
    /// How rays agree at the pose; null where the caller told it, of the first scan of a map, and of an answer that is
    /// given again.
    pub rays: Option<JsonRayAgreement>,
    /// Poses that the scan may have been taken at as well: why it is ambiguous.
    pub rivals: Vec<JsonRival>,
    /// Steps of the alignment.
    pub iterations: u32,
    /// Time of the alignment, milliseconds.
    pub align_ms: f64,
    /// Finest voxels added.
    pub new_voxels: usize,
    /// Finest voxels carved.
    pub carved_voxels: usize,
    /// Points that were left out.
    pub points_skipped: usize,
    /// True of a scan that was accepted before: this is that answer.
    pub replayed: bool,
    /// True of a robot that stands where its last scan was taken and sees nothing new.
    pub stationary: bool,
    /// How the robot, which was lost, was found again; null of a scan that fits from its own guess, or nowhere.
    #[schema(value_type = Option<described::Recovered>)]
    pub recovered: Option<&'static str>,
    /// Places in the scan of the points that the map does not show.
    #[schema(nullable = false)]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub foreground: Option<Vec<usize>>,
    /// The map's version: after the scan, or where it was refused, before.
    #[serde(flatten)]
    pub version: JsonVersion,
}

/// The places of the bits that are set, the lowest of each byte first.
fn places(bitmap: &[u8]) -> Vec<usize> {
    (0..bitmap.len() * 8).filter(|i| bitmap[i / 8] >> (i % 8) & 1 == 1).collect()
}

/// A direction of a pose that the map leaves open.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = Direction)]
pub struct JsonDirection {
    /// A unit vector: x y z along the axes of the map, then rotations about them through the sensor, each times the
    /// root mean square range of the scan, so that both are lengths.
    #[schema(value_type = PoseVector)]
    pub direction: [f64; 6],
    /// Standard deviation along it, meters; null where nothing holds the pose.
    pub std_m: Option<f64>,
}

impl From<Direction> for JsonDirection {
    fn from(open: Direction) -> Self {
        Self { direction: open.direction, std_m: Some(open.std_m).filter(|std_m| std_m.is_finite()) }
    }
}

impl From<ScanAnswer> for JsonScan {
    fn from(answer: ScanAnswer) -> Self {
        Self {
            accepted: answer.accepted,
            verdict: answer.verdict.as_str(),
            map_from_sensor: (&answer.map_from_sensor).into(),
            overlap: answer.overlap(),
            iterations: answer.iterations,
            new_voxels: answer.new_voxels,
            carved_voxels: answer.carved_voxels,
            points_skipped: answer.points_skipped,
            replayed: answer.replayed,
            stationary: answer.stationary,
            recovered: answer.recovered.map(Keyword::as_str),
            foreground: answer.foreground.map(|foreground| places(&foreground.bitmap)),
            version: answer.version.into(),
            align_ms: answer.align_time.as_secs_f64() * 1e3,
            inliers: answer.inliers,
            fitness: answer.fitness,
            information: answer.information,
            undetermined: answer.undetermined.into_iter().map(Into::into).collect(),
            rays: answer.rays.map(Into::into),
            rivals: answer.rivals.into_iter().map(Into::into).collect(),
            level_overlaps: answer.level_overlaps,
            reason: answer.reason,
        }
    }
}
