//! What keeps nodes that share a log from losing or mixing up changes.

/// A rule of all nodes. Tests leave one out at a time, and see what comes of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Rule {
    /// A node makes changes only in an epoch that names it, and that it began itself.
    OwnEpoch,
    /// What it publishes comes directly behind what it has read, or not at all.
    Position,
    /// It made everything that was there before it claims to lead.
    CaughtUp,
    /// What is sent again is the same message.
    SameId,
    /// It makes changes only after the other live nodes have said how far they are, having read its claim.
    FreshHeads,
}
