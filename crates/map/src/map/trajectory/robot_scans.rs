//! The scans of one robot.

use std::collections::BTreeMap;

use super::chunked::Chunked;
use super::id_ranges::IdRanges;
use super::known_scan::ForgottenIds;
use super::scan::MappedScan;
use super::session::Session;
use super::thinning::Seen;
use crate::map::name::SessionName;

/// Sessions of one robot whose scan ids a map tells apart, at most, besides the empty one. Beyond, the session that was
/// used least recently is closed: its name alone is remembered, and each of its ids counts as too old.
pub const SESSIONS_PER_ROBOT_MAX: usize = 64;

/// Where the poses of one robot are, and which of its scan ids are known.
#[derive(Debug, Clone, Default)]
pub(super) struct RobotScans {
    /// Revisions of the robot's scans that are stored and not undone.
    pub(super) revisions: Chunked<u64>,
    sessions: BTreeMap<SessionName, Session>,
    /// Digests of the names of closed sessions.
    closed: IdRanges,
    pub(super) seen: Seen,
}

/// What is known of a scan id.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum KnownId {
    /// It is that of the scan which made this revision.
    Of(u64),
    /// It is, or may be, that of a scan whose pose is not stored any more.
    TooOld,
}

impl RobotScans {
    pub(super) fn push(&mut self, pose: &MappedScan) {
        self.revisions.insert(pose.revision);
        self.push_id(pose);
    }

    /// Notes the id of a scan, undone or not.
    pub(super) fn push_id(&mut self, pose: &MappedScan) {
        let Some(id) = pose.scan_id.filter(|_| !self.is_closed(&pose.session)) else { return };
        self.sessions.entry(pose.session.clone()).or_default().push(id, pose.revision);
        self.close_oldest();
    }

    /// Takes over what is known of ids whose scans are not stored.
    pub(super) fn remember(&mut self, ids: &ForgottenIds<'_>) {
        let ranges = ids.ranges.iter().copied();
        match ids.session {
            Some(session) => {
                let of_session = Session::of_forgotten(ranges, ids.last_revision);
                self.sessions.insert(session.clone(), of_session);
                self.close_oldest();
            }
            None => ranges.for_each(|(first, last)| self.closed.insert(first, last)),
        }
    }

    /// Closes the session that was used least recently, where there are too many.
    fn close_oldest(&mut self) {
        let named = self.sessions.keys().filter(|name| !name.is_empty()).count();
        if named <= SESSIONS_PER_ROBOT_MAX {
            return;
        }
        let named = self.sessions.iter().filter(|(name, _)| !name.is_empty());
        let oldest = named.min_by_key(|(_, session)| session.last_revision).map(|(name, _)| name.clone());
        if let Some(oldest) = oldest {
            self.sessions.remove(&oldest);
            let digest = digest(&oldest);
            self.closed.insert(digest, digest);
        }
    }

    fn is_closed(&self, session: &SessionName) -> bool {
        !session.is_empty() && !self.sessions.contains_key(session) && self.closed.contains(digest(session))
    }

    /// What is known of an id of a session.
    pub(super) fn find(&self, session: &SessionName, id: u64) -> Option<KnownId> {
        if self.is_closed(session) {
            return Some(KnownId::TooOld);
        }
        let session = self.sessions.get(session)?;
        let stored = session.find(id).map(KnownId::Of);
        stored.or_else(|| session.has_forgotten(id).then_some(KnownId::TooOld))
    }

    /// The sessions with a stored scan of this id, and the revisions that these made; the one that was used last comes
    /// first.
    pub(super) fn sessions_with(&self, id: u64) -> Vec<(&SessionName, u64)> {
        let found =
            self.sessions.iter().filter_map(|(name, session)| Some((name, session, session.find(id)?)));
        let mut found: Vec<_> = found.collect();
        found.sort_by_key(|(_, session, _)| std::cmp::Reverse(session.last_revision));
        found.into_iter().map(|(name, _, revision)| (name, revision)).collect()
    }

    /// The robot's own name of a session, where it is known: one text for all scans.
    pub(super) fn session_name(&self, session: &SessionName) -> Option<&SessionName> {
        self.sessions.get_key_value(session).map(|(name, _)| name)
    }

    /// Forgets these scans, whose poses are not stored any more; their ids stay known.
    pub(super) fn forget<'p>(&mut self, poses: impl Iterator<Item = &'p MappedScan>) {
        let mut by_session: BTreeMap<&SessionName, Vec<(u64, u64)>> = BTreeMap::new();
        let mut revisions = Vec::new();
        for pose in poses {
            revisions.push(pose.revision);
            if let Some(id) = pose.scan_id {
                by_session.entry(&pose.session).or_default().push((id, pose.revision));
            }
        }
        self.revisions.remove_all(&revisions);
        for (session, scans) in by_session {
            if let Some(session) = self.sessions.get_mut(session) {
                session.forget(&scans);
            }
        }
    }

    /// Takes out the scans that made `revisions`, ascending; their ids stay known.
    pub(super) fn withdraw(&mut self, revisions: &[u64]) {
        self.revisions.remove_all(revisions);
    }

    /// Ids whose scans are not stored, session by session; at last the closed sessions. Named sessions are among them
    /// even without such an id, since the time of their last use is known from here alone.
    pub(super) fn forgotten(&self) -> impl Iterator<Item = ForgottenIds<'_>> {
        let sessions = self.sessions.iter().map(|(name, session)| ForgottenIds {
            session: Some(name),
            ranges: session.forgotten(),
            last_revision: if name.is_empty() { 0 } else { session.last_revision },
        });
        let sessions = sessions.filter(|ids| ids.last_revision > 0 || !ids.ranges.is_empty());
        let closed = ForgottenIds { session: None, ranges: self.closed.as_slice(), last_revision: 0 };
        sessions.chain(Some(closed).filter(|closed| !closed.ranges.is_empty()))
    }

    /// The revisions before `before` that are to be judged, all but the last two of them, ascending.
    pub(super) fn unjudged(&self, before: u64) -> Vec<u64> {
        let unjudged = self.revisions.from(self.seen.judged.saturating_add(1));
        let mut revisions: Vec<u64> = unjudged.copied().take_while(|&revision| revision < before).collect();
        revisions.truncate(revisions.len().saturating_sub(2));
        revisions
    }

    /// The last revision that a scan of a session made, as far as that is known.
    pub(super) fn last_revision(&self) -> u64 {
        self.sessions.values().map(|session| session.last_revision).max().unwrap_or_default()
    }

    /// True of a robot of whom nothing is known.
    pub(super) fn is_unknown(&self) -> bool {
        self.revisions.is_empty() && self.sessions.is_empty() && self.closed.as_slice().is_empty()
    }

    pub(super) fn bytes(&self) -> usize {
        const OF_SESSION: usize =
            2 * (size_of::<(SessionName, Session)>() + crate::map::name::NAME_LENGTH_MAX);
        let sessions: usize = self.sessions.values().map(|session| OF_SESSION + session.bytes()).sum();
        size_of::<Self>() + self.revisions.bytes() + sessions + self.closed.bytes() + self.seen.bytes()
    }
}

/// The digest by which the name of a closed session is remembered: FNV-1a of 64 bits, the same on every machine, and
/// its bits mixed, so that names which differ in their last letter do not lie beside each other.
fn digest(session: &SessionName) -> u64 {
    let fnv = session.as_str().bytes().fold(0xcbf2_9ce4_8422_2325, |digest: u64, byte| {
        (digest ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3)
    });
    let mixed = (fnv ^ fnv >> 33).wrapping_mul(0xff51_afd7_ed55_8ccd);
    mixed ^ mixed >> 33
}
