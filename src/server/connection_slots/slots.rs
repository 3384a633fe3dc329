//! The slots of connections, and who gives way where all are taken.

use std::cmp::Reverse;
use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use parking_lot::Mutex;
use tokio::time::{Instant, sleep};
use tokio_util::sync::CancellationToken;

use super::reserved::Reserved;
use crate::access::Peer;
use crate::admission::OfConnection;

/// How long a client without a key may leave an answer unread while others find no place, and how old a connection is
/// no newcomer any more.
const GRACE: Duration = Duration::from_secs(1);

/// The places of a protocol. A clone is another handle on the same ones.
#[derive(Debug, Clone)]
pub(crate) struct ConnectionSlots {
    most: usize,
    reserved_most: usize,
    taken: Arc<Mutex<Taken>>,
}

#[derive(Debug, Default)]
struct Taken {
    /// By the order in which they came.
    connections: BTreeMap<u64, Connection>,
    reserved: Reserved,
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
pub(crate) struct ConnectionSlot(Arc<Held>);

#[derive(Debug)]
struct Held {
    number: u64,
    places: ConnectionSlots,
    lost: CancellationToken,
    shared: OfConnection,
    is_reserved: bool,
    unread: Unread,
    next_answer: AtomicU64,
}

/// A request in flight, until it is dropped.
#[derive(Debug)]
pub(crate) struct InUse {
    place: ConnectionSlot,
    answer: u64,
}

impl ConnectionSlots {
    /// `most` places, and `reserved_most` for health checks besides.
    pub(crate) fn new(most: usize, reserved_most: usize) -> Self {
        Self { most, reserved_most, taken: Arc::default() }
    }

    /// A place for a new connection; none where all are taken by connections in use, and none are reserved.
    pub(crate) fn take(&self, peer: Peer) -> Option<ConnectionSlot> {
        let mut taken = self.taken.lock();
        let has_place = taken.connections.len() < self.most || taken.free_one(self.spared());
        if !has_place {
            taken.reserved.free_one(self.reserved_most)?;
        }
        let (number, lost, unread) = (taken.next, CancellationToken::new(), Unread::default());
        let shared = OfConnection::new(!has_place);
        taken.next += 1;
        if has_place {
            let (lost, shared, unread) = (lost.clone(), shared.clone(), Arc::clone(&unread));
            let connection = Connection { requests: 0, idle_since: Instant::now(), lost, shared, unread };
            taken.connections.insert(number, connection);
        } else {
            taken.reserved.insert(number, peer, lost.clone());
        }
        Some(ConnectionSlot(Arc::new(Held {
            number,
            places: self.clone(),
            lost,
            shared,
            is_reserved: !has_place,
            unread,
            next_answer: AtomicU64::new(0),
        })))
    }

    /// Newcomers that give way to nobody: as many as could be checks of health.
    fn spared(&self) -> usize {
        self.reserved_most.min(self.most / 2)
    }
}

impl Taken {
    /// Takes the place of a connection that gives way; false where none does. So few as `spared` that have only just
    /// come, and were let in for nothing yet, give way to nobody.
    fn free_one(&mut self, spared: usize) -> bool {
        let without_key = || self.connections.iter().filter(|(_, it)| it.shared.key().is_none());
        let unused = without_key().filter_map(|(&number, it)| Some((it.unused_since()?, number))).min();
        let number = match unused {
            Some((since, number)) => {
                let newcomers = without_key().filter(|(_, it)| it.unused_since().is_some()).count();
                (since.elapsed() >= GRACE || newcomers > spared).then_some(number)
            }
            None => None,
        };
        let number = number.or_else(|| self.idle_of_who_has_most());
        let freed = number.and_then(|number| self.connections.remove(&number));
        freed.map(|connection| connection.lost.cancel()).is_some()
    }

    /// The connection that has been idle for longest, of the key that has most idle ones.
    fn idle_of_who_has_most(&self) -> Option<u64> {
        let mut idle: HashMap<&str, (usize, Instant, u64)> = HashMap::new();
        for (&number, it) in &self.connections {
            let (Some(key), Some(idle_since)) = (it.shared.key(), it.shared.idle_since()) else { continue };
            let (count, since, longest) = idle.entry(key).or_insert((0, idle_since, number));
            *count += 1;
            (*since, *longest) = (*since, *longest).min((idle_since, number));
        }
        let most = idle.into_values().max_by_key(|&(count, since, _)| (count, Reverse(since)));
        most.map(|(_, _, longest)| longest)
    }
}

impl Connection {
    /// Since when its client has had no request that was let in, or has read nothing of an answer where that is long
    /// enough for others to go first.
    fn unused_since(&self) -> Option<Instant> {
        let unread = || self.unread.lock().values().min().copied().filter(|since| since.elapsed() >= GRACE);
        self.shared.idle_since().or_else(unread)
    }
}

impl ConnectionSlot {
    /// A request begins.
    pub(crate) fn used(&self) -> InUse {
        self.change(|connection| connection.requests += 1);
        if self.0.is_reserved {
            self.0.places.taken.lock().reserved.asks(self.0.number);
        }
        InUse { place: self.clone(), answer: self.0.next_answer.fetch_add(1, Ordering::Relaxed) }
    }

    /// What its requests share.
    pub(crate) fn shared(&self) -> OfConnection {
        self.0.shared.clone()
    }

    /// True where it was taken for health checks alone, while all others were in use.
    pub(crate) fn is_reserved(&self) -> bool {
        self.0.is_reserved
    }

    /// Ends the connection when it is cancelled.
    pub(crate) fn hang_up(&self) -> CancellationToken {
        self.0.lost.clone()
    }

    /// Waits until another connection has got this place, or somebody hung up.
    pub(crate) async fn lost(&self) {
        self.0.lost.cancelled().await;
    }

    /// Waits until there was no request in flight for `time`.
    pub(crate) async fn idle_for(&self, time: Duration) {
        loop {
            let idle = self.idle();
            match idle.filter(|idle| *idle >= time) {
                Some(_) => return,
                None => sleep(time - idle.unwrap_or_default()).await,
            }
        }
    }

    /// Waits until the client has not read on in an answer for `time`.
    pub(crate) async fn unread_for(&self, time: Duration) {
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
    pub(crate) fn handed_over(&self) {
        self.place.0.unread.lock().insert(self.answer, Instant::now());
    }

    /// All that was handed over is on its way, and there is room for more.
    pub(crate) fn read(&self) {
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
        if self.place.is_reserved() {
            self.place.0.places.taken.lock().reserved.is_answered(self.place.0.number);
        }
    }
}

impl Drop for Held {
    fn drop(&mut self) {
        let mut taken = self.places.taken.lock();
        taken.connections.remove(&self.number);
        taken.reserved.remove(self.number);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A request that is let in.
    fn in_use(place: &ConnectionSlot) -> (InUse, impl Sized + use<>) {
        (place.used(), place.0.shared.let_in())
    }

    #[tokio::test(start_paused = true)]
    async fn a_newcomer_gets_the_place_that_was_idle_for_longest() {
        let places = ConnectionSlots::new(2, 0);
        let first = places.take(Peer::Local).unwrap();
        sleep(Duration::from_secs(1)).await;
        let second = places.take(Peer::Local).unwrap();
        // The first is now the one that was used last.
        sleep(Duration::from_secs(1)).await;
        drop(in_use(&first));
        let _third = places.take(Peer::Local).unwrap();
        assert!(second.0.lost.is_cancelled() && !first.0.lost.is_cancelled());
        // What it does in its last moments harms nobody.
        drop(in_use(&second));
        drop(second);
        assert_eq!(places.taken.lock().connections.len(), 2);
    }

    #[tokio::test]
    async fn a_place_in_use_is_nobody_elses() {
        let places = ConnectionSlots::new(1, 0);
        let place = places.take(Peer::Local).unwrap();
        let used = in_use(&place);
        assert!(places.take(Peer::Local).is_none());
        drop(used);
        assert!(places.take(Peer::Local).is_some());
    }

    #[tokio::test(start_paused = true)]
    async fn who_has_shown_no_key_gives_way_first() {
        let places = ConnectionSlots::new(3, 0);
        let keyed = places.take(Peer::Local).unwrap();
        keyed.0.shared.show_key("r1");
        sleep(Duration::from_secs(9)).await;
        let (idle, unread) = (places.take(Peer::Local).unwrap(), places.take(Peer::Local).unwrap());
        let used = in_use(&unread);
        used.0.handed_over();
        let _first = in_use(&places.take(Peer::Local).unwrap());
        assert!(idle.0.lost.is_cancelled() && !keyed.0.lost.is_cancelled() && !unread.0.lost.is_cancelled());
        sleep(GRACE).await;
        let _second = in_use(&places.take(Peer::Local).unwrap());
        assert!(unread.0.lost.is_cancelled() && !keyed.0.lost.is_cancelled());
        let _third = in_use(&places.take(Peer::Local).unwrap());
        assert!(keyed.0.lost.is_cancelled());
        assert!(places.take(Peer::Local).is_none());
    }

    #[tokio::test(start_paused = true)]
    async fn a_newcomer_among_connections_that_nobody_reads_is_not_the_first_to_go() {
        let places = ConnectionSlots::new(4, 2);
        let flood: Vec<_> = (0..4).map(|_| places.take(Peer::Local).unwrap()).collect();
        let unread = flood.iter().map(|place| {
            let used = in_use(place);
            used.0.handed_over();
            used
        });
        let _unread: Vec<_> = unread.collect();
        sleep(GRACE).await;
        let check = places.take(Peer::Local).unwrap();
        assert!(!check.is_reserved() && flood[0].0.lost.is_cancelled());
        let _others = [(); 3].map(|()| places.take(Peer::Local).unwrap());
        assert!(flood[3].0.lost.is_cancelled() && !check.0.lost.is_cancelled());
        // All have only just come: one of them goes, since more are silent than places are kept for checks.
        let another = places.take(Peer::Local).unwrap();
        assert!(!another.is_reserved() && check.0.lost.is_cancelled());
    }

    #[tokio::test(start_paused = true)]
    async fn a_few_that_have_only_just_come_are_spared_for_a_moment() {
        let places = ConnectionSlots::new(2, 1);
        let _used = in_use(&places.take(Peer::Local).unwrap());
        let check = places.take(Peer::Local).unwrap();
        assert!(places.take(Peer::Local).unwrap().is_reserved());
        assert!(!check.0.lost.is_cancelled());
        sleep(GRACE).await;
        assert!(!places.take(Peer::Local).unwrap().is_reserved());
        assert!(check.0.lost.is_cancelled());
    }

    #[tokio::test(start_paused = true)]
    async fn refusals_that_nobody_reads_keep_nobody_out_however_often_they_are_asked_for() {
        let places = ConnectionSlots::new(4, 1);
        let held: Vec<_> = (0..4).map(|_| places.take(Peer::Local).unwrap()).collect();
        let mut asked = Vec::new();
        for _ in 0..4 {
            // The last answer is read when the next is there.
            let answers = held.iter().map(|place| {
                let used = place.used();
                used.handed_over();
                used
            });
            asked = answers.collect();
            sleep(GRACE * 7 / 10).await;
        }
        let robots = [(); 4].map(|()| {
            let robot = places.take(Peer::Local).unwrap();
            robot.0.shared.show_key("r1");
            assert!(!robot.is_reserved());
            in_use(&robot)
        });
        assert!(held.iter().all(|place| place.0.lost.is_cancelled()));
        drop((asked, robots));
    }

    #[tokio::test(start_paused = true)]
    async fn newcomers_do_not_shut_out_others_while_places_of_a_key_are_idle() {
        let places = ConnectionSlots::new(4, 2);
        let insider: Vec<_> = (0..4).map(|_| places.take(Peer::Local).unwrap()).collect();
        insider.iter().for_each(|place| place.0.shared.show_key("insider"));
        let trickle = places.take(Peer::Local).unwrap();
        let robot = places.take(Peer::Local).unwrap();
        assert!(!trickle.is_reserved() && !robot.is_reserved());
        assert!(insider[1].0.lost.is_cancelled() && !trickle.0.lost.is_cancelled());
    }

    #[tokio::test(start_paused = true)]
    async fn idle_connections_of_one_key_leave_those_of_others_alone() {
        let places = ConnectionSlots::new(4, 0);
        let of_key = |key| {
            let place = places.take(Peer::Local).unwrap();
            place.0.shared.show_key(key);
            place
        };
        let quiet = of_key("quiet");
        sleep(Duration::from_secs(1)).await;
        let mut flood = Vec::new();
        for _ in 0..10 {
            flood.push(of_key("flooder"));
            sleep(Duration::from_millis(1)).await;
        }
        assert!(!quiet.0.lost.is_cancelled());
        let left = flood.iter().map(|place| !place.0.lost.is_cancelled());
        assert!(left.eq((0..10).map(|i| i >= 7)));
    }

    #[tokio::test]
    async fn where_all_are_in_use_some_places_are_left_for_health() {
        let places = ConnectionSlots::new(1, 2);
        let used = in_use(&places.take(Peer::Local).unwrap());
        let (one, two) = (places.take(Peer::Local).unwrap(), places.take(Peer::Local).unwrap());
        assert!(one.is_reserved() && two.is_reserved() && !used.0.place.is_reserved());
        let three = places.take(Peer::Local).unwrap();
        assert!(one.0.lost.is_cancelled() && !two.0.lost.is_cancelled() && three.is_reserved());
        drop((one, two, three));
        assert_eq!(places.taken.lock().reserved.len(), 0);
        drop(used);
        assert!(!places.take(Peer::Local).unwrap().is_reserved());
    }

    #[tokio::test(start_paused = true)]
    async fn an_answer_that_nobody_reads_is_found_out() {
        let place = ConnectionSlots::new(1, 0).take(Peer::Local).unwrap();
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
        let place = ConnectionSlots::new(1, 0).take(Peer::Local).unwrap();
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
