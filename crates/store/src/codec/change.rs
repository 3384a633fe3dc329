//! Encoding of changes, and of the requests that made them.

use super::unreadable::{Unreadable, count, required};
use crate::pb;
use mrol_map::map::{
    CallerName, Change, CompletedRequest, DeletionRecord, Request, RequestId, RequestKind, UndoRecord,
};
use mrol_map::voxel::VoxelSet;

impl From<&Change> for pb::Change {
    fn from(change: &Change) -> Self {
        use pb::change::Kind;
        let kind = match change {
            Change::Insertion(scan) => Kind::Insertion(scan.into()),
            Change::Deletion(deletion) => Kind::Deletion(deletion.into()),
            Change::Undo(undo) => Kind::Undo(undo.into()),
            Change::KeepOut(keep_out) => Kind::KeepOut(keep_out.into()),
        };
        Self { kind: Some(kind) }
    }
}

impl TryFrom<pb::Change> for Change {
    type Error = Unreadable;

    fn try_from(message: pb::Change) -> Result<Self, Unreadable> {
        use pb::change::Kind;
        match required(message.kind, "the change's kind, or known to this version,")? {
            Kind::Insertion(scan) => Ok(Self::Insertion(scan.try_into()?)),
            Kind::Deletion(deletion) => Ok(Self::Deletion(deletion.try_into()?)),
            Kind::Undo(undo) => Ok(Self::Undo(undo.try_into()?)),
            Kind::KeepOut(keep_out) => Ok(Self::KeepOut(keep_out.try_into()?)),
        }
    }
}

impl From<&DeletionRecord> for pb::Deletion {
    fn from(deletion: &DeletionRecord) -> Self {
        Self { voxels: Some((&deletion.voxels).into()), request: deletion.request.as_ref().map(Into::into) }
    }
}

impl TryFrom<pb::Deletion> for DeletionRecord {
    type Error = Unreadable;

    fn try_from(message: pb::Deletion) -> Result<Self, Unreadable> {
        Ok(Self {
            voxels: required(message.voxels, "deletion.voxels")?.try_into()?,
            request: message.request.map(Request::try_from).transpose()?,
        })
    }
}

impl From<&UndoRecord> for pb::Undo {
    fn from(undo: &UndoRecord) -> Self {
        Self {
            scans: undo.scans.clone(),
            deletions: undo.deletions.clone(),
            removed: Some((&undo.removed).into()),
            restored: (!undo.restored.is_empty()).then(|| (&undo.restored).into()),
            moments: Some((&undo.moments).into()),
            request: undo.request.as_ref().map(Into::into),
        }
    }
}

impl TryFrom<pb::Undo> for UndoRecord {
    type Error = Unreadable;

    fn try_from(message: pb::Undo) -> Result<Self, Unreadable> {
        if !message.scans.is_sorted() || !message.deletions.is_sorted() {
            return Err("undo.scans and undo.deletions must ascend".into());
        }
        let removed = required(message.removed, "undo.removed")?.try_into()?;
        let restored = message.restored.unwrap_or_default().try_into()?;
        if !VoxelSet::is_disjoint(&removed, &restored) {
            return Err("undo.restored has voxels of undo.removed".into());
        }
        Ok(Self {
            scans: message.scans,
            deletions: message.deletions,
            removed,
            restored,
            moments: message.moments.unwrap_or_default().try_into()?,
            request: message.request.map(Request::try_from).transpose()?,
        })
    }
}

impl From<&Request> for pb::Request {
    fn from(request: &Request) -> Self {
        let caller = text_of(request.caller.as_ref());
        Self { id: request.id.as_str().to_owned(), digest: request.digest, caller }
    }
}

impl TryFrom<pb::Request> for Request {
    type Error = Unreadable;

    fn try_from(message: pb::Request) -> Result<Self, Unreadable> {
        let id = RequestId::new(&message.id).map_err(|e| e.to_string())?;
        Ok(Self { id, digest: message.digest, caller: caller_from(&message.caller)? })
    }
}

/// The name of a caller as text; empty where there was none.
pub(super) fn text_of(caller: Option<&CallerName>) -> String {
    caller.map(|caller| caller.as_str().to_owned()).unwrap_or_default()
}

/// The inverse of [`text_of`].
pub(super) fn caller_from(text: &str) -> Result<Option<CallerName>, Unreadable> {
    let caller = (!text.is_empty()).then(|| CallerName::new(text));
    caller.transpose().map_err(|e| e.to_string())
}

impl From<&CompletedRequest> for pb::CompletedRequest {
    fn from(answered: &CompletedRequest) -> Self {
        let CompletedRequest { id, digest, caller, .. } = answered.clone();
        let request = Request { id, digest, caller };
        Self {
            request: Some((&request).into()),
            revision: answered.revision,
            removed: answered.removed as u64,
            scans: answered.scans as u64,
            restored: answered.restored as u64,
            deletions: answered.deletions as u64,
            is_of_keep_out: answered.kind == RequestKind::KeepOut,
        }
    }
}

impl TryFrom<pb::CompletedRequest> for CompletedRequest {
    type Error = Unreadable;

    fn try_from(message: pb::CompletedRequest) -> Result<Self, Unreadable> {
        let Request { id, digest, caller } = required(message.request, "requests.request")?.try_into()?;
        // An undo takes back a scan or a deletion at least.
        let kind = match (message.is_of_keep_out, message.scans.max(message.deletions)) {
            (true, _) => RequestKind::KeepOut,
            (false, 0) => RequestKind::Deletion,
            (false, _) => RequestKind::Undo,
        };
        Ok(Self {
            id,
            digest,
            caller,
            revision: message.revision,
            removed: count(message.removed),
            restored: count(message.restored),
            scans: count(message.scans),
            deletions: count(message.deletions),
            kind,
        })
    }
}
