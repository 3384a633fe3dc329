//! Why a planner's question cannot be answered.

use crate::geometry::QUATERNION_NORM_TOLERANCE;

/// Which sphere of a question.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SpherePlace {
    /// Of a link of a body.
    InLink {
        /// The link.
        link: usize,
        /// The sphere in it.
        sphere: usize,
    },
    /// Of spheres in groups, by its number among all of them.
    InGroups(usize),
}

impl std::fmt::Display for SpherePlace {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::InLink { link, sphere } => write!(f, "links[{link}].spheres[{sphere}]"),
            Self::InGroups(number) => write!(f, "spheres[{number}]"),
        }
    }
}

/// What of a question comes before a part of it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Before {
    /// Configurations, among those of all motions.
    pub configurations: usize,
    /// Motions.
    pub motions: usize,
    /// Spheres in groups.
    pub spheres: usize,
}

/// Why numbers are not a question.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PlanningError {
    /// A sphere that is none.
    #[error(
        "{place} must have a finite center and a radius in 0..={radius_max_m} m, got {center_m:?} and {radius_m}"
    )]
    Sphere {
        /// Which one.
        place: SpherePlace,
        /// Its center, meters.
        center_m: [f32; 3],
        /// Its radius, meters.
        radius_m: f32,
        /// The largest radius, meters.
        radius_max_m: f32,
    },
    /// A sphere that is too large for the level.
    #[error(
        "{place} has a radius of {radius} voxels with its padding, at most {radius_max} are possible: ask a coarser level"
    )]
    RadiusInVoxels {
        /// Which one; points with padding come after the spheres.
        place: SpherePlace,
        /// Its radius, voxels of the level.
        radius: f64,
        /// The largest radius, voxels of the level.
        radius_max: f64,
    },
    /// A point with NaN or infinity.
    #[error("links[{link}].points[{point}] must be finite, got {xyz_m:?}")]
    Point {
        /// The link.
        link: usize,
        /// The point in it.
        point: usize,
        /// Its coordinates, meters.
        xyz_m: [f32; 3],
    },
    /// A padding that is none.
    #[error("links[{link}].padding_m must lie in 0..={padding_max_m} m, got {padding_m}")]
    Padding {
        /// The link.
        link: usize,
        /// Its padding, meters.
        padding_m: f32,
        /// The largest padding, meters.
        padding_max_m: f32,
    },
    /// A body without a link.
    #[error("a body has at least one link")]
    NoLinks,
    /// A body that is nowhere: it would be free everywhere.
    #[error("a body has at least one sphere or point, got {links} links without any")]
    NoParts {
        /// The body's links.
        links: usize,
    },
    /// Numbers that are not whole configurations.
    #[error(
        "a configuration of {links} links has {expected} numbers (x y z qx qy qz qw each), got {got} in all"
    )]
    Configurations {
        /// The body's links.
        links: usize,
        /// Numbers of a configuration.
        expected: usize,
        /// Numbers that came.
        got: usize,
    },
    /// A pose that is none.
    #[error(
        "configurations[{configuration}].links[{link}] must be finite, with a unit quaternion within {QUATERNION_NORM_TOLERANCE}, got {numbers:?}"
    )]
    Pose {
        /// The configuration.
        configuration: usize,
        /// The link.
        link: usize,
        /// x y z qx qy qz qw.
        numbers: [f32; 7],
    },
    /// Groups whose sizes do not sum up to the spheres.
    #[error("sizes are of {expected} spheres in all, got {got} spheres")]
    Groups {
        /// The sum of the groups' sizes.
        expected: usize,
        /// Spheres that came.
        got: usize,
    },
    /// A motion of fewer than two configurations, or motions whose lengths do not sum up.
    #[error("motions have at least 2 configurations each, {configurations} in all, got {lengths:?}")]
    Motions {
        /// Configurations that came.
        configurations: usize,
        /// The motions' lengths; the first of them where they are many.
        lengths: Vec<usize>,
    },
    /// A configuration of which a part lies beyond what the map can hold.
    #[error(
        "configurations[{configuration}].links[{link}] reaches beyond {min_m}..{end_m} m in an axis, with {around_m} m around it that count: no voxel can be there; is the unit meters?"
    )]
    BodyRange {
        /// The configuration, among those of all motions.
        configuration: usize,
        /// The link.
        link: usize,
        /// What counts around it, meters: a clearance where unknown voxels count as occupied.
        around_m: f64,
        /// Smallest coordinate of the map, meters.
        min_m: f64,
        /// One past the largest, meters.
        end_m: f64,
    },
    /// A sphere of which a part lies beyond what the map can hold.
    #[error(
        "spheres[{sphere}] reaches beyond {min_m}..{end_m} m in an axis, with {around_m} m around it that count: no voxel can be there; is the unit meters?"
    )]
    SphereRange {
        /// The sphere, by its number among all of them.
        sphere: usize,
        /// What counts around it, meters: a clearance where unknown voxels count as occupied.
        around_m: f64,
        /// Smallest coordinate of the map, meters.
        min_m: f64,
        /// One past the largest, meters.
        end_m: f64,
    },
    /// A level that the map has not.
    #[error("level must lie in 0..={level_max}, got {level}")]
    Level {
        /// The level.
        level: u32,
        /// The map's coarsest.
        level_max: u32,
    },
    /// A distance that is none.
    #[error("{field} must lie in {min}..={max}, got {value}")]
    Number {
        /// Which number it is.
        field: &'static str,
        /// The number.
        value: f64,
        /// The least.
        min: f64,
        /// The largest.
        max: f64,
    },
    /// A motion that takes too many steps.
    #[error("motions[{motion}] takes {steps} steps, at most {steps_max} are made: take a larger step_m")]
    Steps {
        /// The motion.
        motion: usize,
        /// Its steps.
        steps: u64,
        /// The largest number of steps.
        steps_max: u64,
    },
}

impl PlanningError {
    /// The error of a part of a question as one of the whole, of which so much comes before the part.
    #[must_use]
    pub fn behind(mut self, before: Before) -> Self {
        match &mut self {
            Self::Pose { configuration, .. } | Self::BodyRange { configuration, .. } => {
                *configuration += before.configurations;
            }
            Self::SphereRange { sphere: number, .. }
            | Self::Sphere { place: SpherePlace::InGroups(number), .. }
            | Self::RadiusInVoxels { place: SpherePlace::InGroups(number), .. } => *number += before.spheres,
            Self::Steps { motion, .. } => *motion += before.motions,
            _ => {}
        }
        self
    }
}
