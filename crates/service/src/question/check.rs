//! What checks of bodies have in common: how they are answered, and what is in the answer.

use super::pieces::Joined;
use crate::error::{Reason, ServiceError};
use crate::limits::Limits;
use mrol_map::planning::{Clearance, Hit, PlanningError, PlanningView, clearance_max_m};

/// How a check is answered.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum CheckAs {
    /// By a bit: does it meet a voxel?
    #[default]
    Colliding,
    /// By what it meets first.
    FirstHit,
    /// By how far the nearest voxel is.
    Clearance {
        /// Up to where it is told, meters; up to 64 voxels of the level without.
        most_m: Option<f32>,
    },
}

/// The answer to a check of configurations, or of groups of spheres.
#[derive(Debug, Clone, PartialEq)]
pub enum Collisions {
    /// Whether each meets a voxel.
    Colliding {
        /// Number i is bit i % 64 of word i / 64.
        words: Vec<u64>,
        /// How many were checked.
        checked: usize,
    },
    /// What each meets first, where it meets something.
    FirstHits(Vec<Option<Hit>>),
    /// How much room each has.
    Clearances(Vec<Clearance>),
}

impl Collisions {
    /// How many were checked.
    pub fn checked(&self) -> usize {
        match self {
            Self::Colliding { checked, .. } => *checked,
            Self::FirstHits(hits) => hits.len(),
            Self::Clearances(clearances) => clearances.len(),
        }
    }

    /// How much room number `i` has, meters; 0 where that was not asked for.
    pub(super) fn clearance_m(&self, i: usize) -> f64 {
        match self {
            Self::Colliding { .. } | Self::FirstHits(_) => 0.0,
            Self::Clearances(clearances) => clearances.get(i).map_or(0.0, |of| f64::from(of.distance_m)),
        }
    }

    /// Whether each meets a voxel or a keep-out: number i is bit i % 64 of word i / 64.
    pub fn words(&self) -> Vec<u64> {
        let pack = |bits: &mut dyn Iterator<Item = bool>| {
            let mut words = vec![0; self.checked().div_ceil(64)];
            bits.enumerate().for_each(|(i, bit)| words[i / 64] |= u64::from(bit) << (i % 64));
            words
        };
        match self {
            Self::Colliding { words, .. } => words.clone(),
            Self::FirstHits(hits) => pack(&mut hits.iter().map(Option::is_some)),
            Self::Clearances(clearances) => pack(&mut clearances.iter().map(|of| of.distance_m == 0.0)),
        }
    }
}

/// Bytes of one check in an answer, at most: a link, a part, a voxel, the number of a keep-out, and a bit.
pub(super) const BYTES_EACH: usize = 21;

/// Up to where clearances are told, meters.
pub(super) fn clearance_most_m(view: &PlanningView<'_>, level: u32, most_m: Option<f32>) -> f32 {
    most_m.unwrap_or_else(|| clearance_max_m(view.lattice(), level))
}

/// Refuses more regions to ignore than may be.
pub(super) fn check_ignored(regions: usize, limits: &Limits) -> Result<(), ServiceError> {
    if regions <= limits.ignored_regions_max {
        return Ok(());
    }
    let message =
        format!("ignored has {regions} regions, ignored_regions_max is {}", limits.ignored_regions_max);
    Err(ServiceError::new(Reason::BatchTooLarge, message))
}

impl Joined for Collisions {
    fn join(&mut self, next: Self) {
        match (self, next) {
            (Self::Colliding { words, checked }, Self::Colliding { words: more, checked: count }) => {
                words.extend(more);
                *checked += count;
            }
            (Self::FirstHits(hits), Self::FirstHits(more)) => hits.extend(more),
            (Self::Clearances(clearances), Self::Clearances(more)) => clearances.extend(more),
            // One question is answered in one way.
            (Self::Colliding { .. } | Self::FirstHits(_) | Self::Clearances(_), _) => {}
        }
    }

    fn reserve(&mut self, elements: usize) {
        match self {
            Self::Colliding { words, .. } => words.reserve_exact(elements.div_ceil(64)),
            Self::FirstHits(hits) => hits.reserve_exact(elements),
            Self::Clearances(clearances) => clearances.reserve_exact(elements),
        }
    }
}

impl From<PlanningError> for ServiceError {
    fn from(error: PlanningError) -> Self {
        let reason = match error {
            PlanningError::BodyRange { .. } | PlanningError::SphereRange { .. } => Reason::PointOutOfRange,
            _ => Reason::BadCheck,
        };
        Self::new(reason, error.to_string())
    }
}
