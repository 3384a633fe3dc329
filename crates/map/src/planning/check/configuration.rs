//! One configuration: does the body meet a voxel, which first, and how far is it from one.

use super::field_lookup::{FieldLookup, FoundGroup};
use super::found_spheres::FoundSpheres;
use super::pipeline::{Staged, Unanswered};
use super::{link, points};
use crate::planning::body::{BodyInCells, CellsFromLink, EightTransforms, LinkPose, NUMBERS_PER_POSE};
use crate::planning::clearance::LANES;
use crate::util::bits::for_each_bit;
use crate::voxel::VoxelKey;

/// Answers for one configuration after the other. None means that a part of the field is waited for.
#[derive(Debug)]
pub(super) struct Configuration<'a> {
    body: &'a BodyInCells,
    cells_per_m: f64,
    poses: &'a [[f32; NUMBERS_PER_POSE]],
    /// The transforms of the links, eight at a time.
    transforms: Vec<EightTransforms>,
    /// The links that the balls around them do not clear.
    near: Vec<usize>,
}

/// A configuration on its way through the stages of the [`pipeline`](super::pipeline), one after the other.
#[derive(Debug)]
pub(super) struct StagedConfiguration<'a, 'o, 'f> {
    configuration: Configuration<'a>,
    unanswered: Unanswered<'a, 'o>,
    place: usize,
    /// The balls around the links, eight at a time.
    balls: Vec<FoundGroup<'f>>,
    /// The spheres of links that are not clear.
    spheres: FoundSpheres<'a, 'f>,
}

impl<'a, 'o> StagedConfiguration<'a, 'o, '_> {
    pub(super) fn new(body: &'a BodyInCells, cells_per_m: f64, unanswered: Unanswered<'a, 'o>) -> Self {
        let configuration = Configuration::new(body, cells_per_m);
        Self { configuration, unanswered, place: 0, balls: Vec::new(), spheres: FoundSpheres::default() }
    }
}

impl<'f> Staged<'f> for StagedConfiguration<'_, '_, 'f> {
    #[inline(always)]
    fn begin(&mut self, lookup: &mut FieldLookup<'f>, part: usize) {
        self.place = part;
        self.configuration.place(self.unanswered.poses_of(part));
        self.configuration.find_balls(lookup, &mut self.balls);
    }

    #[inline(always)]
    fn go_on(&mut self, lookup: &mut FieldLookup<'f>) {
        self.configuration.find_spheres(lookup, &self.balls, &mut self.spheres);
    }

    #[inline(always)]
    fn end(&mut self, lookup: &mut FieldLookup<'f>, answers: &mut [Option<bool>]) {
        answers[self.unanswered.items[self.place]] =
            self.configuration.meets_found(lookup, &mut self.spheres);
    }
}

/// The first part of a link, or of a body, that meets a voxel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct FirstHit {
    pub(super) link: usize,
    pub(super) part: usize,
    pub(super) voxel: VoxelKey,
}

/// The distance to the nearest voxel, cells, and the link that is nearest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct NearestLink {
    pub(super) distance: f64,
    pub(super) link: Option<usize>,
}

impl<'a> Configuration<'a> {
    pub(super) fn new(body: &'a BodyInCells, cells_per_m: f64) -> Self {
        Self { body, cells_per_m, poses: &[], transforms: Vec::new(), near: Vec::new() }
    }

    /// Puts the links at these poses.
    #[inline(always)]
    pub(super) fn place(&mut self, poses: &'a [[f32; NUMBERS_PER_POSE]]) {
        self.poses = poses;
        self.transforms.resize(poses.len().div_ceil(LANES), EightTransforms::NOTHING);
        for (poses, transforms) in poses.chunks(LANES).zip(&mut self.transforms) {
            transforms.set(poses, self.cells_per_m);
        }
    }

    /// The transform of a link.
    #[inline(always)]
    fn cells_from_link(&self, link: usize) -> CellsFromLink {
        self.transforms[link / LANES].lane(link % LANES)
    }

    /// Notes the links of whose surroundings the field does not say that nothing is in them.
    #[inline(always)]
    fn note_near(&mut self, lookup: &mut FieldLookup<'_>) {
        self.near.clear();
        for (eight, (balls, transforms)) in self.body.balls.iter().zip(&self.transforms).enumerate() {
            let bounds = lookup.classify_spheres(balls, &balls.centers_of_each(transforms));
            for_each_bit(u64::from(bounds.meets | bounds.is_open), |lane| {
                self.near.push(eight * LANES + lane as usize);
            });
        }
    }

    /// True where the body meets a voxel; none where a part of the field is waited for.
    #[inline(always)]
    pub(super) fn meets(&mut self, lookup: &mut FieldLookup<'_>) -> Option<bool> {
        let (mut balls, mut spheres) = (Vec::new(), FoundSpheres::default());
        self.find_balls(lookup, &mut balls);
        self.find_spheres(lookup, &balls, &mut spheres);
        self.meets_found(lookup, &mut spheres)
    }

    /// Finds the balls around the links in the field.
    #[inline(always)]
    fn find_balls<'f>(&self, lookup: &mut FieldLookup<'f>, found: &mut Vec<FoundGroup<'f>>) {
        found.resize(self.body.balls.len(), FoundGroup::NOTHING);
        let balls = self.body.balls.iter().zip(&self.transforms);
        for ((balls, transforms), found) in balls.zip(found) {
            lookup.find(balls, &balls.centers_of_each(transforms), found);
        }
    }

    /// Finds the spheres of the links that are not clear.
    #[inline(always)]
    fn find_spheres<'f>(
        &mut self,
        lookup: &mut FieldLookup<'f>,
        balls: &[FoundGroup<'f>],
        spheres: &mut FoundSpheres<'a, 'f>,
    ) {
        self.near.clear();
        for (eight, (balls, found)) in self.body.balls.iter().zip(balls).enumerate() {
            let bounds = lookup.classify_found(balls, found);
            for_each_bit(u64::from(bounds.meets | bounds.is_open), |lane| {
                self.near.push(eight * LANES + lane as usize);
            });
        }
        spheres.clear();
        for &number in &self.near {
            let cells_from_link = self.cells_from_link(number);
            for group in &self.body.links[number].groups {
                spheres.add(lookup, group, &cells_from_link);
            }
        }
    }

    /// Reads what was found.
    #[inline(always)]
    fn meets_found(&self, lookup: &mut FieldLookup<'_>, spheres: &mut FoundSpheres<'_, '_>) -> Option<bool> {
        let do_spheres = spheres.meets(lookup, 0..spheres.len())?;
        Some(do_spheres || self.points_meet(lookup))
    }

    fn points_meet(&self, lookup: &mut FieldLookup<'_>) -> bool {
        self.near.iter().any(|&number| {
            let pose = LinkPose::of(&self.poses[number]);
            points::meet(lookup, &self.body.links[number], &pose, &self.cells_from_link(number))
        })
    }

    /// What the body meets first: in the order of links, in a link spheres before points.
    pub(super) fn first_hit(&mut self, lookup: &mut FieldLookup<'_>) -> Option<Option<FirstHit>> {
        self.note_near(lookup);
        let mut unmade = 0;
        for &number in &self.near {
            let (link, cells_from_link) = (&self.body.links[number], self.cells_from_link(number));
            let hit = link::first_sphere(lookup, link, &cells_from_link, &mut unmade);
            if lookup.waits_for(unmade) {
                continue;
            }
            let hit = hit.or_else(|| {
                let spheres = link.spheres;
                let hit =
                    points::first_hit(lookup, link, &LinkPose::of(&self.poses[number]), &cells_from_link)?;
                Some((spheres + hit.point, hit.voxel))
            });
            if let Some((part, voxel)) = hit {
                return Some(Some(FirstHit { link: number, part, voxel }));
            }
        }
        (!lookup.waits_for(unmade)).then_some(None)
    }

    /// The distance from the body to the nearest voxel, cells, 0 where they meet; `most` where that is more.
    pub(super) fn nearest(&mut self, lookup: &mut FieldLookup<'_>, most: f64) -> Option<NearestLink> {
        let (mut unmade, mut upper) = (0, most);
        for (number, link) in self.body.links.iter().enumerate() {
            let cells_from_link = self.cells_from_link(number);
            upper = upper.min(link::upper_bound(lookup, link, &cells_from_link, &mut unmade));
        }
        if lookup.waits_for(unmade) {
            return None;
        }
        let mut nearest = NearestLink { distance: most, link: None };
        for (number, link) in self.body.links.iter().enumerate() {
            // What is further than something else is known to be is passed over.
            let bound = upper.max(0.0).min(nearest.distance);
            let distance = link::nearest(lookup, link, &self.cells_from_link(number), bound);
            if let Some(distance) = distance.filter(|distance| *distance < nearest.distance) {
                nearest = NearestLink { distance, link: Some(number) };
            }
        }
        Some(nearest)
    }
}
