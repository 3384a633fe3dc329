//! What a snapshot says of the parts that its viewpoints lie in.

use prost::Message;

use crate::codec::{Unreadable, ascending_from, gaps_of};
use crate::pb;

/// A part that a snapshot names.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct PartUse {
    /// The part's number.
    pub(crate) number: u64,
    /// The part's checksum.
    pub(crate) checksum: u32,
    /// Revisions of the viewpoints that the snapshot has of it, ascending.
    pub(crate) revisions: Vec<u64>,
}

/// Encodes what a snapshot says of its parts; nothing where it has none.
pub(crate) fn section_of(uses: &[PartUse]) -> Vec<u8> {
    let of_part = |PartUse { number, checksum, revisions }: &PartUse| pb::UsedViewpointPart {
        number: *number,
        checksum: *checksum,
        revision_gaps: gaps_of(revisions.iter().copied()),
    };
    pb::UsedViewpointParts { parts: uses.iter().map(of_part).collect() }.encode_to_vec()
}

/// The inverse of [`section_of`].
pub(crate) fn uses_in(section: &[u8]) -> Result<Vec<PartUse>, Unreadable> {
    let message =
        pb::UsedViewpointParts::decode(section).map_err(|e| format!("what it says of its parts: {e}"))?;
    let uses: Vec<PartUse> = message.parts.into_iter().map(use_of).collect::<Result<_, _>>()?;
    if !uses.is_sorted_by(|one, next| one.number < next.number) {
        return Err("the numbers of the parts that it names must ascend".into());
    }
    let mut revisions: Vec<u64> = uses.iter().flat_map(|used| used.revisions.iter().copied()).collect();
    revisions.sort_unstable();
    match revisions.windows(2).find(|pair| pair[0] == pair[1]) {
        Some(pair) => Err(format!("two parts have the viewpoint of revision {}", pair[0])),
        None => Ok(uses),
    }
}

fn use_of(message: pb::UsedViewpointPart) -> Result<PartUse, Unreadable> {
    let pb::UsedViewpointPart { number, checksum, revision_gaps } = message;
    let revisions = ascending_from(&revision_gaps, "the revisions of a part that it names")?;
    Ok(PartUse { number, checksum, revisions })
}
