//! State that the follower and the readers of a replica share.

use std::time::{Duration, Instant};

use parking_lot::{Mutex, RwLock};
use tokio::sync::watch;

use super::copy::{Applied, Copied};

use super::status::ReplicaStatus;
use mrol_service::{Reason, ServiceError};

/// What the follower and the readers share.
#[derive(Debug)]
pub(super) struct Shared {
    pub(super) copied: RwLock<Copied>,
    pub(super) status: watch::Sender<ReplicaStatus>,
    /// When the server last told something, if only that nothing changed.
    pub(super) heard: Mutex<Instant>,
}

impl Shared {
    pub(super) fn tell(&self, change: impl FnOnce(&mut ReplicaStatus)) {
        self.status.send_modify(change);
    }

    /// Notes that the server told something.
    pub(super) fn hear(&self) {
        *self.heard.lock() = Instant::now();
    }

    /// How long ago the server last told something.
    pub(super) fn age(&self) -> Duration {
        self.heard.lock().elapsed()
    }

    /// Refuses what is asked of a copy that is older than `most`.
    ///
    /// # Errors
    /// `Unavailable` with `replica_stale`.
    pub(super) fn check_age(&self, most: Option<Duration>) -> Result<(), ServiceError> {
        let age = self.age();
        let Some(most) = most.filter(|most| age > *most) else { return Ok(()) };
        let status = self.status.borrow();
        let cause = status.last_error.as_deref().map(|cause| format!(": {cause}")).unwrap_or_default();
        let message = format!(
            "the server was heard {age:.1?} ago, age_max is {most:?}{cause}; ask the server, or wait until the replica is connected"
        );
        Err(ServiceError::new(Reason::ReplicaStale, message))
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

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use mrol_map::map::{MapSettings, MultiResolutionMap};

    #[test]
    fn a_copy_whose_server_was_heard_too_long_ago_is_refused_with_its_age_and_the_cause() {
        let map = Arc::new(MultiResolutionMap::new(MapSettings::new(0.1, 1)).unwrap());
        let (map_uuid, version) = (uuid::Uuid::nil(), map.content_version());
        let copied = Copied { map, map_uuid, planner: Arc::default() };
        let status = ReplicaStatus {
            map_uuid,
            version,
            head_revision: 0,
            is_connected: false,
            resets: 1,
            last_error: Some("lost the connection".into()),
            has_ended: false,
        };
        let long_ago = Instant::now().checked_sub(Duration::from_secs(60)).unwrap();
        let shared = Shared {
            copied: RwLock::new(copied),
            status: watch::Sender::new(status),
            heard: Mutex::new(long_ago),
        };
        assert!(shared.age() >= Duration::from_secs(60));
        assert_eq!(shared.check_age(None), Ok(()));
        assert_eq!(shared.check_age(Some(Duration::from_secs(3600))), Ok(()));
        let refused = shared.check_age(Some(Duration::from_secs(30))).unwrap_err();
        assert_eq!(refused.reason, Reason::ReplicaStale);
        assert!(refused.message.contains("age_max is 30s: lost the connection"), "{refused}");
        shared.hear();
        assert_eq!(shared.check_age(Some(Duration::from_secs(30))), Ok(()));
    }
}
