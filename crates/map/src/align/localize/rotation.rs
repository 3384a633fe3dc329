//! The lattice of rotations: how a search divides them into cells.

use std::f64::consts::{SQRT_2, TAU};

use nalgebra::UnitQuaternion;

use super::orientation::Orientation;

/// Division of the rotations of an [`Orientation`] into cells, at each depth of the search; 0 is the finest.
#[derive(Debug, Clone)]
pub(super) struct RotationLattice {
    /// Tolerance of the common axis, each way in x and y, radians.
    tilt_max_rad: f64,
    /// Number of cells of the full turn, by depth.
    yaws: Vec<i32>,
    /// Number of cells of the tilt along each of its two axes, by depth.
    tilts: Vec<i32>,
}

/// A cell of a [`RotationLattice`]: its index along the yaw and along each tilt.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct RotationCell {
    pub(super) yaw: i32,
    pub(super) tilt: [i32; 2],
}

impl RotationLattice {
    /// Divides rotations into cells of at most `turn_rad` from their center at depth 0, and about twice as much at each
    /// next depth, half of it for the yaw and half for the tilt.
    pub(super) fn new(turn_rad: f64, tilt_max_rad: f64, depths: u32) -> Self {
        let turn_at = |depth: u32| turn_rad * f64::from(1u32 << depth);
        let top = depths - 1;
        let yaws_at_top = (TAU / turn_at(top)).ceil().max(1.0) as i32;
        let tilts = |depth| {
            // A square of tilts reaches furthest at its corner.
            let cells = (tilt_max_rad * SQRT_2 / (turn_at(depth) / 2.0)).ceil().max(1.0) as u32;
            cells.next_power_of_two() as i32
        };
        Self {
            tilt_max_rad,
            yaws: (0..depths).map(|depth| yaws_at_top << (top - depth)).collect(),
            tilts: (0..depths).map(tilts).collect(),
        }
    }

    /// Number of depths.
    pub(super) fn depths(&self) -> u32 {
        self.yaws.len() as u32
    }

    /// The largest angle between a cell's center and a rotation in it.
    ///
    /// The angle between exp(a) and exp(b) is at most |a - b| (Hartley and Kahl, *Global Optimization through
    /// Rotation Space Search*, IJCV 2009), and angles add up at most.
    pub(super) fn turn_rad(&self, depth: u32) -> f64 {
        let depth = depth as usize;
        TAU / f64::from(self.yaws[depth]) / 2.0 + self.tilt_max_rad * SQRT_2 / f64::from(self.tilts[depth])
    }

    /// The rotation at the center of a cell, map_from_sensor.
    pub(super) fn center(
        &self,
        orientation: &Orientation,
        depth: u32,
        cell: RotationCell,
    ) -> UnitQuaternion<f64> {
        self.at(orientation, depth, cell, [0.5; 3])
    }

    /// The rotation at a place in a cell: `part` of its yaw and of its two tilts, each 0 to 1.
    pub(super) fn at(
        &self,
        orientation: &Orientation,
        depth: u32,
        cell: RotationCell,
        part: [f64; 3],
    ) -> UnitQuaternion<f64> {
        let depth = depth as usize;
        let [yaw, x, y] = part;
        let share = |i: i32, part: f64, cells: i32| (f64::from(i) + part) / f64::from(cells);
        let tilt = |i: i32, part: f64| (2.0 * share(i, part, self.tilts[depth]) - 1.0) * self.tilt_max_rad;
        orientation.turned(
            TAU * share(cell.yaw, yaw, self.yaws[depth]),
            [tilt(cell.tilt[0], x), tilt(cell.tilt[1], y)],
        )
    }

    /// All cells of a depth.
    pub(super) fn cells(&self, depth: u32) -> impl Iterator<Item = RotationCell> + use<> {
        let tilts = self.tilts[depth as usize];
        (0..self.yaws[depth as usize]).flat_map(move |yaw| {
            (0..tilts).flat_map(move |x| (0..tilts).map(move |y| RotationCell { yaw, tilt: [x, y] }))
        })
    }

    /// The cells of the next finer depth that a cell of `depth` consists of.
    pub(super) fn children(
        &self,
        depth: u32,
        cell: RotationCell,
    ) -> impl Iterator<Item = RotationCell> + use<> {
        let depth = depth as usize;
        let parts = self.tilts[depth - 1] / self.tilts[depth];
        (0..2).flat_map(move |half| {
            let yaw = 2 * cell.yaw + half;
            let tilt = move |x: i32, y: i32| [cell.tilt[0] * parts + x, cell.tilt[1] * parts + y];
            (0..parts).flat_map(move |x| (0..parts).map(move |y| RotationCell { yaw, tilt: tilt(x, y) }))
        })
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{UnitVector3, Vector3};
    use proptest::prelude::*;

    use super::*;

    fn lattice() -> impl Strategy<Value = RotationLattice> {
        (0.01..0.3, 0.0..3.2).prop_map(|(turn, tilt)| RotationLattice::new(turn, tilt, 4))
    }

    proptest! {
        #[test]
        fn no_rotation_of_a_cell_is_further_from_its_center_than_the_turn(
            lattice in lattice(),
            axes: [[i8; 3]; 2],
            depth in 0u32..4,
            cell: [u16; 3],
            part in prop::array::uniform3(0.0..=1.0),
        ) {
            let axis = |a: [i8; 3]| UnitVector3::new_normalize(Vector3::from(a.map(f64::from)) + Vector3::x() * 0.3);
            let orientation = Orientation::bringing(axis(axes[0]), axis(axes[1]));
            let (yaws, tilts) = (lattice.yaws[depth as usize], lattice.tilts[depth as usize]);
            let [yaw, x, y] = cell.map(i32::from);
            let cell = RotationCell { yaw: yaw % yaws, tilt: [x % tilts, y % tilts] };
            let center = lattice.center(&orientation, depth, cell);
            let angle = center.angle_to(&lattice.at(&orientation, depth, cell, part));
            prop_assert!(angle <= lattice.turn_rad(depth) + 1e-9, "{angle} of {}", lattice.turn_rad(depth));
        }

        #[test]
        fn the_children_of_all_cells_are_all_cells_of_the_next_depth(lattice in lattice()) {
            prop_assume!(lattice.cells(2).count() < 20_000);
            let mut children: Vec<_> = lattice.cells(3).flat_map(|cell| lattice.children(3, cell)).collect();
            children.sort_unstable();
            let mut cells: Vec<_> = lattice.cells(2).collect();
            cells.sort_unstable();
            prop_assert_eq!(children, cells);
        }
    }

    #[test]
    fn cells_are_as_small_as_asked() {
        let lattice = RotationLattice::new(0.01, 0.04, 5);
        for depth in 0..5 {
            let turn = lattice.turn_rad(depth) / f64::from(1u32 << depth);
            assert!(turn <= 0.01, "{turn} at {depth}");
        }
    }
}
