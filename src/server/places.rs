//! Places for the connections of a protocol.
//!
//! Where all are taken, a new connection gets that of the one which has been idle for longest. Connections that
//! nobody uses can therefore never keep others out, however many there are; those in use are fewer than the places,
//! since requests and streams in flight have lower limits.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use parking_lot::Mutex;
use tokio::time::{Instant, sleep};
use tokio_util::sync::CancellationToken;

/// The places of a protocol. A clone is another handle on the same ones.
#[derive(Debug, Clone)]
pub(super) struct Places {
    most: usize,
    taken: Arc<Mutex<Taken>>,
}

#[derive(Debug, Default)]
struct Taken {
    /// By the order in which they came.
    connections: BTreeMap<u64, Connection>,
    next: u64,
}

#[derive(Debug)]
struct Connection {
    /// Requests in flight.
    requests: usize,
    /// When the last request was done, or since it came.
    idle_since: Instant,
    lost: CancellationToken,
}

/// The place of one connection, free again when this is dropped. A clone is another handle on it.
#[derive(Debug, Clone)]
pub(super) struct Place(Arc<Held>);

#[derive(Debug)]
struct Held {
    number: u64,
    places: Places,
    lost: CancellationToken,
    /// Since when pieces of answers have been on their way, by answer.
    unread: Mutex<BTreeMap<u64, Instant>>,
    next_answer: AtomicU64,
}

/// A request in flight, until it is dropped.
#[derive(Debug)]
pub(super) struct InUse {
    place: Place,
    answer: u64,
}

impl Places {
    pub(super) fn new(most: usize) -> Self {
        Self { most, taken: Arc::default() }
    }

    /// A place for a new connection; none where all are taken by connections in use.
    pub(super) fn take(&self) -> Option<Place> {
        let mut taken = self.taken.lock();
        if taken.connections.len() >= self.most {
            taken.free_the_idlest()?;
        }
        let (number, lost) = (taken.next, CancellationToken::new());
        taken.next += 1;
        let connection = Connection { requests: 0, idle_since: Instant::now(), lost: lost.clone() };
        taken.connections.insert(number, connection);
        Some(Place(Arc::new(Held {
            number,
            places: self.clone(),
            lost,
            unread: Mutex::default(),
            next_answer: AtomicU64::new(0),
        })))
    }
}

impl Taken {
    fn free_the_idlest(&mut self) -> Option<()> {
        let idle = self.connections.iter().filter(|(_, connection)| connection.requests == 0);
        let (&number, _) = idle.min_by_key(|(_, connection)| connection.idle_since)?;
        self.connections.remove(&number)?.lost.cancel();
        Some(())
    }
}

impl Place {
    /// A request begins.
    pub(super) fn used(&self) -> InUse {
        self.change(|connection| connection.requests += 1);
        InUse { place: self.clone(), answer: self.0.next_answer.fetch_add(1, Ordering::Relaxed) }
    }

    /// Ends the connection when it is cancelled.
    pub(super) fn hang_up(&self) -> CancellationToken {
        self.0.lost.clone()
    }

    /// Waits until another connection has got this place, or somebody hung up.
    pub(super) async fn lost(&self) {
        self.0.lost.cancelled().await;
    }

    /// Waits until there was no request in flight for `time`.
    pub(super) async fn idle_for(&self, time: Duration) {
        loop {
            let idle = self.idle();
            match idle.filter(|idle| *idle >= time) {
                Some(_) => return,
                None => sleep(time - idle.unwrap_or_default()).await,
            }
        }
    }

    /// Waits until the client has not read on in an answer for `time`.
    pub(super) async fn unread_for(&self, time: Duration) {
        loop {
            let oldest = self.0.unread.lock().values().min().map_or(Duration::ZERO, Instant::elapsed);
            if oldest >= time {
                return;
            }
            sleep(time - oldest).await;
        }
    }

    /// For how long there has been no request in flight; none while there is one.
    fn idle(&self) -> Option<Duration> {
        let taken = self.0.places.taken.lock();
        let connection = taken.connections.get(&self.0.number)?;
        (connection.requests == 0).then(|| connection.idle_since.elapsed())
    }

    fn change(&self, change: impl FnOnce(&mut Connection)) {
        // A connection that has just lost its place is closed anyway.
        if let Some(connection) = self.0.places.taken.lock().connections.get_mut(&self.0.number) {
            change(connection);
        }
    }
}

impl InUse {
    /// A piece of the answer was handed over to be sent.
    pub(super) fn handed_over(&self) {
        self.place.0.unread.lock().insert(self.answer, Instant::now());
    }

    /// All that was handed over is on its way, and there is room for more.
    pub(super) fn read(&self) {
        self.place.0.unread.lock().remove(&self.answer);
    }
}

impl Drop for InUse {
    fn drop(&mut self) {
        self.read();
        self.place.change(|connection| {
            connection.requests -= 1;
            connection.idle_since = Instant::now();
        });
    }
}

impl Drop for Held {
    fn drop(&mut self) {
        self.places.taken.lock().connections.remove(&self.number);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test(start_paused = true)]
    async fn a_newcomer_gets_the_place_that_was_idle_for_longest() {
        let places = Places::new(2);
        let first = places.take().unwrap();
        sleep(Duration::from_secs(1)).await;
        let second = places.take().unwrap();
        // The first is now the one that was used last.
        sleep(Duration::from_secs(1)).await;
        drop(first.used());
        let _third = places.take().unwrap();
        assert!(second.0.lost.is_cancelled() && !first.0.lost.is_cancelled());
        // What it does in its last moments harms nobody.
        drop(second.used());
        drop(second);
        assert_eq!(places.taken.lock().connections.len(), 2);
    }

    #[tokio::test]
    async fn a_place_in_use_is_nobody_elses() {
        let places = Places::new(1);
        let place = places.take().unwrap();
        let used = place.used();
        assert!(places.take().is_none());
        drop(used);
        assert!(places.take().is_some());
    }

    #[tokio::test(start_paused = true)]
    async fn an_answer_that_nobody_reads_is_found_out() {
        let place = Places::new(1).take().unwrap();
        let (slow, quick) = (place.used(), place.used());
        let start = Instant::now();
        slow.handed_over();
        let unread = tokio::spawn({
            let place = place.clone();
            async move { place.unread_for(Duration::from_secs(30)).await }
        });
        for _ in 0..4 {
            sleep(Duration::from_secs(5)).await;
            quick.handed_over();
            sleep(Duration::from_secs(5)).await;
            quick.read();
            if start.elapsed().as_secs() == 20 {
                // The slow one reads on after 20 seconds, and then no more.
                slow.read();
                slow.handed_over();
            }
        }
        unread.await.unwrap();
        assert_eq!(start.elapsed().as_secs(), 50);
    }

    #[tokio::test(start_paused = true)]
    async fn idle_time_is_counted_from_the_last_request() {
        let place = Places::new(1).take().unwrap();
        let (start, used) = (Instant::now(), place.used());
        let idle = tokio::spawn({
            let place = place.clone();
            async move { place.idle_for(Duration::from_secs(60)).await }
        });
        sleep(Duration::from_secs(90)).await;
        drop(used);
        idle.await.unwrap();
        assert_eq!(start.elapsed().as_secs(), 150);
    }
}
