//! Shortest ways over the floor: a grid of places, and Dijkstra's algorithm from where the robot is.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Distance between two places of the grid, meters.
const SPACING_M: f64 = 0.1;

/// A place of the grid: column and row.
pub(super) type Cell = [usize; 2];

/// Places in a rectangle.
#[derive(Debug, Clone, Copy)]
pub(super) struct Grid {
    first_m: [f64; 2],
    count: [usize; 2],
}

impl Grid {
    /// The places between the smallest and the largest x and y.
    pub(super) fn around([low, high]: [[f64; 2]; 2]) -> Self {
        let count = [0, 1].map(|axis: usize| ((high[axis] - low[axis]) / SPACING_M) as usize + 1);
        Self { first_m: low, count }
    }

    /// All places, row by row.
    pub(super) fn places(self) -> impl Iterator<Item = [f64; 2]> {
        let [columns, rows] = self.count;
        (0..rows).flat_map(move |row| (0..columns).map(move |column| self.place([column, row])))
    }

    fn place(self, cell: Cell) -> [f64; 2] {
        [0, 1].map(|axis: usize| self.first_m[axis] + cell[axis] as f64 * SPACING_M)
    }

    /// The number of the place that is nearest to one within the rectangle.
    fn nearest(self, place: [f64; 2]) -> usize {
        self.number(self.cell(place))
    }

    fn cell(self, place: [f64; 2]) -> Cell {
        [0, 1].map(|axis: usize| ((place[axis] - self.first_m[axis]) / SPACING_M).round() as usize)
    }

    fn number(self, [column, row]: Cell) -> usize {
        row * self.count[0] + column
    }

    /// The places beside a cell, straight and askew, each with its distance in spacings.
    fn beside(self, [column, row]: Cell) -> impl Iterator<Item = (Cell, f64)> {
        let steps = (-1..=1).flat_map(|dy: isize| (-1..=1).map(move |dx: isize| (dx, dy)));
        steps.filter(|step| *step != (0, 0)).filter_map(move |(dx, dy)| {
            let cell = [column.checked_add_signed(dx)?, row.checked_add_signed(dy)?];
            let is_in = cell[0] < self.count[0] && cell[1] < self.count[1];
            is_in.then_some((cell, ((dx * dx + dy * dy) as f64).sqrt()))
        })
    }
}

/// The places of a grid, and what it costs to go there: infinite where the robot's body does not fit.
pub(super) struct Places {
    pub(super) grid: Grid,
    /// A number a place of the grid, row by row.
    pub(super) costs: Vec<f64>,
}

impl Places {
    /// The robot does not fit at a place after all.
    pub(super) fn take_out(&mut self, place: [f64; 2]) {
        let number = self.grid.nearest(place);
        self.costs[number] = f64::INFINITY;
    }
}

/// The shortest ways from one place to all others where the robot fits.
#[derive(Debug)]
pub(super) struct Ways {
    grid: Grid,
    /// What the way to each place costs; infinite to those that cannot be reached.
    costs: Vec<f64>,
    /// From where each is reached.
    from: Vec<Option<Cell>>,
    start: [f64; 2],
}

impl Ways {
    /// The ways from `start` over places that a meter `costs` so much, infinite where the robot does not fit; each is
    /// asked once, when it is reached.
    pub(super) fn from(grid: Grid, mut costs: impl FnMut(usize, [f64; 2]) -> f64, start: [f64; 2]) -> Self {
        let mut asked = vec![None; grid.count[0] * grid.count[1]];
        let mut ways =
            Self { grid, costs: vec![f64::INFINITY; asked.len()], from: vec![None; asked.len()], start };
        let nearest = grid.cell(start);
        let mut open = BinaryHeap::new();
        ways.costs[grid.number(nearest)] = 0.0;
        open.push((Reverse(0), nearest));
        while let Some((Reverse(_), cell)) = open.pop() {
            let here = ways.costs[grid.number(cell)];
            for (next, spacings) in grid.beside(cell) {
                let number = grid.number(next);
                let cost = here
                    + spacings
                        * SPACING_M
                        * *asked[number].get_or_insert_with(|| costs(number, grid.place(next)));
                if cost < ways.costs[number] - 1e-9 {
                    (ways.costs[number], ways.from[number]) = (cost, Some(cell));
                    open.push((Reverse((cost * 1e6) as u64), next));
                }
            }
        }
        ways
    }

    /// Of the places at most `near_m` from `place` that can be reached, the nearest, with what the way to it costs.
    pub(super) fn nearest_to(&self, place: [f64; 2], near_m: f64) -> Option<(Cell, f64)> {
        let off = |cell: [f64; 2]| (cell[0] - place[0]).hypot(cell[1] - place[1]);
        let near = self.reached(1).filter(|(_, _, at)| off(*at) <= near_m);
        let (cell, cost, _) = near.min_by(|one, other| off(one.2).total_cmp(&off(other.2)))?;
        Some((cell, cost))
    }

    /// Places that can be reached, one of `every` along each axis, each with what the way to it costs.
    pub(super) fn reached(&self, every: usize) -> impl Iterator<Item = (Cell, f64, [f64; 2])> + '_ {
        let [columns, rows] = self.grid.count;
        let cells =
            (0..rows).step_by(every).flat_map(move |row| (0..columns).step_by(every).map(move |x| [x, row]));
        let reached = cells.map(|cell| (cell, self.costs[self.grid.number(cell)], self.grid.place(cell)));
        reached.filter(|(_, cost, _)| cost.is_finite())
    }

    /// The places along the way to a cell, from the start on.
    pub(super) fn way_to(&self, cell: Cell) -> Vec<[f64; 2]> {
        let mut way = vec![self.grid.place(cell)];
        let mut at = cell;
        while let Some(from) = self.from[self.grid.number(at)] {
            at = from;
            way.push(self.grid.place(at));
        }
        // The robot stands beside the place of the grid that is nearest to it, where it need not fit.
        way.pop();
        way.push(self.start);
        way.reverse();
        way
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ways_lead_around_what_does_not_fit_and_are_the_shortest() {
        let grid = Grid::around([[0.0, 0.0], [1.0, 1.0]]);
        // A wall with a gap at its end.
        let fits =
            |_, [x, y]: [f64; 2]| if !(0.45..0.55).contains(&x) || y > 0.85 { 1.0 } else { f64::INFINITY };
        let ways = Ways::from(grid, fits, [0.1, 0.1]);
        let (cell, way_m) = ways.nearest_to([0.9, 0.1], 0.01).unwrap();
        let way = ways.way_to(cell);
        assert_eq!((way[0], way.len()), ([0.1, 0.1], 17));
        assert!(way.iter().all(|[x, y]| !(0.45..0.55).contains(x) || *y > 0.85));
        // Eight steps up and eight down, all but none of them askew.
        assert!((1.6..2.0).contains(&way_m), "{way_m}");
    }

    #[test]
    fn what_is_walled_in_cannot_be_reached() {
        let grid = Grid::around([[0.0, 0.0], [1.0, 1.0]]);
        let fits = |_, [x, _]: [f64; 2]| if (0.45..0.55).contains(&x) { f64::INFINITY } else { 1.0 };
        assert!(Ways::from(grid, fits, [0.1, 0.1]).nearest_to([0.9, 0.1], 0.2).is_none());
    }
}
