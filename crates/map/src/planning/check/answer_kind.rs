//! The kinds of answers for one configuration: a bit, the first hit, the clearance.

use super::configuration::{Configuration, NearestLink};
use super::field_lookup::FieldLookup;
use crate::planning::answers::{CLEARANCE_CELLS_MAX, Clearance, Hit, Met};
use crate::planning::error::PlanningError;

/// A kind of answer.
pub(super) trait AnswerKind {
    /// The answer.
    type Answer;

    /// The answer for a configuration that is placed; none where it waits for a part of the field.
    fn answer(
        &self,
        configuration: &mut Configuration<'_>,
        lookup: &mut FieldLookup<'_>,
    ) -> Option<Self::Answer>;
}

/// Does the body meet a voxel?
#[derive(Debug, Clone, Copy)]
pub(super) struct Meets;

/// What does it meet first?
#[derive(Debug, Clone, Copy)]
pub(super) struct FirstHits;

/// How far is it from a voxel?
#[derive(Debug, Clone, Copy)]
pub(super) struct Clearances {
    most_m: f32,
    most: f64,
    cells_per_m: f64,
}

impl Clearances {
    /// Clearances up to `most_m` meters.
    ///
    /// # Errors
    /// When that is negative, or more than [`CLEARANCE_CELLS_MAX`] cells.
    pub(super) fn up_to(most_m: f32, cells_per_m: f64) -> Result<Self, PlanningError> {
        let (value, max) = (f64::from(most_m), CLEARANCE_CELLS_MAX / cells_per_m);
        let most = (value * cells_per_m).min(CLEARANCE_CELLS_MAX);
        // The largest distance comes as the float next to it, which may be more.
        let is_in_range = (0.0..=max as f32).contains(&most_m);
        let refused = PlanningError::Number { field: "clearance_max_m", value, min: 0.0, max };
        is_in_range.then_some(Self { most_m, most, cells_per_m }).ok_or(refused)
    }

    /// The largest distance that is told, cells.
    pub(super) fn most(&self) -> f64 {
        self.most
    }

    /// A distance in cells, as meters.
    pub(super) fn told_m(&self, distance: f64) -> f32 {
        ((distance / self.cells_per_m) as f32).min(self.most_m)
    }
}

impl AnswerKind for Meets {
    type Answer = bool;

    #[inline(always)]
    fn answer(&self, configuration: &mut Configuration<'_>, lookup: &mut FieldLookup<'_>) -> Option<bool> {
        configuration.meets(lookup)
    }
}

impl AnswerKind for FirstHits {
    type Answer = Option<Hit>;

    #[inline(always)]
    fn answer(
        &self,
        configuration: &mut Configuration<'_>,
        lookup: &mut FieldLookup<'_>,
    ) -> Option<Option<Hit>> {
        let hit = configuration.first_hit(lookup)?;
        Some(hit.map(|hit| Hit { link: hit.link as u32, part: hit.part as u32, met: Met::Voxel(hit.voxel) }))
    }
}

impl AnswerKind for Clearances {
    type Answer = Clearance;

    #[inline(always)]
    fn answer(
        &self,
        configuration: &mut Configuration<'_>,
        lookup: &mut FieldLookup<'_>,
    ) -> Option<Clearance> {
        let NearestLink { distance, link } = configuration.nearest(lookup, self.most)?;
        Some(Clearance { distance_m: self.told_m(distance), link: link.map(|link| link as u32) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_distance_is_taken_as_the_float_that_says_it() {
        // 6.4 is no float: the one next to it is more.
        assert_eq!(Clearances::up_to(6.4, 10.0).unwrap().most(), CLEARANCE_CELLS_MAX);
        assert!(Clearances::up_to(0.0, 10.0).is_ok());
        for most_m in [6.4f32.next_up(), -1e-9, f32::NAN, f32::INFINITY] {
            assert!(Clearances::up_to(most_m, 10.0).is_err(), "{most_m}");
        }
    }
}
