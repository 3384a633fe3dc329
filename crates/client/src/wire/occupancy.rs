//! Point queries and voxel listings (`occupancy.proto`).

use super::pb;
use super::values::{InField, count_from, lookup_from, required, uuid_from};
use mrol_map::geometry::Pose;
use mrol_map::map::{Frustum, MapName, Region, VoxelSelection};
use mrol_map::voxel::VoxelKey;
use mrol_service::{ListingRequest, PointAnswer, PointQuery, Reason, ServiceError, VoxelListing};

/// Keys of one message of a listing, at most: half a MiB.
pub const KEYS_PER_CHUNK: usize = 65_536;

impl TryFrom<pb::QueryPointsRequest> for (MapName, PointQuery) {
    type Error = ServiceError;

    fn try_from(request: pb::QueryPointsRequest) -> Result<Self, ServiceError> {
        let query = PointQuery {
            points: required(request.points, "points")?.try_into().in_field("points")?,
            map_from_points: request
                .map_from_points
                .map(|pose| pose.try_into().in_field("map_from_points"))
                .transpose()?,
            level: request.level,
            lookup: lookup_from(request.lookup)?,
            min_revision: request.min_revision,
            map_uuid: (!request.map_uuid.is_empty()).then(|| uuid_from(&request.map_uuid)).transpose()?,
            keep_out: request.keep_out,
        };
        Ok((MapName::new(&request.map)?, query))
    }
}

impl From<(&MapName, PointQuery)> for pb::QueryPointsRequest {
    fn from((map, query): (&MapName, PointQuery)) -> Self {
        Self {
            map: map.to_string(),
            points: Some(query.points.into()),
            map_from_points: query.map_from_points.as_ref().map(Into::into),
            level: query.level,
            lookup: pb::Lookup::from(query.lookup).into(),
            min_revision: query.min_revision,
            map_uuid: query.map_uuid.map(|uuid| uuid.to_string()).unwrap_or_default(),
            keep_out: query.keep_out,
        }
    }
}

impl From<PointAnswer> for pb::QueryPointsResponse {
    fn from(answer: PointAnswer) -> Self {
        Self {
            occupied: answer.occupied,
            points: answer.points as u64,
            points_occupied: answer.points_occupied as u64,
            version: Some(answer.version.into()),
        }
    }
}

impl TryFrom<pb::QueryPointsResponse> for PointAnswer {
    type Error = ServiceError;

    fn try_from(answer: pb::QueryPointsResponse) -> Result<Self, ServiceError> {
        Ok(Self {
            occupied: answer.occupied,
            points: count_from(answer.points),
            points_occupied: count_from(answer.points_occupied),
            version: required(answer.version, "version")?.try_into()?,
        })
    }
}

impl TryFrom<pb::ListVoxelsRequest> for (MapName, ListingRequest) {
    type Error = ServiceError;

    fn try_from(request: pb::ListVoxelsRequest) -> Result<Self, ServiceError> {
        let pb::ListVoxelsRequest { map, level, region, keep_out, count_only, view } = request;
        let region = region.map(Region::try_from).transpose()?;
        let view = view.map(Frustum::try_from).transpose().in_field("view")?;
        let selection = VoxelSelection { region, view };
        Ok((MapName::new(&map)?, ListingRequest { level, selection, keep_out, count_only }))
    }
}

impl From<(&MapName, ListingRequest)> for pb::ListVoxelsRequest {
    fn from((map, request): (&MapName, ListingRequest)) -> Self {
        let ListingRequest { level, selection: VoxelSelection { region, view }, keep_out, count_only } =
            request;
        let (region, view) = (region.map(Into::into), view.map(Into::into));
        Self { map: map.to_string(), level, region, keep_out, count_only, view }
    }
}

impl TryFrom<pb::View> for Frustum {
    type Error = ServiceError;

    fn try_from(view: pb::View) -> Result<Self, ServiceError> {
        let pb::View { map_from_camera, horizontal_rad, vertical_rad, near_m, far_m } = view;
        let map_from_camera: Pose =
            required(map_from_camera, "map_from_camera")?.try_into().in_field("map_from_camera")?;
        Ok(Self::new(map_from_camera, [horizontal_rad, vertical_rad], [near_m, far_m])?)
    }
}

impl From<Frustum> for pb::View {
    fn from(view: Frustum) -> Self {
        let ([horizontal_rad, vertical_rad], [near_m, far_m]) = (view.angles_rad(), view.distances_m());
        let map_from_camera = Some(view.map_from_camera().into());
        Self { map_from_camera, horizontal_rad, vertical_rad, near_m, far_m }
    }
}

/// Bytes of memory that a listing of so many voxels takes until its last message is sent: its keys, and three messages,
/// one that is made and one that is sent, written with room for twice as much.
pub fn listing_bytes(voxels: usize) -> usize {
    size_of::<VoxelKey>() * (voxels + 3 * voxels.min(KEYS_PER_CHUNK))
}

/// A listing as messages of at most [`KEYS_PER_CHUNK`] keys, each made when it is asked for; one without keys
/// where there is no voxel, so that the state is told.
pub fn voxel_chunks(listing: VoxelListing) -> impl Iterator<Item = pb::ListVoxelsResponse> + Send {
    let VoxelListing { resolution_m, voxels_total, keys, version } = listing;
    let chunks = keys.len().div_ceil(KEYS_PER_CHUNK).max(1);
    (0..chunks).map(move |chunk| {
        let start = chunk * KEYS_PER_CHUNK;
        let end = keys.len().min(start + KEYS_PER_CHUNK);
        pb::ListVoxelsResponse {
            keys: keys[start..end].iter().map(|key| key.to_bits()).collect(),
            version: Some(version.into()),
            resolution_m,
            voxels_total: voxels_total as u64,
        }
    })
}

impl TryFrom<pb::ListVoxelsResponse> for VoxelListing {
    type Error = ServiceError;

    fn try_from(chunk: pb::ListVoxelsResponse) -> Result<Self, ServiceError> {
        Ok(Self {
            resolution_m: chunk.resolution_m,
            voxels_total: count_from(chunk.voxels_total),
            keys: keys_from(&chunk.keys)?,
            version: required(chunk.version, "version")?.try_into()?,
        })
    }
}

/// Voxel keys from their packed form.
pub(super) fn keys_from(bits: &[u64]) -> Result<Vec<VoxelKey>, ServiceError> {
    let key = |(i, &bits): (usize, &u64)| {
        VoxelKey::from_bits(bits).ok_or_else(|| {
            ServiceError::new(Reason::BadKey, format!("keys[{i}] must have bit 63 clear, got {bits:#018x}"))
        })
    };
    bits.iter().enumerate().map(key).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use mrol_map::map::ContentHash;
    use mrol_service::MapVersion;
    use uuid::Uuid;

    #[test]
    fn a_listing_is_cut_into_chunks_that_hold_all_of_it() {
        let version = MapVersion {
            revision: 3,
            map_uuid: Uuid::from_u128(7),
            content_hash: Some(ContentHash::from_bits(u64::MAX)),
        };
        for count in [0, 1, KEYS_PER_CHUNK, KEYS_PER_CHUNK + 1] {
            let keys: Vec<_> = (0..count as u64).map(|bits| VoxelKey::from_bits(bits).unwrap()).collect();
            let listing =
                VoxelListing { resolution_m: 0.1, voxels_total: count, keys: keys.clone(), version };
            let chunks: Vec<_> = voxel_chunks(listing).collect();
            assert!(chunks.iter().all(|chunk| chunk.voxels_total == count as u64));
            assert_eq!(chunks.len(), count.div_ceil(KEYS_PER_CHUNK).max(1));
            let back = chunks.into_iter().flat_map(|chunk| VoxelListing::try_from(chunk).unwrap().keys);
            assert_eq!(back.collect::<Vec<_>>(), keys);
        }
    }

    #[test]
    fn a_request_for_a_listing_survives_the_wire_and_a_view_that_is_none_is_named() {
        let map = MapName::new("a").unwrap();
        let pose = mrol_map::geometry::pose([1.0, 2.0, 3.0], [0.0, 0.6, 0.0, 0.8]).unwrap();
        let view = Frustum::new(pose, [1.5, 1.0], [0.1, 20.0]).unwrap();
        let region = Region::cuboid([0.0; 3], [1.0; 3]).unwrap();
        for (region, view) in [(None, None), (Some(region), None), (Some(region), Some(view))] {
            let selection = VoxelSelection { region, view };
            let request =
                ListingRequest { level: 2, selection, keep_out: view.is_none(), count_only: view.is_some() };
            let message = pb::ListVoxelsRequest::from((&map, request));
            assert_eq!(<(MapName, ListingRequest)>::try_from(message).unwrap(), (map.clone(), request));
        }
        let view = pb::View { far_m: f64::NAN, ..view.into() };
        let request = pb::ListVoxelsRequest { map: "a".into(), view: Some(view), ..Default::default() };
        let error = <(MapName, ListingRequest)>::try_from(request.clone()).unwrap_err();
        assert_eq!(error.reason, Reason::BadView);
        assert!(error.message.starts_with("view: near_m must not be negative"), "{error}");
        let blind = pb::ListVoxelsRequest { view: Some(pb::View::default()), ..request };
        let error = <(MapName, ListingRequest)>::try_from(blind).unwrap_err();
        assert_eq!(error.message, "view: map_from_camera is missing");
    }

    #[test]
    fn a_key_that_is_none_is_named() {
        let error = keys_from(&[0, 1 << 63]).unwrap_err();
        assert!(error.message.starts_with("keys[1] must have bit 63 clear"), "{error}");
    }

    #[test]
    fn a_query_names_the_field_that_is_wrong() {
        let good = pb::QueryPointsRequest {
            map: "a".into(),
            points: Some(pb::Points { xyz: vec![0.0; 3], ..Default::default() }),
            ..Default::default()
        };
        let message = |change: fn(&mut pb::QueryPointsRequest)| {
            let mut request = good.clone();
            change(&mut request);
            <(MapName, PointQuery)>::try_from(request).unwrap_err().message
        };
        assert_eq!(message(|r| r.points = None), "points is missing");
        assert!(message(|r| r.map = "A".into()).starts_with("map must match"));
        assert!(message(|r| r.lookup = 9).contains("got 9"));
        assert!(message(|r| r.map_uuid = "x".into()).starts_with("map_uuid must be a uuid"));
        let rotation = "map_from_points: rotation is missing";
        let half = |r: &mut pb::QueryPointsRequest| {
            r.map_from_points = Some(pb::Pose { translation_m: Some([0.0; 3].into()), rotation: None });
        };
        assert_eq!(message(half), rotation);
    }
}
