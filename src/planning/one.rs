//! One configuration: does the body meet a voxel, which first, and how far is it from one.

use super::configurations::NUMBERS_PER_POSE;
use super::eight::{Centers, LANES};
use super::in_cells::{BodyInCells, Group};
use super::link;
use super::look::{FoundGroup, Look};
use super::placement::{CellsFromLink, EightTransforms, LinkPose};
use super::points;
use crate::util::bits::for_each_bit;
use crate::voxel::VoxelKey;

/// A sphere of which the field does not say whether it meets a voxel.
#[derive(Debug, Clone, Copy)]
struct OpenSphere {
    center: [f64; 3],
    radius: f64,
}

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
    open: Vec<OpenSphere>,
}

/// Where the field says what a configuration needs to know.
#[derive(Debug, Default)]
pub(super) struct Aim<'a, 'f> {
    /// The balls around the links, eight at a time.
    balls: Vec<FoundGroup<'f>>,
    /// The spheres of links that are not clear: the first so many. The others are from before.
    groups: Vec<AimedGroup<'a, 'f>>,
    count: usize,
}

#[derive(Debug)]
struct AimedGroup<'a, 'f> {
    group: &'a Group,
    centers: Centers,
    found: FoundGroup<'f>,
}

impl<'a, 'f> Aim<'a, 'f> {
    /// The place for one more group.
    #[inline(always)]
    fn next(&mut self, group: &'a Group) -> &mut AimedGroup<'a, 'f> {
        if self.count == self.groups.len() {
            let (centers, found) = ([[0.0; LANES]; 3], FoundGroup::NOTHING);
            self.groups.push(AimedGroup { group, centers, found });
        }
        self.count += 1;
        let aimed = &mut self.groups[self.count - 1];
        aimed.group = group;
        aimed
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
        Self { body, cells_per_m, poses: &[], transforms: Vec::new(), near: Vec::new(), open: Vec::new() }
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
    fn note_near(&mut self, look: &mut Look<'_>) {
        self.near.clear();
        for (eight, (balls, transforms)) in self.body.balls.iter().zip(&self.transforms).enumerate() {
            let judged = look.judge(balls, &balls.centers_of_each(transforms));
            for_each_bit(u64::from(judged.meets | judged.is_open), |lane| {
                self.near.push(eight * LANES + lane as usize);
            });
        }
    }

    /// True where the body meets a voxel.
    #[inline(always)]
    pub(super) fn meets(&mut self, look: &mut Look<'_>) -> Option<bool> {
        let mut aim = Aim::default();
        self.find_balls(look, &mut aim);
        self.find_spheres(look, &mut aim);
        self.meets_found(look, &aim)
    }

    /// The first step of [`Configuration::meets`]: finds the balls around the links in the field.
    #[inline(always)]
    pub(super) fn find_balls<'f>(&mut self, look: &mut Look<'f>, aim: &mut Aim<'a, 'f>) {
        aim.balls.resize(self.body.balls.len(), FoundGroup::NOTHING);
        let balls = self.body.balls.iter().zip(&self.transforms);
        for ((balls, transforms), found) in balls.zip(&mut aim.balls) {
            look.find(balls, &balls.centers_of_each(transforms), found);
        }
    }

    /// The second step: finds the spheres of links that are not clear.
    #[inline(always)]
    pub(super) fn find_spheres<'f>(&mut self, look: &mut Look<'f>, aim: &mut Aim<'a, 'f>) {
        self.near.clear();
        aim.count = 0;
        for (eight, (balls, found)) in self.body.balls.iter().zip(&aim.balls).enumerate() {
            let judged = look.judge_found(balls, found);
            for_each_bit(u64::from(judged.meets | judged.is_open), |lane| {
                self.near.push(eight * LANES + lane as usize);
            });
        }
        for &number in &self.near {
            let cells_from_link = self.cells_from_link(number);
            for group in &self.body.links[number].groups {
                let aimed = aim.next(group);
                aimed.centers = group.centers(&cells_from_link);
                look.find(group, &aimed.centers, &mut aimed.found);
            }
        }
    }

    /// The last step: reads what was found.
    #[inline(always)]
    pub(super) fn meets_found(&mut self, look: &mut Look<'_>, aim: &Aim<'_, '_>) -> Option<bool> {
        self.open.clear();
        let mut unmade = 0;
        for AimedGroup { group, centers, found } in &aim.groups[..aim.count] {
            let judged = look.judge_found(group, found);
            if judged.meets != 0 {
                return Some(true);
            }
            unmade |= judged.unmade;
            for_each_bit(u64::from(judged.is_open), |lane| {
                let (center, radius) = (link::lane_of(centers, lane as usize), group.radius[lane as usize]);
                self.open.push(OpenSphere { center, radius });
            });
        }
        if look.waits_for(unmade) {
            return None;
        }
        Some(self.open_meets(look) || self.points_meet(look))
    }

    #[inline(always)]
    fn open_meets(&self, look: &Look<'_>) -> bool {
        for sphere in &self.open {
            if look.meets(sphere.center, sphere.radius) {
                return true;
            }
        }
        false
    }

    fn points_meet(&self, look: &mut Look<'_>) -> bool {
        self.near.iter().any(|&number| {
            let pose = LinkPose::of(&self.poses[number]);
            points::meet(look, &self.body.links[number], &pose, &self.cells_from_link(number))
        })
    }

    /// What the body meets first: in the order of links, in a link spheres before points.
    pub(super) fn first_hit(&mut self, look: &mut Look<'_>) -> Option<Option<FirstHit>> {
        self.note_near(look);
        let mut unmade = 0;
        for &number in &self.near {
            let (link, cells_from_link) = (&self.body.links[number], self.cells_from_link(number));
            let hit = link::first_sphere(look, link, &cells_from_link, &mut unmade);
            if look.waits_for(unmade) {
                continue;
            }
            let hit = hit.or_else(|| {
                let spheres = link.spheres;
                let hit =
                    points::first_hit(look, link, &LinkPose::of(&self.poses[number]), &cells_from_link)?;
                Some((spheres + hit.point, hit.voxel))
            });
            if let Some((part, voxel)) = hit {
                return Some(Some(FirstHit { link: number, part, voxel }));
            }
        }
        (!look.waits_for(unmade)).then_some(None)
    }

    /// The distance from the body to the nearest voxel, cells, 0 where they meet; `most` where that is more.
    pub(super) fn nearest(&mut self, look: &mut Look<'_>, most: f64) -> Option<NearestLink> {
        let (mut unmade, mut upper) = (0, most);
        for (number, link) in self.body.links.iter().enumerate() {
            let cells_from_link = self.cells_from_link(number);
            upper = upper.min(link::upper_bound(look, link, &cells_from_link, &mut unmade));
        }
        if look.waits_for(unmade) {
            return None;
        }
        let mut nearest = NearestLink { distance: most, link: None };
        for (number, link) in self.body.links.iter().enumerate() {
            // What is further than something else is known to be is passed over.
            let bound = upper.max(0.0).min(nearest.distance);
            let distance = link::nearest(look, link, &self.cells_from_link(number), bound);
            if let Some(distance) = distance.filter(|distance| *distance < nearest.distance) {
                nearest = NearestLink { distance, link: Some(number) };
            }
        }
        Some(nearest)
    }
}
