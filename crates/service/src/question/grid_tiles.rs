//! A large grid in tiles, one after the other.

use std::sync::Arc;
use std::time::{Duration, Instant};

use tokio_stream::Stream;

use super::grid::{GridQuestion, GridScope};
use super::known::KnownPart;
use super::planner_question::Question;
use super::question_target::QuestionTarget;
use super::scope::{AtVersion, QuestionScope};
use crate::error::{Reason, ServiceError};
use crate::limits::Limits;
use crate::map_service::MapService;
use crate::resources::Reservation;
use crate::watch::{Teller, stream_of};
use crate::work::check_not_stopped;
use mrol_map::map::{ContentVersion, MapName, MultiResolutionMap};
use mrol_map::planning::{Floor, Grid, GridArea, GridExtent, GridRequest, grid_extent, project_grid_above};
use mrol_map::util::StopSignal;

/// Most cells of a grid in tiles: 1.6 km by 1.6 km of cells of 0.1 m.
pub const TILED_CELLS_MAX: usize = 1 << 28;
/// Cells along the sides of a tile, and voxels, at most: one is drawn in a small part of `question_time_max_s`. A whole
/// number of blocks, so that no block is looked into for two tiles.
const TILE_CELLS: i64 = 256;
const TILE_VOXELS: i64 = 512;
/// Name under which the memory of a floor is reserved, for refusals.
const FLOOR: &str = "the floor of a grid in tiles";
/// Bytes of a cell of a tile while it is drawn.
const BYTES_EACH: usize = 9;

/// A part of a grid, at a revision of its own.
#[derive(Debug, Clone, PartialEq)]
pub struct GridTile {
    /// Corner of the whole grid: smallest x and y, meters.
    pub origin_m: [f64; 2],
    /// Number of cells of the whole grid along x and y.
    pub size: [usize; 2],
    /// Number of tiles; one without cells where the grid has none.
    pub tiles: usize,
    /// The cell of the whole grid that is the tile's first one.
    pub first: [usize; 2],
    /// True of the last tile.
    pub is_last: bool,
    /// The tile's cells.
    pub grid: AtVersion<Grid>,
}

/// A grid in tiles, from the smallest y on, in each row from the smallest x: each is drawn when the one before it was
/// taken.
#[derive(Debug)]
pub struct GridTiles {
    service: MapService,
    map: MapName,
    question: GridQuestion,
    extent: GridExtent,
    /// The number of the next one.
    next: usize,
    begun: Instant,
    /// Memory of the floor.
    _reserved: Reservation,
}

impl MapService {
    /// Begins to draw a grid in tiles of one revision each: of any size up to [`TILED_CELLS_MAX`], where a question for
    /// all of it would have too many cells or take too long. Changes of the map go on between two tiles.
    ///
    /// # Errors
    /// As a question has them; `ResourceExhausted` for too many cells.
    pub async fn grid_tiles(&self, map: &MapName, question: GridQuestion) -> Result<GridTiles, ServiceError> {
        let extent = self.ask(map, ExtentQuestion(question)).await?;
        // Every tile is of the map that was measured.
        let asked = QuestionScope { map_uuid: Some(extent.version.map_uuid), ..question.asked };
        let (service, map, question) = (self.clone(), map.clone(), GridQuestion { asked, ..question });
        let extent = extent.answer;
        // All tiles count from one floor, which stays until the last one is taken.
        let floor_bytes = extent.floor.as_ref().map_or(0, |floor| floor.memory_bytes());
        let reserved = self.inner.budget.reserve_transient(floor_bytes as u64, FLOOR)?;
        Ok(GridTiles { service, map, question, extent, next: 0, begun: Instant::now(), _reserved: reserved })
    }
}

impl GridTiles {
    /// The tiles as a stream, which ends with its first error: that of `end`, once it comes; `time_limit` after
    /// `grid_time_max_s`; or `watch_stalled` where the client took no tile for `watch_unread_max_s`.
    pub fn into_stream(
        self,
        end: impl Future<Output = ServiceError> + Send + 'static,
    ) -> impl Stream<Item = Result<GridTile, ServiceError>> + Send {
        let unread_max_s = self.service.limits().watch_unread_max_s;
        stream_of(self, unread_max_s, end)
    }

    /// Cells along a tile's sides.
    fn side(&self) -> i64 {
        (TILE_VOXELS / self.extent.cell_voxels).clamp(1, TILE_CELLS)
    }

    /// The tiles along x and y, from which to which: they begin at whole multiples of their sides.
    fn columns_and_rows(&self) -> [std::ops::Range<i64>; 2] {
        let (&GridExtent { first, size, .. }, side) = (&self.extent, self.side());
        std::array::from_fn(|axis| {
            let end = first[axis] + size[axis] as i64;
            let is_none = size[axis] == 0;
            let begin = first[axis].div_euclid(side);
            begin..if is_none { begin } else { (end - 1).div_euclid(side) + 1 }
        })
    }

    /// The cells of tile `number`: the first, and the one behind the last.
    fn cells(&self, number: usize) -> [[i64; 2]; 2] {
        let (&GridExtent { first, size, .. }, side) = (&self.extent, self.side());
        let [columns, rows] = self.columns_and_rows();
        let width = ((columns.end - columns.start) as usize).max(1);
        let at = [columns.start + (number % width) as i64, rows.start + (number / width) as i64];
        let end: [i64; 2] = std::array::from_fn(|axis| first[axis] + size[axis] as i64);
        [
            std::array::from_fn(|axis| (at[axis] * side).max(first[axis])),
            std::array::from_fn(|axis| ((at[axis] + 1) * side).min(end[axis])),
        ]
    }

    /// The part of the area that tile `number` has.
    fn area(&self, [first, end]: [[i64; 2]; 2]) -> GridArea {
        let corner_m = |cell: [i64; 2]| cell.map(|c| c as f64 * self.extent.cell_m);
        let (mut min_m, mut max_m) = (corner_m(first), corner_m(end));
        // Cells at the border may reach out of the map; the area does not.
        if let GridArea::Rectangle { min_m: least_m, max_m: most_m } = self.question.scope.area {
            min_m = std::array::from_fn(|axis| min_m[axis].max(least_m[axis]));
            max_m = std::array::from_fn(|axis| max_m[axis].min(most_m[axis]));
        }
        GridArea::Rectangle { min_m, max_m }
    }

    /// The next tile.
    ///
    /// # Errors
    /// As a question has them; `DeadlineExceeded` after `grid_time_max_s`. After an error comes no other tile.
    pub async fn next(&mut self) -> Result<GridTile, ServiceError> {
        let GridExtent { cell_m, first: begin, size, .. } = self.extent;
        let (number, floor) = (self.next, self.extent.floor.clone());
        let tiles = self.columns_and_rows().map(|range| (range.end - range.start) as usize);
        let tiles = tiles[0] * tiles[1];
        let limit_s = self.service.limits().grid_time_max_s;
        if self.begun.elapsed() > Duration::from_secs_f64(limit_s) {
            let message = format!(
                "{number} of {tiles} tiles were drawn within grid_time_max_s, {limit_s}: ask for a smaller area or larger cells"
            );
            return Err(ServiceError::new(Reason::TimeLimit, message));
        }
        let origin_m = begin.map(|cell| cell as f64 * cell_m);
        let [first, end] = self.cells(number);
        let mut question = self.question;
        if tiles > 0 {
            question.scope = GridScope { area: self.area([first, end]), ..question.scope };
        }
        let cells = std::array::from_fn(|axis| (end[axis] - first[axis]).max(0) as usize);
        let grid = self.service.ask(&self.map, TileQuestion { question, cells, floor }).await?;
        self.next += 1;
        let first = std::array::from_fn(|axis| (first[axis] - begin[axis]).max(0) as usize);
        Ok(GridTile { origin_m, size, tiles: tiles.max(1), first, is_last: self.next >= tiles, grid })
    }
}

impl Teller for GridTiles {
    type Message = GridTile;

    async fn tell(&mut self) -> Result<GridTile, ServiceError> {
        self.next().await
    }

    fn is_last(message: &GridTile) -> bool {
        message.is_last
    }
}

/// How large is the grid?
#[derive(Debug)]
struct ExtentQuestion(GridQuestion);

/// What is in the cells of a tile?
#[derive(Debug)]
struct TileQuestion {
    question: GridQuestion,
    cells: [usize; 2],
    /// What the band counts from, in all tiles: it was found for the first revision.
    floor: Option<Arc<Floor>>,
}

impl Question for ExtentQuestion {
    type Answer = GridExtent;

    const OPERATION: &'static str = "StreamGrid";

    fn asked(&self) -> &QuestionScope {
        &self.0.asked
    }

    fn answer_bytes(&self, _: &Limits) -> usize {
        size_of::<GridExtent>()
    }

    fn work_bytes(&self, map: &MultiResolutionMap) -> usize {
        self.0.floor_bytes(map)
    }

    /// Where no area is given it walks all voxels: never a short question.
    fn work_ns(&self) -> usize {
        usize::MAX
    }

    fn is_in_parts(&self) -> bool {
        self.0.is_in_parts()
    }

    fn check(&self, limits: &Limits) -> Result<(), ServiceError> {
        self.0.check(limits)
    }

    fn answer_from(
        &self,
        map: &QuestionTarget<'_>,
        _: &Limits,
        stop: StopSignal<'_>,
    ) -> Result<(GridExtent, ContentVersion), ServiceError> {
        let mut view = map.pausing_view(&self.0.asked);
        let request: GridRequest = self.0.request(view.lattice(), TILED_CELLS_MAX);
        let extent = grid_extent(&mut view, &request, stop);
        check_not_stopped(stop)?;
        Ok((extent?, view.version()))
    }

    fn check_known(&self, _: &GridExtent, _: &KnownPart) -> Result<(), ServiceError> {
        Ok(())
    }
}

impl Question for TileQuestion {
    type Answer = Grid;

    const OPERATION: &'static str = "StreamGrid";

    fn asked(&self) -> &QuestionScope {
        &self.question.asked
    }

    fn answer_bytes(&self, _: &Limits) -> usize {
        self.cells[0] * self.cells[1] * BYTES_EACH
    }

    fn work_ns(&self) -> usize {
        usize::MAX
    }

    fn check(&self, limits: &Limits) -> Result<(), ServiceError> {
        self.question.check(limits)
    }

    fn answer_from(
        &self,
        map: &QuestionTarget<'_>,
        limits: &Limits,
        stop: StopSignal<'_>,
    ) -> Result<(Grid, ContentVersion), ServiceError> {
        let (grid, version) = match self.cells {
            [0, _] | [_, 0] => map.in_view(&self.question.asked, 0, stop, |view| {
                let request = self.question.request(view.lattice(), 0);
                Ok(Grid::empty(request.cell_m, [0.0; 2], [0; 2], request.tells_unknown))
            })?,
            _ => {
                let mut view = map.pausing_view(&self.question.asked);
                let request = self.question.request(view.lattice(), GridQuestion::cells_max(limits));
                let grid = project_grid_above(&mut view, &request, self.floor.as_deref(), stop)?;
                check_not_stopped(stop)?;
                (grid, view.version())
            }
        };
        Ok((grid, version))
    }

    fn check_known(&self, answer: &Grid, known: &KnownPart) -> Result<(), ServiceError> {
        self.question.check_known(answer, known)
    }
}
