//! The rays of a known sensor: how they lie, as its model says and the points of a scan confirm.

use super::density::{Gaps, Neighbors, PointDensity, SeenPixels, spacing};
use super::sensor_model::SensorModel;
use crate::geometry::Point;
use crate::visibility::directions::{CubeMap, TILE_SIDE};
use crate::visibility::thresholds::Thresholds;

/// Tiles along the side of a face, at least and at most: pixels of 0.28 to 5.6 degrees, as for unknown sensors.
const TILES: [usize; 2] = [2, 40];
/// The angle of a pixel at the corners of a face, where it is least, for its side on the face: the square root of 2 by
/// 3, see [`CubeMap::angle_of_step`].
const NARROWEST: f64 = std::f64::consts::SQRT_2 / 3.0;
/// How many of the narrowest pixels have room between two rays, less than: with 2 none beside or above another one,
/// where rays lie in rows and columns of pixels. Rings that cross them askew leave more, but none with 1.
const BETWEEN_RAYS: [f64; 3] = [2.0, std::f64::consts::SQRT_2, 1.0];
/// Points that lie more times as far apart as the model's rays are not all of them: a quarter of the way to every
/// second one. So much leave rays that are lost here and there.
const APART_MAX: f32 = 1.25;

/// How the rays of a scan lie, by the model of its sensor: what is measured of a scan of an unknown one, from its
/// points and by trial.
///
/// A model may be wrong, or the robot may send a part of its points. So there are none without points that were
/// looked at: what a wrong model said would let a scan see between its rays.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SensorRays {
    /// Angle between neighbors by the model, in the direction in which it is larger, radians.
    step: f32,
    /// The same, or what the points tell where that is more.
    spacing: f32,
    /// Pixels as fine as the rays lie.
    map: CubeMap,
}

/// Why a sensor's model is not used for a scan.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum SensorMismatch {
    /// More points than the sensor has rays.
    #[error("its sensor model \"{model}\" is not used: {points} points are more than its {} rays", model.rays())]
    MorePoints {
        /// The model.
        model: SensorModel,
        /// Points of the scan.
        points: usize,
    },
    /// The points lie farther apart than the model says.
    #[error(
        "its sensor model \"{model}\" is not used: points beside each other are {points_deg:.2} degrees apart as a \
         rule, its rays {model_deg:.2}, as where a part of the points is sent"
    )]
    Sparse {
        /// The model.
        model: SensorModel,
        /// Angle between points, degrees.
        points_deg: f32,
        /// Angle between rays by the model, degrees.
        model_deg: f32,
    },
    /// Many points have none beside them where the model has rays.
    #[error(
        "its sensor model \"{model}\" is not used: rays are missing beside its points, {:.1} times for 100 of them, {:.1} \
         at most may be",
        100.0 * share,
        100.0 * share_max
    )]
    Gaps {
        /// The model.
        model: SensorModel,
        /// Gaps of two and more pixels, as a share of the pixels with points.
        share: f64,
        /// How large it may be.
        share_max: f64,
    },
}

impl SensorRays {
    /// The rays of a sensor, confirmed by the points where the rays of a scan ended, all of them (sensor frame; those
    /// that are not finite count for none).
    ///
    /// The model tells how wide pixels have to be that few of them lie between two rays. If the points leave many gaps
    /// of two pixels and more all the same, or are much farther apart as a rule, the model is none of theirs; pixels of
    /// unknown sensors have to pass the first test, too. The points' own angles count if they are larger than the
    /// model's. So neither a wrong model nor a robot that sends a part of its points lets a scan see between its rays.
    ///
    /// # Errors
    /// Says why the model is not the one of these points.
    pub fn confirmed(model: &SensorModel, points: &[Point]) -> Result<Self, SensorMismatch> {
        let has_direction = |offset: &[f32; 3]| offset.iter().all(|c| c.is_finite()) && *offset != [0.0; 3];
        let offsets: Vec<[f32; 3]> = points.iter().map(|point| point.xyz()).filter(has_direction).collect();
        if offsets.len() > model.rays() {
            return Err(SensorMismatch::MorePoints { model: *model, points: offsets.len() });
        }
        let [to_side, up] = model.steps_rad();
        let step = to_side.max(up);
        let (share_max, mut least) = (f64::from(Thresholds::DEFAULT.sieve_share_max), f64::INFINITY);
        for between in BETWEEN_RAYS {
            let map = CubeMap::new(tiles(step / (between * NARROWEST)));
            let seen = SeenPixels::of(map, &offsets);
            let Gaps { of_one, wider } = seen.gaps(f32::INFINITY);
            if wider > share_max {
                least = least.min(wider);
                continue;
            }
            let (step, Neighbors { apart, width }) = (step as f32, seen.neighbors());
            if apart == 0.0 {
                // So few points have none beside them.
                least = 1.0;
                break;
            }
            if apart > APART_MAX * step.max(width) {
                let [points_deg, model_deg] = [apart, step].map(f32::to_degrees);
                return Err(SensorMismatch::Sparse { model: *model, points_deg, model_deg });
            }
            // Wider pixels confirm less: there the points tell, as those of an unknown sensor do.
            let told = if between == BETWEEN_RAYS[0] { apart } else { spacing(map, of_one) };
            return Ok(Self { step, spacing: step.max(told), map });
        }
        Err(SensorMismatch::Gaps { model: *model, share: least, share_max })
    }

    /// What would be measured of the points.
    pub(in crate::visibility) fn density(self) -> PointDensity {
        PointDensity { map: self.map, spacing: self.spacing }
    }

    /// True of pixels of which each has a ray, the narrowest too; and of those as wide as what a point tells of.
    pub(super) fn meet_all(self, map: CubeMap, thresholds: &Thresholds) -> bool {
        map.pitch() * NARROWEST as f32 >= self.step || map.pitch() >= thresholds.spacing_max
    }
}

/// The most tiles along the side of a face whose pixels are so wide.
fn tiles(pitch: f64) -> usize {
    let [least, most] = TILES;
    ((2.0 / TILE_SIDE as f64 / pitch) as usize).clamp(least, most)
}
