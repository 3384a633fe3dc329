//! Agreement of rays in JSON, at the pose of an answer and at its rivals.

use serde::Serialize;
use utoipa::ToSchema;

use super::pose::JsonPose;
use mrol_map::align::{RayAgreement, RayCounts, Rival};

/// What rays of one side say of a pose.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = RayCounts)]
pub struct JsonRayCounts {
    /// Points that were looked for.
    pub asked: usize,
    /// Those where the other side met something, too.
    pub agree: usize,
    /// Those through which the other side saw.
    pub contradicted: usize,
}

/// How the rays of a scan at a pose and those of earlier scans agree.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = RayAgreement)]
pub struct JsonRayAgreement {
    /// The share of points that agree, of those of which anything is known: of the side where it is smaller.
    pub agreement: f64,
    /// The share of points that agree, of all: of the side where it is smaller.
    pub evidence: f64,
    /// The scan's points, in what earlier scans saw.
    pub of_scan: JsonRayCounts,
    /// What earlier scans met, in what the scan saw.
    pub of_map: JsonRayCounts,
}

/// A pose that a scan may have been taken at as well.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = Rival)]
pub struct JsonRival {
    /// The pose of the sensor in the map.
    pub map_from_sensor: JsonPose,
    /// How rays agree there.
    pub rays: JsonRayAgreement,
}

impl From<RayCounts> for JsonRayCounts {
    fn from(RayCounts { asked, agree, contradicted }: RayCounts) -> Self {
        Self { asked, agree, contradicted }
    }
}

impl From<RayAgreement> for JsonRayAgreement {
    fn from(rays: RayAgreement) -> Self {
        Self {
            agreement: rays.worse(),
            evidence: rays.evidence(),
            of_scan: rays.of_scan.into(),
            of_map: rays.of_map.into(),
        }
    }
}

impl From<Rival> for JsonRival {
    fn from(rival: Rival) -> Self {
        Self { map_from_sensor: (&rival.map_from_sensor).into(), rays: rival.agreement.into() }
    }
}
