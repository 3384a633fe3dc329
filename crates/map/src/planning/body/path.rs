//! How a link moves between two poses: its translation along a line, its rotation along the shorter arc, both evenly.
//! Of the two arcs of half a turn the signs of the quaternions decide.

use super::placement::LinkPose;

/// The motion of a link from one pose to another.
#[derive(Debug, Clone, Copy)]
pub(in crate::planning) struct LinkMotion {
    from_m: [f64; 3],
    to_m: [f64; 3],
    /// Unit quaternions x y z w with an angle of at most 90 degrees between them.
    from: [f64; 4],
    to: [f64; 4],
    /// That angle, which is half of the rotation's, radians; and its sine.
    half_angle: f64,
    sine: f64,
}

/// The sine of an angle that is none.
const SINE_MIN: f64 = 1e-9;

impl LinkMotion {
    pub(in crate::planning) fn new(from: &LinkPose, to: &LinkPose) -> Self {
        let (start, mut end) = (unit(from.rotation_xyzw), unit(to.rotation_xyzw));
        if dot(start, end) < 0.0 {
            end = end.map(|c| -c);
        }
        let norm = |sign: f64| {
            let sum: [f64; 4] = std::array::from_fn(|i| start[i] + sign * end[i]);
            dot(sum, sum).sqrt()
        };
        let half_angle = 2.0 * norm(-1.0).atan2(norm(1.0));
        let sine = half_angle.sin();
        Self { from_m: from.translation_m, to_m: to.translation_m, from: start, to: end, half_angle, sine }
    }

    /// The pose after `share` of the motion, 0 to 1.
    #[inline]
    pub(in crate::planning) fn at(&self, share: f64) -> LinkPose {
        let (rest, sine) = (1.0 - share, self.sine);
        let (a, b) = if sine < SINE_MIN {
            (rest, share)
        } else {
            ((rest * self.half_angle).sin() / sine, (share * self.half_angle).sin() / sine)
        };
        LinkPose {
            translation_m: std::array::from_fn(|axis| rest * self.from_m[axis] + share * self.to_m[axis]),
            rotation_xyzw: std::array::from_fn(|i| a * self.from[i] + b * self.to[i]),
        }
    }

    /// How far a point moves at most that is at most `extent_m` from the link's origin, meters, rounded up.
    pub(in crate::planning) fn length_m(&self, extent_m: f64) -> f64 {
        let shift: [f64; 3] = std::array::from_fn(|axis| self.to_m[axis] - self.from_m[axis]);
        let shift_m = shift.iter().map(|c| c * c).sum::<f64>().sqrt();
        (shift_m + 2.0 * self.half_angle * extent_m) * (1.0 + 1e-9)
    }
}

fn dot(a: [f64; 4], b: [f64; 4]) -> f64 {
    (0..4).map(|i| a[i] * b[i]).sum()
}

fn unit(quaternion: [f64; 4]) -> [f64; 4] {
    let norm = dot(quaternion, quaternion).sqrt();
    quaternion.map(|c| c / norm)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planning::body::CellsFromLink;
    use proptest::prelude::*;

    fn pose() -> impl Strategy<Value = LinkPose> {
        let quaternion =
            prop::array::uniform4(-1.0f64..1.0).prop_filter("a rotation", |q| dot(*q, *q) > 0.01);
        (prop::array::uniform3(-5.0f64..5.0), quaternion)
            .prop_map(|(translation_m, rotation_xyzw)| LinkPose { translation_m, rotation_xyzw })
    }

    proptest! {
        #[test]
        fn a_motion_goes_evenly_from_pose_to_pose_and_no_point_further_than_told(
            from in pose(), to in pose(), steps in 1usize..20, direction in prop::array::uniform3(-1.0f64..1.0),
        ) {
            let motion = LinkMotion::new(&from, &to);
            let extent_m = direction.iter().map(|c| c * c).sum::<f64>().sqrt();
            let place = |pose: &LinkPose| CellsFromLink::of(pose, 1.0).cells(direction);
            let moved = |a: [f64; 3], b: [f64; 3]| (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt();
            prop_assert!(moved(place(&motion.at(0.0)), place(&from)) < 1e-9);
            prop_assert!(moved(place(&motion.at(1.0)), place(&to)) < 1e-9);
            for step in 0..steps {
                let share = |step: usize| step as f64 / steps as f64;
                let went = moved(place(&motion.at(share(step))), place(&motion.at(share(step + 1))));
                prop_assert!(went <= motion.length_m(extent_m) / steps as f64 + 1e-9);
            }
        }
    }

    #[test]
    fn half_a_turn_goes_through_a_quarter() {
        let at = |rotation_xyzw| LinkPose { translation_m: [0.0; 3], rotation_xyzw };
        let motion = LinkMotion::new(&at([0.0, 0.0, 0.0, 1.0]), &at([0.0, 0.0, 1.0, 0.0]));
        let place = CellsFromLink::of(&motion.at(0.5), 1.0).cells([1.0, 0.0, 0.0]);
        assert!((place[0]).abs() < 1e-12 && (place[1].abs() - 1.0).abs() < 1e-12);
        assert!((motion.length_m(1.0) - std::f64::consts::PI).abs() < 1e-6);
    }
}
