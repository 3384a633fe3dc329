//! Frontiers: where free space ends and nothing is known beyond.

use super::known::KnownPart;
use super::planner_question::Question;
use super::question_target::QuestionTarget;
use super::scope::QuestionScope;
use crate::error::{Reason, ServiceError};
use crate::limits::Limits;
use crate::work::check_not_stopped;
use mrol_map::map::ContentVersion;
use mrol_map::planning::{
    FRONTIER_SIZE_MIN_DEFAULT, Frontier, FrontierError, FrontierRequest, Frontiers, STANDOFF_VOXELS,
    list_frontiers,
};
use mrol_map::util::StopSignal;

/// Which frontiers has this part of the map?
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrontierQuestion {
    /// What it has in common with other questions.
    pub asked: QuestionScope,
    /// Smallest coordinates of the box that is looked into, meters.
    pub min_m: [f64; 3],
    /// Largest coordinates.
    pub max_m: [f64; 3],
    /// Least number of voxels of a frontier; [`FRONTIER_SIZE_MIN_DEFAULT`] without.
    pub size_min: Option<u64>,
    /// Most frontiers that are told; [`FRONTIERS_MAX_DEFAULT`] without, or as many as the limits allow.
    pub frontiers_max: Option<usize>,
    /// How far from its middle a frontier is looked at, meters; [`STANDOFF_VOXELS`] voxels of the level without.
    pub standoff_m: Option<f64>,
}

/// Frontiers that are told where nobody says.
pub const FRONTIERS_MAX_DEFAULT: usize = 100;
/// Bytes of a voxel of the box while frontiers are looked for: bits of what is known, and the places of frontier
/// voxels.
const WORK_BYTES_EACH: usize = 5;

impl FrontierQuestion {
    fn frontiers_max(&self, limits: &Limits) -> usize {
        self.frontiers_max.unwrap_or(FRONTIERS_MAX_DEFAULT.min(limits.frontiers_max))
    }
}

impl Question for FrontierQuestion {
    type Answer = Frontiers;

    const OPERATION: &'static str = "ListFrontiers";

    fn asked(&self) -> &QuestionScope {
        &self.asked
    }

    fn answer_bytes(&self, limits: &Limits) -> usize {
        limits.frontiers_max * size_of::<Frontier>() + limits.frontier_cells_max * WORK_BYTES_EACH
    }

    fn work_ns(&self) -> usize {
        usize::MAX
    }

    fn check(&self, limits: &Limits) -> Result<(), ServiceError> {
        let (asked, most) = (self.frontiers_max(limits), limits.frontiers_max);
        if asked <= most {
            return Ok(());
        }
        let message = format!("frontiers_max is {asked}, limits.frontiers_max {most}");
        Err(ServiceError::new(Reason::BatchTooLarge, message))
    }

    fn answer_from(
        &self,
        map: &QuestionTarget<'_>,
        limits: &Limits,
        stop: StopSignal<'_>,
    ) -> Result<(Frontiers, ContentVersion), ServiceError> {
        let Self { min_m, max_m, standoff_m, .. } = *self;
        let request = FrontierRequest {
            level: self.asked.level,
            min_m,
            max_m,
            size_min: self.size_min.unwrap_or(FRONTIER_SIZE_MIN_DEFAULT),
            frontiers_max: self.frontiers_max(limits),
            standoff_m,
            cells_max: limits.frontier_cells_max,
        };
        let mut view = map.pausing_view(&self.asked);
        let frontiers = list_frontiers(&mut view, &request, stop)?;
        check_not_stopped(stop)?;
        Ok((frontiers, view.version()))
    }

    fn check_known(&self, _: &Frontiers, known: &KnownPart) -> Result<(), ServiceError> {
        // A place to look from is no further from the box than that, and what would be a better one twice as far.
        let around_m = 2.0 * self.standoff_m.unwrap_or(STANDOFF_VOXELS * known.voxel_m()) + known.voxel_m();
        let ends = [self.min_m, self.max_m];
        (0..8usize).try_for_each(|corner| {
            let corner_m = std::array::from_fn(|axis| ends[corner >> axis & 1][axis]);
            known.check_ball(|| "a corner of the box".to_owned(), corner_m, around_m)
        })
    }
}

impl From<FrontierError> for ServiceError {
    fn from(error: FrontierError) -> Self {
        match error {
            FrontierError::Cells { .. } => {
                let message =
                    format!("frontier_cells_max: {error}: ask for a smaller box or a coarser level");
                Self::new(Reason::FrontierBoxTooLarge, message)
            }
            FrontierError::Range { .. } => Self::new(Reason::PointOutOfRange, error.to_string()),
            _ => Self::new(Reason::BadFrontiers, error.to_string()),
        }
    }
}
