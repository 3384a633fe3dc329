//! How well a scan fits a few voxels aside, by overlap alone.
//!
//! A map that keeps no moments does not know its surfaces. The centers of its voxels make stairs of a wall that lies
//! askew in the lattice, and stairs seem to hold a scan along the wall. Overlap is not misled: where a scan fits about
//! as well some voxels aside, nothing holds it in that direction.

use nalgebra::{Translation3, Unit, UnitQuaternion, Vector3};

use super::overlap::Overlap;
use super::sampled_scan::SampledScan;
use super::settings::AlignmentSettings;
use crate::geometry::Pose;
use crate::map::MultiResolutionMap;

/// Directions on the half of a sphere that are looked at first: some 14 degrees apart.
const DIRECTIONS: usize = 100;
/// Number of the best of them that are looked at more closely.
const FOLLOWED: usize = 4;
/// Angles to the directions beside one, degrees, the widest first.
const ANGLES_DEG: [f64; 3] = [6.0, 3.0, 1.5];
/// Number of directions beside one, at each angle.
const BESIDE: usize = 6;

/// The shift of a scan that costs it least overlap.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Slide {
    /// Where to, along the map's axes.
    pub(super) direction: Unit<Vector3<f64>>,
    /// The overlap there, as a fraction of that at the pose; above 1 where the scan fits better there.
    pub(super) share: f64,
}

impl Slide {
    /// Of all shifts of a scan at `pose` by [`AlignmentSettings::slide`]; none of a scan without overlap, or once
    /// stopped.
    pub(super) fn of(
        map: &MultiResolutionMap,
        scan: &SampledScan<'_>,
        pose: &Pose,
        settings: &AlignmentSettings,
    ) -> Option<Self> {
        let overlap = Overlap::new(map, &scan.sample, 0, settings.lookup);
        let length_m = settings.slide * map.lattice().resolution_m(0);
        let hits = |directions: &[Unit<Vector3<f64>>]| {
            let shifted = |direction: &Unit<Vector3<f64>>| {
                let shift = Translation3::from(direction.as_ref() * length_m);
                Pose::from_parts(shift * pose.translation, pose.rotation)
            };
            overlap.at(&directions.iter().map(shifted).collect::<Vec<_>>(), scan.stop)
        };
        let unshifted = overlap.at(std::slice::from_ref(pose), scan.stop)[0];
        if unshifted == 0 {
            return None;
        }
        let mut best = best_of(all_around(), hits);
        best.truncate(FOLLOWED);
        for angle_deg in ANGLES_DEG {
            let followed = best.iter().map(|(direction, _)| {
                let near = std::iter::once(*direction).chain(beside(direction, angle_deg.to_radians()));
                best_of(near.collect(), hits)[0]
            });
            best = followed.collect();
        }
        let (direction, hits) = best.into_iter().max_by_key(|(_, hits)| *hits)?;
        (!scan.stop.is_stopped()).then(|| Self { direction, share: hits as f64 / unshifted as f64 })
    }
}

/// Directions with their numbers of hits, the highest first.
fn best_of(
    directions: Vec<Unit<Vector3<f64>>>,
    hits: impl Fn(&[Unit<Vector3<f64>>]) -> Vec<usize>,
) -> Vec<(Unit<Vector3<f64>>, usize)> {
    let hits = hits(&directions);
    let mut ranked: Vec<_> = directions.into_iter().zip(hits).collect();
    ranked.sort_by_key(|(_, hits)| std::cmp::Reverse(*hits));
    ranked
}

/// Directions all around, about equally far from each other (a spiral by the golden angle), and their opposites.
fn all_around() -> Vec<Unit<Vector3<f64>>> {
    let golden_angle = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let on_half = (0..DIRECTIONS).map(|i| {
        let (z, angle) = ((i as f64 + 0.5) / DIRECTIONS as f64, golden_angle * i as f64);
        let radius = (1.0 - z * z).sqrt();
        Unit::new_normalize(Vector3::new(radius * angle.cos(), radius * angle.sin(), z))
    });
    on_half.flat_map(|direction| [direction, -direction]).collect()
}

/// Directions at `angle` (radians) to `direction`.
fn beside(direction: &Unit<Vector3<f64>>, angle: f64) -> impl Iterator<Item = Unit<Vector3<f64>>> {
    let direction = *direction;
    // Any axis across it will do: that which it lies along least gives the most exact one.
    let across = Unit::new_normalize(direction.cross(&Vector3::ith(direction.iamin(), 1.0)));
    let tilted = UnitQuaternion::from_axis_angle(&across, angle) * direction;
    (0..BESIDE).map(move |i| {
        let turn = std::f64::consts::TAU * i as f64 / BESIDE as f64;
        UnitQuaternion::from_axis_angle(&direction, turn) * tilted
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_leave_no_gap_wider_than_what_is_looked_at_beside_them() {
        let all = all_around();
        let mut probes = all.iter().flat_map(|direction| beside(direction, 0.1));
        let nearest =
            |probe: &Unit<Vector3<f64>>| all.iter().map(|d| d.angle(probe)).fold(f64::MAX, f64::min);
        assert!(probes.all(|probe| nearest(&probe) < 0.2));
        let (first, angle) = (all[7], 3.0_f64.to_radians());
        assert_eq!(beside(&first, angle).count(), BESIDE);
        assert!(beside(&first, angle).all(|it| (it.angle(&first) - angle).abs() < 1e-9));
    }
}
