//! A view of a map that long work lets go of between its parts.

use super::content_hash::ContentVersion;
use super::multi_resolution_map::MultiResolutionMap;
use super::view::{LongRead, MapView};
use crate::util::StopSignal;
use crate::voxel::Lattice;

/// A view of a whole map that is let go of where others are to go first, and taken again after them, of the revision
/// that the map has then.
///
/// So what is read through it may be of several revisions: of the one that it names, or of later ones.
#[derive(Debug)]
pub struct PausingView<'a> {
    // Dropped first: changes that wait for the long read find no lock held.
    view: MapView<'a>,
    long_read: Option<LongRead<'a>>,
    first: ContentVersion,
}

impl<'a> From<MapView<'a>> for PausingView<'a> {
    fn from(view: MapView<'a>) -> Self {
        Self { first: view.version(), view, long_read: None }
    }
}

impl<'a> PausingView<'a> {
    /// A view of the whole map during `long_read`, with keep-outs and viewpoints where they are wanted.
    pub fn during(long_read: LongRead<'a>, keep_outs: bool, viewpoints: bool) -> Self {
        let view = view_of(long_read.map(), keep_outs, viewpoints);
        Self { first: view.version(), view, long_read: Some(long_read) }
    }

    /// The view as it is by now.
    pub fn view(&self) -> &MapView<'a> {
        &self.view
    }

    /// The lattices of the map's levels.
    pub fn lattice(&self) -> &'a Lattice {
        self.map().lattice()
    }

    /// The first revision that was read, with its hash: everything is of this one or of later ones.
    pub fn version(&self) -> ContentVersion {
        self.first
    }

    /// Lets others go first, where some wait and this work has had its part: to be called between the parts of long
    /// work.
    pub fn give_way(&mut self, stop: StopSignal<'_>) {
        if stop.is_way_due() {
            self.let_go_during(|| stop.give_way());
        }
    }

    /// Lets go of the map during `work`, which does not read it: changes go on meanwhile. Then the view is the newest.
    pub fn let_go_during<A>(&mut self, work: impl FnOnce() -> A) -> A {
        let (map, is_long) = (self.map(), self.long_read.is_some());
        let (keep_outs, viewpoints) = (self.view.keep_outs().is_some(), self.view.viewpoints().is_some());
        self.view.let_go();
        self.long_read = None;
        let done = work();
        self.long_read = is_long.then(|| map.long_read());
        self.view = view_of(map, keep_outs, viewpoints);
        done
    }

    fn map(&self) -> &'a MultiResolutionMap {
        self.view.map()
    }
}

fn view_of(map: &MultiResolutionMap, keep_outs: bool, viewpoints: bool) -> MapView<'_> {
    let view = map.view();
    let view = if keep_outs { view.with_keep_outs() } else { view };
    if viewpoints { view.with_viewpoints() } else { view }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;
    use std::time::Duration;

    use super::*;
    use crate::map::{MapContents, MapSettings};
    use crate::util::GiveWay;
    use crate::voxel::{VoxelKey, VoxelSet};

    /// A change of the map whenever work gives way, which it is to do where that is due.
    struct ChangedBetween<'a> {
        map: &'a MultiResolutionMap,
        is_due: Cell<bool>,
    }

    impl GiveWay for ChangedBetween<'_> {
        fn is_due(&self) -> bool {
            self.is_due.get()
        }

        fn give_way(&self) {
            let gone = self.map.view().voxels();
            self.map.committer().exchange(&gone, &VoxelSet::default());
        }

        fn paused_for(&self) -> Duration {
            Duration::ZERO
        }
    }

    #[test]
    fn what_is_read_is_of_the_first_revision_or_of_one_after_a_pause() {
        let voxel = VoxelKey::new([1, 2, 3]).unwrap();
        let contents = MapContents::at(7, [voxel].into_iter().collect());
        let map = MultiResolutionMap::restore(MapSettings::new(0.1, 1), contents).unwrap();
        let turns = ChangedBetween { map: &map, is_due: Cell::new(false) };
        let stop = StopSignal::NEVER.giving_way_by(&turns);
        let mut view = PausingView::during(map.long_read(), true, true);
        let first = view.version();
        view.give_way(stop);
        assert!(view.view().contains(voxel, 0) && view.view().revision() == 7);
        turns.is_due.set(true);
        view.give_way(stop);
        assert!(!view.view().contains(voxel, 0) && view.view().revision() == 8);
        assert!(view.view().keep_outs().is_some() && view.view().viewpoints().is_some());
        assert_eq!((view.version(), first.revision), (first, 7));
    }
}
