//! A node's copy of a map follows its log.

use std::time::Duration;

use mrol_map::map::MapName;
use mrol_service::{Lead, MapService, Reason};
use tokio::task::JoinHandle;

use crate::jetstream_log::JetStreamLog;

/// When a node looks for more without news: they may be lost while NATS is not reached.
const LOOKED_EVERY: Duration = Duration::from_secs(1);
/// When a node looks again for a message of which it has heard: the replica that it reads may get it a moment later.
const LOOKED_AGAIN: Duration = Duration::from_millis(2);

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
            let mut looks = Looks::default();
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
                let read = read_by(&service, &map).await;
                let woken = tokio::time::timeout(looks.next_within(newest, read), news.beyond(newest)).await;
                heard = woken.ok().map(|()| news.newest());
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

/// Number of the last message that the copy has read.
async fn read_by(service: &MapService, map: &MapName) -> Option<u64> {
    match *service.lead_of(map).await.ok()?.borrow() {
        Lead::Shared { sequence, .. } => Some(sequence),
        _ => None,
    }
}

/// When a node looks at a log again: soon where it lacks a message of which it has heard, and ever later while that
/// does not come, since the log may have lost it.
#[derive(Debug, Default)]
struct Looks {
    awaited: u64,
    fruitless: u32,
}

impl Looks {
    /// How long the next look waits for news, where `newest` is the last message that was heard of and `read` the
    /// last that was read.
    fn next_within(&mut self, newest: u64, read: Option<u64>) -> Duration {
        if read.is_none_or(|read| read >= newest) {
            return LOOKED_EVERY;
        }
        self.fruitless = if self.awaited == newest { self.fruitless.saturating_add(1) } else { 0 };
        self.awaited = newest;
        LOOKED_AGAIN.saturating_mul(1_u32.checked_shl(self.fruitless).unwrap_or(u32::MAX)).min(LOOKED_EVERY)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_that_was_heard_of_and_not_read_is_looked_for_soon() {
        let mut looks = Looks::default();
        assert_eq!(looks.next_within(7, Some(6)), LOOKED_AGAIN);
        assert_eq!(looks.next_within(7, Some(6)), 2 * LOOKED_AGAIN);
        assert_eq!(looks.next_within(8, Some(7)), LOOKED_AGAIN);
    }

    #[test]
    fn whoever_has_read_all_waits_for_news() {
        let mut looks = Looks::default();
        assert_eq!(looks.next_within(0, Some(0)), LOOKED_EVERY);
        assert_eq!(looks.next_within(7, Some(7)), LOOKED_EVERY);
        assert_eq!(looks.next_within(7, None), LOOKED_EVERY);
    }

    #[test]
    fn a_message_that_the_log_has_lost_is_looked_for_no_more_often_than_without_news() {
        let mut looks = Looks::default();
        let last = (0..100).map(|_| looks.next_within(7, Some(6))).last();
        assert_eq!(last, Some(LOOKED_EVERY));
    }
}
