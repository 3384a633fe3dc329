//! Points, poses, regions, states: what several services share (`types.proto`).

use uuid::Uuid;

use super::field::{InField, required};
use crate::wire::pb;
use mrol_map::geometry::{self, Point, Pose};
use mrol_map::map::{ContentHash, Lookup, Region, RequestId};
use mrol_service::{MapVersion, PointCloud, Reason, ServiceError};

impl TryFrom<pb::Points> for PointCloud {
    type Error = ServiceError;

    fn try_from(points: pb::Points) -> Result<Self, ServiceError> {
        match (points.xyz_f32le.is_empty(), points.xyz.is_empty()) {
            (false, true) => Self::from_bytes(points.xyz_f32le),
            (true, false) => from_floats(&points.xyz),
            (true, true) => Err(ServiceError::new(Reason::EmptyBatch, "must hold at least one point, got 0")),
            (false, false) => {
                let message = format!(
                    "must fill one of xyz_f32le and xyz, got both ({} bytes and {} numbers)",
                    points.xyz_f32le.len(),
                    points.xyz.len()
                );
                Err(ServiceError::new(Reason::AmbiguousPoints, message))
            }
        }
    }
}

fn from_floats(numbers: &[f32]) -> Result<PointCloud, ServiceError> {
    let (points, rest) = numbers.as_chunks::<3>();
    if !rest.is_empty() {
        let message = format!("xyz must hold three numbers a point, got {} numbers", numbers.len());
        return Err(ServiceError::new(Reason::TruncatedPoints, message));
    }
    Ok(points.iter().copied().map(Point::from).collect::<Vec<_>>().into())
}

impl From<PointCloud> for pb::Points {
    fn from(points: PointCloud) -> Self {
        let bytes = points.into_bytes();
        Self { xyz_f32le: bytes, xyz: Vec::new() }
    }
}

impl TryFrom<pb::Pose> for Pose {
    type Error = ServiceError;

    fn try_from(pose: pb::Pose) -> Result<Self, ServiceError> {
        let translation_m = required(pose.translation_m, "translation_m")?;
        let pb::Quaternion { x, y, z, w } = required(pose.rotation, "rotation")?;
        Ok(geometry::pose(translation_m.into(), [x, y, z, w])?)
    }
}

impl From<&Pose> for pb::Pose {
    fn from(pose: &Pose) -> Self {
        let [x, y, z, w] = geometry::rotation_xyzw(pose);
        Self {
            translation_m: Some(geometry::translation_m(pose).into()),
            rotation: Some(pb::Quaternion { x, y, z, w }),
        }
    }
}

impl From<pb::Vector3> for [f64; 3] {
    fn from(vector: pb::Vector3) -> Self {
        [vector.x, vector.y, vector.z]
    }
}

impl From<[f64; 3]> for pb::Vector3 {
    fn from([x, y, z]: [f64; 3]) -> Self {
        Self { x, y, z }
    }
}

impl TryFrom<pb::Region> for Region {
    type Error = ServiceError;

    fn try_from(region: pb::Region) -> Result<Self, ServiceError> {
        match required(region.shape, "region.shape")? {
            pb::region::Shape::Box(pb::Box { min_m, max_m }) => {
                let min_m = required(min_m, "region.box.min_m")?.into();
                let max_m = required(max_m, "region.box.max_m")?.into();
                Self::cuboid(min_m, max_m).in_field("region")
            }
            pb::region::Shape::Sphere(pb::Sphere { center_m, radius_m }) => {
                let center_m = required(center_m, "region.sphere.center_m")?.into();
                Self::ball(center_m, radius_m).in_field("region")
            }
            pb::region::Shape::OrientedBox(pb::OrientedBox { map_from_box, size_m }) => {
                let map_from_box = required(map_from_box, "region.oriented_box.map_from_box")?;
                let map_from_box = map_from_box.try_into().in_field("region.oriented_box.map_from_box")?;
                let size_m = required(size_m, "region.oriented_box.size_m")?.into();
                Self::oriented_box(map_from_box, size_m).in_field("region")
            }
        }
    }
}

impl From<Region> for pb::Region {
    fn from(region: Region) -> Self {
        let shape = match region {
            Region::Box { min_m, max_m } => {
                pb::region::Shape::Box(pb::Box { min_m: Some(min_m.into()), max_m: Some(max_m.into()) })
            }
            Region::Sphere { center_m, radius_m } => {
                pb::region::Shape::Sphere(pb::Sphere { center_m: Some(center_m.into()), radius_m })
            }
            Region::OrientedBox(of) => pb::region::Shape::OrientedBox(pb::OrientedBox {
                map_from_box: Some(of.map_from_box().into()),
                size_m: Some(of.size_m().into()),
            }),
        };
        Self { shape: Some(shape) }
    }
}

impl TryFrom<pb::MapVersion> for MapVersion {
    type Error = ServiceError;

    fn try_from(version: pb::MapVersion) -> Result<Self, ServiceError> {
        Ok(Self {
            revision: version.revision,
            map_uuid: uuid_from(&version.map_uuid)?,
            content_hash: version.content_hash.map(ContentHash::from_bits),
        })
    }
}

impl From<MapVersion> for pb::MapVersion {
    fn from(version: MapVersion) -> Self {
        Self {
            revision: version.revision,
            map_uuid: version.map_uuid.to_string(),
            content_hash: version.content_hash.map(ContentHash::to_bits),
        }
    }
}

/// The lookup of an enum field's number.
pub(in crate::wire) fn lookup_from(number: i32) -> Result<Lookup, ServiceError> {
    match pb::Lookup::try_from(number) {
        Ok(pb::Lookup::Unspecified | pb::Lookup::Exact) => Ok(Lookup::Exact),
        Ok(pb::Lookup::Bloom) => Ok(Lookup::Bloom),
        Err(_) => {
            let message = format!("lookup must be 0, 1 (exact) or 2 (bloom), got {number}");
            Err(ServiceError::new(Reason::BadLookup, message))
        }
    }
}

impl From<Lookup> for pb::Lookup {
    fn from(lookup: Lookup) -> Self {
        match lookup {
            Lookup::Exact => Self::Exact,
            Lookup::Bloom => Self::Bloom,
        }
    }
}

/// A map's uuid from its text.
pub fn uuid_from(text: &str) -> Result<Uuid, ServiceError> {
    Uuid::parse_str(text).map_err(|error| {
        let start: String = text.chars().take(64).collect();
        ServiceError::new(Reason::BadUuid, format!("map_uuid must be a uuid, got {start:?}: {error}"))
    })
}

/// A request's id; none where the text is empty.
pub(in crate::wire) fn request_id_from(text: &str) -> Result<Option<RequestId>, ServiceError> {
    Ok((!text.is_empty()).then(|| RequestId::new(text)).transpose()?)
}

/// The inverse of [`request_id_from`].
pub(in crate::wire) fn text_of(id: Option<RequestId>) -> String {
    id.map(|id| id.to_string()).unwrap_or_default()
}

/// A count that came over the wire. Machines of less than 64 bits hold no map that would notice.
pub(in crate::wire) fn count_from(count: u64) -> usize {
    usize::try_from(count).unwrap_or(usize::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_pose_survives_the_wire(t in prop::array::uniform3(-1e3..1e3f64), axis in prop::array::uniform3(-3.0..3.0f64)) {
            let rotation = nalgebra::UnitQuaternion::from_scaled_axis(axis.into());
            let pose = Pose::from_parts(nalgebra::Translation3::from(nalgebra::Vector3::from(t)), rotation);
            let back = Pose::try_from(pb::Pose::from(&pose)).unwrap();
            let (meters, degrees) = geometry::pose_difference(&pose, &back);
            prop_assert!(meters < 1e-9 && degrees < 1e-5);
        }

        #[test]
        fn both_encodings_give_the_same_points(numbers in prop::collection::vec(prop::array::uniform3(any::<f32>()), 1..50)) {
            let xyz: Vec<f32> = numbers.iter().flatten().copied().collect();
            let bytes: Vec<u8> = xyz.iter().flat_map(|c| c.to_le_bytes()).collect();
            let floats = PointCloud::try_from(pb::Points { xyz, ..Default::default() }).unwrap();
            let packed = pb::Points { xyz_f32le: bytes.into(), ..Default::default() };
            prop_assert_eq!(&floats, &PointCloud::try_from(packed.clone()).unwrap());
            prop_assert_eq!(pb::Points::from(floats), packed);
        }
    }

    #[test]
    fn points_that_are_none_say_why() {
        let points = |bytes: usize, numbers: usize| pb::Points {
            xyz_f32le: vec![0; bytes].into(),
            xyz: vec![0.0; numbers],
        };
        let reason = |bytes, numbers| PointCloud::try_from(points(bytes, numbers)).unwrap_err().reason;
        assert_eq!(reason(0, 0), Reason::EmptyBatch);
        assert_eq!(reason(12, 3), Reason::AmbiguousPoints);
        assert_eq!(reason(13, 0), Reason::TruncatedPoints);
        assert_eq!(reason(0, 4), Reason::TruncatedPoints);
    }

    #[test]
    fn regions_survive_the_wire_and_half_of_one_is_refused() {
        let turned = geometry::pose([1.0, 2.0, 3.0], [0.0, 0.6, 0.0, 0.8]).unwrap();
        for region in [
            Region::cuboid([0.0; 3], [1.0; 3]),
            Region::ball([1.0; 3], 2.0),
            Region::oriented_box(turned, [1.0, 2.0, 0.5]),
        ] {
            let region = region.unwrap();
            assert_eq!(Region::try_from(pb::Region::from(region)).unwrap(), region);
        }
        let half = pb::Box { min_m: Some([0.0; 3].into()), max_m: None };
        let error = Region::try_from(pb::Region { shape: Some(pb::region::Shape::Box(half)) }).unwrap_err();
        assert_eq!(error.message, "region.box.max_m is missing");
    }
}
