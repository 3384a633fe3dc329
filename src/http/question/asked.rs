//! The fields that all questions share.

use mrol_client::wire::pb;
use mrol_map::map::MapName;

/// What questions have in common, as a message has it.
pub(super) fn asked(
    map: &MapName,
    (level, ignore_keep_outs): (u32, bool),
    min_revision: Option<u64>,
    map_uuid: Option<String>,
) -> Option<pb::Asked> {
    let (map, map_uuid) = (map.to_string(), map_uuid.unwrap_or_default());
    Some(pb::Asked { map, level, min_revision, map_uuid, ignore_keep_outs })
}
