//! The scans that touched a voxel (`occupancy.proto`).

use super::pb;
use super::values::required;
use mrol_map::geometry::Point;
use mrol_map::map::MapName;
use mrol_map::voxel::VoxelKey;
use mrol_service::{ObservedVoxel, ObserversAnswer, ObserversRequest, ObservingScan, Reason, ServiceError};

impl TryFrom<pb::ListObserversRequest> for (MapName, ObserversRequest) {
    type Error = ServiceError;

    fn try_from(request: pb::ListObserversRequest) -> Result<Self, ServiceError> {
        use pb::list_observers_request::Voxel;
        let voxel = match required(request.voxel, "voxel, point_m or key,")? {
            Voxel::PointM(pb::Vector3 { x, y, z }) => {
                ObservedVoxel::Of(Point::from(nalgebra::Point3::new(x, y, z)))
            }
            Voxel::Key(bits) => ObservedVoxel::Key(key_from(bits)?),
        };
        Ok((MapName::new(&request.map)?, ObserversRequest { voxel, level: request.level }))
    }
}

fn key_from(bits: u64) -> Result<VoxelKey, ServiceError> {
    VoxelKey::from_bits(bits).ok_or_else(|| {
        ServiceError::new(Reason::BadKey, format!("key must have bit 63 clear, got {bits:#018x}"))
    })
}

impl From<(&MapName, ObserversRequest)> for pb::ListObserversRequest {
    fn from((map, ObserversRequest { voxel, level }): (&MapName, ObserversRequest)) -> Self {
        use pb::list_observers_request::Voxel;
        let voxel = match voxel {
            ObservedVoxel::Of(point) => Voxel::PointM(point.xyz().map(f64::from).into()),
            ObservedVoxel::Key(key) => Voxel::Key(key.to_bits()),
        };
        Self { map: map.to_string(), voxel: Some(voxel), level }
    }
}

impl From<ObserversAnswer> for pb::ListObserversResponse {
    fn from(answer: ObserversAnswer) -> Self {
        let scan = |ObservingScan { revision, scan }| pb::ObservingScan { revision, scan: Some(scan.into()) };
        Self {
            scans: answer.scans.into_iter().map(scan).collect(),
            older_scans: answer.older_scans,
            version: Some(answer.version.into()),
            key: answer.voxel.to_bits(),
        }
    }
}

impl TryFrom<pb::ListObserversResponse> for ObserversAnswer {
    type Error = ServiceError;

    fn try_from(answer: pb::ListObserversResponse) -> Result<Self, ServiceError> {
        let scan = |pb::ObservingScan { revision, scan }| {
            Ok(ObservingScan { revision, scan: required(scan, "scans.scan")?.try_into()? })
        };
        Ok(Self {
            voxel: key_from(answer.key)?,
            scans: answer.scans.into_iter().map(scan).collect::<Result<_, ServiceError>>()?,
            older_scans: answer.older_scans,
            version: required(answer.version, "version")?.try_into()?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_request_survives_the_wire_and_one_of_no_voxel_is_refused() {
        let map = MapName::new("a").unwrap();
        let key = VoxelKey::new([-3, 4, 5]).unwrap();
        for voxel in [ObservedVoxel::Of(Point::new(1.5, -2.0, 0.25)), ObservedVoxel::Key(key)] {
            let request = ObserversRequest { voxel, level: 2 };
            let message = pb::ListObserversRequest::from((&map, request));
            assert_eq!(<(MapName, ObserversRequest)>::try_from(message).unwrap(), (map.clone(), request));
        }
        let of = |voxel| pb::ListObserversRequest { map: "a".into(), voxel, level: 0 };
        let refused = |voxel| <(MapName, ObserversRequest)>::try_from(of(voxel)).unwrap_err();
        assert_eq!(refused(None).message, "voxel, point_m or key, is missing");
        let key = refused(Some(pb::list_observers_request::Voxel::Key(1 << 63)));
        assert_eq!(key.reason, Reason::BadKey);
    }
}
