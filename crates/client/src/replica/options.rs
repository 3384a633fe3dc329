//! Options of a replica.

use std::time::Duration;

use mrol_map::bloom::FilterSettings;
use mrol_map::map::Region;
use mrol_map::planning::FIELD_BYTES_MAX_DEFAULT;

/// Finest blocks that a replica may have where nobody says: those of 200 million voxels of a surface.
pub const BLOCKS_MAX_DEFAULT: usize = 16 << 20;

/// Bytes of viewpoints that a replica may have where nobody says: those of a map whose server was given four times as
/// many as is usual.
pub const VIEWPOINT_BYTES_MAX_DEFAULT: usize = 256 << 20;

/// What a replica copies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReplicaOptions {
    /// The part of the map: voxels whose centers lie inside. The whole map without.
    pub region: Option<Region>,
    /// Most blocks of 8 x 8 x 8 finest voxels of the copy; 72 bytes each and what levels and filters take.
    /// [`BLOCKS_MAX_DEFAULT`].
    pub blocks_max: usize,
    /// Filters in front of the copy's levels, for [`Lookup::Bloom`](mrol_map::map::Lookup). None: the exact set
    /// answers, in a small part of the memory.
    pub filter: Option<FilterSettings>,
    /// Most bytes of the distance fields that the copy keeps for checks of bodies; less is slower, and as exact.
    /// [`FIELD_BYTES_MAX_DEFAULT`].
    pub field_bytes_max: usize,
    /// Most bytes of memory of the copy's viewpoints, by which it knows what is free. 0: it has none, and they are not
    /// sent. [`VIEWPOINT_BYTES_MAX_DEFAULT`].
    pub viewpoint_bytes_max: usize,
    /// How long the server may be silent until the connection counts as lost: more than its `watch_heartbeat_s`. 35 s.
    pub silence_max: Duration,
    /// How long ago the server may have been heard last for questions to be answered: more than its
    /// `watch_heartbeat_s`. Without a limit, which is the default, answers may be of any age, and
    /// [`Replica::age`](super::Replica::age) tells it.
    pub age_max: Option<Duration>,
}

impl Default for ReplicaOptions {
    fn default() -> Self {
        let silence_max = Duration::from_secs(35);
        Self {
            region: None,
            blocks_max: BLOCKS_MAX_DEFAULT,
            filter: None,
            field_bytes_max: FIELD_BYTES_MAX_DEFAULT,
            viewpoint_bytes_max: VIEWPOINT_BYTES_MAX_DEFAULT,
            silence_max,
            age_max: None,
        }
    }
}
