//! Frontiers.

use super::scope::{Of, answered, asked_of};
use crate::wire::pb;
use crate::wire::values::{InField, count_from, required};
use mrol_map::map::MapName;
use mrol_map::planning::{Frontier, FrontierView, Frontiers};
use mrol_service::{AtVersion, FrontierQuestion, ServiceError};

impl TryFrom<pb::ListFrontiersRequest> for Of<FrontierQuestion> {
    type Error = ServiceError;

    fn try_from(request: pb::ListFrontiersRequest) -> Result<Self, ServiceError> {
        let (map, asked) = asked_of(request.asked)?;
        let (min_m, max_m) = corners_of(request.r#box, "box")?;
        let pb::ListFrontiersRequest { size_min, frontiers_max, standoff_m, .. } = request;
        let frontiers_max = frontiers_max.map(|most| most as usize);
        Ok((map, FrontierQuestion { asked, min_m, max_m, size_min, frontiers_max, standoff_m }))
    }
}

impl From<(&MapName, FrontierQuestion)> for pb::ListFrontiersRequest {
    fn from((map, question): (&MapName, FrontierQuestion)) -> Self {
        let FrontierQuestion { asked, min_m, max_m, size_min, frontiers_max, standoff_m } = question;
        let frontiers_max = frontiers_max.map(|most| u32::try_from(most).unwrap_or(u32::MAX));
        let asked = Some((map, asked).into());
        Self { asked, r#box: box_of(min_m, max_m), size_min, frontiers_max, standoff_m }
    }
}

impl From<AtVersion<Frontiers>> for pb::ListFrontiersResponse {
    fn from(AtVersion { answer, version }: AtVersion<Frontiers>) -> Self {
        let Frontiers { frontiers, frontiers_total, voxels_total } = answer;
        let frontiers = frontiers.into_iter().map(Into::into).collect();
        Self { frontiers, frontiers_total, voxels_total, version: Some(version.into()) }
    }
}

impl TryFrom<pb::ListFrontiersResponse> for AtVersion<Frontiers> {
    type Error = ServiceError;

    fn try_from(response: pb::ListFrontiersResponse) -> Result<Self, ServiceError> {
        let pb::ListFrontiersResponse { frontiers, frontiers_total, voxels_total, version } = response;
        let frontiers = frontiers.into_iter().map(TryInto::try_into).collect::<Result<_, _>>()?;
        answered(Frontiers { frontiers, frontiers_total, voxels_total }, version)
    }
}

impl From<Frontier> for pb::Frontier {
    fn from(Frontier { voxels, center_m, min_m, max_m, view }: Frontier) -> Self {
        let center_m = Some(center_m.into());
        Self { voxels, center_m, bounds: box_of(min_m, max_m), view: view.map(Into::into) }
    }
}

impl TryFrom<pb::Frontier> for Frontier {
    type Error = ServiceError;

    fn try_from(frontier: pb::Frontier) -> Result<Self, ServiceError> {
        let (min_m, max_m) = corners_of(frontier.bounds, "bounds")?;
        Ok(Self {
            voxels: count_from(frontier.voxels) as u64,
            center_m: required(frontier.center_m, "center_m")?.into(),
            min_m,
            max_m,
            view: frontier.view.map(TryInto::try_into).transpose()?,
        })
    }
}

impl From<FrontierView> for pb::FrontierView {
    fn from(FrontierView { map_from_view, target_m, yaw_rad, elevation_rad }: FrontierView) -> Self {
        let (map_from_view, target_m) = (Some((&map_from_view).into()), Some(target_m.into()));
        Self { map_from_view, target_m, yaw_rad, elevation_rad }
    }
}

impl TryFrom<pb::FrontierView> for FrontierView {
    type Error = ServiceError;

    fn try_from(view: pb::FrontierView) -> Result<Self, ServiceError> {
        let pb::FrontierView { map_from_view, target_m, yaw_rad, elevation_rad } = view;
        let map_from_view = required(map_from_view, "map_from_view")?.try_into().in_field("map_from_view")?;
        Ok(Self { map_from_view, target_m: required(target_m, "target_m")?.into(), yaw_rad, elevation_rad })
    }
}

fn box_of(min_m: [f64; 3], max_m: [f64; 3]) -> Option<pb::Box> {
    Some(pb::Box { min_m: Some(min_m.into()), max_m: Some(max_m.into()) })
}

fn corners_of(of: Option<pb::Box>, field: &str) -> Result<([f64; 3], [f64; 3]), ServiceError> {
    let pb::Box { min_m, max_m } = required(of, field)?;
    let corner = |corner: Option<pb::Vector3>, name: &str| required(corner, name).in_field(field);
    Ok((corner(min_m, "min_m")?.into(), corner(max_m, "max_m")?.into()))
}
