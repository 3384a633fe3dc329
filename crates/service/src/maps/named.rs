//! The maps of a catalog by name: those that are open, those that sleep, and those that could not be opened.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::asleep::Asleep;
use super::hosted_map::HostedMap;
use mrol_map::map::MapName;
use mrol_store::StoreError;

/// What the names stand for. Each stands for one thing.
#[derive(Debug, Default)]
pub(super) struct Named {
    pub(super) open: BTreeMap<MapName, Arc<HostedMap>>,
    /// Maps whose files have all of them, and memory nothing.
    pub(super) asleep: BTreeMap<MapName, Arc<Asleep>>,
    /// Why it could not be opened.
    pub(super) unavailable: BTreeMap<MapName, String>,
}

/// A map that is served.
#[derive(Debug)]
pub(super) enum Place {
    Awake(Arc<HostedMap>),
    Asleep(Arc<Asleep>),
}

impl Named {
    pub(super) fn set_unavailable(&mut self, name: MapName, error: &StoreError) {
        tracing::error!(map = %name, %error, "cannot be opened: the map is unavailable, the others are served");
        self.asleep.remove(&name);
        self.unavailable.insert(name, error.to_string());
    }

    /// The map of that name; none that is served.
    pub(super) fn find(&self, name: &MapName) -> Option<Place> {
        let awake = self.open.get(name).map(|map| Place::Awake(Arc::clone(map)));
        awake.or_else(|| self.asleep.get(name).map(|map| Place::Asleep(Arc::clone(map))))
    }

    /// Number of names that are taken.
    pub(super) fn len(&self) -> usize {
        self.open.len() + self.asleep.len() + self.unavailable.len()
    }

    /// The names that are taken, in no order.
    pub(super) fn taken(&self) -> impl Iterator<Item = &MapName> {
        self.open.keys().chain(self.asleep.keys()).chain(self.unavailable.keys())
    }
}
