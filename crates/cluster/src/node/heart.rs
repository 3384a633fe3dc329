//! A node's beats, and what it sees of those of the others.

use std::collections::{BTreeMap, BTreeSet};
use std::io::ErrorKind;
use std::net::{TcpStream, ToSocketAddrs};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

use mrol_service::replication::NodeName;
use mrol_service::{Lead, MapService, SharedMap};
use parking_lot::Mutex;
use tokio::sync::watch;
use uuid::Uuid;

use super::lag::Lag;
use super::own_beats::{NotPut, OwnBeats};
use super::settings::NodeSettings;
use super::view::{Seen, View};
use crate::beat::{Beat, MapHead};
use crate::beats::{BEAT_EVERY, NodeBeat};
use crate::catalog::Listing;
use crate::forwarder::Forwarder;
use crate::liveness::Liveness;
use crate::store::ClusterStore;

/// How long a port of a silent node may take to answer.
const PORT_WITHIN: Duration = Duration::from_millis(200);
/// Least time between two beats that are asked for.
const ASKED_EVERY: Duration = Duration::from_millis(50);

/// What a heart is told.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Pulse {
    /// To beat at once: somebody waits for what this node has read, or this one for what others say.
    Beat,
    /// To end.
    End,
}

/// A node's beats. They have a thread of their own, so that nothing else that the node does delays them.
pub(super) struct Heart {
    pub(super) settings: NodeSettings,
    pub(super) joined: ClusterStore,
    pub(super) service: MapService,
    /// Is told the addresses of the others.
    pub(super) forwarder: Arc<Forwarder>,
    pub(super) view: watch::Sender<View>,
    /// The maps of the cluster, as far as this node has read.
    pub(super) list: watch::Receiver<Listing>,
    /// Whether it is where the others are.
    pub(super) lag: Arc<Mutex<Lag>>,
}

impl Heart {
    /// Beats until it is told to end.
    pub(super) fn beat(self, pulses: &Receiver<Pulse>) {
        let mut liveness = Liveness::new(self.settings.name.clone());
        let mut own_beats = OwnBeats::new(self.joined.beats.clone(), self.settings.name.clone());
        let (mut before, mut last_said) = (View::default(), None);
        loop {
            let begun = Instant::now();
            let beat = self.beat_once(&mut own_beats, &mut liveness, true);
            if let Some(own) = self.heard(beat, &mut last_said) {
                self.note_lag(&own, &before);
                before = self.view.borrow().clone();
            }
            while let Some(rest) = BEAT_EVERY.checked_sub(begun.elapsed()) {
                match pulses.recv_timeout(rest) {
                    Ok(Pulse::Beat) => {
                        std::thread::sleep(ASKED_EVERY);
                        if pulses.try_iter().any(|pulse| pulse == Pulse::End) {
                            return self.end(&mut own_beats);
                        }
                        let beat = self.beat_once(&mut own_beats, &mut liveness, false);
                        self.heard(beat, &mut last_said);
                    }
                    Ok(Pulse::End) | Err(RecvTimeoutError::Disconnected) => return self.end(&mut own_beats),
                    Err(RecvTimeoutError::Timeout) => break,
                }
            }
        }
    }

    /// The beat, where it was heard. Notes whether this node's are, and says why not, `last_said` being what was said
    /// last.
    fn heard(&self, beat: Result<Beat, NotPut>, last_said: &mut Option<String>) -> Option<Beat> {
        let said = beat.as_ref().err().map(ToString::to_string);
        self.view.send_if_modified(|view| {
            let is_new = view.is_unheard != said.is_some();
            view.is_unheard = said.is_some();
            is_new
        });
        match &said {
            Some(why) if said != *last_said => {
                tracing::warn!(why, "this node's beats do not count: it takes no map over")
            }
            None if last_said.is_some() => tracing::info!("this node's beats count again"),
            _ => {}
        }
        *last_said = said;
        beat.ok()
    }

    /// Says that nobody is to wait for this node any more.
    fn end(&self, own_beats: &mut OwnBeats) {
        let last = Beat { has_ended: true, ..self.own_beat() };
        if let Err(error) = own_beats.put(&last) {
            tracing::debug!(%error, "the other nodes have to miss this one");
        }
    }

    /// Beats, and sees what the others say. Where it `counts`, the silence of others is measured by it.
    fn beat_once(
        &self,
        own_beats: &mut OwnBeats,
        liveness: &mut Liveness,
        counts: bool,
    ) -> Result<Beat, NotPut> {
        let own = self.own_beat();
        let revision = own_beats.put(&own)?;
        match counts {
            true => liveness.own_beat_acknowledged(revision),
            false => liveness.beat_between_acknowledged(revision),
        }
        let View { beats, all_beats, .. } = *self.view.borrow();
        let (beats, all_beats) = (beats + u64::from(counts), all_beats + 1);
        let read = self.joined.beats.read()?;
        let revisions = read.iter().map(|beat| (beat.node.clone(), beat.revision)).collect();
        if !liveness.beats_read(&revisions) {
            // Of a server that lags.
            self.view.send_modify(|view| (view.beats, view.all_beats) = (beats, all_beats));
            return Ok(own);
        }
        let others: Vec<NodeBeat> = read.into_iter().filter(|beat| beat.node != self.settings.name).collect();
        let silent: Vec<NodeName> = liveness.silent().cloned().collect();
        // Each look may take a while: those that are gone anyhow are not looked at.
        let doubtful = |other: &&NodeBeat| {
            silent.contains(&other.node) && !liveness.is_gone(&other.node) && !other.beat.has_ended
        };
        let doubtful: Vec<_> = others.iter().filter(doubtful).collect();
        for other in doubtful {
            if is_refused(&other.beat.grpc) {
                liveness.port_refused(&other.node);
            }
        }
        let seen = |NodeBeat { node, revision, beat }: NodeBeat| {
            let is_live = !liveness.is_gone(&node) && !beat.has_ended;
            (node, Seen { beat, revision, is_live })
        };
        let others = others.into_iter().map(seen).collect();
        let (seen, is_settled) = (Some(Instant::now()), liveness.is_settled());
        let now = View { beats, all_beats, revision, seen, is_settled, is_unheard: false, others };
        tell_changes(&self.view.borrow(), &now);
        let grpc = now.others.iter().map(|(node, seen)| (node.clone(), seen.beat.grpc.clone()));
        // The secret of the cluster is sent there: in the clear only where this node serves in the clear as well.
        let is_secured = own.grpc.starts_with("https://");
        let grpc = grpc.filter(|(_, address)| !is_secured || address.starts_with("https://"));
        self.forwarder.set_addresses(grpc.collect());
        self.view.send_replace(now);
        Ok(own)
    }

    /// Notes whether this node is behind the others. What they had a beat ago is to be here by now; at the first beat
    /// it is known what they have.
    fn note_lag(&self, own: &Beat, before: &View) {
        let now = self.view.borrow();
        if now.seen.is_none() {
            return;
        }
        let elsewhere = self.list.borrow().not_held_by(&self.settings.name);
        let then = if before.seen.is_some() { before } else { &*now };
        let is_behind = is_behind(own, then, &elsewhere);
        drop(now);
        // The beats of the others may be from before a map was made.
        let is_joining = *self.lag.lock() == Lag::NotThereYet;
        let is_behind = is_behind || (is_joining && self.lacks_a_map());
        let mut lag = self.lag.lock();
        *lag = lag.then(is_behind, Instant::now());
    }

    /// True where the list has a map of which this node has no copy, or is not known.
    fn lacks_a_map(&self) -> bool {
        let Ok((listing, _)) = self.joined.catalog.read() else { return true };
        let copies: BTreeSet<Uuid> =
            self.service.shared_maps().into_iter().map(|map| map.version.map_uuid).collect();
        let mut held = listing.maps().filter(|(_, entry)| entry.holders().contains(&self.settings.name));
        held.any(|(_, entry)| !copies.contains(&entry.uuid))
    }

    fn own_beat(&self) -> Beat {
        let NodeSettings { http, grpc, version, record_version, .. } = self.settings.clone();
        let free_bytes = self.service.measure().disk_free_bytes.unwrap_or(u64::MAX);
        let copies = self.service.shared_maps();
        let unjoined = unjoined(&copies, &self.list.borrow());
        let maps = copies.into_iter().filter_map(head_of).collect();
        let no_room = self.service.shortages().first().map(|shortage| shortage.reason().as_str().to_owned());
        Beat { http, grpc, version, record_version, maps, unjoined, free_bytes, no_room, has_ended: false }
    }
}

fn head_of(map: SharedMap) -> Option<(Uuid, MapHead)> {
    let Lead::Shared { is_here, epoch, claim, sequence, agrees, .. } = map.lead else { return None };
    let is_parted = map.failure.is_some();
    let revision = map.version.revision;
    Some((
        map.version.map_uuid,
        MapHead { revision, epoch, claim, sequence, leads: is_here, is_parted, agrees },
    ))
}

/// The copies that have not joined their logs, with their revisions. One that another took the place of is kept under
/// another name than the list has for the map, and joins no log.
fn unjoined(copies: &[SharedMap], list: &Listing) -> BTreeMap<Uuid, u64> {
    let name_of = |uuid: Uuid| list.maps().find(|(_, entry)| entry.uuid == uuid).map(|(name, _)| name);
    let unjoined = copies.iter().filter(|copy| copy.lead == Lead::NotJoined);
    let listed = unjoined.filter(|copy| name_of(copy.version.map_uuid).is_none_or(|name| name == copy.name));
    listed.map(|copy| (copy.version.map_uuid, copy.version.revision)).collect()
}

/// True where a copy is behind where another node was then, or is not there, of a map that is not held `elsewhere`.
fn is_behind(own: &Beat, then: &View, elsewhere: &BTreeSet<Uuid>) -> bool {
    let is_reached = |map: &Uuid, revision: u64| {
        own.maps.get(map).is_some_and(|own| own.agrees && own.revision >= revision)
    };
    let furthest = then.furthest();
    let mut held = furthest.iter().filter(|(map, _)| !elsewhere.contains(map));
    held.any(|(map, revision)| !is_reached(map, *revision))
}

/// Tells the log which nodes have come and gone.
fn tell_changes(before: &View, now: &View) {
    let live = |view: &View| -> BTreeMap<NodeName, bool> {
        view.others.iter().map(|(node, seen)| (node.clone(), seen.is_live)).collect()
    };
    let (before, now) = (live(before), live(now));
    for (node, is_live) in now {
        match (before.get(&node), is_live) {
            (Some(true), false) => tracing::warn!(%node, "a node is gone"),
            (Some(false) | None, true) => tracing::info!(%node, "a node is there"),
            _ => {}
        }
    }
}

/// True where nothing listens at an address: more than that it does not answer.
fn is_refused(address: &str) -> bool {
    let host = address.split_once("://").map_or(address, |(_, host)| host);
    let resolved = host.to_socket_addrs().ok().and_then(|mut all| all.next());
    let connected = resolved.map(|resolved| TcpStream::connect_timeout(&resolved, PORT_WITHIN));
    matches!(connected, Some(Err(error)) if error.kind() == ErrorKind::ConnectionRefused)
}

#[cfg(test)]
mod tests {
    use std::net::TcpListener;

    use super::*;

    #[test]
    fn a_port_refuses_where_nothing_listens() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = format!("http://{}", listener.local_addr().unwrap());
        assert!(!is_refused(&address));
        drop(listener);
        assert!(is_refused(&address));
        assert!(!is_refused("http://no-such-host.invalid:1"), "it is not known");
    }
}
