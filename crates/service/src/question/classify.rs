//! Points as what is known of them: occupied, free, or unknown.

use super::known::KnownPart;
use super::planner_question::{Question, check_elements};
use super::question_target::QuestionTarget;
use super::scope::QuestionScope;
use crate::error::{Reason, ServiceError};
use crate::limits::Limits;
use crate::request::PointCloud;
use mrol_map::map::ContentVersion;
use mrol_map::planning::{OutOfRange, PointStates, classify_points};
use mrol_map::util::StopSignal;

/// Are these points occupied, free, or unknown?
#[derive(Debug, Clone, PartialEq)]
pub struct ClassifyQuestion {
    /// What it has in common with other questions.
    pub asked: QuestionScope,
    /// The points, meters in the map frame.
    pub points: PointCloud,
}

/// Points that are classified at one revision: a tenth of a second or so. A multiple of the bits in a word.
const POINTS_PER_PART: usize = 256 << 10;
/// Points of which two bits each are a byte.
const POINTS_A_BYTE: usize = 4;

impl Question for ClassifyQuestion {
    type Answer = PointStates;

    const OPERATION: &'static str = "ClassifyPoints";

    fn asked(&self) -> &QuestionScope {
        &self.asked
    }

    fn answer_bytes(&self, _: &Limits) -> usize {
        self.points.len().div_ceil(POINTS_A_BYTE) + 2 * size_of::<u64>()
    }

    fn work_ns(&self) -> usize {
        // How many viewpoints are asked of a point the question does not tell.
        usize::MAX
    }

    fn check(&self, limits: &Limits) -> Result<(), ServiceError> {
        check_elements("points", self.points.len(), 1, limits)
    }

    fn is_in_parts(&self) -> bool {
        true
    }

    fn answer_from(
        &self,
        map: &QuestionTarget<'_>,
        limits: &Limits,
        stop: StopSignal<'_>,
    ) -> Result<(PointStates, ContentVersion), ServiceError> {
        let Self { asked, points } = self;
        let of_all = (points.len(), POINTS_PER_PART);
        let (parts, version) = map.in_parts(asked, of_all, limits, stop, |view, range, stop| {
            let some = &points.as_slice()[range.clone()];
            let states = classify_points(view, some, asked.level, stop);
            Ok(states.map_err(|error| OutOfRange { at: range.start + error.at, ..error })?)
        })?;
        let mut all = PointStates { points: points.len(), occupied: Vec::new(), free: Vec::new() };
        for PointStates { occupied, free, .. } in parts {
            all.occupied.extend(occupied);
            all.free.extend(free);
        }
        Ok((all, version))
    }

    fn check_known(&self, _: &PointStates, known: &KnownPart) -> Result<(), ServiceError> {
        let mut points = self.points.as_slice().iter().enumerate();
        points.try_for_each(|(i, point)| {
            known.check_ball(|| format!("points[{i}]"), point.xyz().map(f64::from), 0.0)
        })
    }
}

impl From<OutOfRange> for ServiceError {
    fn from(error: OutOfRange) -> Self {
        let reason = if error.point.is_finite() { Reason::PointOutOfRange } else { Reason::PointNotFinite };
        Self::new(reason, error.to_string())
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;
    use std::sync::{Arc, OnceLock};

    use super::*;
    use mrol_map::geometry::Point;
    use mrol_map::map::{MapContents, MapSettings, MultiResolutionMap};
    use mrol_map::util::GiveWay;
    use mrol_map::voxel::{VoxelKey, VoxelSet};

    /// A change that is made whenever work gives way.
    struct ChangedBetween<'a>(&'a MultiResolutionMap, Cell<u64>);

    impl GiveWay for ChangedBetween<'_> {
        fn is_due(&self) -> bool {
            true
        }

        fn give_way(&self) {
            let gone = self.0.view().voxels();
            let come: VoxelSet = VoxelKey::new([self.1.get() as i32, 0, 0]).into_iter().collect();
            self.1.set(self.1.get() + 1);
            self.0.committer().exchange(&gone, &come);
        }

        fn paused_for(&self) -> std::time::Duration {
            std::time::Duration::ZERO
        }
    }

    /// How long a question takes is not what is tested: an emulated processor takes long.
    fn patient() -> Limits {
        Limits { question_time_max_s: 600.0, ..Limits::default() }
    }

    fn question(points: Vec<Point>) -> ClassifyQuestion {
        ClassifyQuestion { asked: QuestionScope::default(), points: points.into() }
    }

    #[test]
    fn many_points_are_classified_in_parts_between_which_changes_are_made() {
        let map =
            MultiResolutionMap::restore(MapSettings::new(1.0, 1), MapContents::at(1, VoxelSet::default()));
        let (map, planner) = (Arc::new(map.unwrap()), OnceLock::new());
        let questioned = QuestionTarget::new(&map, &planner, 0);
        let point = |x: usize| Point::new(x as f32 + 0.5, 0.5, 0.5);
        // Voxel 0 is occupied during the first part, voxel 1 during the second.
        let points =
            [vec![point(0); POINTS_PER_PART], vec![point(1); POINTS_PER_PART], vec![point(1)]].concat();
        let changes = ChangedBetween(&map, Cell::default());
        let stop = StopSignal::NEVER.giving_way_by(&changes);
        let asked = question(points);
        let (states, version) = asked.answer_from(&questioned, &patient(), stop).unwrap();
        let words = POINTS_PER_PART / 64;
        assert_eq!(states.points, 2 * POINTS_PER_PART + 1);
        assert!(states.occupied[..2 * words].iter().all(|word| *word == u64::MAX));
        assert_eq!((states.occupied.len(), states.occupied[2 * words]), (2 * words + 1, 0));
        assert_eq!(states.free.len(), 2 * words + 1);
        // It names the oldest, which all are of or newer than.
        assert_eq!((version.revision, map.revision()), (2, 4));
    }

    #[test]
    fn a_point_out_of_range_is_named_by_its_place_among_all_and_nothing_has_a_version() {
        let map =
            MultiResolutionMap::restore(MapSettings::new(1.0, 1), MapContents::at(7, VoxelSet::default()));
        let (map, planner) = (Arc::new(map.unwrap()), OnceLock::new());
        let questioned = QuestionTarget::new(&map, &planner, 0);
        let ask = |points| question(points).answer_from(&questioned, &patient(), StopSignal::NEVER);
        let mut points = vec![Point::new(0.0, 0.0, 0.0); POINTS_PER_PART + 3];
        points[POINTS_PER_PART + 1] = Point::new(f32::NAN, 0.0, 0.0);
        let error = ask(points).unwrap_err();
        assert!(error.message.contains(&format!("points[{}]", POINTS_PER_PART + 1)), "{error}");
        let (none, version) = ask(Vec::new()).unwrap();
        assert_eq!((none.points, none.occupied.len(), version.revision), (0, 0, 7));
    }
}
