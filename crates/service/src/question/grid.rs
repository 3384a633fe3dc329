//! The map from above, as a 2-D grid.

use super::known::KnownPart;
use super::planner_question::Question;
use super::question_target::QuestionTarget;
use super::scope::QuestionScope;
use crate::error::{Reason, ServiceError};
use crate::limits::Limits;
use crate::work::check_not_stopped;
use mrol_map::map::{ContentVersion, MultiResolutionMap};
use mrol_map::planning::{BandFrom, Grid, GridArea, GridError, GridRequest, project_grid};
use mrol_map::util::StopSignal;
use mrol_map::voxel::Lattice;

/// What is the map from above?
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GridQuestion {
    /// What it has in common with other questions.
    pub asked: QuestionScope,
    /// What the grid covers, and how finely.
    pub scope: GridScope,
}

/// What a grid covers, and how finely.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GridScope {
    /// Which part of the map, seen from above.
    pub area: GridArea,
    /// Lowest and highest height, meters, between which voxels reach that count; infinite ones are fine.
    pub band_m: [f64; 2],
    /// What these heights count from.
    pub band_from: BandFrom,
    /// Side of a cell, meters: a whole number of the level's voxels. One voxel without.
    pub cell_m: Option<f64>,
    /// True where cells without a voxel are told apart: free ones and unknown ones.
    pub tells_unknown: bool,
}

/// Bytes of a cell in an answer: a height and two bits.
const BYTES_EACH: usize = 5;
/// Bytes of a cell that is told to be free or unknown while that is found: how many of its columns are free.
const WORK_BYTES_EACH: usize = 4;
/// Bytes of a voxel while the floor is looked for, at most: each may be a surface of its own.
const FLOOR_BYTES_EACH: usize = 70;

impl GridScope {
    /// True where the floor has to be found for it: a band without bounds counts from nothing.
    pub(super) fn needs_floor(&self) -> bool {
        self.band_from == BandFrom::Floor && self.band_m.iter().any(|c| c.is_finite())
    }
}

impl GridQuestion {
    /// Bytes of memory that finding the floor takes, where it has to be found.
    pub(super) fn floor_bytes(&self, map: &MultiResolutionMap) -> usize {
        let voxels =
            map.settings().levels.checked_sub(1).map_or(0, |last| map.voxels(self.asked.level.min(last)));
        if self.scope.needs_floor() { voxels * FLOOR_BYTES_EACH } else { 0 }
    }

    /// Most cells of an answer.
    pub(super) fn cells_max(limits: &Limits) -> usize {
        limits.grid_cells_max.min(limits.message_bytes_max / BYTES_EACH)
    }

    /// What is to be drawn of a map with this lattice, in at most so many cells.
    pub(super) fn request(&self, lattice: &Lattice, cells_max: usize) -> GridRequest {
        let (GridScope { area, band_m, band_from, cell_m, tells_unknown }, level) =
            (self.scope, self.asked.level);
        let cell_m = cell_m.unwrap_or_else(|| lattice.resolution_m(level));
        GridRequest { level, area, band_m, band_from, cell_m, tells_unknown, cells_max }
    }
}

impl Question for GridQuestion {
    type Answer = Grid;

    const OPERATION: &'static str = "ProjectGrid";

    const WAY_OUT: &'static str = "ask for the grid in tiles (StreamGrid, POST /v1/maps/{map}/grid/tiles), for larger cells \
                                   (cell_m) or a smaller area, or raise limits.question_time_max_s";

    fn asked(&self) -> &QuestionScope {
        &self.asked
    }

    fn answer_bytes(&self, limits: &Limits) -> usize {
        let work = if self.scope.tells_unknown { WORK_BYTES_EACH } else { 0 };
        Self::cells_max(limits) * (BYTES_EACH + work)
    }

    fn work_bytes(&self, map: &MultiResolutionMap) -> usize {
        self.floor_bytes(map)
    }

    /// It walks all voxels of the area: never a short question.
    fn work_ns(&self) -> usize {
        usize::MAX
    }

    /// The floor is found among all voxels of the map: that may take longer than one part of an answer, and lets others
    /// go first between its own.
    fn is_in_parts(&self) -> bool {
        self.scope.needs_floor()
    }

    fn check(&self, _: &Limits) -> Result<(), ServiceError> {
        Ok(())
    }

    fn answer_from(
        &self,
        map: &QuestionTarget<'_>,
        limits: &Limits,
        stop: StopSignal<'_>,
    ) -> Result<(Grid, ContentVersion), ServiceError> {
        let mut view = map.pausing_view(&self.asked);
        let request = self.request(view.lattice(), Self::cells_max(limits));
        let grid = project_grid(&mut view, &request, stop);
        // What was stopped may lack the floor.
        check_not_stopped(stop)?;
        Ok((grid?, view.version()))
    }

    fn check_known(&self, answer: &Grid, known: &KnownPart) -> Result<(), ServiceError> {
        let GridScope { area, band_m, .. } = self.scope;
        if self.scope.needs_floor() {
            let message = "band_from must be map where a replica copies a region: the floor is found below the poses of \
                           the whole map";
            return Err(ServiceError::new(Reason::PointOutOfRange, message));
        }
        if area == GridArea::Occupied {
            let message =
                "area must be given where a replica copies a region: what is occupied elsewhere is not known";
            return Err(ServiceError::new(Reason::PointOutOfRange, message));
        }
        let end_m = |axis: usize| answer.origin_m[axis] + answer.size[axis] as f64 * answer.cell_m;
        let [xs, ys] = [0, 1].map(|axis| [answer.origin_m[axis], end_m(axis)]);
        (0..8usize).try_for_each(|corner| {
            let corner_m = [xs[corner & 1], ys[corner >> 1 & 1], known.within(band_m[corner >> 2])];
            known.check_ball(|| "a corner of the area between min_z_m and max_z_m".to_owned(), corner_m, 0.0)
        })
    }
}

impl From<GridError> for ServiceError {
    fn from(error: GridError) -> Self {
        match error {
            GridError::Cells { .. } => {
                let message = format!(
                    "grid_cells_max: {error}: ask for a smaller area or larger cells, or for the grid in tiles"
                );
                Self::new(Reason::GridTooLarge, message)
            }
            GridError::BandRange { .. } => Self::new(Reason::PointOutOfRange, error.to_string()),
            GridError::NoPoses | GridError::NoFloor { .. } => Self::new(Reason::NoFloor, error.to_string()),
            _ => Self::new(Reason::BadGrid, error.to_string()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map_service::MapService;
    use crate::settings::ServiceSettings;
    use mrol_map::map::{MapName, MapSettings};
    use mrol_store::OpeningProgress;

    #[tokio::test]
    async fn who_asks_for_a_grid_that_takes_too_long_is_told_of_tiles_cells_and_the_setting() {
        let limits = Limits { question_time_max_s: 0.0, ..Limits::default() };
        let settings = ServiceSettings { limits, ..ServiceSettings::default() };
        let service = MapService::open(settings, &OpeningProgress::default()).unwrap();
        let map = MapName::new("site").unwrap();
        service.create_map(map.clone(), MapSettings::new(0.1, 1)).await.unwrap();
        let band_m = [f64::NEG_INFINITY, f64::INFINITY];
        let (area, band_from) = (GridArea::Occupied, BandFrom::Map);
        let scope = GridScope { area, band_m, band_from, cell_m: None, tells_unknown: false };
        let error =
            service.ask(&map, GridQuestion { asked: QuestionScope::default(), scope }).await.unwrap_err();
        assert_eq!(error.reason, Reason::TimeLimit);
        for way_out in ["StreamGrid", "/grid/tiles", "cell_m", "limits.question_time_max_s"] {
            assert!(error.message.contains(way_out), "{}", error.message);
        }
    }
}
