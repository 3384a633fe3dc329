//! Points as the voxels and moments of a map, part by part: a map of points that were never scans here.

use hashbrown::HashMap;

use crate::collected_voxels::CollectedVoxels;
use mrol_map::geometry::Point;
use mrol_map::map::{MapContents, MapSettings};
use mrol_map::voxel::{Lattice, LatticeFromPoints, MomentSet, Moments, SettingError, VoxelKey, VoxelSet};

/// Points that are worked on at once.
const POINTS_AT_ONCE: usize = 1 << 16;

/// The voxels that points fall in, with the moments of the points where the map keeps them.
///
/// Takes memory by the voxels, however many points there are.
#[derive(Debug)]
pub struct MappedPoints {
    lattice_from_map: LatticeFromPoints,
    voxels: CollectedVoxels,
    /// None of a map that keeps no moments.
    moments: Option<HashMap<VoxelKey, Moments>>,
    beyond: usize,
}

impl MappedPoints {
    /// No points so far, for a map of these settings.
    ///
    /// # Errors
    /// When the resolution or the number of levels is out of range.
    pub fn new(settings: MapSettings) -> Result<Self, SettingError> {
        Ok(Self {
            lattice_from_map: Lattice::new(settings.resolution_m, settings.levels)?.from_map(),
            voxels: CollectedVoxels::default(),
            moments: settings.moments.then(HashMap::new),
            beyond: 0,
        })
    }

    /// Adds points of the map frame, meters. Those without a voxel (not finite, out of range) are left out and counted.
    pub fn add(&mut self, points: &[Point]) {
        for points in points.chunks(POINTS_AT_ONCE) {
            let (voxels, beyond) = VoxelSet::of_points(points, &self.lattice_from_map);
            self.beyond += beyond;
            voxels.blocks().iter().for_each(|(block, mask)| self.voxels.add_block(*block, mask));
            if let Some(moments) = &mut self.moments {
                let added = MomentSet::of_points(points, &self.lattice_from_map);
                added.as_slice().iter().for_each(|&(key, added)| *moments.entry(key).or_default() += added);
            }
        }
    }

    /// How many points had no voxel.
    pub fn beyond(&self) -> usize {
        self.beyond
    }

    /// The contents of a map of the points, at revision 1, without scans.
    pub fn into_contents(self) -> MapContents {
        MapContents {
            revision: 1,
            voxels: self.voxels.into_set(),
            moments: self.moments.into_iter().flatten().collect(),
            ..MapContents::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_in_parts_give_the_map_of_all_of_them() {
        let settings = MapSettings::new(0.25, 3);
        let points: Vec<Point> = (0..1000_u16)
            .map(|k| {
                let k = f32::from(k);
                Point::new(0.03 * k - 9.0, (0.1 * k).sin(), -0.01 * k)
            })
            .collect();
        let mut whole = MappedPoints::new(settings).unwrap();
        whole.add(&points);
        whole.add(&[Point::new(f32::NAN, 0.0, 0.0), Point::new(1e9, 0.0, 0.0)]);
        assert_eq!(whole.beyond(), 2);
        let mut parts = MappedPoints::new(settings).unwrap();
        points.chunks(7).for_each(|part| parts.add(part));
        let lattice = Lattice::new(0.25, 3).unwrap().from_map();
        let contents = whole.into_contents();
        assert_eq!(contents.voxels, VoxelSet::of_points(&points, &lattice).0);
        assert_eq!(contents.moments, MomentSet::of_points(&points, &lattice));
        assert_eq!(contents, parts.into_contents());
    }

    #[test]
    fn a_map_without_moments_gets_none() {
        let mut points = MappedPoints::new(MapSettings::query_only(0.25, 3)).unwrap();
        points.add(&[Point::new(1.0, 2.0, 3.0)]);
        let contents = points.into_contents();
        assert_eq!((contents.voxels.len(), contents.moments.as_slice().len()), (1, 0));
    }
}
