//! A question of many elements, answered piece by piece: others go first between two pieces.

use std::ops::Range;

use crate::error::ServiceError;
use crate::work::check_not_stopped;
use mrol_map::map::{ContentVersion, LongRead, MapView};
use mrol_map::planning::{NearestVoxels, PlanningView, RayHits};
use mrol_map::util::StopSignal;

/// About how long a piece takes where its elements take as long as most do, nanoseconds; longer where they take longer.
/// So a view of the map is held for not much longer than a part of a turn, and few pieces are needed.
const PIECE_NS: usize = 1_000_000;
/// Least elements of a piece, of which pieces have a multiple: the bits of a word.
const WORD: usize = u64::BITS as usize;

/// What a piece is answered from.
pub(super) trait HasVersion {
    /// The version that it shows.
    fn version(&self) -> ContentVersion;
}

/// Answers that are put together.
pub(super) trait Joined {
    /// Adds the answers of the elements that follow; it has those of whole words of bits itself.
    fn join(&mut self, next: Self);

    /// Makes room for so many more.
    fn reserve(&mut self, elements: usize);
}

/// A view of the whole map, and where it is held for longer, what keeps changes from beginning meanwhile.
pub(super) struct WholeView<'a> {
    // Dropped first: changes that wait for the long read find no lock held.
    pub(super) view: MapView<'a>,
    pub(super) _long_read: Option<LongRead<'a>>,
}

/// How a question of many elements is taken apart.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pieces {
    elements: usize,
    of_piece: usize,
}

impl Pieces {
    /// Those of so many elements, which take about so long each, nanoseconds.
    pub(super) fn of(elements: usize, ns_each: usize) -> Self {
        Self { elements, of_piece: (PIECE_NS / ns_each.max(1)).max(1).next_multiple_of(WORD) }
    }

    /// Those of elements that are answered without bits, and may be answered one by one.
    pub(super) fn of_large(elements: usize, ns_each: usize) -> Self {
        Self { elements, of_piece: (PIECE_NS / ns_each.max(1)).max(1) }
    }

    /// The answers that `answer` has to each piece, put together, with the version of the first. All of them come from
    /// one `view`, unless others were to go first between two of them: then from another one that was taken after that,
    /// so that answers may be of later versions.
    ///
    /// # Errors
    /// How the question was stopped; those of `view` and of `answer`.
    pub(super) fn answered<V: HasVersion, A: Joined>(
        self,
        stop: StopSignal<'_>,
        view: impl Fn() -> Result<V, ServiceError>,
        mut answer: impl FnMut(&V, Range<usize>) -> Result<A, ServiceError>,
    ) -> Result<(A, ContentVersion), ServiceError> {
        let Self { elements, of_piece } = self;
        let mut shown = view()?;
        let first = shown.version();
        // One piece of a question of nothing, too: it has an answer.
        let mut all = answer(&shown, 0..elements.min(of_piece))?;
        check_not_stopped(stop)?;
        all.reserve(elements.saturating_sub(of_piece));
        for start in (of_piece..elements).step_by(of_piece) {
            if stop.is_way_due() {
                drop(shown);
                stop.give_way();
                shown = view()?;
            }
            let next = answer(&shown, start..elements.min(start + of_piece))?;
            check_not_stopped(stop)?;
            all.join(next);
        }
        Ok((all, first))
    }
}

impl HasVersion for WholeView<'_> {
    fn version(&self) -> ContentVersion {
        self.view.version()
    }
}

impl HasVersion for PlanningView<'_> {
    fn version(&self) -> ContentVersion {
        PlanningView::version(self)
    }
}

impl<T> Joined for Vec<T> {
    fn join(&mut self, mut next: Self) {
        self.append(&mut next);
    }

    fn reserve(&mut self, elements: usize) {
        self.reserve_exact(elements);
    }
}

impl Joined for RayHits {
    fn join(&mut self, next: Self) {
        self.append(next);
    }

    fn reserve(&mut self, elements: usize) {
        self.hit.reserve_exact(elements.div_ceil(WORD));
        self.distances_m.reserve_exact(elements);
        self.voxels.reserve_exact(elements);
    }
}

impl Joined for NearestVoxels {
    fn join(&mut self, next: Self) {
        self.append(next);
    }

    fn reserve(&mut self, elements: usize) {
        self.found.reserve_exact(elements.div_ceil(WORD));
        self.distances_m.reserve_exact(elements);
        self.voxels.reserve_exact(elements);
        self.away.reserve_exact(elements);
    }
}
