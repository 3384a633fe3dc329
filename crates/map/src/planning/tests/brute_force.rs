//! Every voxel and every step, looked at one by one.

use std::collections::BTreeSet;

use crate::geometry::Point;
use crate::map::MultiResolutionMap;
use crate::planning::body::{CellsFromLink, LinkMotion, LinkPose};
use crate::planning::clearance::squared_distance;
use crate::planning::*;
use crate::voxel::{Lattice, VoxelKey};

/// All voxels of a level, looked at one by one.
pub(super) struct BruteForce {
    voxels: BTreeSet<VoxelKey>,
    lattice: Lattice,
    level: u32,
}

impl BruteForce {
    pub(super) fn of(map: &MultiResolutionMap, level: u32, surroundings: &Surroundings) -> Self {
        let view = map.view();
        let voxels = view.lists(level).flat_map(|list| list.iter());
        let voxels = voxels.filter(|voxel| {
            let center_m = map.lattice().center_m(*voxel, level);
            !surroundings.ignored.iter().any(|region| region.contains(center_m))
        });
        Self { voxels: voxels.collect(), lattice: *map.lattice(), level }
    }

    pub(super) fn cells_per_m(&self) -> f64 {
        1.0 / self.lattice.resolution_m(self.level)
    }

    /// The least squared distance to a voxel, and the first voxel by key that has it.
    pub(super) fn nearest(&self, center: [f64; 3]) -> Option<(f64, VoxelKey)> {
        let squared = |voxel: &VoxelKey| squared_distance(center, voxel.index().map(f64::from), 1.0);
        let all = self.voxels.iter().map(|voxel| (squared(voxel), *voxel));
        all.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))
    }

    pub(super) fn spheres(&self, link: &Link) -> Vec<Sphere> {
        let of_point = |point: &Point| Sphere { center_m: point.xyz(), radius_m: 0.0 };
        let points = link.points.iter().filter(|_| link.padding_m > 0.0).map(of_point);
        link.spheres.iter().copied().chain(points).collect()
    }

    pub(super) fn first_hit(&self, body: &Body, poses: &[LinkPose]) -> Option<Hit> {
        for (number, (link, pose)) in body.links().iter().zip(poses).enumerate() {
            let cells_from_link = CellsFromLink::of(pose, self.cells_per_m());
            let spheres = self.spheres(link);
            for (part, sphere) in spheres.iter().enumerate() {
                let radius = (f64::from(sphere.radius_m) + f64::from(link.padding_m)) * self.cells_per_m();
                let nearest = self.nearest(cells_from_link.cells(sphere.center_m.map(f64::from)));
                if let Some((_, voxel)) = nearest.filter(|(squared, _)| *squared <= radius * radius) {
                    return Some(Hit { link: number as u32, part: part as u32, met: Met::Voxel(voxel) });
                }
            }
            let lattice_from_points = pose.lattice_from_points(&self.lattice);
            for (part, point) in link.points.iter().enumerate().filter(|_| link.padding_m == 0.0) {
                let voxel = lattice_from_points.key(*point).map(|voxel| voxel.ancestor(self.level));
                if let Some(voxel) = voxel.filter(|voxel| self.voxels.contains(voxel)) {
                    let part = (spheres.len() + part) as u32;
                    return Some(Hit { link: number as u32, part, met: Met::Voxel(voxel) });
                }
            }
        }
        None
    }

    pub(super) fn clearance(&self, body: &Body, poses: &[LinkPose], most_m: f32) -> Clearance {
        let mut nearest = (f64::from(most_m) * self.cells_per_m(), None);
        for (number, (link, pose)) in body.links().iter().zip(poses).enumerate() {
            let cells_from_link = CellsFromLink::of(pose, self.cells_per_m());
            let points = link.points.iter().map(|point| Sphere { center_m: point.xyz(), radius_m: 0.0 });
            for sphere in link.spheres.iter().copied().chain(points) {
                let radius = (f64::from(sphere.radius_m) + f64::from(link.padding_m)) * self.cells_per_m();
                let center = cells_from_link.cells(sphere.center_m.map(f64::from));
                let distance = self.nearest(center).map(|(squared, _)| (squared.sqrt() - radius).max(0.0));
                if let Some(distance) = distance.filter(|distance| *distance < nearest.0) {
                    nearest = (distance, Some(number as u32));
                }
            }
        }
        let distance_m = ((nearest.0 / self.cells_per_m()) as f32).min(most_m);
        Clearance { distance_m, link: nearest.1 }
    }
}

/// The answer of a motion for which each step is looked at by brute force.
pub(super) fn every_step(
    oracle: &BruteForce,
    question: &MotionQuestion<'_>,
    first: usize,
    length: usize,
) -> MotionAnswer {
    let step_m = question.step_m.map_or(0.5 / oracle.cells_per_m(), f64::from);
    let (mut first_hit, mut clearance_m) = (None, 4.0f32);
    for segment in 0..length - 1 {
        let poses = |n: usize| question.configurations.poses_of(first + n).iter().map(LinkPose::of);
        let motions: Vec<_> =
            poses(segment).zip(poses(segment + 1)).map(|(a, b)| LinkMotion::new(&a, &b)).collect();
        let extent_m = |link: &Link| {
            let norm = |c: [f32; 3]| c.iter().map(|c| f64::from(*c).powi(2)).sum::<f64>().sqrt();
            let spheres = link
                .spheres
                .iter()
                .map(|s| norm(s.center_m) + f64::from(s.radius_m) + f64::from(link.padding_m));
            let points = link.points.iter().map(|p| norm(p.xyz()) + f64::from(link.padding_m));
            spheres.chain(points).fold(0.0, f64::max)
        };
        let lengths =
            motions.iter().zip(question.body.links()).map(|(motion, link)| motion.length_m(extent_m(link)));
        let steps = (lengths.fold(0.0, f64::max) / step_m).ceil().max(1.0);
        for step in 0..=steps as usize {
            let poses: Vec<_> = motions.iter().map(|motion| motion.at(step as f64 / steps)).collect();
            clearance_m = clearance_m.min(oracle.clearance(question.body, &poses, 4.0).distance_m);
            if oracle.first_hit(question.body, &poses).is_some() {
                let share = (segment as f64 + step as f64 / steps) / (length - 1) as f64;
                first_hit = Some(share as f32);
                return MotionAnswer { first_hit, clearance_m: Some(0.0) };
            }
        }
    }
    MotionAnswer { first_hit, clearance_m: Some(clearance_m) }
}
