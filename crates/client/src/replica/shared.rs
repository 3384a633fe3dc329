//! State that the follower and the readers of a replica share.

use parking_lot::RwLock;
use tokio::sync::watch;

use super::copy::{Applied, Copied};

use super::status::ReplicaStatus;

/// What the follower and the readers share.
#[derive(Debug)]
pub(super) struct Shared {
    pub(super) copied: RwLock<Copied>,
    pub(super) status: watch::Sender<ReplicaStatus>,
}

impl Shared {
    pub(super) fn tell(&self, change: impl FnOnce(&mut ReplicaStatus)) {
        self.status.send_modify(change);
    }

    /// Shows readers what a message did.
    pub(super) fn take(&self, applied: Applied, head_revision: u64) {
        let is_reset = matches!(applied, Applied::Replaced(_));
        if let Applied::Replaced(copied) = applied {
            *self.copied.write() = copied;
        }
        let Copied { map, map_uuid, .. } = self.copied.read().clone();
        let version = map.content_version();
        self.tell(|status| {
            status.resets += u64::from(is_reset);
            (status.map_uuid, status.version) = (map_uuid, version);
            status.head_revision = head_revision.max(version.revision);
            (status.is_connected, status.last_error) = (true, None);
        });
    }
}
