//! What all questions and all answers have in common.

use uuid::Uuid;

use crate::request::MapVersion;

/// What all questions have in common.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct QuestionScope {
    /// The level of the voxels, 0 the finest.
    pub level: u32,
    /// Wait for this revision.
    pub min_revision: Option<u64>,
    /// The incarnation of the map that `min_revision` belongs to.
    pub map_uuid: Option<Uuid>,
    /// True where keep-outs do not count; otherwise they count as voxels do.
    pub ignore_keep_outs: bool,
}

/// The answer to a question, with the state of the map that it is of.
#[derive(Debug, Clone, PartialEq)]
pub struct AtVersion<A> {
    /// The answer.
    pub answer: A,
    /// All of it is at this state; an answer that took long and let others go first is at this one or at later ones.
    pub version: MapVersion,
}
