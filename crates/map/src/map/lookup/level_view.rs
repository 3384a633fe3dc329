//! What a look-up at one level reads.

use crate::bloom::CountingBloomFilter;
use crate::map::shards::{OccupiedVoxelList, SHARDS};
use crate::util::Keyword;
use crate::voxel::Slots;

/// Which of the two structures of a level answers (paper II).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Lookup {
    /// The exact set.
    #[default]
    Exact,
    /// The counting Bloom filter alone: now and then "occupied" of a free voxel, never "free" of an occupied one. The
    /// exact set in a map without filters.
    Bloom,
}

impl Keyword for Lookup {
    const ALL: &'static [Self] = &[Self::Exact, Self::Bloom];

    fn as_str(self) -> &'static str {
        match self {
            Self::Exact => "exact",
            Self::Bloom => "bloom",
        }
    }
}

/// What a look-up at one level reads: plain slices, shard by shard.
#[derive(Debug, Clone)]
pub struct LevelView<'a> {
    /// Bit planes of the level's filters.
    pub(super) planes: [&'a [u64]; SHARDS],
    /// Slots of the tables that serve the level.
    pub(super) blocks: [Slots<'a>; SHARDS],
    /// Hash functions of the filters; 0 where there are none.
    pub(super) hashes: u32,
    pub(super) level: u32,
    /// How many levels up in its block a voxel of the level is.
    pub(super) up: u32,
    /// From an index of the level to its region.
    pub(super) region_shift: u32,
}

impl<'a> LevelView<'a> {
    /// A view of the lists that `list` gives, whose filters have so many `hashes`; a shard without one is read as
    /// empty.
    pub(in crate::map) fn new(
        level: u32,
        up: u32,
        region_shift: u32,
        hashes: Option<u32>,
        list: impl Fn(usize) -> Option<OccupiedVoxelList<'a>>,
    ) -> Self {
        const NO_PLANE: &[u64] = &[0];
        let filter = |i| list(i).and_then(|list| list.filter());
        Self {
            planes: std::array::from_fn(|i| filter(i).map_or(NO_PLANE, CountingBloomFilter::plane)),
            blocks: std::array::from_fn(|i| list(i).map_or(Slots::NONE, |list| list.blocks().slots())),
            hashes: hashes.unwrap_or(0),
            level,
            up,
            region_shift,
        }
    }
}

impl LevelView<'_> {
    /// The structure that answers such a look-up.
    pub(super) fn answering(&self, lookup: Lookup) -> Lookup {
        if self.hashes == 0 { Lookup::Exact } else { lookup }
    }

    /// Bytes that look-ups of this kind may read.
    #[cfg(target_arch = "x86_64")]
    pub(super) fn bytes(&self, lookup: Lookup) -> usize {
        match lookup {
            Lookup::Bloom => self.planes.iter().map(|plane| size_of_val(*plane)).sum(),
            Lookup::Exact => self.blocks.iter().map(|slots| slots.mask_bytes).sum(),
        }
    }
}
