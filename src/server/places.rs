//! Places for the connections of a protocol.
//!
//! Where all are taken, a new connection gets that of another, the first that there is of these:
//!
//! ```text
//! without a key, and asked for nothing since it came, longer ago than the grace
//! without a key, idle for longest
//! without a key, its client has left an answer unread for longest
//! with a key, idle for longest; not while one without a key is within the grace
//! ```
//!
//! Connections that nobody uses can therefore never keep others out, however many there are; those in use are fewer than
//! the places, since requests and streams in flight have lower limits. Who has just come has [`NEWCOMER_GRACE`] to ask for
//! something: nobody comes so fast that an honest client is gone before its request is read.
//!
//! Should no place be free nonetheless, a new connection gets one of some that are kept for health checks, until its first
//! answer. Of those the oldest gives way, once it has had the same grace or has asked for something else; until one does,
//! newcomers wait in the system's queue, where they take nothing.

use std::collections::BTreeMap;
use std::pin::pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use parking_lot::Mutex;
use tokio::sync::Notify;
use tokio::time::{Instant, sleep, sleep_until};
use tokio_util::sync::CancellationToken;

use crate::admission::OfConnection;

/// How long a client without a key may leave an answer unread while others find no place.
const UNREAD_GRACE: Duration = Duration::from_secs(1);

/// How long a connection that has come has the place that it got, whether it asks for something or not.
pub(super) const NEWCOMER_GRACE: Duration = Duration::from_millis(500);

/// The places of a protocol. A clone is another handle on the same ones.
#[derive(Debug, Clone)]
pub(super) struct Places {
    most: usize,
    reserved_most: usize,
    taken: Arc<Mutex<Taken>>,
    /// A place is free, or would be given up.
    freed: Arc<Notify>,
}

/// Why there is no place: from when on one will give way, where that is a matter of time.
type Full = Option<Instant>;

#[derive(Debug, Default)]
struct Taken {
    /// By the order in which they came.
    connections: BTreeMap<u64, Connection>,
    /// The same of those kept for health checks.
    reserved: BTreeMap<u64, Reserved>,
    next: u64,
}

/// A connection with a place that is kept for health checks.
#[derive(Debug)]
struct Reserved {
    gives_way_from: Instant,
    lost: CancellationToken,
}

#[derive(Debug)]
struct Connection {
    /// Requests in flight.
    requests: usize,
    /// When the last request was done, or since it came.
    idle_since: Instant,
    /// A request was done.
    has_asked: bool,
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
    /// Its first request has come.
    asked: CancellationToken,
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
        Self { most, reserved_most, taken: Arc::default(), freed: Arc::default() }
    }

    /// A place for a new connection, as soon as there is one; none where all are taken by connections in use, and none are
    /// kept for health checks.
    pub(super) async fn take(&self) -> Option<Place> {
        loop {
            let mut freed = pin!(self.freed.notified());
            freed.as_mut().enable();
            match self.take_now() {
                Ok(place) => return Some(place),
                Err(None) => return None,
                Err(Some(gives_way_from)) => {
                    tokio::select! {
                        () = freed => {}
                        () = sleep_until(gives_way_from) => {}
                    }
                }
            }
        }
    }

    fn take_now(&self) -> Result<Place, Full> {
        let mut taken = self.taken.lock();
        let has_place = taken.connections.len() < self.most || taken.free_one();
        if !has_place {
            taken.free_a_reserved_one(self.reserved_most)?;
        }
        let (number, lost, unread) = (taken.next, CancellationToken::new(), Unread::default());
        let (shared, now) = (OfConnection::new(!has_place), Instant::now());
        taken.next += 1;
        if has_place {
            let (lost, shared, unread) = (lost.clone(), shared.clone(), Arc::clone(&unread));
            let connection =
                Connection { requests: 0, idle_since: now, has_asked: false, lost, shared, unread };
            taken.connections.insert(number, connection);
        } else {
            let reserved = Reserved { gives_way_from: now + NEWCOMER_GRACE, lost: lost.clone() };
            taken.reserved.insert(number, reserved);
        }
        Ok(Place(Arc::new(Held {
            number,
            places: self.clone(),
            lost,
            shared,
            is_reserved: !has_place,
            asked: CancellationToken::new(),
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
        let without_key = |it: &Connection| !it.shared.has_key();
        let number = first_of(&|it| it.idle_since().filter(|_| without_key(it) && !it.has_asked))
            .or_else(|| first_of(&|it| it.idle_since().filter(|_| without_key(it))))
            .or_else(|| first_of(&|it| it.unread_since().filter(|_| without_key(it))))
            // Else newcomers without a key would take the places of those with one.
            .or_else(|| self.newcomer_until().is_none().then(|| first_of(&Connection::idle_since)).flatten());
        let freed = number.and_then(|number| self.connections.remove(&number));
        freed.map(|connection| connection.lost.cancel()).is_some()
    }

    /// Makes sure that one of `most` reserved places is free.
    fn free_a_reserved_one(&mut self, most: usize) -> Result<(), Full> {
        if self.reserved.len() < most {
            return Ok(());
        }
        let first = self.reserved.iter().map(|(&number, it)| (it.gives_way_from, number)).min();
        let newcomer = self.newcomer_until();
        let (gives_way_from, number) = first.ok_or(newcomer)?;
        if gives_way_from > Instant::now() {
            return Err(Some(newcomer.map_or(gives_way_from, |until| until.min(gives_way_from))));
        }
        if let Some(oldest) = self.reserved.remove(&number) {
            oldest.lost.cancel();
        }
        Ok(())
    }

    /// Until when the first of the newcomers without a key that ask for nothing has its grace; none where there is none.
    fn newcomer_until(&self) -> Option<Instant> {
        let newcomers = self.connections.values().filter(|it| it.is_newcomer() && !it.shared.has_key());
        newcomers.map(|it| it.idle_since + NEWCOMER_GRACE).min()
    }
}

impl Connection {
    /// It has just come, and asked for nothing yet.
    fn is_newcomer(&self) -> bool {
        self.requests == 0 && !self.has_asked && self.idle_since.elapsed() < NEWCOMER_GRACE
    }

    /// Since when it has no request in flight, where others may take its place for that.
    fn idle_since(&self) -> Option<Instant> {
        (self.requests == 0 && !self.is_newcomer()).then_some(self.idle_since)
    }

    /// Since when its client has read nothing of an answer, where that is long enough for others to go first.
    fn unread_since(&self) -> Option<Instant> {
        let oldest = self.unread.lock().values().min().copied();
        oldest.filter(|since| since.elapsed() >= UNREAD_GRACE)
    }
}

impl Place {
    /// A request begins.
    pub(super) fn used(&self) -> InUse {
        self.0.asked.cancel();
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

    /// Waits until its first request has come.
    pub(super) async fn asked(&self) {
        self.0.asked.cancelled().await;
    }

    /// Where it was taken for health checks, it is anybody's from now on: it was used for something else.
    pub(super) fn misused(&self) {
        if let Some(reserved) = self.0.places.taken.lock().reserved.get_mut(&self.0.number) {
            reserved.gives_way_from = Instant::now();
        }
        self.0.places.freed.notify_waiters();
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
            connection.has_asked = true;
            connection.idle_since = Instant::now();
        });
        self.place.0.places.freed.notify_waiters();
    }
}

impl Drop for Held {
    fn drop(&mut self) {
        let mut taken = self.places.taken.lock();
        taken.connections.remove(&self.number);
        taken.reserved.remove(&self.number);
        drop(taken);
        self.places.freed.notify_waiters();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test(start_paused = true)]
    async fn a_newcomer_gets_the_place_that_was_idle_for_longest() {
        let places = Places::new(2, 0);
        let first = places.take_now().unwrap();
        sleep(Duration::from_secs(1)).await;
        let second = places.take_now().unwrap();
        // The first is now the one that was used last.
        sleep(Duration::from_secs(1)).await;
        drop(first.used());
        let _third = places.take_now().unwrap();
        assert!(second.0.lost.is_cancelled() && !first.0.lost.is_cancelled());
        // What it does in its last moments harms nobody.
        drop(second.used());
        drop(second);
        assert_eq!(places.taken.lock().connections.len(), 2);
    }

    #[tokio::test]
    async fn a_place_in_use_is_nobody_elses() {
        let places = Places::new(1, 0);
        let place = places.take_now().unwrap();
        let used = place.used();
        assert!(places.take_now().is_err());
        drop(used);
        assert!(places.take_now().is_ok());
    }

    #[tokio::test(start_paused = true)]
    async fn who_has_shown_no_key_gives_way_first() {
        let places = Places::new(3, 0);
        let keyed = places.take_now().unwrap();
        keyed.0.shared.show_key();
        sleep(Duration::from_secs(9)).await;
        let (idle, unread) = (places.take_now().unwrap(), places.take_now().unwrap());
        drop(idle.used());
        let used = unread.used();
        used.handed_over();
        let _first = places.take_now().unwrap().used();
        assert!(idle.0.lost.is_cancelled() && !keyed.0.lost.is_cancelled() && !unread.0.lost.is_cancelled());
        sleep(UNREAD_GRACE).await;
        let _second = places.take_now().unwrap().used();
        assert!(unread.0.lost.is_cancelled() && !keyed.0.lost.is_cancelled());
        let _third = places.take_now().unwrap().used();
        assert!(keyed.0.lost.is_cancelled());
        assert!(places.take_now().is_err());
    }

    #[tokio::test(start_paused = true)]
    async fn where_all_are_in_use_some_places_are_left_for_health() {
        let places = Places::new(1, 2);
        let used = places.take_now().unwrap().used();
        let (one, two) = (places.take_now().unwrap(), places.take_now().unwrap());
        assert!(one.is_reserved() && two.is_reserved() && !used.place.is_reserved());
        // Nobody loses one before it could ask, and nobody keeps it for longer where others wait.
        let start = Instant::now();
        let three = places.take().await.unwrap();
        assert!((NEWCOMER_GRACE..2 * NEWCOMER_GRACE).contains(&start.elapsed()));
        assert!(one.0.lost.is_cancelled() && !two.0.lost.is_cancelled() && three.is_reserved());
        drop((one, two, three));
        assert_eq!(places.taken.lock().reserved.len(), 0);
        drop(used);
        assert!(!places.take_now().unwrap().is_reserved());
        assert!(Places::new(0, 0).take().await.is_none());
        // Who asks for something else has it no longer.
        let reserved = Places::new(0, 1);
        let (one, start) = (reserved.take_now().unwrap(), Instant::now());
        assert!(reserved.take_now().is_err());
        one.misused();
        let _two = reserved.take().await.unwrap();
        assert!(one.0.lost.is_cancelled() && start.elapsed() < NEWCOMER_GRACE);
    }

    #[tokio::test(start_paused = true)]
    async fn who_has_just_come_keeps_its_place_for_a_moment() {
        let places = Places::new(2, 0);
        let (keyed, probe) = (places.take_now().unwrap(), places.take_now().unwrap());
        keyed.0.shared.show_key();
        drop(keyed.used());
        // Of the others, too, who have a key.
        assert!(places.take_now().is_err());
        assert!(!probe.0.lost.is_cancelled() && !keyed.0.lost.is_cancelled());
        let used = probe.used();
        sleep(NEWCOMER_GRACE).await;
        drop(used);
        let silent = places.take_now().unwrap();
        assert!(probe.0.lost.is_cancelled() && !keyed.0.lost.is_cancelled());
        sleep(NEWCOMER_GRACE).await;
        let newcomer = places.take_now().unwrap();
        assert!(silent.0.lost.is_cancelled() && !newcomer.0.lost.is_cancelled());
    }

    #[tokio::test(start_paused = true)]
    async fn who_has_asked_for_nothing_gives_way_before_who_is_idle() {
        let places = Places::new(2, 0);
        let idle = places.take_now().unwrap();
        drop(idle.used());
        sleep(Duration::from_secs(9)).await;
        let silent = places.take_now().unwrap();
        sleep(NEWCOMER_GRACE).await;
        let _newcomer = places.take_now().unwrap();
        assert!(silent.0.lost.is_cancelled() && !idle.0.lost.is_cancelled());
    }

    #[tokio::test(start_paused = true)]
    async fn a_place_that_is_free_again_is_taken_at_once() {
        let places = Places::new(1, 1);
        let used = places.take_now().unwrap().used();
        let reserved = places.take_now().unwrap();
        let start = Instant::now();
        let (waited, ()) = tokio::join!(places.take(), async { drop(reserved) });
        assert_eq!((waited.unwrap().is_reserved(), start.elapsed()), (true, Duration::ZERO));
        drop(used);
    }

    #[tokio::test(start_paused = true)]
    async fn an_answer_that_nobody_reads_is_found_out() {
        let place = Places::new(1, 0).take_now().unwrap();
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
        let place = Places::new(1, 0).take_now().unwrap();
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
