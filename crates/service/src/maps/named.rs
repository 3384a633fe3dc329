//! The maps of a catalog by name: those that are open, and those that could not be opened.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::hosted_map::HostedMap;
use mrol_map::map::MapName;
use mrol_store::StoreError;

/// What the names stand for.
#[derive(Debug, Default)]
pub(super) struct Named {
    pub(super) open: BTreeMap<MapName, Arc<HostedMap>>,
    /// Why it could not be opened.
    pub(super) unavailable: BTreeMap<MapName, String>,
}

impl Named {
    pub(super) fn set_unavailable(&mut self, name: MapName, error: &StoreError) {
        tracing::error!(map = %name, %error, "cannot be opened: the map is unavailable, the others are served");
        self.unavailable.insert(name, error.to_string());
    }
}
