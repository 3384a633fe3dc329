//! Configurations: a pose for each link of a body.

use std::ops::Range;

use crate::geometry::QUATERNION_NORM_TOLERANCE;
use crate::planning::error::PlanningError;

/// Numbers of a pose: x y z in meters and the unit quaternion qx qy qz qw.
pub const NUMBERS_PER_POSE: usize = 7;

/// The pose of what is in the map frame.
pub(in crate::planning) const MAP_FRAME: [f32; NUMBERS_PER_POSE] = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];

/// Poses of a body's links in the map frame, configuration by configuration, link by link, each x y z qx qy qz qw.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Configurations<'a> {
    numbers: &'a [f32],
    links: usize,
}

impl<'a> Configurations<'a> {
    /// The configurations of a body of `links` links that `numbers` are.
    ///
    /// # Errors
    /// When there are not as many numbers as whole configurations have, or one is not finite, or a quaternion is not of
    /// unit length within [`QUATERNION_NORM_TOLERANCE`].
    pub fn new(numbers: &'a [f32], links: usize) -> Result<Self, PlanningError> {
        let expected = links * NUMBERS_PER_POSE;
        if links == 0 || !numbers.len().is_multiple_of(expected) {
            return Err(PlanningError::Configurations { links, expected, got: numbers.len() });
        }
        let configurations = Self { numbers, links };
        match configurations.poses().position(|pose| !is_pose(pose)) {
            None => Ok(configurations),
            Some(pose) => Err(PlanningError::Pose {
                configuration: pose / links,
                link: pose % links,
                numbers: configurations.pose(pose / links, pose % links),
            }),
        }
    }

    /// Some of the configurations, by their numbers.
    #[must_use]
    pub fn part(self, of: Range<usize>) -> Self {
        let numbers = self.links * NUMBERS_PER_POSE;
        Self { numbers: &self.numbers[of.start * numbers..of.end * numbers], ..self }
    }

    /// Number of configurations.
    pub fn len(&self) -> usize {
        self.numbers.len() / (self.links * NUMBERS_PER_POSE)
    }

    /// True without a configuration.
    pub fn is_empty(&self) -> bool {
        self.numbers.is_empty()
    }

    /// Links of a configuration.
    pub fn links(&self) -> usize {
        self.links
    }

    /// Refuses configurations of another body.
    pub(in crate::planning) fn check_links(&self, links: usize) -> Result<(), PlanningError> {
        let (expected, got) = (links * NUMBERS_PER_POSE, self.links * NUMBERS_PER_POSE);
        if got == expected { Ok(()) } else { Err(PlanningError::Configurations { links, expected, got }) }
    }

    /// The pose of `link` in `configuration`.
    ///
    /// # Panics
    /// When there is no such pose.
    #[inline]
    pub fn pose(&self, configuration: usize, link: usize) -> [f32; NUMBERS_PER_POSE] {
        self.poses_of(configuration)[link]
    }

    /// The poses of all links in `configuration`.
    ///
    /// # Panics
    /// When there is no such configuration.
    #[inline]
    pub fn poses_of(&self, configuration: usize) -> &'a [[f32; NUMBERS_PER_POSE]] {
        let first = configuration * self.links;
        &self.numbers.as_chunks().0[first..first + self.links]
    }

    fn poses(&self) -> impl Iterator<Item = &'a [f32; NUMBERS_PER_POSE]> {
        self.numbers.as_chunks().0.iter()
    }
}

#[inline(always)]
#[expect(clippy::manual_range_contains, reason = "without a branch")]
fn is_pose(&[px, py, pz, x, y, z, w]: &[f32; NUMBERS_PER_POSE]) -> bool {
    const LOW: f32 = ((1.0 - QUATERNION_NORM_TOLERANCE) * (1.0 - QUATERNION_NORM_TOLERANCE)) as f32;
    const HIGH: f32 = ((1.0 + QUATERNION_NORM_TOLERANCE) * (1.0 + QUATERNION_NORM_TOLERANCE)) as f32;
    let norm_squared = x * x + y * y + (z * z + w * w);
    let is_finite = px.is_finite() & py.is_finite() & pz.is_finite();
    (LOW <= norm_squared) & (norm_squared <= HIGH) & is_finite
}

#[cfg(test)]
mod tests {
    use super::*;

    const IDENTITY: [f32; 7] = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];

    #[test]
    fn numbers_are_whole_configurations_of_poses() {
        let numbers = [IDENTITY; 6].concat();
        let configurations = Configurations::new(&numbers, 2).unwrap();
        assert_eq!((configurations.len(), configurations.links()), (3, 2));
        assert_eq!(configurations.pose(2, 1), IDENTITY);
        assert!(Configurations::new(&[], 3).unwrap().is_empty());
        for (count, links) in [(41, 2), (35, 2), (7, 0)] {
            let error = Configurations::new(&numbers[..count], links).unwrap_err().to_string();
            assert!(error.contains(&format!("got {count}")), "{error}");
        }
    }

    #[test]
    fn a_pose_that_is_none_is_named() {
        for (number, value) in
            [(0, f32::NAN), (1, f32::INFINITY), (2, f32::NEG_INFINITY), (6, 0.998), (3, 0.05), (6, f32::NAN)]
        {
            let mut numbers = [IDENTITY; 4].concat();
            numbers[21 + number] = value;
            let error = Configurations::new(&numbers, 2).unwrap_err().to_string();
            assert!(error.contains("configurations[1].links[1]"), "{error}");
        }
        for (number, value) in [(0, f32::MAX), (1, -f32::MAX), (6, 0.9995), (6, 1.0005), (3, 0.04)] {
            let mut numbers = [IDENTITY; 4].concat();
            numbers[number] = value;
            assert!(Configurations::new(&numbers, 2).is_ok(), "{number} {value}");
        }
    }
}
