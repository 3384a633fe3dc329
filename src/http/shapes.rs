//! Parts of space in JSON.

use serde::Deserialize;

use super::object::Object;
use crate::geometry::Pose;
use crate::map::{Prism, PrismError, Region, RegionError};
use crate::service::ServiceError;
use crate::wire::InField;
use crate::wire::json::JsonPose;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct BoxBody {
    min_m: [f64; 3],
    max_m: [f64; 3],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SphereBody {
    center_m: [f64; 3],
    radius_m: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct OrientedBoxBody {
    map_from_box: Object<JsonPose>,
    size_m: [f64; 3],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PrismBody {
    corners_m: Vec<[f64; 2]>,
    z_from_m: f64,
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
