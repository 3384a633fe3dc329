//! Changes that were asked for under an id, so that asking twice does them once.

use std::collections::{HashMap, VecDeque};

use super::RequestId;

/// Requests that a map remembers; the oldest are forgotten first.
pub const REQUESTS_KEPT: usize = 65_536;

/// A change that was asked for under an id, and what came of it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AnsweredRequest {
    /// Chosen by the caller.
    pub id: RequestId,
    /// Of what was asked for.
    pub digest: u64,
    /// The revision that it made.
    pub revision: u64,
    /// Finest voxels that it took out.
    pub voxels: usize,
    /// Scans that it took out.
    pub scans: usize,
}

/// The last [`REQUESTS_KEPT`] answered requests, in the order of their revisions.
#[derive(Debug, Clone, Default)]
pub struct Requests {
    answered: VecDeque<AnsweredRequest>,
    by_id: HashMap<(RequestId, RequestKind), u64>,
}

/// What was asked for. Ids of one kind say nothing of those of the other: who may undo scans is not always who may delete.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum RequestKind {
    /// Voxels taken out.
    Deletion,
    /// Scans taken out again.
    Undo,
}

impl AnsweredRequest {
    /// Its kind: an undo takes out a scan at least, a deletion none.
    pub fn kind(&self) -> RequestKind {
        if self.scans > 0 { RequestKind::Undo } else { RequestKind::Deletion }
    }
}

impl Requests {
    /// What came of the request of that kind and id.
    pub fn find(&self, kind: RequestKind, id: &RequestId) -> Option<&AnsweredRequest> {
        let revision = self.by_id.get(&(id.clone(), kind))?;
        let place = self.answered.binary_search_by_key(revision, |request| request.revision).ok()?;
        self.answered.get(place)
    }

    /// All of them, in the order of their revisions.
    pub fn iter(&self) -> impl Iterator<Item = &AnsweredRequest> {
        self.answered.iter()
    }

    pub(super) fn push(&mut self, request: AnsweredRequest) {
        if self.answered.len() == REQUESTS_KEPT
            && let Some(oldest) = self.answered.pop_front()
        {
            let kind = oldest.kind();
            self.by_id.remove(&(oldest.id, kind));
        }
        self.by_id.insert((request.id.clone(), request.kind()), request.revision);
        self.answered.push_back(request);
    }
}

impl PartialEq for Requests {
    fn eq(&self, other: &Self) -> bool {
        self.answered == other.answered
    }
}

impl FromIterator<AnsweredRequest> for Requests {
    fn from_iter<I: IntoIterator<Item = AnsweredRequest>>(answered: I) -> Self {
        let mut requests = Self::default();
        answered.into_iter().for_each(|request| requests.push(request));
        requests
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn request(n: u64) -> AnsweredRequest {
        let id = RequestId::new(&format!("r{n}")).unwrap();
        AnsweredRequest { id, digest: n, revision: n * 3, voxels: 1, scans: 0 }
    }

    #[test]
    fn an_undo_answers_for_no_deletion_of_the_same_id() {
        let undo = AnsweredRequest { scans: 1, ..request(1) };
        let requests: Requests = [undo.clone()].into_iter().collect();
        assert_eq!(requests.find(RequestKind::Deletion, &undo.id), None);
        assert_eq!(requests.find(RequestKind::Undo, &undo.id), Some(&undo));
    }

    #[test]
    fn the_oldest_request_is_forgotten_first() {
        let kept = REQUESTS_KEPT as u64;
        let requests: Requests = (0..kept + 2).map(request).collect();
        let find = |n: u64| requests.find(RequestKind::Deletion, &request(n).id);
        assert_eq!(find(1), None);
        assert_eq!(find(2), Some(&request(2)));
        assert_eq!(find(kept + 1), Some(&request(kept + 1)));
        assert_eq!(requests.iter().count(), REQUESTS_KEPT);
    }
}
