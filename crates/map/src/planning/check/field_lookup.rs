//! The look-up of a question at a level: the field where it decides, the voxels themselves where it does not.

use crate::map::MapView;
use crate::planning::body::Group;
use crate::planning::clearance::{
    BallState, Bounds, Centers, CubeSearch, FieldBlockKey, Fields, Found, LANES, NearestCube, eight_points,
    small_balls,
};
use crate::planning::effort::Effort;
use crate::planning::unknown::{FreeSpace, Surroundings};
use crate::util::StopSignal;
use crate::voxel::{BLOCK_LEVELS, VoxelKey};

/// Most blocks of the field that are made after one round.
pub(in crate::planning) const UNMADE_MAX: usize = 4096;

/// A coarse voxel holds a fine one, which is no further away than the coarse one and its diagonal, in coarse cells.
const DIAGONAL: f32 = 1.7321;

/// Level, field and voxels, as a question reads them.
#[derive(Debug)]
pub(super) struct FieldLookup<'a> {
    pub(super) view: &'a MapView<'a>,
    pub(super) surroundings: &'a Surroundings,
    pub(super) level: u32,
    /// Coarser levels that have a field.
    levels_above: u32,
    fields: &'a Fields,
    /// Blocks of the field that were asked for and are not made; some more than once.
    unmade: Vec<FieldBlockKey>,
    /// True once so many are to be made that the rest has to wait.
    is_full: bool,
    /// True in the last round: blocks that are not made are not waited for, the exact search of the voxels answers
    /// instead.
    pub(super) is_last: bool,
    effort: Effort<'a>,
}

/// Where the field of a level, or of a coarser one, says of eight points how far the nearest voxel is.
#[derive(Debug, Clone, Copy)]
pub(super) struct FoundGroup<'f> {
    found: Found<'f>,
    /// Cells of the level that is asked along a cell of the field.
    side: f32,
    /// How much further than the nearest voxel of the field that of the level may be, cells of the field.
    beyond: f32,
    /// The lanes of which the field would say more if it were made.
    unmade: u8,
}

impl FoundGroup<'_> {
    /// Nothing was looked for yet.
    pub(super) const NOTHING: Self = Self { found: Found::NOTHING, side: 1.0, beyond: 0.0, unmade: 0 };

    /// Bounds of the distances, in cells of the level that is asked.
    #[inline(always)]
    fn bounds(&self) -> Bounds {
        let Bounds { mut lower, mut upper } = self.found.bounds();
        for lane in 0..LANES {
            lower[lane] *= self.side;
            upper[lane] = (upper[lane] + self.beyond) * self.side;
        }
        Bounds { lower, upper }
    }
}

/// What the field says of eight spheres: bounds of their distances, and which of them meet a voxel.
#[derive(Debug, Clone, Copy)]
pub(super) struct SphereBounds {
    /// The spheres that meet a voxel.
    pub(super) meets: u8,
    /// Those of which the field does not say.
    pub(super) is_open: u8,
    /// Those whose part of the field is not made; they are open too.
    pub(super) unmade: u8,
    /// Bounds of the distances from the surfaces of the spheres to the nearest voxel, cells.
    pub(super) lower: [f32; LANES],
    pub(super) upper: [f32; LANES],
}

impl<'a> FieldLookup<'a> {
    pub(super) fn new(
        view: &'a MapView<'a>,
        surroundings: &'a Surroundings,
        level: u32,
        fields: &'a Fields,
        is_last: bool,
        stop: StopSignal<'a>,
    ) -> Self {
        // What is free at a level does not tell what is at a finer one: fields of coarser levels say nothing of this
        // one then.
        let levels_above =
            if surroundings.unknown_counts() { 0 } else { view.map().block_levels_end() - level };
        let (unmade, effort) = (Vec::new(), Effort::until(stop));
        Self { view, surroundings, level, levels_above, fields, unmade, is_full: false, is_last, effort }
    }

    /// The blocks that were asked for and are not made, each once; at most [`UNMADE_MAX`].
    pub(super) fn into_unmade(mut self) -> Vec<FieldBlockKey> {
        self.leave_each_once();
        self.unmade
    }

    fn leave_each_once(&mut self) {
        self.unmade.sort_unstable();
        self.unmade.dedup();
    }

    /// Notes a block that is to be made, where there is room for it.
    fn note(&mut self, block: FieldBlockKey) {
        if self.unmade.last() == Some(&block) || self.is_full {
            return;
        }
        self.unmade.push(block);
        if self.unmade.len() == UNMADE_MAX {
            self.leave_each_once();
            self.is_full = self.unmade.len() > UNMADE_MAX / 2;
        }
    }

    /// True once the question is to end, or what it waits for has to be made first: the answers are none then.
    #[inline(always)]
    pub(super) fn is_over(&self) -> bool {
        self.effort.is_stopped() || self.is_full && !self.is_last
    }

    /// True where not all of what it waits for could be noted.
    pub(super) fn is_full(&self) -> bool {
        self.is_full
    }

    /// True once the question is to end.
    pub(super) fn is_stopped(&self) -> bool {
        self.effort.is_stopped()
    }

    /// Classifies the spheres of `group` with these centers, cells, by what the field says of them.
    #[inline(always)]
    pub(super) fn classify_spheres(&mut self, group: &Group, centers: &Centers) -> SphereBounds {
        let mut found = FoundGroup::NOTHING;
        self.find(group, centers, &mut found);
        self.classify_found(group, &found)
    }

    /// Finds where the field says it.
    #[inline(always)]
    pub(super) fn find(&mut self, group: &Group, centers: &Centers, found: &mut FoundGroup<'a>) {
        self.find_in(group.coarser_by, centers, found);
    }

    /// [`FieldLookup::find`] in the field of a level so many levels coarser, or of the coarsest.
    #[inline(always)]
    fn find_in(&mut self, coarser_by: u32, centers: &Centers, found: &mut FoundGroup<'a>) {
        self.effort.spend(1);
        let coarser_by = coarser_by.min(self.levels_above);
        let side = (1u32 << coarser_by) as f32;
        (found.side, found.beyond) = (side, if coarser_by == 0 { 0.0 } else { DIAGONAL });
        let field = self.fields.level(self.surroundings.unknown, self.level + coarser_by);
        eight_points::find(field, centers, 1.0 / f64::from(side), &mut found.found);
        found.unmade = 0;
        if found.found.unknown != 0 {
            found.unmade = self.note_unmade(coarser_by, centers, found.found.unknown);
        }
    }

    /// Classifies the spheres of `group` by what the field says where they were found.
    #[inline(always)]
    pub(super) fn classify_found(&self, group: &Group, found: &FoundGroup<'_>) -> SphereBounds {
        let Bounds { lower, upper } = found.bounds();
        let (mut low, mut high) = ([0f32; LANES], [0f32; LANES]);
        for lane in 0..LANES {
            low[lane] = lower[lane] - group.radius_high[lane];
            high[lane] = upper[lane] - group.radius_low[lane];
        }
        // Rounding is allowed for on the way: what is clear by nothing is clear.
        let (mut meets, is_near) =
            (eight_points::lanes_below_zero(&high), eight_points::lanes_below_zero(&low));
        if self.surroundings.ignores_some() {
            // The nearest voxel may be one that does not count.
            (meets, high) = (0, [f32::INFINITY; LANES]);
        }
        let unmade = found.unmade & is_near;
        SphereBounds { meets, is_open: is_near & !meets, unmade, lower: low, upper: high }
    }

    /// Notes what is to be made; the lanes of which there is something to make.
    #[cold]
    fn note_unmade(&mut self, coarser_by: u32, centers: &Centers, lanes: u8) -> u8 {
        let (scale, mut noted) = (1.0 / f64::from(1u32 << coarser_by), 0);
        for lane in (0..LANES).filter(|lane| lanes >> lane & 1 == 1) {
            if let Some(index) = eight_points::cell(centers, scale, lane) {
                let block = VoxelKey::pack(index.map(|i| i >> BLOCK_LEVELS));
                self.note(FieldBlockKey {
                    unknown: self.surroundings.unknown,
                    level: self.level + coarser_by,
                    block,
                });
                noted |= 1 << lane;
            }
        }
        noted
    }

    /// True where the field is not made and is waited for.
    #[inline(always)]
    pub(super) fn waits_for(&self, unmade: u8) -> bool {
        unmade != 0 && !self.is_last
    }

    /// True where a ball meets a voxel, exactly. Where the field is not made, the voxels answer, and it will be.
    #[inline(always)]
    pub(super) fn meets(&mut self, center: [f64; 3], radius: f64) -> bool {
        if !self.surroundings.ignores_some() {
            match small_balls::ask(self.fields.level(self.surroundings.unknown, self.level), center, radius) {
                BallState::Meets => return true,
                BallState::IsFree => return false,
                BallState::Unknown => {}
                BallState::Unmade(cell) => {
                    let block = VoxelKey::pack(cell.map(|i| i >> BLOCK_LEVELS));
                    self.note(FieldBlockKey { unknown: self.surroundings.unknown, level: self.level, block });
                }
            }
        }
        self.search(center).meets(radius)
    }

    /// True where `voxel` counts.
    pub(super) fn counts(&self, voxel: VoxelKey) -> bool {
        let is_obstacle = self.view.contains(voxel, self.level)
            || self.surroundings.unknown_counts()
                && !FreeSpace::of(self.view).is_seen_through(voxel, self.level);
        is_obstacle && !self.surroundings.ignores(self.view.map().lattice(), voxel, self.level)
    }

    /// The nearest voxel that is at most `radius` cells away.
    pub(super) fn nearest(&mut self, center: [f64; 3], radius: f64) -> Option<NearestCube> {
        self.search(center).nearest(radius)
    }

    fn search(&mut self, center: [f64; 3]) -> CubeSearch<'_, 'a> {
        let Self { view, surroundings, level, fields, effort, .. } = self;
        let field = fields.level(surroundings.unknown, *level);
        CubeSearch::new(view, surroundings, (*level, field), center, effort)
    }

    /// A lower bound of the distance from a point to the nearest voxel, cells, by fields of ever coarser levels until
    /// one knows or the bound is at least `enough`.
    pub(super) fn far_lower_bound(&mut self, center: [f64; 3], enough: f64) -> f64 {
        let centers = center.map(|c| [c; LANES]);
        let mut best = 0.0f64;
        for coarser_by in (BLOCK_LEVELS..=self.levels_above).step_by(BLOCK_LEVELS as usize) {
            let mut found = FoundGroup::NOTHING;
            self.find_in(coarser_by, &centers, &mut found);
            let bounds = found.bounds();
            best = best.max(f64::from(bounds.lower[0]));
            if best >= enough || bounds.upper[0].is_finite() || found.unmade != 0 {
                break;
            }
        }
        best
    }
}
