//! Thin things: what a scan seems to see through because its rays ran beside it.

use hashbrown::HashSet;
use nalgebra::{Point3, Vector3};

use crate::geometry::{Point, Pose};
use crate::visibility::{RayWindow, ScanSurface, Thresholds};
use crate::voxel::{Lattice, LatticeFromPoints, VoxelKey, VoxelSet};

/// Things whose voxels lie side by side in so many or more, across the view, are at least as thick as what the rays of
/// a scan that carves cannot miss.
const WIDE: usize = 4;
/// How much deeper what lies beside a voxel may be, in voxels: nearest first.
const ASKEW: [i32; 7] = [0, -1, 1, -2, 2, -3, 3];
/// Voxels that a scan saw through, some of which may hold things thinner than they are.
///
/// A pole or the edge of a table fills a small part of its voxels. Rays that pass these on both sides say nothing of it
/// where they lie farther apart than it is thick. So what is narrow, as it is seen from the sensor, is gone only where
/// rays would have met it.
pub(super) struct ThinThings<'a> {
    /// Voxels that hold something as the map has it, and none of the surface that the scan shows.
    not_met: &'a VoxelSet,
    surface: &'a ScanSurface,
    lattice: &'a Lattice,
    from_map: LatticeFromPoints,
    sensor_from_map: Pose,
    origin: Point3<f64>,
    radius_m: f32,
    /// How far rays may lie from each other across things of one voxel and more, voxels: what fills one or two may be
    /// as thin as it likes, and what is thicker than this was met.
    gaps_max: [f64; WIDE - 1],
    /// How far along a thing rays are looked for that would have met it, voxels to either side.
    length: f64,
}

impl<'a> ThinThings<'a> {
    /// Among the occupied voxels that a scan from `map_from_sensor` did not meet, as balls of `radius_m`.
    pub(super) fn among(
        not_met: &'a VoxelSet,
        surface: &'a ScanSurface,
        lattice: &'a Lattice,
        map_from_sensor: &Pose,
        radius_m: f32,
        thresholds: &Thresholds,
    ) -> Self {
        let (from_map, sensor_from_map) = (lattice.from_map(), map_from_sensor.inverse());
        let origin = map_from_sensor.translation.vector.into();
        let Thresholds { thin_gap_max_1, thin_gap_max_2, thin_gap_max_3, thin_length, .. } = *thresholds;
        let gaps_max = [thin_gap_max_1, thin_gap_max_2, thin_gap_max_3].map(f64::from);
        let length = f64::from(thin_length);
        Self { not_met, surface, lattice, from_map, sensor_from_map, origin, radius_m, gaps_max, length }
    }

    /// True of a voxel that may hold a thing which no ray could meet.
    pub(super) fn may_be_at(&self, voxel: VoxelKey) -> bool {
        let center = Point3::from(self.lattice.center_m(voxel, 0));
        let ray = (center - self.origin).normalize();
        let other = Vector3::ith(if ray.z.abs() < 0.9 { 2 } else { 0 }, 1.0);
        let right = ray.cross(&other).normalize();
        let across = [right, right.cross(&ray)];
        let widths = across.map(|axis| self.width(&center, &axis, &ray));
        (0..2).any(|i| {
            let Some(gap_max) = self.gaps_max.get(widths[i] - 1) else { return false };
            let resolution_m = self.lattice.resolution_m(0);
            let axes = [across[i], across[1 - i]];
            let window = RayWindow {
                offset: (self.sensor_from_map * center).coords.map(|c| c as f32).into(),
                radius_m: self.radius_m,
                across: axes.map(|axis| (self.sensor_from_map.rotation * axis).map(|c| c as f32).into()),
                half_m: [resolution_m / 2.0, resolution_m * ((widths[1 - i] as f64).min(self.length) - 0.5)]
                    .map(|half_m| half_m as f32),
            };
            f64::from(self.surface.widest_gap_m(window)) > gap_max * resolution_m
        })
    }

    /// How many voxels that were not met lie side by side along an axis across the view, this one with them; no more
    /// than [`WIDE`] are told. A surface that is seen askew lies deeper from one to the next.
    fn width(&self, center: &Point3<f64>, axis: &Vector3<f64>, ray: &Vector3<f64>) -> usize {
        let resolution_m = self.lattice.resolution_m(0);
        let deeper_by = |steps: f64, deep: i32| {
            let place = center + (axis * steps + ray * f64::from(deep)) * resolution_m;
            let voxel = self.from_map.key(Point::from(place));
            voxel.is_some_and(|voxel| self.not_met.contains(voxel))
        };
        let to_side = |side: f64| {
            let mut deep = 0;
            let beside = (1..WIDE).take_while(|&i| {
                let next = ASKEW.into_iter().map(|more| deep + more);
                let found = next.into_iter().find(|&deep| deeper_by(side * i as f64, deep));
                deep = found.unwrap_or(deep);
                found.is_some()
            });
            beside.count()
        };
        (1 + to_side(1.0) + to_side(-1.0)).min(WIDE)
    }
}

/// These voxels, and those of `missed` that hang together with them: a side of a thing that is gone may have been seen
/// edge-on.
pub(super) fn with_what_hangs_on(gone: Vec<VoxelKey>, missed: &VoxelSet) -> VoxelSet {
    let (mut found, mut next): (HashSet<VoxelKey>, _) = (gone.iter().copied().collect(), gone);
    let steps = || -1..=1;
    while let Some(voxel) = next.pop() {
        let [x, y, z] = voxel.index();
        let around = steps().flat_map(|dx| steps().flat_map(move |dy| steps().map(move |dz| [dx, dy, dz])));
        for beside in around.filter_map(|[dx, dy, dz]| VoxelKey::new([x + dx, y + dy, z + dz])) {
            if missed.contains(beside) && found.insert(beside) {
                next.push(beside);
            }
        }
    }
    found.into_iter().collect()
}
