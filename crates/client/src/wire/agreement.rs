//! Agreement of rays, at the pose of an answer and at its rivals (`mapping.proto`).

use super::pb;
use super::values::{InField, count_from, required};
use mrol_map::align::{RayAgreement, RayCounts, Rival};
use mrol_service::ServiceError;

impl From<RayCounts> for pb::RayCounts {
    fn from(RayCounts { asked, agree, contradicted }: RayCounts) -> Self {
        Self { asked: asked as u64, agree: agree as u64, contradicted: contradicted as u64 }
    }
}

impl From<pb::RayCounts> for RayCounts {
    fn from(pb::RayCounts { asked, agree, contradicted }: pb::RayCounts) -> Self {
        Self { asked: count_from(asked), agree: count_from(agree), contradicted: count_from(contradicted) }
    }
}

impl From<RayAgreement> for pb::RayAgreement {
    fn from(rays: RayAgreement) -> Self {
        Self { of_scan: Some(rays.of_scan.into()), of_map: Some(rays.of_map.into()) }
    }
}

impl From<pb::RayAgreement> for RayAgreement {
    fn from(rays: pb::RayAgreement) -> Self {
        let counts = |side: Option<pb::RayCounts>| side.unwrap_or_default().into();
        Self { of_scan: counts(rays.of_scan), of_map: counts(rays.of_map) }
    }
}

impl From<&Rival> for pb::Rival {
    fn from(rival: &Rival) -> Self {
        Self { map_from_sensor: Some((&rival.map_from_sensor).into()), rays: Some(rival.agreement.into()) }
    }
}

impl TryFrom<pb::Rival> for Rival {
    type Error = ServiceError;

    fn try_from(rival: pb::Rival) -> Result<Self, ServiceError> {
        let map_from_sensor = required(rival.map_from_sensor, "map_from_sensor")?;
        Ok(Self {
            map_from_sensor: map_from_sensor.try_into().in_field("map_from_sensor")?,
            agreement: rival.rays.unwrap_or_default().into(),
        })
    }
}
