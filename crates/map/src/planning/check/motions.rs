//! Can a body move along these configurations?
//!
//! Between two configurations a link's translation goes along a line and its rotation along the shorter arc; of two
//! that are equally long, half a turn each, the signs of the quaternions decide. A motion is checked in even steps, so
//! that no point of the body moves further than a step. Steps are skipped by clearance: a link that is clear by d
//! cannot meet a voxel before one of its spheres' centers has moved by d. So the answer is that of all steps.
//! Keep-outs, which may be thinner than any step, are met along the whole way.

use super::answer_kind::Clearances;
use super::field_lookup::FieldLookup;
use super::found_spheres::OpenSpheres;
use super::link::{self, LinkState};
use super::rounds::Answerer;
use crate::planning::body::{
    Body, BodyInCells, CellsFromLink, Configurations, LinkMotion, LinkPose, RADIUS_MAX_M, Reach,
};
use crate::planning::effort::Effort;
use crate::planning::error::PlanningError;
use crate::planning::keep_outs::{Among, Figure, Strides, Way};
use crate::planning::planner::PlanningView;
use crate::planning::unknown::Surroundings;
use crate::util::StopSignal;

/// Motions between two checks of the stop signal.
const PER_STOP_CHECK: usize = 16;
/// Most steps of a motion between two configurations.
const STEPS_MAX: u64 = 100_000;
/// The least step, meters.
const STEP_MIN_M: f64 = 1e-5;
/// A link that is clear by less is not asked for by its ball at the next step, cells.
const NEAR_CELLS: f64 = 2.0;
/// What is taken off a clearance before steps are skipped by it, cells.
const ROUNDING_CELLS: f64 = 1e-6;

/// A body along motions.
#[derive(Debug, Clone, Copy)]
pub struct MotionQuestion<'a> {
    /// The body.
    pub body: &'a Body,
    /// The configurations of all motions, one after the other.
    pub configurations: Configurations<'a>,
    /// How many configurations each motion has: two or more.
    pub lengths: &'a [u32],
    /// How far a point of the body moves in a step at most, meters; half a voxel of the level without. Keep-outs are
    /// met along the whole way, to within 1 mm, half a voxel of level 0, or the step, whichever is least.
    pub step_m: Option<f32>,
    /// Up to where the least clearance of each motion is told, meters; it is not told without.
    pub clearance_max_m: Option<f32>,
    /// Level of the voxels that count.
    pub level: u32,
    /// What counts.
    pub surroundings: &'a Surroundings,
}

/// How far a body can move.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionAnswer {
    /// Where the body first meets a voxel (at a step) or a keep-out (anywhere on the way), as a share of the motion:
    /// configuration i of n is i / (n - 1). None where the motion is free.
    pub first_hit: Option<f32>,
    /// The least distance from the body to a voxel at any step or to a keep-out on the way, meters, where it was asked
    /// for: 0 where they meet.
    pub clearance_m: Option<f32>,
}

/// Bytes of memory in which so many `motions` of a body of `links` links, with so many `configurations` in all, are
/// prepared.
pub fn prepared_bytes(motions: usize, configurations: usize, links: usize) -> usize {
    // A list that grows takes up to three times what is in it, and one that begins has room for four.
    let (per_motion, per_segment) = (3 * size_of::<BodyMotion<'_>>(), 3 * size_of::<Segment>());
    let of_links = links.saturating_mul(size_of::<LinkMotion>());
    let segments = configurations.saturating_mul(per_segment.saturating_add(of_links));
    motions.saturating_mul(per_motion + 4 * size_of::<Segment>()).saturating_add(segments)
}

impl MotionAnswer {
    /// True where the body meets nothing on its way.
    pub fn is_free(&self) -> bool {
        self.first_hit.is_none()
    }
}

impl PlanningView<'_> {
    /// Says of each motion whether the body can make it. None once stopped.
    ///
    /// # Errors
    /// For a level that the map has not, spheres that are too large for it, lengths that do not sum up to the
    /// configurations or are below two, a step or clearance out of range, and a motion that leads beyond the map's
    /// lattice.
    pub fn check_motions(
        &self,
        question: &MotionQuestion<'_>,
        stop: StopSignal<'_>,
    ) -> Result<Option<Vec<MotionAnswer>>, PlanningError> {
        let cells_per_m = self.cells_per_m(question.level)?;
        let body = question.body.in_cells(cells_per_m)?;
        let most_m = question.clearance_max_m.unwrap_or(0.0);
        let reach = Reach::of(self.lattice(), cells_per_m, question.surroundings, most_m);
        let motions = question.motions(&body, cells_per_m, &reach)?;
        let chunks = (motions.len(), PER_STOP_CHECK);
        let MotionQuestion { level, surroundings, .. } = *question;
        let answers = self.each(level, surroundings, chunks, stop, Motions(&motions));
        let Some(shapes) = self.shapes() else { return Ok(answers) };
        let Some(mut answers) = answers else { return Ok(None) };
        let (figure, effort) = (Figure::of(question.body.links()), Effort::until(stop));
        let finest_m = self.lattice().resolution_m(0);
        let strides = Strides::of(question.step_m(cells_per_m)?, finest_m);
        for (motion, answer) in motions.iter().zip(&mut answers).take_while(|_| effort.goes_on(1)) {
            motion.mend(answer, &figure, &Among { shapes: &shapes, strides, effort: &effort });
        }
        Ok(effort.done(answers))
    }
}

/// Answers motion by motion.
struct Motions<'a>(&'a [BodyMotion<'a>]);

impl Answerer for Motions<'_> {
    type Answer = MotionAnswer;

    #[inline(always)]
    fn answer(&mut self, lookup: &mut FieldLookup<'_>, item: usize) -> Option<MotionAnswer> {
        self.0[item].answer(lookup)
    }
}

/// The motion of a body along a polyline.
struct BodyMotion<'a> {
    body: &'a BodyInCells,
    segments: Vec<Segment>,
    cells_per_m: f64,
    clearances: Option<Clearances>,
}

/// A motion between two configurations.
struct Segment {
    links: Vec<LinkMotion>,
    steps: u64,
}

impl MotionQuestion<'_> {
    fn motions<'b>(
        &self,
        body: &'b BodyInCells,
        cells_per_m: f64,
        reach: &Reach,
    ) -> Result<Vec<BodyMotion<'b>>, PlanningError> {
        self.configurations.check_links(body.links.len())?;
        self.check_lengths()?;
        let step_m = self.step_m(cells_per_m)?;
        let clearances = self.clearance_max_m.map(|most_m| Clearances::up_to(most_m, cells_per_m));
        let clearances = clearances.transpose()?;
        let mut first = 0;
        let motion = |(number, &length): (usize, &u32)| {
            let (start, end) = (first, first + length as usize - 1);
            first = end + 1;
            let segments = (start..end).map(|from| {
                reach.check_motion(body, &self.configurations, from)?;
                self.segment(body, number, from, step_m)
            });
            let segments = segments.collect::<Result<Vec<_>, _>>()?;
            Ok(BodyMotion { body, segments, cells_per_m, clearances })
        };
        self.lengths.iter().enumerate().map(motion).collect()
    }

    /// Checks how many configurations the motions have.
    ///
    /// # Errors
    /// For lengths that do not sum up to the configurations or are below two.
    pub fn check_lengths(&self) -> Result<(), PlanningError> {
        const SHOWN: usize = 8;
        let sum: u64 = self.lengths.iter().map(|length| u64::from(*length)).sum();
        let configurations = self.configurations.len();
        if sum == configurations as u64 && self.lengths.iter().all(|length| *length >= 2) {
            return Ok(());
        }
        let lengths = self.lengths.iter().take(SHOWN).map(|length| *length as usize).collect();
        Err(PlanningError::Motions { configurations, lengths })
    }

    fn step_m(&self, cells_per_m: f64) -> Result<f64, PlanningError> {
        let value = self.step_m.map_or(0.5 / cells_per_m, f64::from);
        let max = f64::from(RADIUS_MAX_M);
        // The least step comes as the float next to it, which may be less.
        let is_valid = (STEP_MIN_M as f32..=max as f32).contains(&(value as f32));
        is_valid.then_some(value).ok_or(PlanningError::Number {
            field: "step_m",
            value,
            min: STEP_MIN_M,
            max,
        })
    }

    /// The motion of the body from configuration `from` to the next.
    fn segment(
        &self,
        body: &BodyInCells,
        motion: usize,
        from: usize,
        step_m: f64,
    ) -> Result<Segment, PlanningError> {
        let ends = self.configurations.poses_of(from).iter().zip(self.configurations.poses_of(from + 1));
        let links: Vec<_> =
            ends.map(|(from, to)| LinkMotion::new(&LinkPose::of(from), &LinkPose::of(to))).collect();
        let lengths_m = links.iter().zip(&body.links).map(|(motion, link)| motion.length_m(link.extent_m));
        let steps = (lengths_m.fold(0.0, f64::max) / step_m).ceil().max(1.0) as u64;
        if steps > STEPS_MAX {
            return Err(PlanningError::Steps { motion, steps, steps_max: STEPS_MAX });
        }
        Ok(Segment { links, steps })
    }
}

impl BodyMotion<'_> {
    /// None where a part of the field is waited for.
    #[inline(always)]
    fn answer(&self, lookup: &mut FieldLookup<'_>) -> Option<MotionAnswer> {
        let (mut first_hit, mut open) = (None, OpenSpheres::default());
        for (number, segment) in self.segments.iter().enumerate() {
            // The first step of a segment is the last one of that before.
            let step = self.first_hit(lookup, segment, u64::from(number > 0), &mut open)?;
            if let Some(step) = step {
                let share = step as f64 / segment.steps as f64;
                first_hit = Some(((number as f64 + share) / self.segments.len() as f64) as f32);
                break;
            }
        }
        let clearance_m = match (self.clearances, first_hit) {
            (None, _) => None,
            (Some(_), Some(_)) => Some(0.0),
            (Some(clearances), None) => Some(clearances.told_m(self.clearance(lookup, clearances.most())?)),
        };
        Some(MotionAnswer { first_hit, clearance_m })
    }

    /// Makes the answer about voxels one about keep-outs too.
    fn mend(&self, answer: &mut MotionAnswer, figure: &Figure, among: &Among<'_, '_>) {
        let share =
            |number: usize, of_segment: f64| (number as f64 + of_segment) / self.segments.len() as f64;
        let met = self.segments.iter().enumerate().find_map(|(number, segment)| {
            let ways = self.ways(segment, figure);
            let met =
                ways.fold(None, |met: Option<f64>, way| way.first_met(among, met.unwrap_or(1.0)).or(met));
            met.map(|of_segment| share(number, of_segment) as f32)
        });
        answer.first_hit = match (answer.first_hit, met) {
            (Some(voxel), Some(keep_out)) => Some(voxel.min(keep_out)),
            (voxel, keep_out) => voxel.or(keep_out),
        };
        let Some(clearance_m) = &mut answer.clearance_m else { return };
        if answer.first_hit.is_some() {
            *clearance_m = 0.0;
            return;
        }
        for way in self.segments.iter().flat_map(|segment| self.ways(segment, figure)) {
            *clearance_m = clearance_m.min(way.least_m(among, f64::from(*clearance_m)) as f32);
        }
    }

    /// The links on their ways through a segment, in meters.
    fn ways<'w>(&'w self, segment: &'w Segment, figure: &'w Figure) -> impl Iterator<Item = Way<'w>> {
        let links = figure.links().iter().zip(&segment.links).zip(&self.body.links);
        links.map(|((link, motion), in_cells)| Way {
            link,
            motion,
            length_m: motion.length_m(in_cells.center_extent_m),
        })
    }

    /// The first step of a segment, from `first` on, at which a link meets a voxel.
    #[inline(always)]
    fn first_hit(
        &self,
        lookup: &mut FieldLookup<'_>,
        segment: &Segment,
        first: u64,
        open: &mut OpenSpheres,
    ) -> Option<Option<u64>> {
        let (mut end, mut waits) = (segment.steps + 1, false);
        for (link, motion) in self.body.links.iter().zip(&segment.links) {
            let per_step = motion.length_m(link.center_extent_m) * self.cells_per_m / segment.steps as f64;
            // What was near a voxel a step ago is so now: its ball would say nothing.
            let (mut step, mut is_near) = (first, false);
            while step < end {
                if lookup.is_over() {
                    return None;
                }
                let pose = motion.at(step as f64 / segment.steps as f64);
                let cells_from_link = CellsFromLink::of(&pose, self.cells_per_m);
                match link::state(lookup, link, (&pose, &cells_from_link), is_near, open) {
                    LinkState::Meets => end = step,
                    LinkState::IsClear(by) => {
                        is_near = by < NEAR_CELLS;
                        step += steps_without(by, per_step);
                    }
                    LinkState::Waits => {
                        // What else is on the way will be asked for too.
                        waits = true;
                        step += 1;
                    }
                }
            }
        }
        (!waits).then_some(Some(end).filter(|end| *end <= segment.steps))
    }

    /// The least distance at any step, cells, up to `most`; none once the look-up is over.
    fn clearance(&self, lookup: &mut FieldLookup<'_>, most: f64) -> Option<f64> {
        let mut least = most;
        for segment in &self.segments {
            for (link, motion) in self.body.links.iter().zip(&segment.links) {
                let per_step =
                    motion.length_m(link.center_extent_m) * self.cells_per_m / segment.steps as f64;
                let mut step = 0;
                while step <= segment.steps {
                    if lookup.is_over() {
                        return None;
                    }
                    let pose = motion.at(step as f64 / segment.steps as f64);
                    let cells_from_link = CellsFromLink::of(&pose, self.cells_per_m);
                    let lower = link::lower_bound(lookup, link, &cells_from_link);
                    if lower > least {
                        step += steps_without(lower - least, per_step);
                        continue;
                    }
                    least = link::nearest(lookup, link, &cells_from_link, least).unwrap_or(least);
                    step += 1;
                }
            }
        }
        Some(least)
    }
}

/// Steps to the next one at which what is `clear` cells away can be reached, where each step goes `per_step` cells at
/// most.
#[inline(always)]
fn steps_without(clear: f64, per_step: f64) -> u64 {
    let steps = (clear - ROUNDING_CELLS) / per_step;
    if steps >= 1.0 { steps.min(STEPS_MAX as f64 + 1.0) as u64 } else { 1 }
}
