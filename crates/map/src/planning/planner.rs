//! A map with the fields that make its answers fast.

use std::sync::Arc;

use super::clearance::{FIELD_BYTES_MAX_DEFAULT, FieldBlockKey, Fields};
use super::error::PlanningError;
use super::keep_outs::Shapes;
use super::unknown::{Obstacles, SeenBlocks, Unknown};
use crate::map::{BlockFollower, ContentVersion, LongRead, MapView, MultiResolutionMap};
use crate::sync::{Rank, RwLock, RwLockReadGuard};
use crate::util::StopSignal;
use crate::visibility::ViewpointSet;
use crate::voxel::Lattice;

/// Blocks that are made between two checks of the stop signal.
const MADE_PER_STOP_CHECK: usize = 32;

/// Answers planners' questions about a map.
///
/// It keeps distance fields beside the map: made where they are asked for, renewed where the map changed, bounded in
/// memory. A map without a planner costs nothing for it. Dropping the planner gives the memory back.
#[derive(Debug)]
pub struct Planner {
    pub(super) map: Arc<MultiResolutionMap>,
    fields: RwLock<Fields>,
    follower: BlockFollower,
}

/// A planner's map at one revision.
#[derive(Debug)]
pub struct PlanningView<'a> {
    pub(super) planner: &'a Planner,
    pub(super) view: MapView<'a>,
    pub(super) may_wait: bool,
    _changes_wait: LongRead<'a>,
}

impl Planner {
    /// A planner of `map` with fields of at most [`FIELD_BYTES_MAX_DEFAULT`] bytes.
    pub fn new(map: Arc<MultiResolutionMap>) -> Self {
        Self::with_field_bytes(map, FIELD_BYTES_MAX_DEFAULT)
    }

    /// A planner of `map` whose fields hold at most `field_bytes_max` bytes, but for what a question needs at once.
    /// Less is slower, and as exact.
    pub fn with_field_bytes(map: Arc<MultiResolutionMap>, field_bytes_max: usize) -> Self {
        let follower = map.follow_blocks();
        let fields = Fields::new(map.block_levels_end() + 1, field_bytes_max);
        Self { map, fields: RwLock::new(Rank::Fields, fields), follower }
    }

    /// The map.
    pub fn map(&self) -> &Arc<MultiResolutionMap> {
        &self.map
    }

    /// Bytes of memory that the fields hold; the map counts them among its own.
    pub fn field_bytes(&self) -> usize {
        self.fields.read().bytes()
    }

    /// Locks the whole map for questions. Changes wait for it, as for [`MultiResolutionMap::long_read`].
    pub fn view(&self) -> PlanningView<'_> {
        let changes_wait = self.map.long_read();
        let view = self.map.view();
        self.catch_up(&view);
        PlanningView { planner: self, view, may_wait: true, _changes_wait: changes_wait }
    }

    /// [`Planner::view`] for threads that may not wait: none where a lock has to be waited for, or the fields are to be
    /// mended after a change. A question that needs a part of the fields which is not made yet then has no answer, as
    /// if it had been stopped.
    pub fn try_view(&self) -> Option<PlanningView<'_>> {
        let changes_wait = self.map.try_long_read()?;
        let view = self.map.try_view()?;
        let is_ready = self.follower.is_up_to_date();
        is_ready.then_some(PlanningView { planner: self, view, may_wait: false, _changes_wait: changes_wait })
    }

    /// Forgets what is not true any more.
    ///
    /// Nothing changes while the view of the whole map is held. What changed is taken under the fields' lock, so that
    /// whoever finds nothing to take finds the fields mended too.
    fn catch_up(&self, view: &MapView<'_>) {
        if self.follower.is_up_to_date() {
            return;
        }
        let mut fields = self.fields.write();
        let touched = self.follower.take();
        fields.forget(&touched, view);
        self.follower.set_bytes(fields.bytes());
    }

    /// Forgets what is not true any more where unknown voxels count, since scans saw more or were undone.
    fn see(&self, viewpoints: &Arc<ViewpointSet>) {
        if self.fields.read().are_of(Some(viewpoints)) {
            return;
        }
        let mut fields = self.fields.write();
        fields.see(viewpoints, self.map.lattice());
        self.follower.set_bytes(fields.bytes());
    }
}

impl PlanningView<'_> {
    /// The revision of all answers, with the hash of what the map holds then.
    pub fn version(&self) -> ContentVersion {
        self.view.version()
    }

    /// The lattices of the map's levels.
    pub fn lattice(&self) -> &Lattice {
        self.planner.map.lattice()
    }

    /// This view with the keep-outs of the map, which count beside the voxels.
    #[must_use]
    pub fn with_keep_outs(self) -> Self {
        Self { view: self.view.with_keep_outs(), ..self }
    }

    /// [`PlanningView::with_keep_outs`] where no lock has to be waited for; none elsewhere.
    pub fn try_with_keep_outs(self) -> Option<Self> {
        Some(Self { view: self.view.try_with_keep_outs()?, ..self })
    }

    /// This view with where scans saw through, without which all that is not occupied is unknown.
    #[must_use]
    pub fn with_viewpoints(self) -> Self {
        let view = self.view.with_viewpoints();
        if let Some(viewpoints) = view.viewpoints() {
            self.planner.see(viewpoints);
        }
        Self { view, ..self }
    }

    /// The keep-outs that count; none where none do.
    pub(super) fn shapes(&self) -> Option<Shapes<'_>> {
        Shapes::of(&self.view)
    }

    /// Cells of `level` a meter.
    ///
    /// # Errors
    /// For a level that the map has not.
    pub(super) fn cells_per_m(&self, level: u32) -> Result<f64, PlanningError> {
        let lattice = self.planner.map.lattice();
        let level_max = lattice.levels() - 1;
        if level > level_max {
            return Err(PlanningError::Level { level, level_max });
        }
        Ok(1.0 / lattice.resolution_m(level))
    }

    /// The fields; none where they have to be waited for and this view may not.
    pub(super) fn fields(&self) -> Option<RwLockReadGuard<'_, Fields>> {
        if self.may_wait { Some(self.planner.fields.read()) } else { self.planner.fields.try_read() }
    }

    /// True where fields are those of what this view shows.
    pub(super) fn holds(&self, fields: &Fields, unknown: Unknown) -> bool {
        unknown == Unknown::Free || fields.are_of(self.view.viewpoints())
    }

    /// Makes blocks of the field; once stopped, some of them.
    pub(super) fn make(&self, unmade: Vec<FieldBlockKey>, unknown: Unknown, stop: StopSignal<'_>) {
        if unmade.is_empty() {
            return;
        }
        let fields = self.planner.fields.read();
        let is_known = unknown == Unknown::Occupied && self.holds(&fields, unknown);
        let seen = if is_known { fields.seen_around(&unmade) } else { SeenBlocks::new() };
        drop(fields);
        let mut obstacles = Obstacles::of(&self.view, unknown, seen);
        let made = stop.paced(unmade, MADE_PER_STOP_CHECK).map(|key| (key, key.make(&mut obstacles)));
        let blocks = made.collect();
        let mut fields = self.planner.fields.write();
        if self.holds(&fields, unknown) {
            if unknown == Unknown::Occupied {
                fields.keep_seen(obstacles.into_seen());
            }
            fields.keep(blocks);
            self.planner.follower.set_bytes(fields.bytes());
        }
    }
}
