//! Regions, as shapes of the package `mrol` are written in JSON: an object whose field is the word for its kind.

use mrol_client::geometry::{Pose, pose};
use mrol_client::map::Region;
use mrol_client::planning::{Surroundings, Unknown};
use mrol_client::service::ServiceError;
use pyo3::prelude::*;

use crate::failure::Failure;

/// A pose, x y z and qx qy qz qw.
pub(crate) type Seven = [f64; 7];

/// A pose of seven numbers.
pub(crate) fn pose_of([x, y, z, i, j, k, w]: Seven) -> Result<Pose, Failure> {
    Ok(pose([x, y, z], [i, j, k, w]).map_err(ServiceError::from)?)
}

/// A box along the axes: its smallest and its largest corner.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Corners<const N: usize> {
    pub(crate) min_m: [f64; N],
    pub(crate) max_m: [f64; N],
}

/// A ball.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct BallFields {
    center_m: [f64; 3],
    radius_m: f64,
}

/// A pose.
#[derive(FromPyObject, IntoPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct PoseFields {
    translation_m: [f64; 3],
    rotation_xyzw: [f64; 4],
}

/// A box with any orientation.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct OrientedBoxFields {
    map_from_box: PoseFields,
    size_m: [f64; 3],
}

/// A part of space.
#[derive(FromPyObject)]
pub(crate) enum Shape {
    Box {
        #[pyo3(item("box"))]
        corners: Corners<3>,
    },
    Sphere {
        #[pyo3(item("sphere"))]
        ball: BallFields,
    },
    OrientedBox {
        #[pyo3(item("oriented_box"))]
        oriented: OrientedBoxFields,
    },
}

impl PoseFields {
    /// The fields of a pose.
    pub(crate) fn of(pose: &Pose) -> Self {
        let rotation = pose.rotation.coords;
        Self {
            translation_m: pose.translation.vector.into(),
            rotation_xyzw: [rotation.x, rotation.y, rotation.z, rotation.w],
        }
    }
}

impl Shape {
    /// The region that it means.
    pub(crate) fn region(&self) -> Result<Region, Failure> {
        let region = match self {
            Self::Box { corners } => Region::cuboid(corners.min_m, corners.max_m),
            Self::Sphere { ball } => Region::ball(ball.center_m, ball.radius_m),
            Self::OrientedBox { oriented } => {
                let PoseFields { translation_m, rotation_xyzw } = oriented.map_from_box;
                let map_from_box = pose(translation_m, rotation_xyzw).map_err(ServiceError::from)?;
                Region::oriented_box(map_from_box, oriented.size_m)
            }
        };
        Ok(region.map_err(ServiceError::from)?)
    }
}

/// What counts as an obstacle: voxels outside some regions, and what nobody saw or not.
pub(crate) fn surroundings(ignored: Option<&[Shape]>, unknown: &str) -> Result<Surroundings, Failure> {
    let ignored = ignored.unwrap_or_default().iter().map(Shape::region).collect::<Result<_, _>>()?;
    Ok(Surroundings { ignored, unknown: unknown_of(unknown) })
}

/// What a word says of places that nobody saw.
pub(crate) fn unknown_of(word: &str) -> Unknown {
    if word == "occupied" { Unknown::Occupied } else { Unknown::Free }
}
