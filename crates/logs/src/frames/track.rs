//! Poses of one frame in another over time.

use std::collections::VecDeque;

use mrol_map::geometry::{Pose, Twist, extrapolate, is_finite};

/// How far beyond the first and the last pose a track is believed, nanoseconds.
pub const EXTRAPOLATION_MAX_NS: i64 = 100_000_000;
/// Longest time between two poses that is interpolated over, nanoseconds: a robot that stands still may tell its pose
/// seldom, and one that was out of sight for longer may have gone anywhere.
const GAP_MAX_NS: i64 = 2_000_000_000;
/// How long poses are kept, nanoseconds: clouds wait for a second at most, and a driver may be late.
const KEPT_NS: i64 = 10_000_000_000;
/// Poses that are kept, at most: a kilohertz for all of that time.
const POSES_MAX: usize = 10_000;

/// Poses of one frame in another over the last ten seconds.
#[derive(Debug, Clone, Default)]
pub struct Track {
    /// In the order of their stamps, which are all different.
    poses: VecDeque<(i64, Pose)>,
}

/// How far the nearest pose is from a time that a track does not tell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Outside {
    /// Nanoseconds from the nearest pose to the time: positive where all poses are before it.
    pub off_ns: i64,
}

impl Track {
    /// Adds a pose; one of the same stamp is replaced. What is older than ten seconds goes. Where a pose comes that is
    /// older than that, the clock was set back, or ran ahead for a moment: the poses before it go.
    pub fn insert(&mut self, stamp_ns: i64, pose: Pose) {
        if !is_finite(&pose) {
            return;
        }
        if self.newest_ns().is_some_and(|newest_ns| newest_ns.saturating_sub(stamp_ns) > KEPT_NS) {
            self.poses.clear();
        }
        match self.poses.binary_search_by_key(&stamp_ns, |(stamp_ns, _)| *stamp_ns) {
            Ok(at) => self.poses[at].1 = pose,
            Err(at) => self.poses.insert(at, (stamp_ns, pose)),
        }
        let newest_ns = self.newest_ns().unwrap_or(stamp_ns);
        let is_old = |oldest: &(i64, Pose)| newest_ns.saturating_sub(oldest.0) > KEPT_NS;
        while self.poses.front().is_some_and(is_old) || self.poses.len() > POSES_MAX {
            self.poses.pop_front();
        }
    }

    /// The stamp of the last pose.
    pub fn newest_ns(&self) -> Option<i64> {
        self.poses.back().map(|(stamp_ns, _)| *stamp_ns)
    }

    /// The pose at a time, on the way from the pose before it to the one after it at constant velocity, or, by at most
    /// `beyond_ns`, further along the last motion.
    ///
    /// # Errors
    /// When the track does not tell so far; none at all where it has no pose.
    pub fn at(&self, stamp_ns: i64, beyond_ns: i64) -> Result<Pose, Option<Outside>> {
        let after = self.poses.partition_point(|(at_ns, _)| *at_ns < stamp_ns);
        let (before, next) = (after.checked_sub(1).map(|k| &self.poses[k]), self.poses.get(after));
        match (before, next) {
            (_, Some((at_ns, pose))) if *at_ns == stamp_ns => Ok(*pose),
            (Some(from), Some(to)) => {
                let gap_ns = to.0.saturating_sub(from.0);
                let since_ns = stamp_ns.saturating_sub(from.0);
                let nearest_ns = if since_ns < gap_ns / 2 { since_ns } else { stamp_ns.saturating_sub(to.0) };
                if gap_ns > GAP_MAX_NS && nearest_ns.saturating_abs() > beyond_ns {
                    return Err(Some(Outside { off_ns: nearest_ns }));
                }
                let motion = Twist::of_motion(&from.1.inv_mul(&to.1), 1.0);
                Ok(from.1 * motion.motion(since_ns as f64 / gap_ns as f64))
            }
            (Some(_), None) => self.beyond(stamp_ns, self.poses.iter().rev(), beyond_ns),
            (None, Some(_)) => self.beyond(stamp_ns, self.poses.iter(), beyond_ns),
            (None, None) => Err(None),
        }
    }

    /// The pose at a time beyond the first of `from_end`, along the motion from the second of them.
    fn beyond<'a>(
        &self,
        stamp_ns: i64,
        mut from_end: impl Iterator<Item = &'a (i64, Pose)>,
        beyond_ns: i64,
    ) -> Result<Pose, Option<Outside>> {
        let (end_ns, end) = from_end.next().ok_or(None)?;
        let off_ns = stamp_ns.saturating_sub(*end_ns);
        if off_ns.saturating_abs() > beyond_ns {
            return Err(Some(Outside { off_ns }));
        }
        let inner = from_end.next().filter(|(at_ns, _)| end_ns.abs_diff(*at_ns) <= GAP_MAX_NS as u64);
        Ok(inner.map_or(*end, |(inner_ns, inner)| {
            extrapolate(inner, end, off_ns as f64 / end_ns.saturating_sub(*inner_ns) as f64)
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mrol_map::geometry::pose_difference;
    use nalgebra::Vector3;

    const MS: i64 = 1_000_000;

    fn arc() -> Twist {
        Twist { linear: Vector3::new(2.0, 0.0, 0.0), angular: Vector3::new(0.0, 0.0, 1.0) }
    }

    #[test]
    fn an_arc_is_followed_between_poses_and_a_tenth_of_a_second_beyond() {
        let mut track = Track::default();
        for ms in [300, 0, 200, 100] {
            track.insert(ms * MS, arc().motion(ms as f64 * 1e-3));
        }
        for ms in [0, 30, 150, 299, 300] {
            let (meters, degrees) =
                pose_difference(&track.at(ms * MS, 0).unwrap(), &arc().motion(ms as f64 * 1e-3));
            assert!(meters < 1e-9 && degrees < 1e-6, "{ms} ms: {meters} m");
        }
        assert_eq!(track.at(301 * MS, 0), Err(Some(Outside { off_ns: MS })));
        assert_eq!(track.at(-MS, 0), Err(Some(Outside { off_ns: -MS })));
        for ms in [-100, 400] {
            let beyond = track.at(ms * MS, EXTRAPOLATION_MAX_NS).unwrap();
            assert!(pose_difference(&beyond, &arc().motion(ms as f64 * 1e-3)).0 < 0.02, "{ms} ms");
        }
        assert!(track.at(401 * MS, EXTRAPOLATION_MAX_NS).is_err());
        assert_eq!(Track::default().at(0, EXTRAPOLATION_MAX_NS), Err(None));
    }

    #[test]
    fn a_long_gap_is_not_bridged() {
        let mut track = Track::default();
        track.insert(0, Pose::identity());
        track.insert(3_000 * MS, Pose::translation(1.0, 0.0, 0.0));
        assert_eq!(track.at(1_000 * MS, EXTRAPOLATION_MAX_NS), Err(Some(Outside { off_ns: 1_000 * MS })));
        assert!(track.at(50 * MS, EXTRAPOLATION_MAX_NS).is_ok());
    }

    #[test]
    fn a_track_goes_on_after_a_stamp_of_another_year() {
        let mut track = Track::default();
        for ms in [0, 100, 31_536_000_000, 200, 300] {
            track.insert(ms * MS, Pose::translation(ms as f64, 0.0, 0.0));
        }
        assert_eq!(track.at(250 * MS, 0).unwrap().translation.x, 250.0);
        assert!(track.at(100 * MS, 0).is_err(), "what was before is forgotten");
    }

    #[test]
    fn a_track_stays_small_whatever_its_stamps_are() {
        let mut track = Track::default();
        for k in 0..30_000 {
            track.insert(k * 10_000, Pose::identity());
        }
        assert_eq!(track.poses.len(), POSES_MAX);
        for stamp_ns in [i64::MIN, i64::MAX, 0, i64::MIN, i64::MAX] {
            track.insert(stamp_ns, Pose::identity());
            let _ = track.at(stamp_ns / 2, EXTRAPOLATION_MAX_NS);
        }
        assert!(track.poses.len() < 3);
    }
}
