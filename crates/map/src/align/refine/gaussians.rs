//! The Gaussians of a map's voxels at several sizes, made as an alignment asks for them.

use hashbrown::HashMap;
use nalgebra::Vector3;

use super::gaussian::{Gaussian, Softness};
use super::known_moments::KnownMoments;
use crate::voxel::{MOMENT_LEVEL, Moments, VoxelKey};

/// Number of voxel sizes that have Gaussians: 4, 8 and 16 r_0. Where the smallest voxels hold too few points to show a
/// surface, the larger ones, which are sums of them, may.
const SIZES: usize = 3;

/// The Gaussians of a map's voxels near a scan, computed on demand and kept for one alignment, with all its ends. The
/// map may change meanwhile; a Gaussian that is kept stays as it was.
#[derive(Debug)]
pub(in crate::align) struct VoxelGaussians {
    resolution_m: f64,
    /// How soft they are where they are looked up.
    softness: Softness,
    sizes: [HashMap<VoxelKey, Option<u32>>; SIZES],
    /// By octants of the smallest voxels: in one of them all points lie in the same voxels, and next to the same
    /// neighbors.
    near: HashMap<VoxelKey, Near>,
    gaussians: Vec<Gaussian>,
}

/// Indices of the Gaussians that a point may belong to, the present ones first: one of its own voxel, or up to three of
/// neighbors.
type Near = [Option<u32>; 3];

impl VoxelGaussians {
    /// None yet, of a map whose finest voxels have sides of `resolution_m`.
    pub(in crate::align) fn new(resolution_m: f64) -> Self {
        let softness = Softness { std_m: 0.0, spread: 0.0 };
        Self {
            resolution_m,
            softness,
            sizes: Default::default(),
            near: HashMap::new(),
            gaussians: Vec::new(),
        }
    }

    /// Softens those that are looked up from now on; see [`Gaussian::soften`].
    pub(super) fn soften(&mut self, softness: Softness) {
        self.softness = softness;
    }

    /// The Gaussian with index `i`, as [`VoxelGaussians::nearest`] returned it since it was last softened.
    pub(super) fn get(&self, i: u32) -> &Gaussian {
        &self.gaussians[i as usize]
    }

    /// Index of the Gaussian that a point of the map frame belongs to: that of its smallest voxel that has one or,
    /// failing that, of the neighbors across its nearest faces; then the same for larger voxels. (Otherwise a surface
    /// on the border of two voxels would attract only the points on its own side.)
    pub(super) fn nearest(&mut self, moments: &KnownMoments<'_>, point_m: &Vector3<f64>) -> Option<u32> {
        let octant = (point_m / (self.side_m(0) / 2.0)).map(|c| c.floor() as i32);
        let octant = VoxelKey::new(octant.into())?;
        let near = match self.near.get(&octant) {
            Some(known) => *known,
            None => {
                let near = (0..SIZES).map(|size| self.near_of(moments, point_m, size));
                let near = near.into_iter().find(|near| near[0].is_some()).unwrap_or_default();
                self.near.insert(octant, near);
                near
            }
        };
        let mut nearest = None;
        for i in near.into_iter().flatten() {
            let gaussian = &mut self.gaussians[i as usize];
            gaussian.soften(self.softness);
            if near[1].is_none() {
                return Some(i);
            }
            let distance = gaussian.distance_squared(point_m);
            if nearest.is_none_or(|(_, least)| distance < least) {
                nearest = Some((i, distance));
            }
        }
        nearest.map(|(i, _)| i)
    }

    /// True where two places (map frame) lie on the same side of the surface that a point belongs to; none where it
    /// belongs to no plane.
    pub(in crate::align) fn is_one_side(
        &mut self,
        moments: &KnownMoments<'_>,
        point_m: &Vector3<f64>,
        places_m: [&Vector3<f64>; 2],
    ) -> Option<bool> {
        let surface = self.nearest(moments, point_m)?;
        let [a, b] = places_m.map(|place_m| self.get(surface).height_m(place_m));
        Some(a? * b? > 0.0)
    }

    /// Indices of the Gaussians that a point may belong to in voxels of a size: its own voxel's or, failing that, the
    /// neighbors'.
    fn near_of(&mut self, moments: &KnownMoments<'_>, point_m: &Vector3<f64>, size: usize) -> Near {
        let scaled = point_m / self.side_m(size);
        let index = scaled.map(|c| c.floor() as i32);
        let own = self.of_voxel(moments, index.into(), size);
        if own.is_some() {
            return [own, None, None];
        }
        let mut neighbors = Near::default();
        let mut count = 0;
        for axis in 0..3 {
            let mut neighbor = index;
            let side = if scaled[axis] - f64::from(index[axis]) < 0.5 { -1 } else { 1 };
            neighbor[axis] = index[axis].saturating_add(side);
            if let Some(i) = self.of_voxel(moments, neighbor.into(), size) {
                neighbors[count] = Some(i);
                count += 1;
            }
        }
        neighbors
    }

    fn of_voxel(&mut self, moments: &KnownMoments<'_>, index: [i32; 3], size: usize) -> Option<u32> {
        let voxel = VoxelKey::new(index)?;
        if let Some(&known) = self.sizes[size].get(&voxel) {
            return known;
        }
        let side_m = self.side_m(size);
        let center_m = Vector3::from(index.map(|i| (f64::from(i) + 0.5) * side_m));
        let unit_m = self.side_m(0) / Moments::UNITS as f64;
        let gaussian = Gaussian::of(&moments_of(moments, index, size), center_m, side_m, unit_m);
        let number = gaussian.map(|gaussian| {
            self.gaussians.push(gaussian);
            self.gaussians.len() as u32 - 1
        });
        self.sizes[size].insert(voxel, number);
        number
    }

    fn side_m(&self, size: usize) -> f64 {
        self.resolution_m * f64::from(1u32 << (MOMENT_LEVEL as usize + size))
    }
}

/// The moments of the points in a voxel `size` levels above those that keep them, about its center.
fn moments_of(moments: &KnownMoments<'_>, index: [i32; 3], size: usize) -> Moments {
    let side = 1 << size;
    let mut sum = Moments::default();
    for child in (0..side * side * side).map(|i| [i % side, i / side % side, i / (side * side)]) {
        let voxel = VoxelKey::new([0, 1, 2].map(|axis| index[axis] * side + child[axis]));
        if let Some(moments) = voxel.and_then(|voxel| moments.in_voxel(voxel)) {
            sum += moments.about(child.map(|c| i64::from(2 * c + 1 - side) * (Moments::UNITS / 2)));
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Point, Pose};
    use crate::map::{MapContents, MapSettings, MappedScan, MultiResolutionMap, RobotName, ScanRecord};
    use crate::voxel::{Lattice, MomentSet, VoxelSet};

    #[test]
    fn a_map_without_moments_knows_those_of_its_voxels_centers() {
        let voxels: VoxelSet = (-40..40).filter_map(|i| VoxelKey::new([i, i * i % 17, i / 3])).collect();
        let of =
            |settings| MultiResolutionMap::restore(settings, MapContents::at(1, voxels.clone())).unwrap();
        let (with, without) = (of(MapSettings::new(1.0, 1)), of(MapSettings::query_only(1.0, 1)));
        let (with, without) = (KnownMoments::of(&with), KnownMoments::of(&without));
        for voxel in voxels.moment_voxels() {
            assert!(without.in_voxel(voxel).is_some());
            assert_eq!(with.in_voxel(voxel), without.in_voxel(voxel));
        }
        assert_eq!(without.in_voxel(VoxelKey::new([50, 0, 0]).unwrap()), None);
    }

    #[test]
    fn a_larger_voxel_has_the_moments_of_all_its_points() {
        let map = MultiResolutionMap::new(MapSettings::new(0.25, 4)).unwrap();
        let points: Vec<_> =
            (0..200).map(|i| Point::new((i % 32) as f32 / 8.0, (i % 7) as f32 / 2.0, 1.5)).collect();
        let pose = MappedScan::new(RobotName::new("r").unwrap(), Pose::identity());
        map.committer().insert_scan(ScanRecord::of_points(pose, &points, map.lattice()));

        // The same points in a lattice four times as coarse, whose units are four times as long.
        let coarse = MomentSet::of_points(&points, &Lattice::new(1.0, 1).unwrap().from_map());
        let sum = moments_of(&KnownMoments::of(&map), [0, 0, 0], 2);
        let (_, expected) = coarse.as_slice()[0];
        assert_eq!((sum.count(), coarse.as_slice().len()), (200, 1));
        let scaled = expected.to_numbers();
        let sum = sum.to_numbers();
        assert_eq!(sum[1..4], [1, 2, 3].map(|i| scaled[i] * 4));
        assert_eq!(sum[4..], [4, 5, 6, 7, 8, 9].map(|i| scaled[i] * 16));
    }
}
