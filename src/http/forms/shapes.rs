//! Parts of space in JSON.

use serde::Deserialize;
use utoipa::ToSchema;

use super::object::Object;
use crate::json::{JsonPose, Vector2, Vector3};
use mrol_client::wire::InField;
use mrol_map::geometry::Pose;
use mrol_map::map::{Prism, PrismError, Region, RegionError};
use mrol_service::ServiceError;

/// A box along the map's axes, meters.
#[derive(Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(in crate::http) struct BoxBody {
    /// Smallest coordinates.
    #[schema(value_type = Vector3)]
    min_m: [f64; 3],
    /// Largest coordinates.
    #[schema(value_type = Vector3)]
    max_m: [f64; 3],
}

/// A ball, meters.
#[derive(Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(in crate::http) struct SphereBody {
    /// The center.
    #[schema(value_type = Vector3)]
    center_m: [f64; 3],
    /// The radius, 0 or more.
    radius_m: f64,
}

/// A box with any orientation, meters.
#[derive(Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(in crate::http) struct OrientedBoxBody {
    /// Where its center is, and how it is turned.
    #[schema(value_type = JsonPose)]
    map_from_box: Object<JsonPose>,
    /// Its sides.
    #[schema(value_type = Vector3)]
    size_m: [f64; 3],
}

/// A polygon with a height, meters.
#[derive(Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(in crate::http) struct PrismBody {
    /// x and y of each corner: 3 to 64 of a polygon that does not cross itself, in
    /// either direction.
    #[schema(value_type = Vec<Vector2>, min_items = 3)]
    corners_m: Vec<[f64; 2]>,
    /// The smallest height.
    z_from_m: f64,
    /// The largest height.
    z_to_m: f64,
}

impl TryFrom<BoxBody> for Region {
    type Error = RegionError;

    fn try_from(BoxBody { min_m, max_m }: BoxBody) -> Result<Self, RegionError> {
        Self::cuboid(min_m, max_m)
    }
}

impl TryFrom<SphereBody> for Region {
    type Error = RegionError;

    fn try_from(SphereBody { center_m, radius_m }: SphereBody) -> Result<Self, RegionError> {
        Self::ball(center_m, radius_m)
    }
}

impl TryFrom<OrientedBoxBody> for Region {
    type Error = ServiceError;

    fn try_from(body: OrientedBoxBody) -> Result<Self, ServiceError> {
        let OrientedBoxBody { map_from_box: Object(pose), size_m } = body;
        let map_from_box = Pose::try_from(pose).in_field("oriented_box.map_from_box")?;
        Ok(Self::oriented_box(map_from_box, size_m)?)
    }
}

impl TryFrom<PrismBody> for Prism {
    type Error = PrismError;

    fn try_from(PrismBody { corners_m, z_from_m, z_to_m }: PrismBody) -> Result<Self, PrismError> {
        Self::new(&corners_m, [z_from_m, z_to_m])
    }
}
