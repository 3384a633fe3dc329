//! Places kept for health checks, for when all others are in use.
//!
//! Where all of these are taken as well, a new connection gets that of another: of one that has its answer, then the
//! one without news for longest of the peers that have most, where that is more than a monitor takes that makes several
//! checks at once. A request is news once, when it begins. So one peer's
//! connections, however many come, leave those of other peers alone; and a check of the same peer has the time in which
//! all places change hands, once to ask and once more to be answered.

use std::collections::{BTreeMap, HashMap};

use tokio::time::Instant;
use tokio_util::sync::CancellationToken;

use crate::access::Peer;

/// The reserved places that are taken, by the connection's number.
#[derive(Debug, Default)]
pub(super) struct Reserved(BTreeMap<u64, Guest>);

/// A connection in a reserved place.
#[derive(Debug)]
struct Guest {
    peer: Peer,
    stage: Stage,
    /// When the connection came, or its one request began.
    news: Instant,
    lost: CancellationToken,
}

/// One of so many reserved places and more of them are a flood where one peer takes them: 8 of 128. Fewer are a
/// monitor's that makes several checks at once, and do not make it the peer that has most.
const MONITORS: usize = 16;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    Silent,
    Requesting,
    Answered,
}

impl Reserved {
    /// Makes sure that one of `most` places is free; none where there are none.
    pub(super) fn free_one(&mut self, most: usize) -> Option<()> {
        if self.0.len() >= most {
            let gone = self.0.remove(&self.first_to_go(most)?)?;
            gone.lost.cancel();
        }
        (most > 0).then_some(())
    }

    pub(super) fn insert(&mut self, number: u64, peer: Peer, lost: CancellationToken) {
        self.0.insert(number, Guest { peer, stage: Stage::Silent, news: Instant::now(), lost });
    }

    pub(super) fn remove(&mut self, number: u64) {
        self.0.remove(&number);
    }

    /// A request of the connection begins.
    pub(super) fn asks(&mut self, number: u64) {
        if let Some(guest) = self.0.get_mut(&number).filter(|guest| guest.stage == Stage::Silent) {
            (guest.stage, guest.news) = (Stage::Requesting, Instant::now());
        }
    }

    /// A request of the connection is answered.
    pub(super) fn is_answered(&mut self, number: u64) {
        if let Some(guest) = self.0.get_mut(&number) {
            guest.stage = Stage::Answered;
        }
    }

    fn first_to_go(&self, places: usize) -> Option<u64> {
        let mut of_peer: HashMap<Peer, usize> = HashMap::new();
        self.0.values().for_each(|guest| *of_peer.entry(guest.peer).or_default() += 1);
        let burden = |peer: &Peer| of_peer[peer].max(places / MONITORS);
        let most = of_peer.keys().map(burden).max()?;
        let is_answered = |guest: &Guest| guest.stage == Stage::Answered;
        // Those of a lesser peer go last, and never do as long as there are others.
        let rank = |guest: &Guest| (!is_answered(guest), burden(&guest.peer) < most, guest.news);
        self.0.iter().min_by_key(|(_, guest)| rank(guest)).map(|(&number, _)| number)
    }

    #[cfg(test)]
    pub(super) fn len(&self) -> usize {
        self.0.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::net::Ipv4Addr;
    use std::time::Duration;

    /// So many places, and who is in them.
    struct ConnectionSlots {
        reserved: Reserved,
        most: usize,
        lost: Vec<CancellationToken>,
    }

    impl ConnectionSlots {
        fn new(most: usize) -> Self {
            Self { reserved: Reserved::default(), most, lost: Vec::new() }
        }

        /// A connection of that peer comes; its number.
        async fn comes(&mut self, peer: u8) -> u64 {
            tokio::time::advance(Duration::from_millis(1)).await;
            self.reserved.free_one(self.most).unwrap();
            let (number, lost) = (self.lost.len() as u64, CancellationToken::new());
            self.lost.push(lost.clone());
            self.reserved.insert(number, Peer::Address(Ipv4Addr::new(10, 0, 0, peer).into()), lost);
            number
        }

        fn left(&self) -> Vec<u64> {
            assert!(self.reserved.len() <= self.most);
            let there = |&number: &u64| !self.lost[number as usize].is_cancelled();
            (0..self.lost.len() as u64).filter(there).collect()
        }
    }

    #[tokio::test(start_paused = true)]
    async fn a_flood_from_many_addresses_leaves_a_monitor_several_checks_at_once() {
        let mut places = ConnectionSlots::new(48);
        for address in 0..48 {
            places.comes(address).await;
        }
        let checks = [places.comes(100).await, places.comes(100).await, places.comes(100).await];
        for address in 101..146 {
            places.comes(address).await;
        }
        assert!(checks.iter().all(|&check| !places.lost[check as usize].is_cancelled()));
    }

    #[tokio::test(start_paused = true)]
    async fn one_peers_flood_leaves_anothers_check_alone() {
        let mut places = ConnectionSlots::new(4);
        let check = places.comes(1).await;
        for _ in 0..100 {
            places.comes(2).await;
        }
        assert_eq!(places.left(), [check, 98, 99, 100]);
    }

    #[tokio::test(start_paused = true)]
    async fn of_one_peer_the_connection_without_news_for_longest_goes_and_a_request_is_news_once() {
        let mut places = ConnectionSlots::new(3);
        let check = places.comes(1).await;
        places.comes(1).await;
        places.comes(1).await;
        tokio::time::advance(Duration::from_millis(1)).await;
        places.reserved.asks(check);
        places.comes(1).await;
        assert_eq!(places.left(), [check, 2, 3]);
        places.reserved.asks(check);
        places.comes(1).await;
        places.comes(1).await;
        assert_eq!(places.left(), [3, 4, 5]);
    }

    #[tokio::test(start_paused = true)]
    async fn who_has_its_answer_goes_first() {
        let mut places = ConnectionSlots::new(3);
        places.comes(1).await;
        places.comes(1).await;
        let answered = places.comes(2).await;
        places.reserved.asks(answered);
        places.reserved.is_answered(answered);
        places.comes(1).await;
        assert_eq!(places.left(), [0, 1, 3]);
    }

    #[test]
    fn where_none_are_reserved_there_is_none_to_free() {
        assert_eq!(Reserved::default().free_one(0), None);
    }
}
