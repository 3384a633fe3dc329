//! Rays.

use super::body::unknown_from;
use super::keep_outs::{keep_outs_from, keep_outs_of};
use super::scope::{Of, answered, asked_of};
use crate::wire::pb;
use crate::wire::values::{
    InField, bitmap_of, bytes_of, count_from, numbers_of, required, voxels_of, words_of,
};
use mrol_map::map::MapName;
use mrol_map::planning::RayHits;
use mrol_service::{AtVersion, PointCloud, RayQuestion, RaysToward, Reason, ServiceError};

impl TryFrom<pb::CastRaysRequest> for Of<RayQuestion> {
    type Error = ServiceError;

    fn try_from(request: pb::CastRaysRequest) -> Result<Self, ServiceError> {
        let (map, asked) = asked_of(request.asked)?;
        let origins = required(request.origins, "origins")?.try_into().in_field("origins")?;
        let toward = match (request.directions, request.ends, request.range_m) {
            (Some(directions), None, range_m) => RaysToward::Directions {
                directions: directions.try_into().in_field("directions")?,
                range_m: range_m.unwrap_or(f64::INFINITY),
            },
            (None, Some(ends), None) => RaysToward::Ends(ends.try_into().in_field("ends")?),
            _ => {
                let message = "rays take directions, with range_m or without, or ends alone";
                return Err(ServiceError::new(Reason::BadRay, message));
            }
        };
        let unknown = unknown_from(request.unknown, Reason::BadRay)?;
        Ok((map, RayQuestion { asked, origins, toward, unknown }))
    }
}

impl From<(&MapName, RayQuestion)> for pb::CastRaysRequest {
    fn from((map, rays): (&MapName, RayQuestion)) -> Self {
        let RayQuestion { asked, origins, toward, unknown } = rays;
        let points = |points: PointCloud| Some(points.into());
        let (directions, ends, range_m) = match toward {
            RaysToward::Directions { directions, range_m } => (points(directions), None, Some(range_m)),
            RaysToward::Ends(ends) => (None, points(ends), None),
        };
        let (asked, unknown) = (Some((map, asked).into()), pb::Unknown::from(unknown).into());
        Self { asked, origins: points(origins), directions, ends, range_m, unknown }
    }
}

impl From<AtVersion<RayHits>> for pb::CastRaysResponse {
    fn from(AtVersion { answer, version }: AtVersion<RayHits>) -> Self {
        let (rays, hits) = (answer.len(), answer.hits());
        let RayHits { hit, distances_m, voxels, keep_outs } = answer;
        Self {
            hit: bitmap_of(hit, rays),
            rays: rays as u64,
            hits: hits as u64,
            distances_m_f32le: bytes_of(distances_m),
            voxels_u64le: bytes_of(voxels.into_iter().map(|voxel| voxel.to_bits())),
            version: Some(version.into()),
            keep_outs: keep_outs_of(keep_outs.iter().map(Option::as_ref)),
        }
    }
}

impl TryFrom<pb::CastRaysResponse> for AtVersion<RayHits> {
    type Error = ServiceError;

    fn try_from(response: pb::CastRaysResponse) -> Result<Self, ServiceError> {
        let rays = count_from(response.rays);
        let hits = RayHits {
            hit: words_of(&response.hit, rays, "hit")?,
            distances_m: numbers_of(&response.distances_m_f32le, rays, "distances_m_f32le")?,
            voxels: voxels_of(&response.voxels_u64le, rays, "voxels_u64le")?,
            keep_outs: keep_outs_from(response.keep_outs, rays, "keep_outs")?,
        };
        answered(hits, response.version)
    }
}
