//! Questions of planners, answered by the copy.

use super::copy::Copied;
use super::error::ReplicaError;
use super::handle::{Replica, check_level};
use mrol_map::util::StopSignal;
use mrol_service::{
    AtVersion, KnownPart, Limits, MapVersion, Question, QuestionScope, QuestionTarget, Reason, ServiceError,
};

impl Replica {
    /// Answers a question of a planner at one revision; `min_revision` is not waited for. The limits are those of
    /// [`Limits::default`].
    ///
    /// # Errors
    /// `ReplicaStale` of a copy that is older than the options allow; for what makes no question; a level that is none;
    /// another uuid than the map's; a `min_revision` that the copy has not; of a copy of a region, `PointOutOfRange`
    /// where what lies beyond the region could change the answer.
    pub fn ask<Q: Question>(&self, question: &Q) -> Result<AtVersion<Q::Answer>, ReplicaError> {
        self.shared.check_age(self.age_max)?;
        let limits = Limits::default();
        question.check(&limits)?;
        let Copied { map, map_uuid, planner } = self.shared.copied.read().clone();
        let asked @ QuestionScope { level, .. } = *question.asked();
        check_level(level, &map)?;
        check_uuid(&asked, map_uuid)?;
        check_revision(asked.min_revision, map.revision())?;
        let questioned = QuestionTarget::new(&map, &planner, self.field_bytes_max);
        let (answer, version) = question.answer_from(&questioned, &limits, StopSignal::NEVER)?;
        if let Some(region) = self.region {
            question.check_known(&answer, &KnownPart::of(region, map.lattice(), level))?;
        }
        // The hash of a part is not the map's.
        let content_hash = self.region.is_none().then_some(version.hash);
        let version = MapVersion { revision: version.revision, map_uuid, content_hash };
        Ok(AtVersion { answer, version })
    }
}

fn check_uuid(asked: &QuestionScope, map_uuid: uuid::Uuid) -> Result<(), ServiceError> {
    if asked.map_uuid.is_none_or(|uuid| uuid == map_uuid) {
        return Ok(());
    }
    let message = format!("map_uuid is {map_uuid}: the map was deleted and made again");
    Err(ServiceError::new(Reason::MapReplaced, message))
}

fn check_revision(least: Option<u64>, revision: u64) -> Result<(), ServiceError> {
    if least.is_none_or(|least| least <= revision) {
        return Ok(());
    }
    let message = format!("min_revision was not reached: the copy is at {revision}");
    Err(ServiceError::new(Reason::RevisionNotReached, message))
}
