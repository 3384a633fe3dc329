//! The nearest voxel of points.

use super::keep_outs::{keep_outs_from, keep_outs_of};
use super::scope::{Of, answered, asked_of};
use crate::wire::pb;
use crate::wire::values::{
    InField, bitmap_of, bytes_of, count_from, numbers_of, required, voxels_of, words_of,
};
use mrol_map::map::MapName;
use mrol_map::planning::{MeasuredTo, NearestVoxels};
use mrol_service::{AtVersion, NearestQuestion, Reason, ServiceError};

impl TryFrom<pb::FindNearestRequest> for Of<NearestQuestion> {
    type Error = ServiceError;

    fn try_from(request: pb::FindNearestRequest) -> Result<Self, ServiceError> {
        let (map, asked) = asked_of(request.asked)?;
        let points = required(request.points, "points")?.try_into().in_field("points")?;
        let to = match pb::MeasuredTo::try_from(request.to) {
            Ok(pb::MeasuredTo::Unspecified | pb::MeasuredTo::Cubes) => MeasuredTo::Cubes,
            Ok(pb::MeasuredTo::Centers) => MeasuredTo::Centers,
            Err(_) => {
                let message = format!("to must be 0, 1 (cubes) or 2 (centers), got {}", request.to);
                return Err(ServiceError::new(Reason::BadRadius, message));
            }
        };
        Ok((map, NearestQuestion { asked, points, radius_m: request.radius_m, to }))
    }
}

impl From<(&MapName, NearestQuestion)> for pb::FindNearestRequest {
    fn from((map, question): (&MapName, NearestQuestion)) -> Self {
        let NearestQuestion { asked, points, radius_m, to } = question;
        let to = pb::MeasuredTo::from(to);
        Self { asked: Some((map, asked).into()), points: Some(points.into()), radius_m, to: to.into() }
    }
}

impl From<MeasuredTo> for pb::MeasuredTo {
    fn from(to: MeasuredTo) -> Self {
        match to {
            MeasuredTo::Cubes => Self::Cubes,
            MeasuredTo::Centers => Self::Centers,
        }
    }
}

impl From<AtVersion<NearestVoxels>> for pb::FindNearestResponse {
    fn from(AtVersion { answer, version }: AtVersion<NearestVoxels>) -> Self {
        let points = answer.len();
        let NearestVoxels { found, distances_m, voxels, away, keep_outs } = answer;
        Self {
            found: bitmap_of(found, points),
            points: points as u64,
            distances_m_f32le: bytes_of(distances_m),
            voxels_u64le: bytes_of(voxels.into_iter().map(|voxel| voxel.to_bits())),
            away_f32le: bytes_of(away.into_iter().flatten()),
            version: Some(version.into()),
            keep_outs: keep_outs_of(keep_outs.iter().map(Option::as_ref)),
        }
    }
}

impl TryFrom<pb::FindNearestResponse> for AtVersion<NearestVoxels> {
    type Error = ServiceError;

    fn try_from(response: pb::FindNearestResponse) -> Result<Self, ServiceError> {
        let points = count_from(response.points);
        let away: Vec<f32> = numbers_of(&response.away_f32le, points.saturating_mul(3), "away_f32le")?;
        let nearest = NearestVoxels {
            found: words_of(&response.found, points, "found")?,
            distances_m: numbers_of(&response.distances_m_f32le, points, "distances_m_f32le")?,
            voxels: voxels_of(&response.voxels_u64le, points, "voxels_u64le")?,
            away: away.as_chunks::<3>().0.to_vec(),
            keep_outs: keep_outs_from(response.keep_outs, points, "keep_outs")?,
        };
        answered(nearest, response.version)
    }
}
