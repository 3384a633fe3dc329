//! A look at a level: the field where it decides, the voxels themselves where it does not.

use super::clearance::{FieldBlockKey, Fields};
use super::cubes::{CubeSearch, NearestCube};
use super::eight::{self, Bounds, Centers, LANES};
use super::in_cells::Group;
use super::nearby;
use super::surroundings::Surroundings;
use crate::map::MapView;
use crate::voxel::{BLOCK_LEVELS, VoxelKey};

/// What lies between the nearest voxels of a level and of a coarser one, in cells of the coarser: a diagonal.
const DIAGONAL: f32 = 1.7321;

/// Level, field and voxels, as a question reads them.
#[derive(Debug)]
pub(super) struct Look<'a> {
    pub(super) view: &'a MapView<'a>,
    pub(super) surroundings: &'a Surroundings,
    pub(super) level: u32,
    fields: &'a Fields,
    /// Blocks of the field that were asked for and are not made.
    unmade: Vec<FieldBlockKey>,
    /// True where what is not made is not waited for: the voxels answer.
    pub(super) is_last: bool,
}

/// What the field says of eight spheres.
#[derive(Debug, Clone, Copy)]
pub(super) struct Judgment {
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

impl<'a> Look<'a> {
    pub(super) fn new(
        view: &'a MapView<'a>,
        surroundings: &'a Surroundings,
        level: u32,
        fields: &'a Fields,
        is_last: bool,
    ) -> Self {
        Self { view, surroundings, level, fields, unmade: Vec::new(), is_last }
    }

    /// The blocks that were asked for and are not made, each once.
    pub(super) fn into_unmade(self) -> Vec<FieldBlockKey> {
        let mut unmade = self.unmade;
        unmade.sort_unstable();
        unmade.dedup();
        unmade
    }

    /// What the field says of the spheres of `group` with these centers, cells.
    #[inline(always)]
    pub(super) fn judge(&mut self, group: &Group, centers: &Centers) -> Judgment {
        let Bounds { lower, upper, unmade } = self.bounds(group.coarser_by, centers);
        let (mut meets, mut is_clear) = (0u8, 0u8);
        let (mut low, mut high) = ([0f32; LANES], [0f32; LANES]);
        for lane in 0..LANES {
            low[lane] = lower[lane] - group.radius_high[lane];
            high[lane] = upper[lane] - group.radius_low[lane];
        }
        for lane in 0..LANES {
            is_clear |= u8::from(low[lane] > 0.0) << lane;
            meets |= u8::from(high[lane] < 0.0) << lane;
        }
        if self.surroundings.ignores_some() {
            // The nearest voxel may be one that does not count.
            (meets, high) = (0, [f32::INFINITY; LANES]);
        }
        Judgment { meets, is_open: !(meets | is_clear), unmade: unmade & !is_clear, lower: low, upper: high }
    }

    /// Bounds of the distances to the nearest voxel, cells, by the field of a level so many levels coarser.
    #[inline(always)]
    fn bounds(&mut self, coarser_by: u32, centers: &Centers) -> Bounds {
        if coarser_by == 0 {
            let mut bounds = eight::bounds(self.fields.level(self.level), centers, 1.0);
            if bounds.unmade != 0 {
                bounds.unmade = self.note_unmade(0, centers, bounds.unmade);
            }
            return bounds;
        }
        self.coarse_bounds(coarser_by, centers)
    }

    /// Notes what is to be made; the lanes of which there is something to make.
    #[cold]
    fn note_unmade(&mut self, coarser_by: u32, centers: &Centers, lanes: u8) -> u8 {
        let (scale, mut noted) = (1.0 / f64::from(1u32 << coarser_by), 0);
        for lane in (0..LANES).filter(|lane| lanes >> lane & 1 == 1) {
            if let Some(index) = eight::cell(centers, scale, lane) {
                let block = VoxelKey::pack(index.map(|i| i >> BLOCK_LEVELS));
                self.unmade.push(FieldBlockKey { level: self.level + coarser_by, block });
                noted |= 1 << lane;
            }
        }
        noted
    }

    #[inline(never)]
    fn coarse_bounds(&mut self, coarser_by: u32, centers: &Centers) -> Bounds {
        let coarser_by = coarser_by.min(self.view.map().block_levels_end() - self.level);
        let side = (1u32 << coarser_by) as f32;
        let field = self.fields.level(self.level + coarser_by);
        let Bounds { lower, upper, mut unmade } = eight::bounds(field, centers, 1.0 / f64::from(side));
        if unmade != 0 {
            unmade = self.note_unmade(coarser_by, centers, unmade);
        }
        // A coarse voxel holds a fine one, and goes no further than that by more than its diagonal.
        Bounds {
            lower: lower.map(|lower| lower * side),
            upper: upper.map(|upper| (upper + DIAGONAL) * side),
            unmade,
        }
    }

    /// True where the field is not made and is waited for.
    #[inline(always)]
    pub(super) fn waits_for(&self, unmade: u8) -> bool {
        unmade != 0 && !self.is_last
    }

    /// True where a ball meets a voxel, exactly.
    #[inline(always)]
    pub(super) fn meets(&self, center: [f64; 3], radius: f64) -> bool {
        let by_field = if self.surroundings.ignores_some() {
            None
        } else {
            nearby::meets(self.fields.level(self.level), center, radius)
        };
        by_field.unwrap_or_else(|| self.search(center).meets(radius))
    }

    /// The nearest voxel that is at most `radius` cells away.
    pub(super) fn nearest(&self, center: [f64; 3], radius: f64) -> Option<NearestCube> {
        self.search(center).nearest(radius)
    }

    fn search(&self, center: [f64; 3]) -> CubeSearch<'_> {
        CubeSearch::new(self.view, self.surroundings, self.level, center)
    }

    /// A lower bound of the distance from a point to the nearest voxel, cells, by fields of ever coarser levels until one
    /// knows or the bound is at least `enough`.
    pub(super) fn far_lower_bound(&mut self, center: [f64; 3], enough: f64) -> f64 {
        let centers = center.map(|c| [c; LANES]);
        let end = self.view.map().block_levels_end() - self.level;
        let mut best = 0.0f64;
        for coarser_by in (BLOCK_LEVELS..=end).step_by(BLOCK_LEVELS as usize) {
            let bounds = self.coarse_bounds(coarser_by, &centers);
            best = best.max(f64::from(bounds.lower[0]));
            if best >= enough || bounds.upper[0].is_finite() || bounds.unmade != 0 {
                break;
            }
        }
        best
    }
}
