//! A node's copy of a map follows its log.

use std::time::Duration;

use mrol_map::map::MapName;
use mrol_service::{MapService, Reason};
use tokio::task::JoinHandle;

use crate::jetstream_log::JetStreamLog;

/// When a node looks for more without news: they may be lost while NATS is not reached.
const LOOKED_EVERY: Duration = Duration::from_secs(1);

/// Makes what the log of a map has, as it comes, until it is dropped.
#[derive(Debug)]
pub struct Following {
    task: JoinHandle<()>,
}

impl Following {
    /// Follows the log of a map that `service` shares by it.
    pub fn begin(service: MapService, map: MapName, log: &JetStreamLog) -> Self {
        let mut news = log.on_news();
        let follow = async move {
            let mut heard = None;
            let mut last_said = None;
            loop {
                let newest = news.newest();
                let followed = service.follow_map(&map, heard).await;
                let said = followed.err().map(|error| (error.reason, error.message));
                match &said {
                    Some((Reason::MapNotFound, _)) => return,
                    Some((_, why)) if said != last_said => {
                        tracing::warn!(%map, why, "does not follow its log")
                    }
                    _ => {}
                }
                last_said = said;
                heard = tokio::time::timeout(LOOKED_EVERY, news.beyond(newest))
                    .await
                    .ok()
                    .map(|()| news.newest());
            }
        };
        Self { task: log.engine().spawn(follow) }
    }
}

impl Drop for Following {
    fn drop(&mut self) {
        self.task.abort();
    }
}
