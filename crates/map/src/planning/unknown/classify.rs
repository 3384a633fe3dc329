//! Points as what is known of them: occupied, free, or unknown.

use super::free_space::FreeSpace;
use crate::geometry::{Point, Pose};
use crate::map::{Lookup, MapView};
use crate::util::{Keyword, StopSignal};
use crate::voxel::{Lattice, VoxelKey};

/// Points between two checks of the stop signal. A multiple of the bits in a word.
const POINTS_PER_STOP_CHECK: usize = 4096;
/// Points that viewpoints are asked of between two checks of it: where thousands looked, one takes up to a millisecond.
const ASKED_PER_STOP_CHECK: usize = 16;

/// What is known of a place.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum PointState {
    /// A voxel or a keep-out is there.
    Occupied,
    /// A scan saw through it, and nothing is there.
    Free,
    /// No scan saw it.
    Unknown,
}

impl Keyword for PointState {
    const ALL: &'static [Self] = &[Self::Occupied, Self::Free, Self::Unknown];

    fn as_str(self) -> &'static str {
        match self {
            Self::Occupied => "occupied",
            Self::Free => "free",
            Self::Unknown => "unknown",
        }
    }
}

/// Which of some points are occupied and which are free; the others are unknown.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct PointStates {
    /// Number of points.
    pub points: usize,
    /// Whether point i is occupied: bit i % 64 of `occupied[i / 64]`.
    pub occupied: Vec<u64>,
    /// The same for free ones. No point is both.
    pub free: Vec<u64>,
}

/// A point in no voxel of the map's lattice.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("points[{at}] must be finite and lie in {min_m}..{end_m} m in each axis, got {point:?}")]
pub struct OutOfRange {
    /// Which point.
    pub at: usize,
    /// The point.
    pub point: Point,
    /// Smallest coordinate of the map, meters.
    pub min_m: f64,
    /// One past the largest, meters.
    pub end_m: f64,
}

impl OutOfRange {
    /// Refuses points of which one lies in no voxel of a lattice.
    ///
    /// # Errors
    /// For the first such point.
    pub(in crate::planning) fn check(points: &[Point], lattice: &Lattice) -> Result<(), Self> {
        let from_map = lattice.from_map();
        let at = points.iter().position(|&point| from_map.index(point).is_none());
        at.map_or(Ok(()), |at| Err(Self::of(points, at, lattice)))
    }

    fn of(points: &[Point], at: usize, lattice: &Lattice) -> Self {
        let (min_m, end_m) = lattice.range_m();
        Self { at, point: points[at], min_m, end_m }
    }
}

impl PointStates {
    /// What is known of point `i`.
    pub fn state(&self, i: usize) -> PointState {
        let is_set = |words: &[u64]| words[i / 64] >> (i % 64) & 1 == 1;
        match (is_set(&self.occupied), is_set(&self.free)) {
            (true, _) => PointState::Occupied,
            (false, true) => PointState::Free,
            (false, false) => PointState::Unknown,
        }
    }

    /// Number of points that are occupied.
    pub fn points_occupied(&self) -> usize {
        ones(&self.occupied)
    }

    /// Number of points that are free.
    pub fn points_free(&self) -> usize {
        ones(&self.free)
    }
}

fn ones(words: &[u64]) -> usize {
    words.iter().map(|word| word.count_ones() as usize).sum()
}

/// Says of each point (map frame) whether its voxel of `level` is occupied, free, or unknown.
///
/// Occupied is what has a voxel of the level, or lies in a keep-out where the view has them
/// ([`MapView::with_keep_outs`]): the point itself. Free is what else a scan saw through, at the center of the point's
/// voxel, where the view has viewpoints ([`MapView::with_viewpoints`]). All else is unknown: what was never seen, what
/// is hidden, and what a deletion laid bare and no scan saw through.
///
/// The view must cover the whole map. Takes 2 bits a point. Once stopped, points are left that are said to be unknown.
///
/// # Errors
/// For the first point that lies in no voxel.
pub fn classify_points(
    view: &MapView<'_>,
    points: &[Point],
    level: u32,
    stop: StopSignal<'_>,
) -> Result<PointStates, OutOfRange> {
    let words = points.len().div_ceil(64);
    let mut states = PointStates { points: points.len(), occupied: vec![0; words], free: vec![0; words] };
    let from_map = view.lattice().from_map();
    let mut free_space = FreeSpace::of(view);
    // Points that come one after the other are often in one voxel.
    let mut last: Option<(VoxelKey, bool)> = None;
    let mut asked = 0;
    let words = states
        .occupied
        .chunks_mut(POINTS_PER_STOP_CHECK / 64)
        .zip(states.free.chunks_mut(POINTS_PER_STOP_CHECK / 64));
    'all: for (looked_up, (some, (occupied, free))) in
        stop.paced(points.chunks(POINTS_PER_STOP_CHECK).zip(words).enumerate(), 1)
    {
        if !view.query(some, &from_map, level, Lookup::Exact, occupied) {
            let at = some.iter().position(|&point| from_map.index(point).is_none()).unwrap_or_default();
            return Err(OutOfRange::of(points, looked_up * POINTS_PER_STOP_CHECK + at, view.lattice()));
        }
        if let Some(keep_outs) = view.keep_outs() {
            keep_outs.mark(some, &Pose::identity(), occupied, stop);
        }
        for (i, &point) in some.iter().enumerate().filter(|(i, _)| occupied[i / 64] >> (i % 64) & 1 == 0) {
            let Some(voxel) = from_map.key(point).map(|finest| finest.ancestor(level)) else { continue };
            asked += 1;
            if asked % ASKED_PER_STOP_CHECK == 0 && stop.is_stopped() {
                break 'all;
            }
            let is_free = match last {
                Some((before, is_free)) if before == voxel => is_free,
                _ => free_space.is_seen_through(voxel, level),
            };
            last = Some((voxel, is_free));
            free[i / 64] |= u64::from(is_free) << (i % 64);
        }
    }
    Ok(states)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::planning::tests::{point, seen_history_and_level};

    fn near() -> impl Strategy<Value = Point> {
        prop_oneof![
            8 => prop::array::uniform3(-8.0f32..8.0).prop_map(Point::from),
            1 => point().prop_filter("in a voxel", |point| point.xyz().iter().all(|c| c.abs() < 5e5)),
        ]
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 200, ..ProptestConfig::default() })]

        #[test]
        fn a_point_is_what_all_viewpoints_voxels_and_shapes_say(
            (history, level) in seen_history_and_level(),
            mut points in prop::collection::vec(near(), 1..300),
            repeated in 0usize..50,
        ) {
            points.extend_from_within(..repeated.min(points.len()));
            let seen = history.map();
            let from_map = seen.map.lattice().from_map();
            for keep_outs in [true, false] {
                let view = seen.map.view().with_viewpoints();
                let view = if keep_outs { view.with_keep_outs() } else { view };
                let states = classify_points(&view, &points, level, StopSignal::NEVER).unwrap();
                for (i, &point) in points.iter().enumerate() {
                    let voxel = from_map.key(point).unwrap().ancestor(level);
                    let is_kept_out = view.keep_outs().is_some_and(|all| all.contains(point.to_f64().coords.into()));
                    let expected = match view.contains(voxel, level) || is_kept_out {
                        true => PointState::Occupied,
                        false if seen.is_free(&view, voxel, level) => PointState::Free,
                        false => PointState::Unknown,
                    };
                    prop_assert_eq!(states.state(i), expected, "{:?}", point);
                }
            }
        }
    }

    #[test]
    fn a_point_in_no_voxel_is_named() {
        let map = crate::map::MultiResolutionMap::new(crate::map::MapSettings::new(0.1, 2)).unwrap();
        let mut points = vec![Point::new(0.0, 0.0, 0.0); 5000];
        let ask =
            |points: &[Point]| classify_points(&map.view().with_viewpoints(), points, 0, StopSignal::NEVER);
        assert_eq!(ask(&points).unwrap().points_free(), 0);
        points[4999] = Point::new(0.0, f32::NAN, 0.0);
        assert!(ask(&points).unwrap_err().to_string().starts_with("points[4999] must be finite"));
        points[4998] = Point::new(0.0, 0.0, 1e9);
        assert!(ask(&points).unwrap_err().to_string().starts_with("points[4998] must be finite"));
    }
}
