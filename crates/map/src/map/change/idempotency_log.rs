//! Changes that were asked for under an id, so that asking twice does them once.

use std::collections::{BTreeMap, HashMap, VecDeque};

use super::committed::Committed;
use super::records::{Request, UndoRecord};
use crate::map::name::{CallerName, RequestId};

/// Requests that a map remembers, those of all callers together.
pub const REQUESTS_KEPT: usize = 65_536;

/// Requests of one caller with a name that a map remembers: one more displaces the caller's own oldest. Those of
/// callers without a name, as all of a server without keys are, share [`REQUESTS_KEPT`] with the others.
pub const REQUESTS_PER_CALLER_KEPT: usize = 8_192;

/// A change that was asked for under an id, and what came of it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CompletedRequest {
    /// Chosen by the caller.
    pub id: RequestId,
    /// A digest of what was asked for.
    pub digest: u64,
    /// The caller who asked for it, where that is known.
    pub caller: Option<CallerName>,
    /// The revision that it made.
    pub revision: u64,
    /// Finest voxels that it took out.
    pub removed: usize,
    /// Finest voxels that it put back.
    pub restored: usize,
    /// Scans that it took back.
    pub scans: usize,
    /// Deletions that it took back.
    pub deletions: usize,
    /// What was asked for.
    pub kind: RequestKind,
}

/// The last answered requests of each caller, in the order of their revisions.
///
/// A caller with a name has [`REQUESTS_PER_CALLER_KEPT`] at most, so that nobody's requests displace those of others.
/// Where [`REQUESTS_KEPT`] are remembered all the same, the oldest goes of the caller that has most: who asks for
/// little keeps all of it.
#[derive(Debug, Clone, Default)]
pub struct IdempotencyLog {
    /// By the revision that each made.
    answered: BTreeMap<u64, CompletedRequest>,
    by_id: HashMap<Key, u64>,
    /// The revisions of each caller's, ascending.
    by_caller: BTreeMap<Option<CallerName>, VecDeque<u64>>,
}

/// Whose id it is, and for what: callers do not know of each other's ids.
type Key = (Option<CallerName>, RequestKind, RequestId);

/// What was asked for. Ids of one kind say nothing of those of another: who may undo scans is not always who may
/// delete.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum RequestKind {
    /// Voxels taken out.
    Deletion,
    /// Scans and deletions taken back.
    Undo,
    /// A keep-out put or removed.
    KeepOut,
}

impl CompletedRequest {
    /// The request for a deletion that was made.
    pub(in crate::map) fn of_deletion(request: &Request, committed: &Committed) -> Self {
        Self { kind: RequestKind::Deletion, ..Self::of_undo(request, &UndoRecord::default(), committed) }
    }

    /// The request for a keep-out, put or removed, that was granted.
    pub(in crate::map) fn of_keep_out(request: &Request, committed: &Committed) -> Self {
        Self { kind: RequestKind::KeepOut, ..Self::of_deletion(request, committed) }
    }

    /// The request for an undo that was made.
    pub(in crate::map) fn of_undo(request: &Request, undo: &UndoRecord, committed: &Committed) -> Self {
        let Request { id, digest, caller } = request.clone();
        let &Committed { revision, added, removed, .. } = committed;
        let (scans, deletions) = (undo.scans.len(), undo.deletions.len());
        let kind = RequestKind::Undo;
        Self { id, digest, caller, revision, removed, restored: added, scans, deletions, kind }
    }

    fn key(&self) -> Key {
        (self.caller.clone(), self.kind, self.id.clone())
    }
}

impl IdempotencyLog {
    /// What came of the caller's request of that kind and id. Requests of which nobody noted the caller, as those of a
    /// server that had no keys then, are everybody's.
    pub fn find(
        &self,
        kind: RequestKind,
        id: &RequestId,
        caller: Option<&CallerName>,
    ) -> Option<&CompletedRequest> {
        let of = |caller| self.by_id.get(&(caller, kind, id.clone()));
        self.answered.get(of(caller.cloned()).or_else(|| of(None))?)
    }

    /// All completed requests, in the order of their revisions.
    pub fn iter(&self) -> impl Iterator<Item = &CompletedRequest> {
        self.answered.values()
    }

    /// Remembers a request in place of an older one of its caller, kind and id. No server answers an id that it
    /// remembers, but a journal may have been written by one that remembered fewer.
    pub(in crate::map) fn push(&mut self, request: CompletedRequest) {
        let (caller, revision) = (request.caller.clone(), request.revision);
        if let Some(older) = self.by_id.insert(request.key(), revision) {
            self.forget(older);
        }
        self.by_caller.entry(caller.clone()).or_default().push_back(revision);
        self.answered.insert(revision, request);
        if caller.is_some() && self.of(&caller) > REQUESTS_PER_CALLER_KEPT {
            self.forget_oldest_of(&caller);
        } else if self.answered.len() > REQUESTS_KEPT {
            let most = self.by_caller.iter().max_by_key(|(other, of)| (of.len(), **other == caller));
            if let Some(most) = most.map(|(most, _)| most.clone()) {
                self.forget_oldest_of(&most);
            }
        }
    }

    /// How many requests of a caller are remembered.
    fn of(&self, caller: &Option<CallerName>) -> usize {
        self.by_caller.get(caller).map_or(0, VecDeque::len)
    }

    fn forget_oldest_of(&mut self, caller: &Option<CallerName>) {
        let oldest = self.by_caller.get(caller).and_then(|of| of.front().copied());
        if let Some(gone) = oldest.and_then(|revision| self.forget(revision)) {
            self.by_id.remove(&gone.key());
        }
    }

    /// Takes out the request that made `revision`, but for its id.
    fn forget(&mut self, revision: u64) -> Option<CompletedRequest> {
        let gone = self.answered.remove(&revision)?;
        if let Some(of) = self.by_caller.get_mut(&gone.caller) {
            of.binary_search(&revision).ok().and_then(|i| of.remove(i));
            if of.is_empty() {
                self.by_caller.remove(&gone.caller);
            }
        }
        Some(gone)
    }
}

impl PartialEq for IdempotencyLog {
    fn eq(&self, other: &Self) -> bool {
        self.answered == other.answered
    }
}

impl FromIterator<CompletedRequest> for IdempotencyLog {
    fn from_iter<I: IntoIterator<Item = CompletedRequest>>(answered: I) -> Self {
        let mut requests = Self::default();
        answered.into_iter().for_each(|request| requests.push(request));
        requests
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn request(n: u64) -> CompletedRequest {
        let id = RequestId::new(&format!("r{n}")).unwrap();
        CompletedRequest {
            id,
            digest: n,
            caller: None,
            revision: n * 3,
            removed: 1,
            restored: 0,
            scans: 0,
            deletions: 0,
            kind: RequestKind::Deletion,
        }
    }

    fn of_caller(caller: &str, n: u64) -> CompletedRequest {
        CompletedRequest { caller: Some(CallerName::new(caller).unwrap()), ..request(n) }
    }

    fn remembers(requests: &IdempotencyLog, n: u64) -> bool {
        requests.iter().any(|request| request.digest == n)
    }

    #[test]
    fn a_request_of_one_kind_answers_for_none_of_another_of_the_same_id() {
        const KINDS: [RequestKind; 3] = [RequestKind::Deletion, RequestKind::Undo, RequestKind::KeepOut];
        for kind in KINDS {
            let of_kind = CompletedRequest { kind, ..request(1) };
            let requests: IdempotencyLog = [of_kind.clone()].into_iter().collect();
            for other in KINDS {
                let found = requests.find(other, &of_kind.id, None);
                assert_eq!(found, Some(&of_kind).filter(|_| other == kind), "{kind:?} {other:?}");
            }
        }
    }

    #[test]
    fn an_id_is_remembered_once_a_caller_and_callers_do_not_know_of_each_others() {
        let of = |caller: &str, revision| CompletedRequest { revision, ..of_caller(caller, 1) };
        let (mallory, old, alice) = (of("mallory", 2), of("alice", 3), of("alice", 9));
        let requests: IdempotencyLog = [mallory.clone(), old, alice.clone()].into_iter().collect();
        assert!(requests.iter().eq([&mallory, &alice]));
        let find = |caller: &str| {
            requests.find(RequestKind::Deletion, &alice.id, Some(&CallerName::new(caller).unwrap()))
        };
        assert_eq!((find("mallory"), find("alice"), find("bob")), (Some(&mallory), Some(&alice), None));
        assert_eq!(requests.find(RequestKind::Deletion, &alice.id, None), None);
        assert_eq!(requests.of(&alice.caller), 1);
    }

    #[test]
    fn a_request_whose_caller_nobody_noted_is_everybodys() {
        let requests: IdempotencyLog = [request(1)].into_iter().collect();
        let caller = CallerName::new("r1").unwrap();
        assert_eq!(requests.find(RequestKind::Deletion, &request(1).id, Some(&caller)), Some(&request(1)));
    }

    #[test]
    fn the_oldest_request_of_a_caller_is_forgotten_first() {
        let kept = REQUESTS_PER_CALLER_KEPT as u64;
        let requests: IdempotencyLog = (0..kept + 2).map(|n| of_caller("r1", n)).collect();
        assert!(!remembers(&requests, 1) && remembers(&requests, 2) && remembers(&requests, kept + 1));
        assert_eq!(requests.iter().count(), REQUESTS_PER_CALLER_KEPT);
    }

    #[test]
    fn callers_without_a_name_share_all_there_is() {
        let kept = REQUESTS_KEPT as u64;
        let requests: IdempotencyLog = (0..kept + 2).map(request).collect();
        assert!(!remembers(&requests, 1) && remembers(&requests, 2) && remembers(&requests, kept + 1));
        assert_eq!(requests.iter().count(), REQUESTS_KEPT);
    }

    #[test]
    fn one_callers_flood_displaces_none_of_anothers_requests() {
        let flood = (10..10 + REQUESTS_KEPT as u64).map(|n| of_caller("flooder", n));
        let requests: IdempotencyLog = [request(1), of_caller("quiet", 2)].into_iter().chain(flood).collect();
        assert!(remembers(&requests, 1) && remembers(&requests, 2));
        // The same after they were written and read.
        let again: IdempotencyLog = requests.iter().cloned().collect();
        assert_eq!(again, requests);
        assert!(remembers(&again, 2) && !remembers(&again, 10));
    }

    #[test]
    fn of_many_callers_the_one_that_has_most_gives_way() {
        let full = (REQUESTS_KEPT / REQUESTS_PER_CALLER_KEPT) as u64;
        let greedy = |caller: u64| {
            let name = format!("c{caller}");
            let first = 100_000 * (caller + 1);
            (first..first + REQUESTS_PER_CALLER_KEPT as u64).map(move |n| of_caller(&name, n))
        };
        let mut requests: IdempotencyLog = (0..full).flat_map(greedy).collect();
        assert_eq!(requests.iter().count(), REQUESTS_KEPT);
        for n in 0..100 {
            requests.push(of_caller("quiet", 90_000_000 + n));
        }
        assert_eq!(requests.iter().count(), REQUESTS_KEPT);
        assert!((0..100).all(|n| remembers(&requests, 90_000_000 + n)));
        let left = |caller: u64| requests.of(&Some(CallerName::new(&format!("c{caller}")).unwrap()));
        assert!((0..full).all(|caller| left(caller) >= REQUESTS_PER_CALLER_KEPT - 13));
        let again: IdempotencyLog = requests.iter().cloned().collect();
        assert_eq!(again, requests);
    }
}
