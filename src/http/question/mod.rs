//! `POST /v1/maps/{map}/{question}`: what planners ask.

mod answer;
mod body;
mod form;
mod grid;
mod motions;
mod nearest;
mod poses;
mod rays;
mod spheres;

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
    level: u32,
    min_revision: Option<u64>,
    map_uuid: Option<String>,
) -> Option<pb::Asked> {
    Some(pb::Asked { map: map.to_string(), level, min_revision, map_uuid: map_uuid.unwrap_or_default() })
}
