//! Where locks stand in the order in which they are taken.

/// Where a lock stands in the order in which locks are taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Rank {
    /// The snapshots of a map's folder, held while one is written.
    Snapshots,
    /// A map's journal, held while it is written and synced.
    Journal,
    /// The turn to change a map.
    Commit,
    /// Held by long reads of a map; a change waits for it where no short reader queues behind.
    LongRead,
    /// The moments of shard i. Several are taken in ascending order.
    Moments(u8),
    /// The voxels of shard i. Several are taken in ascending order.
    Shard(u8),
    /// The keep-outs of a map.
    KeepOuts,
    /// The viewpoints of a map.
    Viewpoints,
    /// The trajectory of a map.
    Trajectory,
    /// The answers to requests that a map remembers.
    Requests,
    /// The distance fields that a planner keeps beside a map.
    Fields,
    /// Anything that is held for a few instructions.
    Brief,
}

#[cfg(debug_assertions)]
impl Rank {
    /// True of a lock of a map's content: its holder may not wait for a disk.
    pub(super) fn forbids_file_operations(self) -> bool {
        self >= Self::Commit
    }
}
