//! Upper bounds of the search: how many points of a scan can fall on the map from any pose in a cell of poses.

use std::f64::consts::PI;

use super::dilated::DilatedLevels;
use super::distance_field::{DISTANCE_MAX, DistanceField, GridFromSensor, ReachingPoint};
use super::orientation::Orientation;
use super::rotation::{RotationCell, RotationLattice};
use super::sample::SearchSample;
use crate::geometry::Pose;

/// Slack for the rounding of grid coordinates to f32, in voxels.
const ROUNDING: f64 = 1e-2;
/// A distance, in voxels, that every voxel is within.
const ANYWHERE: u8 = u8::MAX;

/// A part of the space of poses: a cube of translations and a cell of rotations.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct PoseCell {
    /// Number of times that the cell can still be halved.
    pub(super) depth: u32,
    /// Index of the orientation among those of the search.
    pub(super) orientation: usize,
    pub(super) rotation: RotationCell,
    /// Index of the cube of translations along each axis, from the corner of the search box.
    pub(super) translation: [i32; 3],
}

/// The upper bounds of a search.
///
/// From a cell of half side h and turn delta a point at range rho lands within h + 2 rho sin(delta / 2) of where the
/// cell's center puts it, an axis. It can fall on the map only if an occupied voxel is within so many voxels, rounded
/// up. Counting the points for which that is so bounds the overlap of every pose in the cell from above.
#[derive(Debug)]
pub(super) struct Bounds<'a> {
    levels: &'a DilatedLevels,
    sample: &'a SearchSample,
    orientations: &'a [Orientation],
    pub(super) rotations: RotationLattice,
    /// Side of the cubes at depth 0, meters.
    side_m: f64,
    /// The sample for each depth, with how far, in voxels of its field, a voxel may be for each point.
    points: Vec<Vec<ReachingPoint>>,
}

impl<'a> Bounds<'a> {
    pub(super) fn new(
        levels: &'a DilatedLevels,
        sample: &'a SearchSample,
        orientations: &'a [Orientation],
        rotations: RotationLattice,
    ) -> Self {
        let side_m = levels.finest().resolution_m();
        let mut bounds = Self { levels, sample, orientations, rotations, side_m, points: Vec::new() };
        bounds.points = (0..bounds.rotations.depths()).map(|depth| bounds.points_at(depth)).collect();
        bounds
    }

    fn points_at(&self, depth: u32) -> Vec<ReachingPoint> {
        let half_side_m = self.side_m_at(depth) / 2.0;
        let half_turn = (self.rotations.turn_rad(depth) / 2.0).min(PI / 2.0);
        let reach = |range_m: f64| {
            let displacement_m = half_side_m + 2.0 * range_m * half_turn.sin();
            let voxels = (displacement_m / self.levels.at(depth).resolution_m() + ROUNDING).ceil();
            if voxels <= f64::from(DISTANCE_MAX) { voxels as u8 } else { ANYWHERE }
        };
        let reaching = |point: &nalgebra::Point3<f64>| ReachingPoint {
            xyz: point.coords.map(|c| c as f32).into(),
            reach: reach(point.coords.norm()),
        };
        self.sample.points.iter().map(reaching).collect()
    }

    /// Number of points of the sample.
    pub(super) fn points(&self) -> u16 {
        self.sample.points.len() as u16
    }

    pub(super) fn orientations(&self) -> usize {
        self.orientations.len()
    }

    /// Side of the cubes of translations at `depth`, meters.
    pub(super) fn side_m_at(&self, depth: u32) -> f64 {
        self.side_m * f64::from(1u32 << depth)
    }

    /// Number of cubes at `depth` along each axis of the search box; even.
    pub(super) fn cubes(&self, depth: u32) -> [i32; 3] {
        let (min_m, max_m) = (self.levels.domain.min_m(), self.levels.domain.max_m());
        let pairs = |axis: usize| ((max_m[axis] - min_m[axis]) / self.side_m_at(depth) / 2.0).ceil().max(1.0);
        std::array::from_fn(|axis| 2 * pairs(axis) as i32)
    }

    /// The pose at the center of a cell.
    pub(super) fn center(&self, cell: &PoseCell) -> Pose {
        let side_m = self.side_m_at(cell.depth);
        let min_m = self.levels.domain.min_m();
        let center_m: [f64; 3] =
            std::array::from_fn(|axis| min_m[axis] + (f64::from(cell.translation[axis]) + 0.5) * side_m);
        let rotation = self.rotations.center(&self.orientations[cell.orientation], cell.depth, cell.rotation);
        Pose::from_parts(center_m.into(), rotation)
    }

    /// True when a part of the cube lies in the search's box; of a finest one, when its center does.
    pub(super) fn is_in_domain(&self, cell: &PoseCell) -> bool {
        let (min_m, max_m) = (self.levels.domain.min_m(), self.levels.domain.max_m());
        let side_m = self.side_m_at(cell.depth);
        let from = if cell.depth == 0 { 0.5 } else { 0.0 };
        (0..3).all(|axis| min_m[axis] + (f64::from(cell.translation[axis]) + from) * side_m <= max_m[axis])
    }

    /// Prepares the bounds of cells that have the rotation of `cell`.
    pub(super) fn turned(&self, cell: &PoseCell) -> Turned<'_> {
        let rotation = self.rotations.center(&self.orientations[cell.orientation], cell.depth, cell.rotation);
        let field = self.levels.at(cell.depth);
        let matrix = rotation.to_rotation_matrix();
        let side = self.side_m_at(cell.depth) / field.resolution_m();
        let corner = field.in_grid(self.levels.domain.min_m());
        Turned {
            field,
            points: &self.points[cell.depth as usize],
            rotation: std::array::from_fn(|row| {
                std::array::from_fn(|column| (matrix[(row, column)] / field.resolution_m()) as f32)
            }),
            corner: corner.map(|c| (c + side / 2.0) as f32),
            side: side as f32,
        }
    }
}

/// The bounds of cells of one depth and rotation.
pub(super) struct Turned<'a> {
    field: &'a DistanceField,
    points: &'a [ReachingPoint],
    rotation: [[f32; 3]; 3],
    /// The center of the first cube, in voxels from the grid's corner.
    corner: [f32; 3],
    side: f32,
}

impl Turned<'_> {
    /// The bounds of the eight cells at `translation` + {0, 1} an axis, x fastest; zeros when none of them can exceed
    /// `floor`.
    pub(super) fn bounds_of_eight(&self, translation: [i32; 3], floor: u16) -> [u16; 8] {
        let place = |axis: usize| self.corner[axis] + translation[axis] as f32 * self.side;
        let grid_from_sensor =
            GridFromSensor { rotation: self.rotation, translation: std::array::from_fn(place) };
        self.field.count_of_eight(self.points, &grid_from_sensor, self.side, floor)
    }
}

/// The eight cubes of [`Turned::bounds_of_eight`].
pub(super) fn eight(corner: [i32; 3]) -> impl Iterator<Item = [i32; 3]> {
    (0..8).map(move |i| [corner[0] + (i & 1), corner[1] + (i >> 1 & 1), corner[2] + (i >> 2)])
}

#[cfg(test)]
mod tests {
    use nalgebra::{UnitVector3, Vector3};
    use proptest::prelude::*;

    use super::*;
    use crate::align::localize::settings::LocalizationSettings;
    use crate::geometry::Point;
    use crate::map::{MapSettings, MappedScan, MultiResolutionMap, RobotName, ScanRecord};
    use crate::util::StopSignal;

    const RESOLUTION_M: f64 = 0.1;
    const DEPTHS: u32 = 5;

    fn points(count: usize, within_m: f32) -> impl Strategy<Value = Vec<Point>> {
        let point = prop::array::uniform3(-within_m..within_m).prop_map(Point::from);
        prop::collection::vec(point, count..2 * count)
    }

    fn map_of(points: &[Point]) -> MultiResolutionMap {
        let map = MultiResolutionMap::new(MapSettings::new(RESOLUTION_M, 3)).unwrap();
        let pose = MappedScan::new(RobotName::new("r").unwrap(), Pose::identity());
        map.committer().insert_scan(ScanRecord::of_points(pose, points, map.lattice()));
        map
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(200))]
        #[test]
        fn no_pose_in_a_cell_overlaps_more_than_the_cells_bound(
            map_points in points(60, 4.0),
            scan in points(40, 5.0),
            axes: [[i8; 3]; 2],
            tilt_max in 0.0..0.5,
            depth in 0..DEPTHS,
            cell: [u16; 6],
            part in prop::array::uniform6(0.0..=1.0),
        ) {
            let map = map_of(&map_points);
            let sample = SearchSample::of(&scan, 100, 0, StopSignal::NEVER);
            let settings = LocalizationSettings { resolutions_per_range: 20.0, ..Default::default() };
            let levels = DilatedLevels::of_all(&map, &sample, &settings);
            let axis = |a: [i8; 3]| UnitVector3::new_normalize(Vector3::from(a.map(f64::from)) + Vector3::x() * 0.3);
            let orientations = [Orientation::bringing(axis(axes[0]), axis(axes[1]))];
            let side_m = levels.finest().resolution_m();
            let rotations = RotationLattice::new(0.5 * side_m / sample.range_m, tilt_max, DEPTHS);
            let bounds = Bounds::new(&levels, &sample, &orientations, rotations);

            let [yaw, x, y, i, j, k] = cell.map(i32::from);
            let all: Vec<RotationCell> = bounds.rotations.cells(depth).take(10_000).collect();
            let rotation = all[((yaw * 31 + x * 17 + y) as usize) % all.len()];
            let cubes = bounds.cubes(depth);
            let corner: [i32; 3] = std::array::from_fn(|axis| [i, j, k][axis] % cubes[axis] / 2 * 2);
            let first = PoseCell { depth, orientation: 0, rotation, translation: corner };
            let counts = bounds.turned(&first).bounds_of_eight(corner, 0);

            for (translation, count) in eight(corner).zip(counts) {
                let min_m = levels.domain.min_m();
                let place = |axis: usize| {
                    min_m[axis] + (f64::from(translation[axis]) + part[axis]) * bounds.side_m_at(depth)
                };
                let sensor_m: [f64; 3] = std::array::from_fn(place);
                let turn = bounds.rotations.at(&orientations[0], depth, rotation, [part[3], part[4], part[5]]);
                let pose = Pose::from_parts(sensor_m.into(), turn);
                let finest = levels.finest();
                let hits = sample.points.iter().filter(|point| {
                    finest.at(finest.in_grid((pose * **point).coords.into()).map(|c| c as f32)) == 0
                });
                let hits = hits.count();
                prop_assert!(hits <= usize::from(count), "{hits} hits in a cell bounded by {count}");
            }
        }
    }
}
