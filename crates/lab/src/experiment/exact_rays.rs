//! Carving by counting exact rays, as occupancy grids do: what the surface of a scan is compared with.

use std::collections::HashMap;

use mrol_map::geometry::{Point, Pose};
use mrol_map::voxel::{Lattice, VoxelKey, VoxelSet};

/// Carves what rays crossed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExactRays {
    /// Rays of one scan that must have crossed a voxel.
    pub rays_min: u32,
    /// Voxels around those that the scan met that stay.
    pub margin_voxels: i32,
    /// Voxels farther from the sensor stay, meters.
    pub range_max_m: f64,
}

impl ExactRays {
    /// The voxels of `occupied` that at least `rays_min` rays crossed, and beside which none ended: rays from
    /// `map_from_sensor` to `ends` (sensor frame), of a scan that met the voxels `met`.
    pub fn carve(
        &self,
        (occupied, met): (&VoxelSet, &VoxelSet),
        lattice: &Lattice,
        map_from_sensor: &Pose,
        ends: &[Point],
    ) -> VoxelSet {
        let resolution_m = lattice.resolution_m(0);
        let in_voxels = |place: nalgebra::Point3<f64>| place.coords.map(|c| c / resolution_m);
        let origin = in_voxels(map_from_sensor.translation.vector.into());
        let mut crossed: HashMap<VoxelKey, u32> = HashMap::new();
        for end in ends {
            let offset = map_from_sensor.rotation * end.to_f64().coords;
            let share = (self.range_max_m / offset.norm()).min(1.0);
            let steps = Steps::between(origin.into(), (origin + offset * share / resolution_m).into());
            for voxel in steps.filter_map(VoxelKey::new).filter(|voxel| occupied.contains(*voxel)) {
                *crossed.entry(voxel).or_default() += 1;
            }
        }
        let is_met = |voxel: VoxelKey| {
            let around = || -self.margin_voxels..=self.margin_voxels;
            let [x, y, z] = voxel.index();
            let mut near =
                around().flat_map(|dx| around().flat_map(move |dy| around().map(move |dz| [dx, dy, dz])));
            near.any(|[dx, dy, dz]| {
                VoxelKey::new([x + dx, y + dy, z + dz]).is_some_and(|at| met.contains(at))
            })
        };
        let gone = crossed.into_iter().filter(|(voxel, rays)| *rays >= self.rays_min && !is_met(*voxel));
        gone.map(|(voxel, _)| voxel).collect()
    }
}

/// The voxels between two places, in voxels, from the first on (Amanatides and Woo, 1987).
struct Steps {
    at: [i32; 3],
    step: [i32; 3],
    /// Share of the way at which the next voxel begins along each axis, and how much more each one is.
    next: [f64; 3],
    more: [f64; 3],
    is_done: bool,
}

impl Steps {
    fn between(from: [f64; 3], to: [f64; 3]) -> Self {
        let way: [f64; 3] = std::array::from_fn(|axis| to[axis] - from[axis]);
        let begins = |axis: usize| {
            let (low, along) = (from[axis].floor(), way[axis]);
            let edge = if along > 0.0 { low + 1.0 } else { low };
            if along == 0.0 { f64::INFINITY } else { (edge - from[axis]) / along }
        };
        Self {
            at: from.map(|c| c.floor() as i32),
            step: way.map(|along| if along > 0.0 { 1 } else { -1 }),
            next: std::array::from_fn(begins),
            more: way.map(|along| 1.0 / along.abs()),
            is_done: false,
        }
    }
}

impl Iterator for Steps {
    type Item = [i32; 3];

    fn next(&mut self) -> Option<[i32; 3]> {
        if self.is_done {
            return None;
        }
        let at = self.at;
        let axis = (0..3).min_by(|&a, &b| self.next[a].total_cmp(&self.next[b]))?;
        self.is_done = self.next[axis] > 1.0;
        self.at[axis] += self.step[axis];
        self.next[axis] += self.more[axis];
        Some(at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_pass_every_voxel_on_the_way() {
        let steps: Vec<_> = Steps::between([0.5, 0.5, 0.5], [2.5, 0.5, 0.5]).collect();
        assert_eq!(steps, [[0, 0, 0], [1, 0, 0], [2, 0, 0]]);
        let back: Vec<_> = Steps::between([0.5, 0.25, 0.5], [-1.5, 1.25, 0.5]).collect();
        assert_eq!(back.first(), Some(&[0, 0, 0]));
        assert_eq!(back.last(), Some(&[-2, 1, 0]));
        assert_eq!(back.len(), 4, "three edges are crossed");
    }
}
