//! Points as what is known of them.

use super::scope::{Of, answered, asked_of};
use crate::wire::pb;
use crate::wire::values::{InField, bitmap_of, count_from, required, words_of};
use mrol_map::map::MapName;
use mrol_map::planning::PointStates;
use mrol_service::{AtVersion, ClassifyQuestion, ServiceError};

impl TryFrom<pb::ClassifyPointsRequest> for Of<ClassifyQuestion> {
    type Error = ServiceError;

    fn try_from(request: pb::ClassifyPointsRequest) -> Result<Self, ServiceError> {
        let (map, asked) = asked_of(request.asked)?;
        let points = required(request.points, "points")?.try_into().in_field("points")?;
        Ok((map, ClassifyQuestion { asked, points }))
    }
}

impl From<(&MapName, ClassifyQuestion)> for pb::ClassifyPointsRequest {
    fn from((map, ClassifyQuestion { asked, points }): (&MapName, ClassifyQuestion)) -> Self {
        Self { asked: Some((map, asked).into()), points: Some(points.into()) }
    }
}

impl From<AtVersion<PointStates>> for pb::ClassifyPointsResponse {
    fn from(AtVersion { answer, version }: AtVersion<PointStates>) -> Self {
        let (points_occupied, points_free) = (answer.points_occupied() as u64, answer.points_free() as u64);
        let PointStates { points, occupied, free } = answer;
        Self {
            occupied: bitmap_of(occupied, points),
            free: bitmap_of(free, points),
            points: points as u64,
            points_occupied,
            points_free,
            version: Some(version.into()),
        }
    }
}

impl TryFrom<pb::ClassifyPointsResponse> for AtVersion<PointStates> {
    type Error = ServiceError;

    fn try_from(response: pb::ClassifyPointsResponse) -> Result<Self, ServiceError> {
        let points = count_from(response.points);
        let states = PointStates {
            points,
            occupied: words_of(&response.occupied, points, "occupied")?,
            free: words_of(&response.free, points, "free")?,
        };
        answered(states, response.version)
    }
}
