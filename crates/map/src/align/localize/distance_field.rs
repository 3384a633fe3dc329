//! Distance field: one grid that holds a level of the map and all its dilations.

use super::supervision::{Unbuilt, check};
use crate::util::StopSignal;
use crate::voxel::VoxelKey;

/// Largest Chebyshev distance that is stored, in voxels; greater ones are all [`FAR`].
pub(super) const DISTANCE_MAX: u8 = 8;
/// Value of a voxel with nothing occupied within [`DISTANCE_MAX`].
const FAR: u8 = DISTANCE_MAX + 1;

/// The Chebyshev distance of every voxel of a box to the nearest occupied one, in voxels, up to [`DISTANCE_MAX`].
///
/// The voxels at distance `k` or less *are* the level dilated by `k` voxels each way, so one byte a voxel serves
/// every cell of the search, whatever its size.
#[derive(Debug, Clone)]
pub(super) struct DistanceField {
    resolution_m: f64,
    /// Index of the first voxel of the grid.
    min: [i32; 3],
    size: [usize; 3],
    distances: Vec<u8>,
}

impl DistanceField {
    /// Size of the grid around the voxels `min..=max`, including a border that is [`FAR`] from all of them.
    pub(super) fn grid(min: [i32; 3], max: [i32; 3]) -> [usize; 3] {
        let border = 2 * usize::from(FAR);
        std::array::from_fn(|axis| max[axis].abs_diff(min[axis]) as usize + 1 + border)
    }

    /// A field around the voxels `min..=max` of side `resolution_m`, none of them occupied yet.
    pub(super) fn empty(
        min: [i32; 3],
        max: [i32; 3],
        resolution_m: f64,
        stop: StopSignal<'_>,
    ) -> Result<Self, Unbuilt> {
        let size = Self::grid(min, max);
        let distances = far_everywhere(size.iter().product(), stop)?;
        Ok(Self { resolution_m, min: min.map(|i| i - i32::from(FAR)), size, distances })
    }

    /// Marks a voxel as occupied; it must be within the box that the field was made for.
    pub(super) fn occupy(&mut self, voxel: VoxelKey) {
        let cell = self.cell(voxel.index());
        self.distances[cell] = 0;
    }

    /// Computes the distances to the voxels that are marked as occupied.
    ///
    /// Each round extends the distances by one voxel: the smallest of the 3 x 3 x 3 neighbors, axis by axis, plus one.
    pub(super) fn spread(&mut self, stop: StopSignal<'_>) -> Result<(), Unbuilt> {
        let strides = [1, self.size[0], self.size[0] * self.size[1]];
        let (mut from, mut to) =
            (far_everywhere(self.distances.len(), stop)?, far_everywhere(self.distances.len(), stop)?);
        for _ in 0..DISTANCE_MAX {
            for (from, distances) in
                from.chunks_mut(CELLS_PER_STOP_CHECK).zip(self.distances.chunks(CELLS_PER_STOP_CHECK))
            {
                check(stop)?;
                from.copy_from_slice(distances);
            }
            for stride in strides {
                smallest_of_three(&from, stride, &mut to, stop)?;
                std::mem::swap(&mut from, &mut to);
            }
            for (distances, from) in
                self.distances.chunks_mut(CELLS_PER_STOP_CHECK).zip(from.chunks(CELLS_PER_STOP_CHECK))
            {
                check(stop)?;
                for (distance, nearest) in distances.iter_mut().zip(from) {
                    *distance = (*distance).min(*nearest + 1);
                }
            }
        }
        Ok(())
    }

    fn cell(&self, index: [i32; 3]) -> usize {
        let [x, y, z] = std::array::from_fn(|axis| (index[axis] - self.min[axis]) as usize);
        (z * self.size[1] + y) * self.size[0] + x
    }

    /// True of an occupied voxel.
    pub(super) fn is_occupied(&self, voxel: VoxelKey) -> bool {
        let index = voxel.index();
        let is_inside = |axis: usize| {
            (0..self.size[axis] as i64).contains(&(i64::from(index[axis]) - i64::from(self.min[axis])))
        };
        (0..3).all(is_inside) && self.distances[self.cell(index)] == 0
    }

    /// About `wish` of the occupied voxels, at even distances in the order of their keys.
    pub(super) fn some_occupied(&self, wish: usize, stop: StopSignal<'_>) -> Result<Vec<VoxelKey>, Unbuilt> {
        let mut occupied = 0;
        for distances in self.distances.chunks(CELLS_PER_STOP_CHECK) {
            check(stop)?;
            occupied += distances.iter().filter(|&&distance| distance == 0).count();
        }
        let stride = occupied.div_ceil(wish.max(1)).max(1);
        let (mut some, mut passed, mut since_look) = (Vec::new(), 0, 0);
        let [xs, ys, zs] = std::array::from_fn(|axis| self.in_order_of_keys(axis));
        for (z, y) in zs.flat_map(|z| ys.clone().map(move |y| (z, y))) {
            since_look += self.size[0];
            if since_look >= CELLS_PER_STOP_CHECK {
                since_look = 0;
                check(stop)?;
            }
            let row = self.cell([self.min[0], y, z]);
            if !self.distances[row..row + self.size[0]].contains(&0) {
                continue;
            }
            for x in xs.clone().filter(|x| self.distances[row + (x - self.min[0]) as usize] == 0) {
                if passed % stride == 0 {
                    some.extend(VoxelKey::new([x, y, z]));
                }
                passed += 1;
            }
        }
        Ok(some)
    }

    /// The grid's indices along an axis as keys order them: two's complement, so that -1 comes last.
    fn in_order_of_keys(&self, axis: usize) -> impl Iterator<Item = i32> + Clone + use<> {
        let (first, end) = (self.min[axis], self.min[axis] + self.size[axis] as i32);
        (first.max(0)..end).chain(first..end.min(0))
    }

    pub(super) fn resolution_m(&self) -> f64 {
        self.resolution_m
    }

    /// Converts `point_m` (map frame, meters) to voxels from the grid's corner.
    pub(super) fn in_grid(&self, point_m: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|axis| point_m[axis] / self.resolution_m - f64::from(self.min[axis]))
    }

    /// The distance at `place`, in voxels from the grid's corner; [`FAR`] outside of the grid.
    #[cfg(test)]
    pub(super) fn at(&self, place: [f32; 3]) -> u8 {
        let [x, y, z] = std::array::from_fn(|axis| self.clamped(place[axis], axis));
        self.distances[(z * self.size[1] + y) * self.size[0] + x]
    }

    /// Row of the grid that a coordinate falls in, clamped to the grid.
    #[cfg(test)]
    fn clamped(&self, coordinate: f32, axis: usize) -> usize {
        (coordinate.max(0.0) as usize).min(self.size[axis] - 1)
    }

    /// Number of points near an occupied voxel, for the eight translations `grid_from_sensor` + {0, `side`} an axis (x
    /// fastest). Zeros when none of them can exceed `floor`.
    ///
    /// The inner loop of the search: rotate, translate, quantize, and look up, eight look-ups a point.
    pub(super) fn count_of_eight(
        &self,
        points: &[ReachingPoint],
        grid_from_sensor: &GridFromSensor,
        side: f32,
        floor: u16,
    ) -> [u16; 8] {
        let strides = [1, self.size[0] as u32, (self.size[0] * self.size[1]) as u32];
        let last = self.size.map(|size| (size - 1) as f32);
        let mut counts = [0u16; 8];
        let mut left = points.len();
        for points in points.chunks(CHUNK) {
            // Rows of the grid for the low and high translation, axis by axis. Two loops, so that the first is
            // vectorized.
            let mut rows = [[[0u32; CHUNK]; 2]; 3];
            for axis in 0..3 {
                let [r0, r1, r2] = grid_from_sensor.rotation[axis];
                let [low, high] = &mut rows[axis];
                for ((point, low), high) in points.iter().zip(low).zip(high) {
                    let [x, y, z] = point.xyz;
                    let place = r0 * x + r1 * y + r2 * z + grid_from_sensor.translation[axis];
                    *low = whole(place, last[axis]) * strides[axis];
                    *high = whole(place + side, last[axis]) * strides[axis];
                }
            }
            let [xs, ys, zs] = &rows;
            for (p, point) in points.iter().enumerate() {
                for (i, count) in counts.iter_mut().enumerate() {
                    let cell = xs[i & 1][p] + ys[i >> 1 & 1][p] + zs[i >> 2][p];
                    *count += u16::from(self.distances[cell as usize] <= point.reach);
                }
            }
            left -= points.len();
            let highest = counts.iter().copied().max().unwrap_or(0);
            if usize::from(highest) + left <= usize::from(floor) {
                return [0; 8];
            }
        }
        counts
    }
}

/// A point in the sensor frame, meters, and the distance, in voxels, within which a voxel must be occupied for the
/// point to count.
#[derive(Debug, Clone, Copy)]
pub(super) struct ReachingPoint {
    pub(super) xyz: [f32; 3],
    pub(super) reach: u8,
}

/// Transform from meters in the sensor frame to voxels from the corner of a grid.
#[derive(Debug, Clone, Copy)]
pub(super) struct GridFromSensor {
    /// Rows of the rotation matrix, over the resolution.
    pub(super) rotation: [[f32; 3]; 3],
    pub(super) translation: [f32; 3],
}

/// Points between two checks of whether `floor` can still be exceeded.
const CHUNK: usize = 32;

/// The integer part of `place`, clamped to 0..=`last`.
///
/// Adding 2^23 leaves no bit for fractions: a conversion that vectorizes without any unsafe code. It rounds to
/// nearest, so half is taken off; a tie may go either way, which the slack of a bound allows for.
#[inline(always)]
fn whole(place: f32, last: f32) -> u32 {
    const SHIFT: f32 = 8_388_608.0;
    ((place - 0.5).clamp(0.0, last) + SHIFT).to_bits() - SHIFT.to_bits()
}

/// Cells of a grid between two checks of the stop signal: a fraction of a millisecond.
const CELLS_PER_STOP_CHECK: usize = 1 << 20;

/// A grid of `cells` voxels, all of them [`FAR`].
fn far_everywhere(cells: usize, stop: StopSignal<'_>) -> Result<Vec<u8>, Unbuilt> {
    let mut distances = Vec::with_capacity(cells);
    while distances.len() < cells {
        check(stop)?;
        distances.resize(cells.min(distances.len() + CELLS_PER_STOP_CHECK), FAR);
    }
    Ok(distances)
}

/// The smallest of each value and its neighbors a `stride` away; the ends of the grid are border.
fn smallest_of_three(from: &[u8], stride: usize, to: &mut [u8], stop: StopSignal<'_>) -> Result<(), Unbuilt> {
    let inner = from.len() - 2 * stride;
    for start in (0..inner).step_by(CELLS_PER_STOP_CHECK) {
        check(stop)?;
        let end = inner.min(start + CELLS_PER_STOP_CHECK);
        let neighbors = from[start..end].iter().zip(&from[start + stride..]).zip(&from[start + 2 * stride..]);
        for (smallest, ((a, b), c)) in to[start + stride..].iter_mut().zip(neighbors) {
            *smallest = *a.min(b).min(c);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn voxels() -> impl Strategy<Value = Vec<[i32; 3]>> {
        prop::collection::vec(prop::array::uniform3(-9..12i32), 1..12)
    }

    fn field(voxels: &[[i32; 3]], resolution_m: f64) -> DistanceField {
        let ends = |pick: fn(i32, i32) -> i32| {
            std::array::from_fn(|axis| voxels.iter().map(|v| v[axis]).reduce(pick).unwrap())
        };
        let keys = voxels.iter().map(|v| VoxelKey::new(*v).unwrap());
        let never = StopSignal::NEVER;
        let mut field = DistanceField::empty(ends(i32::min), ends(i32::max), resolution_m, never).unwrap();
        keys.for_each(|key| field.occupy(key));
        field.spread(never).unwrap();
        field
    }

    fn distance(voxels: &[[i32; 3]], index: [i32; 3]) -> u32 {
        let to = |v: &[i32; 3]| (0..3).map(|axis| v[axis].abs_diff(index[axis])).max().unwrap();
        voxels.iter().map(to).min().unwrap()
    }

    proptest! {
        #[test]
        fn occupied_voxels_come_in_the_order_of_their_keys(voxels in voxels(), wish in 1usize..20) {
            let field = field(&voxels, 0.5);
            let keys: std::collections::BTreeSet<VoxelKey> = voxels.iter().map(|v| VoxelKey::new(*v).unwrap()).collect();
            prop_assert!(keys.iter().all(|&key| field.is_occupied(key)));
            prop_assert!(!field.is_occupied(VoxelKey::new([500, 0, 0]).unwrap()));
            let expected: Vec<_> = keys.iter().copied().step_by(keys.len().div_ceil(wish)).collect();
            prop_assert_eq!(field.some_occupied(wish, StopSignal::NEVER).unwrap(), expected);
        }

        #[test]
        fn every_voxel_knows_its_distance(voxels in voxels(), index in prop::array::uniform3(-30..30i32)) {
            let field = field(&voxels, 0.5);
            let place = field.in_grid(index.map(|i| (f64::from(i) + 0.5) * 0.5)).map(|c| c as f32);
            prop_assert_eq!(u32::from(field.at(place)), distance(&voxels, index).min(u32::from(FAR)));
        }

        #[test]
        fn eight_counts_are_those_of_points_looked_up_one_by_one(
            voxels in voxels(),
            points in prop::collection::vec((prop::array::uniform3(-80..80i16), 0u8..=9), 1..80),
            corner in prop::array::uniform3(0..30i8),
            side in 1..6i8,
            floor in 0u16..60,
        ) {
            let field = field(&voxels, 1.0);
            // Quarters of voxels, off the borders, so that every sum is exact.
            let points: Vec<ReachingPoint> = points.into_iter().map(|(xyz, reach)| {
                let reach = if reach == 9 { u8::MAX } else { reach };
                ReachingPoint { xyz: xyz.map(|c| f32::from(c) / 4.0 + 0.125), reach }
            }).collect();
            let (corner, side) = (corner.map(f32::from), f32::from(side) / 2.0);
            let turn = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]];
            let grid_from_sensor = GridFromSensor { rotation: turn, translation: corner };
            let counts = field.count_of_eight(&points, &grid_from_sensor, side, floor);
            let expected: [u16; 8] = std::array::from_fn(|i| {
                let shift = [i & 1, i >> 1 & 1, i >> 2].map(|bit| bit as f32 * side);
                let is_near = |point: &&ReachingPoint| {
                    let [x, y, z] = point.xyz;
                    let turned = [-y, x, z];
                    field.at(std::array::from_fn(|axis| turned[axis] + corner[axis] + shift[axis])) <= point.reach
                };
                points.iter().filter(is_near).count() as u16
            });
            if counts == [0; 8] {
                prop_assert!(expected.iter().all(|&count| count <= floor));
            } else {
                prop_assert_eq!(counts, expected);
            }
        }
    }
}
