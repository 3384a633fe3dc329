//! How the whole of what a map holds is found out.

use std::sync::Arc;

use crate::service::full_state::FullState;
use crate::service::hosted_map::HostedMap;
use crate::service::resource_budget::ResourceBudget;
use crate::service::{BlockBytes, ServiceError, WatchForm, check_not_stopped};
use crate::util::StopSignal;

/// Whom memory is lent to, in refusals.
const WATCH: &str = "a watch";
/// Bytes of memory of a block.
const BLOCK_BYTES: usize = BlockBytes::OF_BLOCK;

impl HostedMap {
    /// What the map holds: as it is, or as it was shortly before where that is at hand and can be followed from. Those who
    /// watch a region share it with those who watch everything.
    pub(super) fn whole_state(
        &self,
        form: WatchForm,
        budget: &ResourceBudget,
        stop: StopSignal<'_>,
    ) -> Result<Arc<FullState>, ServiceError> {
        let (key, level) = match form {
            WatchForm::Changes => (None, 0),
            WatchForm::Deltas { level } => (Some(level), level),
        };
        if let Some(known) =
            self.full_states.get(key).filter(|state| self.recent.can_follow(state.version.revision, form))
        {
            return Ok(known);
        }
        let long_read = self.map.long_read();
        let view = long_read.view().with_keep_outs();
        let stored: usize = view.lists(level).map(|list| list.blocks().len()).sum();
        // Lent while it is made; then it lies in memory, and is measured there.
        let _lent = budget.reserve_transient((stored * BLOCK_BYTES) as u64, WATCH)?;
        let (voxels, version) = (view.level_blocks(level, stop), view.version());
        let keep_outs = view.keep_outs().cloned().unwrap_or_default();
        drop(view);
        drop(long_read);
        check_not_stopped(stop)?;
        let state = Arc::new(FullState { version, level, voxels, keep_outs });
        self.full_states.put(key, &state);
        Ok(state)
    }
}
