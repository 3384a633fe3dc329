//! The whole of what a map holds, for watches that begin.

use std::collections::BTreeMap;
use std::sync::{Arc, Weak};

use mrol_map::map::{ContentVersion, KeepOuts};
use mrol_map::sync::{Mutex, Rank};
use mrol_map::visibility::ViewpointSet;
use mrol_map::voxel::VoxelSet;

/// The voxels of a level, the keep-outs and the viewpoints at one revision. Those who begin to watch at about the same
/// time share it.
#[derive(Debug)]
pub(crate) struct FullState {
    pub(crate) version: ContentVersion,
    pub(crate) level: u32,
    pub(crate) voxels: VoxelSet,
    pub(crate) keep_outs: Arc<KeepOuts>,
    pub(crate) viewpoints: Arc<ViewpointSet>,
}

/// The states that somebody is being told of, by their form.
#[derive(Debug)]
pub(crate) struct FullStates(Mutex<BTreeMap<Option<u32>, Weak<FullState>>>);

impl Default for FullStates {
    fn default() -> Self {
        Self(Mutex::new(Rank::Brief, BTreeMap::new()))
    }
}

impl FullStates {
    /// The state that was put there last under `key`, while somebody holds it.
    pub(crate) fn get(&self, key: Option<u32>) -> Option<Arc<FullState>> {
        self.0.lock().get(&key).and_then(Weak::upgrade)
    }

    /// Puts a state there.
    pub(crate) fn put(&self, key: Option<u32>, state: &Arc<FullState>) {
        let mut states = self.0.lock();
        states.retain(|_, state| state.strong_count() > 0);
        states.insert(key, Arc::downgrade(state));
    }
}
