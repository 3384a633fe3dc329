//! Bodies of one link: eight configurations at once.

use super::field_lookup::{FieldLookup, FoundGroup};
use super::found_spheres::FoundSpheres;
use super::pipeline::{Staged, Unanswered};
use super::points;
use crate::planning::body::{EightTransforms, Group, LinkInCells, LinkPose, NUMBERS_PER_POSE};
use crate::planning::clearance::LANES;

/// A link at eight places.
#[derive(Debug)]
pub(super) struct EightPlaces<'a, 'o, 'f> {
    link: &'a LinkInCells,
    /// Each of its spheres eight times, where they are few.
    singles: &'a [Group],
    cells_per_m: f64,
    unanswered: Unanswered<'a, 'o>,
    /// The ball around the link, eight times.
    balls: Group,
    /// Those that are asked about: so many, from the first on.
    first: usize,
    count: usize,
    transforms: EightTransforms,
    around: FoundGroup<'f>,
    /// The places where the ball is not clear, with the spheres there: one place after the other, or, where that is
    /// less to look for, one sphere after the other at all places.
    near: u8,
    is_by_sphere: bool,
    spheres: FoundSpheres<'a, 'f>,
}

impl<'a, 'o> EightPlaces<'a, 'o, '_> {
    /// A link, and each of its spheres eight times, if there is to be a choice.
    pub(super) fn new(
        (link, singles): (&'a LinkInCells, &'a [Group]),
        cells_per_m: f64,
        unanswered: Unanswered<'a, 'o>,
    ) -> Self {
        Self {
            link,
            singles,
            cells_per_m,
            unanswered,
            balls: Group::of_one(&link.ball),
            first: 0,
            count: 0,
            transforms: EightTransforms::NOTHING,
            around: FoundGroup::NOTHING,
            near: 0,
            is_by_sphere: false,
            spheres: FoundSpheres::default(),
        }
    }

    fn pose(&self, lane: usize) -> &'a [f32; NUMBERS_PER_POSE] {
        &self.unanswered.poses_of(self.first + lane)[0]
    }

    /// True where the link meets a voxel at one of the places; none where a part of the field is waited for.
    #[inline(always)]
    fn meets(
        &mut self,
        lookup: &mut FieldLookup<'_>,
        lane: usize,
        groups: std::ops::Range<usize>,
    ) -> Option<bool> {
        let do_spheres = self.spheres.meets(lookup, groups)?;
        Some(do_spheres || self.points_meet(lookup, lane))
    }

    /// True where a point of the link meets a voxel at one of the places.
    #[inline(always)]
    fn points_meet(&self, lookup: &mut FieldLookup<'_>, lane: usize) -> bool {
        !self.link.points.is_empty() && {
            let pose = LinkPose::of(self.pose(lane));
            points::meet(lookup, self.link, &pose, &self.transforms.lane(lane))
        }
    }
}

impl<'f> Staged<'f> for EightPlaces<'_, '_, 'f> {
    #[inline(always)]
    fn begin(&mut self, lookup: &mut FieldLookup<'f>, part: usize) {
        self.first = part * LANES;
        self.count = LANES.min(self.unanswered.items.len() - self.first);
        let poses: [_; LANES] =
            std::array::from_fn(|lane| *self.pose(if lane < self.count { lane } else { 0 }));
        self.transforms.set(&poses, self.cells_per_m);
        lookup.find(&self.balls, &self.balls.centers_of_each(&self.transforms), &mut self.around);
    }

    #[inline(always)]
    fn go_on(&mut self, lookup: &mut FieldLookup<'f>) {
        let bounds = lookup.classify_found(&self.balls, &self.around);
        self.near = (bounds.meets | bounds.is_open) & (u8::MAX >> (LANES - self.count));
        self.spheres.clear();
        let one_by_one = self.near.count_ones() as usize * self.link.groups.len();
        self.is_by_sphere = (1..one_by_one).contains(&self.singles.len());
        if self.is_by_sphere {
            // Where the ball is clear, nothing need be made.
            self.transforms.leave(self.near);
            for single in self.singles {
                self.spheres.add_single(lookup, single, &self.transforms);
            }
            return;
        }
        // A closure for each bit would be compiled by itself, without the wide instructions.
        for lane in 0..LANES {
            if self.near >> lane & 1 == 1 {
                let cells_from_link = self.transforms.lane(lane);
                for group in &self.link.groups {
                    self.spheres.add(lookup, group, &cells_from_link);
                }
            }
        }
    }

    #[inline(always)]
    fn end(&mut self, lookup: &mut FieldLookup<'f>, answers: &mut [Option<bool>]) {
        if self.is_by_sphere {
            let (meets, waits) = self.spheres.singles_meet(lookup, self.near);
            for lane in 0..self.count {
                let item = self.unanswered.items[self.first + lane];
                let is = |places: u8| places >> lane & 1 == 1;
                answers[item] = match is(waits) {
                    true => None,
                    false => Some(is(meets) || is(self.near) && self.points_meet(lookup, lane)),
                };
            }
            return;
        }
        let (groups, mut begin) = (self.link.groups.len(), 0);
        for lane in 0..self.count {
            let item = self.unanswered.items[self.first + lane];
            answers[item] = Some(false);
            if self.near >> lane & 1 == 1 {
                answers[item] = self.meets(lookup, lane, begin..begin + groups);
                begin += groups;
            }
        }
    }
}
