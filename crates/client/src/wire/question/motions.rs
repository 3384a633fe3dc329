//! Bodies along motions.

use std::sync::Arc;

use super::body::{configurations_from, counts_from, ignored_of, surroundings_from};
use super::scope::{Of, answered, asked_of};
use crate::wire::pb;
use crate::wire::values::{bitmap_of, bytes_of, count_from, numbers_of, required};
use mrol_map::map::MapName;
use mrol_map::planning::MotionAnswer;
use mrol_service::{AtVersion, MotionCheck, ServiceError};

impl TryFrom<pb::CheckMotionsRequest> for Of<MotionCheck> {
    type Error = ServiceError;

    fn try_from(request: pb::CheckMotionsRequest) -> Result<Self, ServiceError> {
        let (map, asked) = asked_of(request.asked)?;
        let check = MotionCheck {
            asked,
            body: Arc::new(required(request.body, "body")?.try_into()?),
            configurations: configurations_from(&request.configurations_f32le)?,
            lengths: counts_from(&request.lengths_u32le, "lengths_u32le")?,
            step_m: request.step_m,
            clearance_max_m: request.clearance_max_m,
            surroundings: surroundings_from(request.ignored, request.unknown)?,
        };
        Ok((map, check))
    }
}

impl From<(&MapName, MotionCheck)> for pb::CheckMotionsRequest {
    fn from((map, check): (&MapName, MotionCheck)) -> Self {
        let MotionCheck { asked, body, configurations, lengths, step_m, clearance_max_m, surroundings } =
            check;
        Self {
            asked: Some((map, asked).into()),
            body: Some((&*body).into()),
            configurations_f32le: bytes_of(configurations),
            lengths_u32le: bytes_of(lengths),
            step_m,
            clearance_max_m,
            unknown: pb::Unknown::from(surroundings.unknown).into(),
            ignored: ignored_of(surroundings),
        }
    }
}

impl From<AtVersion<Vec<MotionAnswer>>> for pb::CheckMotionsResponse {
    fn from(AtVersion { answer, version }: AtVersion<Vec<MotionAnswer>>) -> Self {
        let mut words = vec![0u64; answer.len().div_ceil(64)];
        for (i, motion) in answer.iter().enumerate() {
            words[i / 64] |= u64::from(motion.is_free()) << (i % 64);
        }
        let clearances = answer.iter().filter_map(|motion| motion.clearance_m);
        Self {
            motions: answer.len() as u64,
            free: bitmap_of(words, answer.len()),
            free_count: answer.iter().filter(|motion| motion.is_free()).count() as u64,
            first_hits_f32le: bytes_of(answer.iter().map(|motion| motion.first_hit.unwrap_or(f32::NAN))),
            clearances_m_f32le: bytes_of(clearances.collect::<Vec<_>>()),
            version: Some(version.into()),
        }
    }
}

impl TryFrom<pb::CheckMotionsResponse> for AtVersion<Vec<MotionAnswer>> {
    type Error = ServiceError;

    fn try_from(response: pb::CheckMotionsResponse) -> Result<Self, ServiceError> {
        let motions = count_from(response.motions);
        let shares: Vec<f32> = numbers_of(&response.first_hits_f32le, motions, "first_hits_f32le")?;
        let has_clearances = !response.clearances_m_f32le.is_empty();
        let told = if has_clearances { motions } else { 0 };
        let clearances: Vec<f32> = numbers_of(&response.clearances_m_f32le, told, "clearances_m_f32le")?;
        let motion = |(i, share): (usize, f32)| MotionAnswer {
            first_hit: (!share.is_nan()).then_some(share),
            clearance_m: clearances.get(i).copied(),
        };
        answered(shares.into_iter().enumerate().map(motion).collect(), response.version)
    }
}
