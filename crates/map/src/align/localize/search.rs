//! The search: branch and bound over cells of poses, best first.

use std::collections::BinaryHeap;
use std::ops::ControlFlow;

use super::answer::SearchProgress;
use super::basins::{Basin, Basins};
use super::bound::{Bounds, PoseCell, Turned, eight};
use super::settings::LocalizationSettings;
use super::supervision::Supervision;

/// What a search found.
#[derive(Debug)]
pub(super) struct Found {
    /// The places, best first.
    pub(super) places: Vec<Basin>,
    /// True when the search ended by itself and dropped no cell for want of memory.
    pub(super) complete: bool,
    /// Number of cells whose bound was computed.
    pub(super) cells: u64,
}

/// A cell that waits to be divided, ordered by [`Waiting::promise`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Waiting {
    /// Priority of the cell: its bound less the expected loss until the finest depth. Among equal bounds deep cells
    /// come first, so that good poses are found early and prune the rest.
    promise: i32,
    bound: u16,
    cell: PoseCell,
}

/// Expected loss of a bound with each halving, as a share of the points.
const LOSS_PER_HALVING: f64 = 0.04;
/// Cells that are divided between two progress reports.
const CELLS_PER_REPORT: u32 = 64;
/// Groups of eight cells that are bounded between two checks of the stop signal. Each group takes eight look-ups a
/// search point; together they take a millisecond or less.
const EIGHTS_PER_STOP_CHECK: u32 = 64;

/// Initial capacity of the queue, in cells.
const ROOM_AT_FIRST: usize = 1024;

/// A search under way.
pub(super) struct Search<'a, 's> {
    bounds: &'a Bounds<'a>,
    settings: &'a LocalizationSettings,
    supervision: &'a mut Supervision<'s>,
    /// Groups of eight that were bounded since the last check of the stop signal.
    since_look: u32,
    waiting: BinaryHeap<Waiting>,
    /// Number of cells that memory is reserved for.
    room: usize,
    /// Most cells that may wait, by settings and memory; beyond it the least promising are dropped.
    waiting_max: usize,
    basins: Basins,
    cells: u64,
    complete: bool,
}

impl<'a, 's> Search<'a, 's> {
    pub(super) fn new(
        bounds: &'a Bounds<'a>,
        settings: &'a LocalizationSettings,
        basins: Basins,
        supervision: &'a mut Supervision<'s>,
    ) -> Self {
        Self {
            bounds,
            settings,
            supervision,
            since_look: 0,
            waiting: BinaryHeap::new(),
            room: 0,
            waiting_max: settings.cells_waiting_max,
            basins,
            cells: 0,
            complete: true,
        }
    }

    /// Finds the poses of highest overlap on the lattice of finest cells.
    pub(super) fn run(mut self) -> Found {
        if self.enter_roots().is_continue() && self.divide_best_first().is_continue() {
            return self.found(true);
        }
        self.found(false)
    }

    fn found(self, to_the_end: bool) -> Found {
        Found {
            places: self.basins.found().to_vec(),
            complete: to_the_end && self.complete,
            cells: self.cells,
        }
    }

    /// Bounds all cells of the coarsest depth.
    fn enter_roots(&mut self) -> ControlFlow<()> {
        let depth = self.settings.halvings;
        let [nx, ny, nz] = self.bounds.cubes(depth);
        for orientation in 0..self.bounds.orientations() {
            for rotation in self.bounds.rotations.cells(depth) {
                self.report()?;
                let cell = PoseCell { depth, orientation, rotation, translation: [0; 3] };
                let turned = self.bounds.turned(&cell);
                for z in (0..nz).step_by(2) {
                    for y in (0..ny).step_by(2) {
                        for x in (0..nx).step_by(2) {
                            let first = PoseCell { translation: [x, y, z], ..cell };
                            self.enter_eight(first, &turned, u16::MAX)?;
                        }
                    }
                }
            }
        }
        ControlFlow::Continue(())
    }

    /// Divides the most promising cell until no cell can hold a better place.
    fn divide_best_first(&mut self) -> ControlFlow<()> {
        let mut divided = 0u32;
        while let Some(Waiting { bound, cell, .. }) = self.waiting.pop() {
            divided = divided.wrapping_add(1);
            if divided.is_multiple_of(CELLS_PER_REPORT) {
                self.report()?;
            }
            if bound <= self.floor() || self.is_known(&cell, bound) {
                continue;
            }
            if cell.depth == 0 {
                self.basins.offer(Basin { map_from_sensor: self.bounds.center(&cell), score: bound });
            } else {
                self.divide(cell, bound)?;
            }
        }
        ControlFlow::Continue(())
    }

    fn divide(&mut self, cell: PoseCell, bound: u16) -> ControlFlow<()> {
        let depth = cell.depth - 1;
        for rotation in self.bounds.rotations.children(cell.depth, cell.rotation) {
            let first = PoseCell { depth, rotation, translation: cell.translation.map(|i| 2 * i), ..cell };
            self.enter_eight(first, &self.bounds.turned(&first), bound)?;
        }
        ControlFlow::Continue(())
    }

    /// Computes the bounds of `first` and its seven siblings, and queues those that may hold a better place.
    fn enter_eight(&mut self, first: PoseCell, turned: &Turned<'_>, parent: u16) -> ControlFlow<()> {
        self.since_look += 1;
        if self.since_look >= EIGHTS_PER_STOP_CHECK {
            self.look()?;
        }
        let floor = self.floor();
        let counts = turned.bounds_of_eight(first.translation, floor);
        self.cells += 8;
        if self.waiting.len() + 8 > self.room {
            self.make_room();
        }
        let loss = (LOSS_PER_HALVING * f64::from(self.bounds.points())) as i32;
        for (translation, count) in eight(first.translation).zip(counts) {
            let (cell, bound) = (PoseCell { translation, ..first }, count.min(parent));
            if bound > floor && self.bounds.is_in_domain(&cell) {
                let promise = i32::from(bound) - loss * cell.depth as i32;
                self.waiting.push(Waiting { promise, bound, cell });
            }
        }
        if self.waiting.len() > self.waiting_max {
            self.drop_least_promising();
        }
        ControlFlow::Continue(())
    }

    /// Doubles the capacity of the queue. Where memory for that is refused, the present capacity becomes the limit.
    fn make_room(&mut self) {
        let room = (2 * self.room).max(ROOM_AT_FIRST);
        // While the queue is moved, both allocations exist.
        match self.supervision.take(room * size_of::<Waiting>()) {
            Ok(()) => {
                self.waiting.reserve_exact(room - self.waiting.len());
                self.room = room;
            }
            Err(_) => self.waiting_max = self.waiting_max.min(self.room.saturating_sub(8)),
        }
    }

    /// Cells whose bound is this or less are discarded.
    fn floor(&self) -> u16 {
        let share = |share: f64, of: u16| (share * f64::from(of)) as u16;
        share(self.settings.search_overlap_min, self.bounds.points())
            .max(share(self.settings.search_share_of_best, self.basins.best()))
            .max(self.basins.entry())
    }

    /// True when every pose of the cell belongs to a known place with a better score.
    fn is_known(&self, cell: &PoseCell, bound: u16) -> bool {
        let half_diagonal_m = self.bounds.side_m_at(cell.depth) / 2.0 * 3f64.sqrt();
        let turn_rad = self.bounds.rotations.turn_rad(cell.depth);
        self.basins.best() >= bound
            && self.basins.cover(&self.bounds.center(cell), half_diagonal_m, turn_rad, bound)
    }

    /// Drops the less promising half of the queue.
    fn drop_least_promising(&mut self) {
        let mut cells = std::mem::take(&mut self.waiting).into_vec();
        let floor = self.floor();
        cells.retain(|waiting| waiting.bound > floor);
        let most = self.waiting_max / 2;
        if cells.len() > most {
            if most > 0 {
                cells.select_nth_unstable_by(most - 1, |a, b| b.cmp(a));
            }
            cells.truncate(most);
            self.complete = false;
        }
        self.waiting = cells.into();
    }

    fn report(&mut self) -> ControlFlow<()> {
        (self.supervision.progress)(&SearchProgress {
            cells: self.cells,
            waiting: self.waiting.len(),
            best_overlap: f64::from(self.basins.best()) / f64::from(self.bounds.points().max(1)),
        });
        self.look()
    }

    /// Gives way to others and checks the stop signal; breaks when the search is to end.
    fn look(&mut self) -> ControlFlow<()> {
        self.since_look = 0;
        let Supervision { stop, search_stop, .. } = &self.supervision;
        stop.give_way();
        if stop.is_stopped() || search_stop.is_stopped() {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use nalgebra::Vector3;

    use super::*;
    use crate::align::localize::dilated::DilatedLevels;
    use crate::align::localize::orientation::Orientation;
    use crate::align::localize::rotation::RotationLattice;
    use crate::align::localize::sample::SearchSample;
    use crate::geometry::{Point, Pose};
    use crate::map::{MapSettings, MappedScan, MultiResolutionMap, RobotName, ScanRecord};
    use crate::util::StopSignal;

    /// Two walls and a post, seen from inside.
    fn corner() -> Vec<Point> {
        let wall = (0..40).flat_map(|i| (0..8).map(move |j| [i as f32 * 0.1 - 1.0, 1.55, j as f32 * 0.1]));
        let other = (0..20).flat_map(|i| (0..8).map(move |j| [-1.05, i as f32 * 0.1 - 0.4, j as f32 * 0.1]));
        let post = (0..8).map(|j| [1.25, 0.35, j as f32 * 0.1]);
        wall.chain(other).chain(post).map(Point::from).collect()
    }

    struct Problem {
        levels: DilatedLevels,
        sample: SearchSample,
        settings: LocalizationSettings,
    }

    impl Problem {
        fn new() -> Self {
            let map = MultiResolutionMap::new(MapSettings::new(0.1, 3)).unwrap();
            let pose = MappedScan::new(RobotName::new("r").unwrap(), Pose::identity());
            map.committer().insert_scan(ScanRecord::of_points(pose, &corner(), map.lattice()));
            let settings = LocalizationSettings {
                resolutions_per_range: 10.0,
                halvings: 3,
                search_share_of_best: 0.0,
                search_overlap_min: 0.3,
                ..Default::default()
            };
            let sample = SearchSample::of(&corner(), 80, 1, StopSignal::NEVER);
            let levels = DilatedLevels::of_all(&map, &sample, &settings);
            Self { levels, sample, settings }
        }

        fn with_bounds<T>(&self, of: impl FnOnce(&Bounds<'_>) -> T) -> T {
            let turn_rad =
                self.settings.arc_share * self.levels.finest().resolution_m() / self.sample.range_m;
            let rotations = RotationLattice::new(turn_rad, 0.0, self.settings.halvings + 1);
            let upright = [Orientation::bringing(Vector3::z_axis(), Vector3::z_axis())];
            of(&Bounds::new(&self.levels, &self.sample, &upright, rotations))
        }

        /// Searches until `is_over` of the cells so far.
        fn search(&self, is_over: impl Fn(u64) -> bool) -> Found {
            let (cells, over) = (Cell::new(0), Cell::new(false));
            let is_stopped = || {
                over.set(over.get() || is_over(cells.get()));
                over.get()
            };
            let supervision = &mut Supervision {
                stop: StopSignal::when(&is_stopped),
                search_stop: StopSignal::NEVER,
                progress: &mut |progress| cells.set(progress.cells),
                reserve: &mut |_| true,
            };
            self.with_bounds(|bounds| {
                Search::new(bounds, &self.settings, Basins::new(0.4, 0.3, 16), supervision).run()
            })
        }

        /// The highest count of any finest cell, all of them looked at.
        fn highest_by_force(&self) -> u16 {
            self.with_bounds(|bounds| {
                let [nx, ny, nz] = bounds.cubes(0);
                let mut highest = 0;
                for rotation in bounds.rotations.cells(0) {
                    let cell = PoseCell { depth: 0, orientation: 0, rotation, translation: [0; 3] };
                    let turned = bounds.turned(&cell);
                    for (x, y, z) in (0..nx).step_by(2).flat_map(|x| {
                        (0..ny).step_by(2).flat_map(move |y| (0..nz).step_by(2).map(move |z| (x, y, z)))
                    }) {
                        let counts = turned.bounds_of_eight([x, y, z], 0);
                        for (translation, count) in eight([x, y, z]).zip(counts) {
                            if bounds.is_in_domain(&PoseCell { translation, ..cell }) {
                                highest = count.max(highest);
                            }
                        }
                    }
                }
                highest
            })
        }
    }

    #[test]
    fn the_best_place_is_the_best_of_all_poses_of_the_lattice() {
        let problem = Problem::new();
        let found = problem.search(|_| false);
        assert!(found.complete);
        assert_eq!(found.places[0].score, problem.highest_by_force());
        assert!(found.places.windows(2).all(|pair| pair[0].score >= pair[1].score));
    }

    #[test]
    fn a_search_that_is_stopped_says_so() {
        let problem = Problem::new();
        let at_once = problem.search(|_| true);
        assert!(!at_once.complete && at_once.places.is_empty() && at_once.cells == 0);

        let all = problem.search(|_| false).cells;
        let later = problem.search(|cells| cells > all / 2);
        assert!(!later.complete && later.cells < all);
    }

    #[test]
    fn a_search_without_memory_for_more_cells_drops_some_and_says_so() {
        let problem = Problem::new();
        let reserved = Cell::new(0);
        let supervision = &mut Supervision {
            stop: StopSignal::NEVER,
            search_stop: StopSignal::NEVER,
            progress: &mut |_| (),
            reserve: &mut |bytes| {
                reserved.set(reserved.get() + bytes);
                reserved.get() <= ROOM_AT_FIRST * size_of::<Waiting>()
            },
        };
        let (found, waited) = problem.with_bounds(|bounds| {
            let mut search = Search::new(bounds, &problem.settings, Basins::new(0.4, 0.3, 16), supervision);
            let _ = search.enter_roots();
            let waited = (search.waiting.len(), search.waiting.capacity());
            (search.run(), waited)
        });
        assert!(waited.0 <= ROOM_AT_FIRST && waited.1 == ROOM_AT_FIRST, "{waited:?}");
        assert!(!found.complete && !found.places.is_empty());
    }

    #[test]
    fn a_search_that_runs_out_of_room_says_so_and_still_finds_a_place() {
        let mut problem = Problem::new();
        problem.settings.cells_waiting_max = 200;
        let found = problem.search(|_| false);
        assert!(!found.complete && !found.places.is_empty());
    }
}
