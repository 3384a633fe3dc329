//! `POST /v1/maps/{map}/{question}`: what planners ask.

mod answer;
mod body;
mod classify;
mod form;
mod frontiers;
mod grid;
mod motions;
mod nearest;
mod poses;
mod rays;
mod spheres;

pub(super) use classify::classify_points;
pub(super) use frontiers::list_frontiers;
pub(super) use grid::project_grid;
pub(super) use motions::check_motions;
pub(super) use nearest::find_nearest;
pub(super) use poses::check_poses;
pub(super) use rays::cast_rays;
pub(super) use spheres::check_spheres;

use crate::map::MapName;
use crate::wire::pb;

/// What questions have in common, as a message has it.
fn asked(
    map: &MapName,
    (level, ignore_keep_outs): (u32, bool),
    min_revision: Option<u64>,
    map_uuid: Option<String>,
) -> Option<pb::Asked> {
    let (map, map_uuid) = (map.to_string(), map_uuid.unwrap_or_default());
    Some(pb::Asked { map, level, min_revision, map_uuid, ignore_keep_outs })
}
