//! Places for the connections of a protocol.
//!
//! Where all are taken, a new connection gets that of another: of the one without a key that has been idle for longest,
//! then of the one without a key whose client has left an answer unread for longest, then of the one with a key that
//! has been idle for longest. Connections that nobody uses can therefore never keep others out, however many there are;
//! those in use are fewer than the places, since requests and streams in flight have lower limits.
//!
//! Should all be in use nonetheless, a new connection gets a place of some that are kept for health checks, for a moment;
//! the oldest of those gives way.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use parking_lot::Mutex;
use tokio::time::{Instant, sleep};
use tokio_util::sync::CancellationToken;

use crate::admission::OfConnection;

/// How long a client without a key may leave an answer unread while others find no place.
const UNREAD_GRACE: Duration = Duration::from_secs(1);

/// The places of a protocol. A clone is another handle on the same ones.
#[derive(Debug, Clone)]
pub(super) struct Places {
    most: usize,
    reserved_most: usize,
    taken: Arc<Mutex<Taken>>,
}

#[derive(Debug, Default)]
struct Taken {
    /// By the order in which they came.
    connections: BTreeMap<u64, Connection>,
    /// The same of those kept for health checks: when each came is all that counts.
    reserved: BTreeMap<u64, CancellationToken>,
    next: u64,
}

#[derive(Debug)]
struct Connection {
    /// Requests in flight.
    requests: usize,
    /// When the last request was done, or since it came.
    idle_since: Instant,
    lost: CancellationToken,
    shared: OfConnection,
    unread: Unread,
}

/// Since when pieces of answers have been on their way, by answer.
type Unread = Arc<Mutex<BTreeMap<u64, Instant>>>;

/// The place of one connection, free again when this is dropped. A clone is another handle on it.
#[derive(Debug, Clone)]
pub(super) struct Place(Arc<Held>);

#[derive(Debug)]
struct Held {
    number: u64,
    places: Places,
    lost: CancellationToken,
    shared: OfConnection,
    is_reserved: bool,
    unread: Unread,
    next_answer: AtomicU64,
}

/// A request in flight, until it is dropped.
#[derive(Debug)]
pub(super) struct InUse {
    place: Place,
    answer: u64,
}

impl Places {
    /// `most` places, and `reserved_most` for health checks besides.
    pub(super) fn new(most: usize, reserved_most: usize) -> Self {
        Self { most, reserved_most, taken: Arc::default() }
    }

    /// A place for a new connection; none where all are taken by connections in use, and none are reserved.
    pub(super) fn take(&self) -> Option<Place> {
        let mut taken = self.taken.lock();
        let has_place = taken.connections.len() < self.most || taken.free_one();
        if !has_place {
            taken.free_a_reserved_one(self.reserved_most)?;
        }
        let (number, lost, unread) = (taken.next, CancellationToken::new(), Unread::default());
        let shared = OfConnection::new(!has_place);
        taken.next += 1;
        if has_place {
            let (lost, shared, unread) = (lost.clone(), shared.clone(), Arc::clone(&unread));
            let connection = Connection { requests: 0, idle_since: Instant::now(), lost, shared, unread };
            taken.connections.insert(number, connection);
        } else {
            taken.reserved.insert(number, lost.clone());
        }
        Some(Place(Arc::new(Held {
            number,
            places: self.clone(),
            lost,
            shared,
            is_reserved: !has_place,
            unread,
            next_answer: AtomicU64::new(0),
        })))
    }
}

impl Taken {
    /// Takes the place of a connection that gives way; false where none does.
    fn free_one(&mut self) -> bool {
        let first_of = |gives_way: &dyn Fn(&Connection) -> Option<Instant>| {
            let able = self.connections.iter().filter_map(|(&number, it)| Some((gives_way(it)?, number)));
            able.min().map(|(_, number)| number)
        };
        let idle = |it: &Connection| (it.requests == 0).then_some(it.idle_since);
        let without_key = |it: &Connection| !it.shared.has_key();
        let number = first_of(&|it| idle(it).filter(|_| without_key(it)))
            .or_else(|| first_of(&|it| it.unread_since().filter(|_| without_key(it))))
            .or_else(|| first_of(&|it| idle(it)));
        let freed = number.and_then(|number| self.connections.remove(&number));
        freed.map(|connection| connection.lost.cancel()).is_some()
    }

    /// Makes sure that one of `most` reserved places is free; none where there are none.
    fn free_a_reserved_one(&mut self, most: usize) -> Option<()> {
        if self.reserved.len() >= most {
            let (_, oldest) = self.reserved.pop_first()?;
            oldest.cancel();
        }
        (most > 0).then_some(())
    }
}

impl Connection {
    /// Since when its client has read nothing of an answer, where that is long enough for others to go first.
    fn unread_since(&self) -> Option<Instant> {
        let oldest = self.unread.lock().values().min().copied();
        oldest.filter(|since| since.elapsed() >= UNREAD_GRACE)
    }
}

impl Place {
    /// A request begins.
    pub(super) fn used(&self) -> InUse {
        self.change(|connection| connection.requests += 1);
        InUse { place: self.clone(), answer: self.0.next_answer.fetch_add(1, Ordering::Relaxed) }
    }

    /// What its requests share.
    pub(super) fn shared(&self) -> OfConnection {
        self.0.shared.clone()
    }

    /// True where it was taken for health checks alone, while all others were in use.
    pub(super) fn is_reserved(&self) -> bool {
        self.0.is_reserved
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
        let mut taken = self.places.taken.lock();
        taken.connections.remove(&self.number);
        taken.reserved.remove(&self.number);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test(start_paused = true)]
    async fn a_newcomer_gets_the_place_that_was_idle_for_longest() {
        let places = Places::new(2, 0);
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
        let places = Places::new(1, 0);
        let place = places.take().unwrap();
        let used = place.used();
        assert!(places.take().is_none());
        drop(used);
        assert!(places.take().is_some());
    }

    #[tokio::test(start_paused = true)]
    async fn who_has_shown_no_key_gives_way_first() {
        let places = Places::new(3, 0);
        let keyed = places.take().unwrap();
        keyed.0.shared.show_key();
        sleep(Duration::from_secs(9)).await;
        let (idle, unread) = (places.take().unwrap(), places.take().unwrap());
        let used = unread.used();
        used.handed_over();
        let _first = places.take().unwrap().used();
        assert!(idle.0.lost.is_cancelled() && !keyed.0.lost.is_cancelled() && !unread.0.lost.is_cancelled());
        sleep(UNREAD_GRACE).await;
        let _second = places.take().unwrap().used();
        assert!(unread.0.lost.is_cancelled() && !keyed.0.lost.is_cancelled());
        let _third = places.take().unwrap().used();
        assert!(keyed.0.lost.is_cancelled());
        assert!(places.take().is_none());
    }

    #[tokio::test]
    async fn where_all_are_in_use_some_places_are_left_for_health() {
        let places = Places::new(1, 2);
        let used = places.take().unwrap().used();
        let (one, two) = (places.take().unwrap(), places.take().unwrap());
        assert!(one.is_reserved() && two.is_reserved() && !used.place.is_reserved());
        let three = places.take().unwrap();
        assert!(one.0.lost.is_cancelled() && !two.0.lost.is_cancelled() && three.is_reserved());
        drop((one, two, three));
        assert_eq!(places.taken.lock().reserved.len(), 0);
        drop(used);
        assert!(!places.take().unwrap().is_reserved());
    }

    #[tokio::test(start_paused = true)]
    async fn an_answer_that_nobody_reads_is_found_out() {
        let place = Places::new(1, 0).take().unwrap();
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
        let place = Places::new(1, 0).take().unwrap();
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
