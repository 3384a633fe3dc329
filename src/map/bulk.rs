//! Many blocks, or keys, at once: their cache misses are under way together.

use super::shard::Block;
use crate::ahead::fetch;
use crate::bloom::{CountingBloomFilter, Probe};
use crate::voxel::{BlockMask, BlockTable};

/// How many misses are under way at once.
const AT_ONCE: usize = 32;

/// Calls `f(block, slot, voxels there)` for each block; none and none where it is absent.
pub(super) fn find_each(
    table: &BlockTable,
    blocks: &[&Block],
    mut f: impl FnMut(&Block, Option<usize>, &BlockMask),
) {
    for blocks in blocks.chunks(AT_ONCE) {
        blocks.iter().for_each(|block| fetch(table.home(block.0)));
        let mut found = [None; AT_ONCE];
        for (found, block) in found.iter_mut().zip(blocks) {
            *found = table.find(block.0);
            found.iter().for_each(|&slot| fetch(table.at(slot)));
        }
        for (block, slot) in blocks.iter().zip(found) {
            f(block, slot, slot.map_or(&BlockMask::EMPTY, |slot| table.at(slot)));
        }
    }
}

/// Calls `change(table, item)` for each item, which is about to touch the block at `slot(item)`.
pub(super) fn change_each<T>(
    table: &mut BlockTable,
    items: &[T],
    slot: impl Fn(&T) -> Option<usize>,
    mut change: impl FnMut(&mut BlockTable, &T),
) {
    for items in items.chunks(AT_ONCE) {
        items.iter().filter_map(&slot).for_each(|slot| fetch(table.at(slot)));
        items.iter().for_each(|item| change(table, item));
    }
}

/// Counts keys in or out, and says what is to become of the plane. That is fetched too, so that it is near when
/// readers wait for it.
pub(super) fn count_each(
    filter: &CountingBloomFilter,
    keys: &[u64],
    count: impl Fn(&CountingBloomFilter, Probe) -> Probe,
) -> Vec<Probe> {
    let mut probes: Vec<_> = keys.iter().map(|&key| filter.probe(key)).collect();
    for probes in probes.chunks_mut(AT_ONCE) {
        for &probe in &*probes {
            fetch(filter.counters_at(probe));
            fetch(filter.plane_at(probe));
        }
        probes.iter_mut().for_each(|probe| *probe = count(filter, *probe));
    }
    probes
}

/// Sets or clears what was counted.
pub(super) fn show_each(
    filter: &mut CountingBloomFilter,
    probes: &[Probe],
    show: impl Fn(&mut CountingBloomFilter, Probe),
) {
    for probes in probes.chunks(AT_ONCE) {
        probes.iter().for_each(|&probe| fetch(filter.plane_at(probe)));
        probes.iter().for_each(|&probe| show(filter, probe));
    }
}
