//! The tree of transforms.

use std::collections::BTreeMap;

use super::contradiction::{Contradiction, SAME_DEG, SAME_M};
use super::error::{BadTransform, NoTransform};
use super::track::{EXTRAPOLATION_MAX_NS, Track};
use mrol_map::geometry::{Pose, pose_difference};
use mrol_map::util::excerpt;

/// Frames of a tree, at most.
pub const FRAMES_MAX: usize = 1000;
/// Bytes of a frame's name, at most.
pub const NAME_BYTES_MAX: usize = 256;
/// Frames from one to the root of its tree, at most: every transform walks there.
pub const DEPTH_MAX: usize = 64;
/// Frames that an error lists, at most.
const FRAMES_LISTED: usize = 12;

/// The tree of transforms that several publishers tell, each of its own frames.
#[derive(Debug, Clone, Default)]
pub struct FrameTree {
    links: BTreeMap<String, Link>,
}

/// How a frame hangs on its parent.
#[derive(Debug, Clone)]
struct Link {
    parent: String,
    motion: Motion,
}

#[derive(Debug, Clone)]
enum Motion {
    Fixed(Pose),
    Moving(Track),
}

impl FrameTree {
    /// Notes where `child` always is in `parent`: parent_from_child.
    ///
    /// # Errors
    /// When it cannot be part of a tree, or there are too many frames.
    pub fn fix(&mut self, parent: &str, child: &str, parent_from_child: Pose) -> Result<(), BadTransform> {
        self.link(parent, child)?.motion = Motion::Fixed(parent_from_child);
        Ok(())
    }

    /// Notes where `child` was in `parent` at a time. A frame that is fixed stays so.
    ///
    /// # Errors
    /// When it cannot be part of a tree, or there are too many frames.
    pub fn note(
        &mut self,
        parent: &str,
        child: &str,
        stamp_ns: i64,
        parent_from_child: Pose,
    ) -> Result<(), BadTransform> {
        match &mut self.link(parent, child)?.motion {
            Motion::Fixed(_) => {}
            Motion::Moving(track) => track.insert(stamp_ns, parent_from_child),
        }
        Ok(())
    }

    /// What a transform says against what was told before: one that always holds where `fixed` is its pose, or else one
    /// of a moving frame.
    pub fn contradiction(&self, parent: &str, child: &str, fixed: Option<&Pose>) -> Option<Contradiction> {
        let link = self.links.get(child)?;
        let (before, parent, child) = (link.parent.clone(), parent.to_owned(), child.to_owned());
        if before != parent {
            let mut parents = [before, parent];
            parents.sort();
            return Some(Contradiction::OtherParent { child, parents });
        }
        match (&link.motion, fixed) {
            (Motion::Fixed(before), Some(now)) => {
                let (off_m, off_rad) = pose_difference(before, now);
                let off_deg = off_rad.to_degrees();
                (off_m > SAME_M || off_deg > SAME_DEG).then_some(Contradiction::Elsewhere {
                    parent,
                    child,
                    off_m,
                    off_deg,
                })
            }
            (Motion::Moving(_), None) => None,
            (Motion::Fixed(_), None) | (Motion::Moving(_), Some(_)) => {
                Some(Contradiction::FixedAndMoving { parent, child })
            }
        }
    }

    /// The link between two frames, which is made where there is none. A frame that changes its parent forgets where it
    /// was.
    fn link(&mut self, parent: &str, child: &str) -> Result<&mut Link, BadTransform> {
        for name in [parent, child] {
            if name.is_empty() || name.len() > NAME_BYTES_MAX || name.contains(char::is_control) {
                return Err(BadTransform::name(name));
            }
        }
        let is_same = self.links.get(child).is_some_and(|link| link.parent == parent);
        if !is_same {
            if self.ancestors(parent).any(|ancestor| ancestor == child) {
                return Err(BadTransform::Circle { parent: parent.to_owned(), child: child.to_owned() });
            }
            if self.ancestors(parent).count() >= DEPTH_MAX {
                return Err(BadTransform::TooDeep(child.to_owned()));
            }
            if !self.links.contains_key(child) && self.links.len() >= FRAMES_MAX {
                return Err(BadTransform::TooMany(child.to_owned()));
            }
            let link = Link { parent: parent.to_owned(), motion: Motion::Moving(Track::default()) };
            self.links.insert(child.to_owned(), link);
        }
        // It was there, or was made.
        self.links.get_mut(child).ok_or_else(|| BadTransform::TooMany(child.to_owned()))
    }

    /// A frame, its parent, and so on up to a root, or until there were as many as may be in a row.
    pub fn ancestors<'a>(&'a self, frame: &'a str) -> impl Iterator<Item = &'a str> {
        let parent = |frame: &&str| self.links.get(*frame).map(|link| link.parent.as_str());
        std::iter::successors(Some(frame), parent).take(DEPTH_MAX)
    }

    /// True of a frame that is a child or a parent.
    pub fn has(&self, frame: &str) -> bool {
        self.links.contains_key(frame) || self.links.values().any(|link| link.parent == frame)
    }

    /// True of a frame that moves in its parent.
    pub fn moves(&self, frame: &str) -> bool {
        self.links.get(frame).is_some_and(|link| matches!(link.motion, Motion::Moving(_)))
    }

    /// All frames, by name.
    pub fn frames(&self) -> Vec<&str> {
        let mut frames: Vec<_> =
            self.links.iter().flat_map(|(child, link)| [child.as_str(), link.parent.as_str()]).collect();
        frames.sort_unstable();
        frames.dedup();
        frames
    }

    /// Where `source` is in `target` at a time: target_from_source. Poses are interpolated, and extrapolated by at most
    /// `beyond_ns`, which is cut to 0.1 s.
    ///
    /// # Errors
    /// When a frame is not known, they are not connected, or a transform between them is told of other times alone.
    pub fn transform(
        &self,
        target: &str,
        source: &str,
        stamp_ns: i64,
        beyond_ns: i64,
    ) -> Result<Pose, NoTransform> {
        if target == source {
            return Ok(Pose::identity());
        }
        if let Some(frame) = [target, source].into_iter().find(|frame| !self.has(frame)) {
            return Err(NoTransform::Unknown { frame: excerpt(frame), known: self.listed() });
        }
        let up: Vec<&str> = self.ancestors(target).collect();
        let Some(common) = self.ancestors(source).find(|ancestor| up.contains(ancestor)) else {
            let root = |frame| self.ancestors(frame).last().unwrap_or_default().to_owned();
            return Err(NoTransform::NotConnected {
                a: target.to_owned(),
                b: source.to_owned(),
                root_a: root(target),
                root_b: root(source),
            });
        };
        let beyond_ns = beyond_ns.min(EXTRAPOLATION_MAX_NS);
        let common_from_target = self.pose_in_ancestor(common, target, stamp_ns, beyond_ns)?;
        let common_from_source = self.pose_in_ancestor(common, source, stamp_ns, beyond_ns)?;
        Ok(common_from_target.inv_mul(&common_from_source))
    }

    /// Where a frame is in one of its ancestors.
    fn pose_in_ancestor(
        &self,
        ancestor: &str,
        frame: &str,
        stamp_ns: i64,
        beyond_ns: i64,
    ) -> Result<Pose, NoTransform> {
        let mut ancestor_from_frame = Pose::identity();
        for child in self.ancestors(frame).take_while(|name| *name != ancestor) {
            let Some(link) = self.links.get(child) else { break };
            let parent_from_child = match &link.motion {
                Motion::Fixed(pose) => *pose,
                Motion::Moving(track) => {
                    let other = |outside| NoTransform::other_time(&link.parent, child, outside, beyond_ns);
                    track.at(stamp_ns, beyond_ns).map_err(other)?
                }
            };
            ancestor_from_frame = parent_from_child * ancestor_from_frame;
        }
        Ok(ancestor_from_frame)
    }

    /// The names of frames, as many as an error may list.
    pub(crate) fn listed(&self) -> String {
        let frames: Vec<_> = self.frames().into_iter().map(excerpt).collect();
        match frames.len() {
            0 => "none at all".to_owned(),
            1..=FRAMES_LISTED => frames.join(" "),
            more => format!("{} and {} more", frames[..FRAMES_LISTED].join(" "), more - FRAMES_LISTED),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn x(meters: f64) -> Pose {
        Pose::translation(meters, 0.0, 0.0)
    }

    #[test]
    fn static_publishers_join_and_a_moving_frame_is_asked_at_its_time() {
        let mut tree = FrameTree::default();
        tree.fix("base", "lidar", x(0.5)).unwrap();
        tree.fix("base", "imu", x(-0.5)).unwrap();
        tree.note("odom", "base", 0, x(0.0)).unwrap();
        tree.note("odom", "base", 1_000_000_000, x(2.0)).unwrap();
        let odom_from_lidar = tree.transform("odom", "lidar", 500_000_000, 0).unwrap();
        assert!(pose_difference(&odom_from_lidar, &x(1.5)).0 < 1e-12);
        let imu_from_lidar = tree.transform("imu", "lidar", i64::MAX, 0).unwrap();
        assert!(pose_difference(&imu_from_lidar, &x(1.0)).0 < 1e-12);
        let late = tree.transform("odom", "lidar", 1_050_000_000, 0).unwrap_err();
        assert!(matches!(late, NoTransform::OtherTime { side: "before", .. }), "{late}");
        assert!(tree.transform("odom", "lidar", 1_050_000_000, i64::MAX).is_ok());
        assert!(tree.transform("odom", "lidar", 1_150_000_000, i64::MAX).is_err());
    }

    #[test]
    fn what_is_missing_is_told_with_what_is_there() {
        let mut tree = FrameTree::default();
        tree.fix("base", "imu", x(1.0)).unwrap();
        let unknown = tree.transform("base", "lidar", 0, 0).unwrap_err().to_string();
        assert!(unknown.contains("\"lidar\"") && unknown.contains("base imu"), "{unknown}");
        tree.fix("sensors", "lidar", x(1.0)).unwrap();
        let apart = tree.transform("base", "lidar", 0, 0).unwrap_err().to_string();
        assert!(apart.contains("not connected") && apart.contains("sensors"), "{apart}");
    }

    #[test]
    fn what_two_publishers_say_differently_is_told() {
        let mut tree = FrameTree::default();
        assert_eq!(tree.contradiction("base", "lidar", Some(&x(0.5))), None);
        tree.fix("base", "lidar", x(0.5)).unwrap();
        // As often as it likes, and rounded.
        assert_eq!(tree.contradiction("base", "lidar", Some(&x(0.500_01))), None);
        let elsewhere = tree.contradiction("base", "lidar", Some(&x(0.8))).unwrap();
        assert!(matches!(elsewhere, Contradiction::Elsewhere { off_m, .. } if (off_m - 0.3).abs() < 1e-9));
        let turned =
            Pose::from_parts(x(0.5).translation, nalgebra::UnitQuaternion::from_euler_angles(0.0, 0.0, 0.1));
        assert!(tree.contradiction("base", "lidar", Some(&turned)).is_some());
        assert!(matches!(
            tree.contradiction("base", "lidar", None),
            Some(Contradiction::FixedAndMoving { .. })
        ));
        let parent = tree.contradiction("camera", "lidar", Some(&x(0.5))).unwrap();
        assert!(parent.to_string().contains("\"base\" and on \"camera\""), "{parent}");
        tree.note("odom", "base", 0, x(0.0)).unwrap();
        assert_eq!(tree.contradiction("odom", "base", None), None);
        assert!(tree.contradiction("map", "base", None).is_some(), "as two localizations would");
    }

    #[test]
    fn frames_never_go_in_a_circle_and_are_bounded() {
        let mut tree = FrameTree::default();
        tree.fix("a", "b", x(1.0)).unwrap();
        tree.fix("b", "c", x(1.0)).unwrap();
        for (parent, child) in [("c", "a"), ("a", "a"), ("c", "b")] {
            let refused = tree.fix(parent, child, x(0.0));
            assert!(matches!(refused, Err(BadTransform::Circle { .. })), "{parent} {child}: {refused:?}");
        }
        let mut chain = FrameTree::default();
        let name = |k: usize| format!("f{k:04}");
        let deep = (0..200).find_map(|k| chain.fix(&name(k), &name(k + 1), x(1.0)).err());
        assert!(matches!(deep, Some(BadTransform::TooDeep(_))), "{deep:?}");
        assert_eq!(chain.frames().len(), DEPTH_MAX);
        // From its leaf up, each parent has no parent yet: what is beyond is not found.
        let mut chain = FrameTree::default();
        (0..200).rev().for_each(|k| chain.fix(&name(k), &name(k + 1), x(1.0)).unwrap());
        assert!(chain.transform(&name(0), &name(200), 0, 0).is_err());
        assert!(chain.transform(&name(150), &name(200), 0, 0).is_ok());
        let long = "n".repeat(NAME_BYTES_MAX + 1);
        assert!(matches!(tree.fix("a", &long, x(0.0)), Err(BadTransform::Name { len: 257, .. })));
        let refused =
            (0..2 * FRAMES_MAX).filter(|k| tree.fix("a", &format!("f{k}"), x(0.0)).is_err()).count();
        assert_eq!(refused, FRAMES_MAX + 2);
        assert!(tree.transform("zz", "a", 0, 0).unwrap_err().to_string().len() < 400);
    }
}
