//! Do these spheres of the map frame meet voxels?

use std::ops::Range;

use super::answer_kind::{AnswerKind, Clearances, FirstHits, Meets};
use super::configuration::Configuration;
use super::field_lookup::FieldLookup;
use super::poses::words;
use super::rounds::Answerer;
use crate::planning::answers::{Clearance, Hit};
use crate::planning::body::{BodyInCells, LinkInCells, MAP_FRAME, RADIUS_MAX_M, Reach, Sphere};
use crate::planning::error::{PlanningError, SpherePlace};
use crate::planning::keep_outs::{Posed, Shapes, Solid};
use crate::planning::planner::PlanningView;
use crate::planning::unknown::Surroundings;
use crate::util::StopSignal;

/// Groups between two checks of the stop signal.
const PER_STOP_CHECK: usize = 256;

/// Spheres of the map frame, in groups that are answered as one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SphereGroups<'a> {
    spheres: &'a [Sphere],
    sizes: &'a [u32],
}

/// Groups of spheres.
#[derive(Debug, Clone, Copy)]
pub struct SphereQuestion<'a> {
    /// The spheres.
    pub groups: SphereGroups<'a>,
    /// What is added to all radii, meters.
    pub padding_m: f32,
    /// Level of the voxels that count.
    pub level: u32,
    /// What counts.
    pub surroundings: &'a Surroundings,
}

impl<'a> SphereGroups<'a> {
    /// The groups of `spheres`, so many in each.
    ///
    /// # Errors
    /// When the sizes do not sum up to the spheres, or a sphere is not finite or out of range.
    pub fn new(spheres: &'a [Sphere], sizes: &'a [u32]) -> Result<Self, PlanningError> {
        let expected: usize = sizes.iter().map(|size| *size as usize).sum();
        if expected != spheres.len() {
            return Err(PlanningError::Groups { expected, got: spheres.len() });
        }
        match spheres.iter().position(|sphere| !sphere.is_valid()) {
            Some(number) => Err(spheres[number].refused(SpherePlace::InGroups(number))),
            None => Ok(Self { spheres, sizes }),
        }
    }

    /// Some of the groups, by their numbers, and how many spheres those before them have.
    #[must_use]
    pub fn part(self, of: Range<usize>) -> (Self, usize) {
        let count = |sizes: &[u32]| sizes.iter().map(|size| *size as usize).sum();
        let before: usize = count(&self.sizes[..of.start]);
        let sizes = &self.sizes[of];
        (Self { spheres: &self.spheres[before..][..count(sizes)], sizes }, before)
    }

    fn iter(&self) -> impl Iterator<Item = &'a [Sphere]> {
        let mut rest = self.spheres;
        self.sizes.iter().map(move |size| rest.split_off(..*size as usize).unwrap_or_default())
    }
}

impl PlanningView<'_> {
    /// Says of each group whether a sphere of it meets a voxel: group i is bit i % 64 of word i / 64. None once
    /// stopped.
    ///
    /// # Errors
    /// For a level that the map has not, a padding out of range, and spheres that are too large for the level or reach
    /// beyond the map's lattice.
    pub fn spheres_meet(
        &self,
        question: &SphereQuestion<'_>,
        stop: StopSignal<'_>,
    ) -> Result<Option<Vec<u64>>, PlanningError> {
        let words = self.each_group(question, stop, (Meets, 0.0))?.map(|meets| words(&meets));
        Ok(self.among_keep_outs(question, words, |posed, shapes, words| posed.mark(shapes, words, stop)))
    }

    /// The first sphere of each group that meets a voxel, where one does; the link is 0. None once stopped.
    ///
    /// # Errors
    /// As for [`PlanningView::spheres_meet`].
    pub fn first_sphere_hits(
        &self,
        question: &SphereQuestion<'_>,
        stop: StopSignal<'_>,
    ) -> Result<Option<Vec<Option<Hit>>>, PlanningError> {
        let hits = self.each_group(question, stop, (FirstHits, 0.0))?;
        Ok(self.among_keep_outs(question, hits, |posed, shapes, hits| posed.hits(shapes, hits, stop)))
    }

    /// How much room each group has, up to `most_m` meters; the link is 0. None once stopped.
    ///
    /// # Errors
    /// As for [`PlanningView::spheres_meet`], and when `most_m` is more than 64 voxels.
    pub fn sphere_clearances(
        &self,
        question: &SphereQuestion<'_>,
        most_m: f32,
        stop: StopSignal<'_>,
    ) -> Result<Option<Vec<Clearance>>, PlanningError> {
        let clearances = Clearances::up_to(most_m, self.cells_per_m(question.level)?)?;
        let clearances = self.each_group(question, stop, (clearances, most_m))?;
        Ok(self.among_keep_outs(question, clearances, |posed, shapes, clearances| {
            posed.clearances(shapes, clearances, stop)
        }))
    }

    /// The answers that `mend` makes of those about voxels, where there are keep-outs that count.
    fn among_keep_outs<A>(
        &self,
        question: &SphereQuestion<'_>,
        answers: Option<A>,
        mend: impl FnOnce(Posed<'_>, &Shapes<'_>, A) -> Option<A>,
    ) -> Option<A> {
        let Some(shapes) = self.shapes() else { return answers };
        let groups = question.groups.iter().map(|spheres| Solid::of_spheres(spheres, question.padding_m));
        mend(Posed::Groups(&groups.collect::<Vec<_>>()), &shapes, answers?)
    }

    fn each_group<K: AnswerKind>(
        &self,
        question: &SphereQuestion<'_>,
        stop: StopSignal<'_>,
        (kind, most_m): (K, f32),
    ) -> Result<Option<Vec<K::Answer>>, PlanningError> {
        let SphereQuestion { groups, padding_m, level, surroundings } = *question;
        let cells_per_m = self.cells_per_m(level)?;
        check_padding(padding_m)?;
        let reach = Reach::of(self.lattice(), cells_per_m, surroundings, most_m);
        reach.check_spheres(groups.spheres, padding_m)?;
        let mut before = 0;
        let mut in_cells = |spheres: &[Sphere]| {
            let link = LinkInCells::of_spheres(spheres, padding_m, before, cells_per_m)?;
            before += spheres.len();
            Ok(BodyInCells::of_link(link))
        };
        let (mut answers, chunk) =
            (Vec::with_capacity(groups.sizes.len()), groups.sizes.len().min(PER_STOP_CHECK));
        let mut bodies = Vec::with_capacity(chunk);
        let mut groups = groups.iter().peekable();
        while groups.peek().is_some() {
            bodies.clear();
            for group in groups.by_ref().take(PER_STOP_CHECK) {
                bodies.push(in_cells(group)?);
            }
            let of_bodies = Groups { bodies: &bodies, kind: &kind, cells_per_m };
            match self.each(level, surroundings, (bodies.len(), PER_STOP_CHECK), stop, of_bodies) {
                Some(some) => answers.extend(some),
                None => return Ok(None),
            }
        }
        Ok(Some(answers))
    }
}

/// Answers group by group.
struct Groups<'a, K> {
    bodies: &'a [BodyInCells],
    kind: &'a K,
    cells_per_m: f64,
}

impl<K: AnswerKind> Answerer for Groups<'_, K> {
    type Answer = K::Answer;

    #[inline(always)]
    fn answer(&mut self, lookup: &mut FieldLookup<'_>, item: usize) -> Option<K::Answer> {
        let mut configuration = Configuration::new(&self.bodies[item], self.cells_per_m);
        configuration.place(&[MAP_FRAME]);
        self.kind.answer(&mut configuration, lookup)
    }
}

fn check_padding(padding_m: f32) -> Result<(), PlanningError> {
    let (value, max) = (f64::from(padding_m), f64::from(RADIUS_MAX_M));
    let refused = PlanningError::Number { field: "padding_m", value, min: 0.0, max };
    (0.0..=max).contains(&value).then_some(()).ok_or(refused)
}
