//! Fields that all questions share, and the version that all answers name.

use crate::wire::pb;
use crate::wire::values::{InField, required, uuid_from};
use mrol_map::map::MapName;
use mrol_service::{AtVersion, MapVersion, QuestionScope, ServiceError};

/// A question with the map that it is about.
pub(in crate::wire) type Of<Q> = (MapName, Q);

impl TryFrom<pb::Asked> for Of<QuestionScope> {
    type Error = ServiceError;

    fn try_from(asked: pb::Asked) -> Result<Self, ServiceError> {
        let pb::Asked { map, level, min_revision, map_uuid, ignore_keep_outs } = asked;
        let map_uuid = (!map_uuid.is_empty()).then(|| uuid_from(&map_uuid)).transpose()?;
        Ok((MapName::new(&map)?, QuestionScope { level, min_revision, map_uuid, ignore_keep_outs }))
    }
}

impl From<(&MapName, QuestionScope)> for pb::Asked {
    fn from((map, asked): (&MapName, QuestionScope)) -> Self {
        let QuestionScope { level, min_revision, map_uuid, ignore_keep_outs } = asked;
        let map_uuid = map_uuid.map(|uuid| uuid.to_string()).unwrap_or_default();
        Self { map: map.to_string(), level, min_revision, map_uuid, ignore_keep_outs }
    }
}

/// What a question has in common with others.
pub(super) fn asked_of(asked: Option<pb::Asked>) -> Result<Of<QuestionScope>, ServiceError> {
    required(asked, "asked")?.try_into()
}

/// An answer with its version, which the message must name.
pub(super) fn answered<A>(answer: A, version: Option<pb::MapVersion>) -> Result<AtVersion<A>, ServiceError> {
    let version: MapVersion = required(version, "version")?.try_into().in_field("version")?;
    Ok(AtVersion { answer, version })
}
