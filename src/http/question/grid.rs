//! `POST /v1/maps/{map}/grid`: the map from above, as a 2-D grid.

use axum::body::Bytes;
use axum::response::Response;
use serde::{Deserialize, Serialize};

use super::answer::{Answer, Array};
use super::asked;
use super::form::QuestionBody;
use crate::http::error::HttpError;
use crate::http::middleware::Service;
use crate::http::object::Object;
use crate::http::params::Map;
use crate::service::GridQuestion;
use crate::wire::pb;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(in crate::http) struct GridBody {
    area: Option<Object<AreaBody>>,
    min_z_m: Option<f64>,
    max_z_m: Option<f64>,
    cell_m: Option<f64>,
    #[serde(default)]
    tell_unknown: bool,
    #[serde(default)]
    level: u32,
    min_revision: Option<u64>,
    map_uuid: Option<String>,
    #[serde(default)]
    ignore_keep_outs: bool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct AreaBody {
    min_m: [f64; 2],
    max_m: [f64; 2],
}

#[derive(Serialize)]
struct GridHead {
    cell_m: f64,
    origin_m: [f64; 2],
    size: [u64; 2],
    cells_occupied: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    cells_free: Option<u64>,
}

pub(in crate::http) async fn project_grid(
    Service(service): Service,
    Map(map): Map,
    asking: QuestionBody<GridBody>,
) -> Result<Response, HttpError> {
    let form = asking.form;
    let message = move |of: GridBody, _: &Bytes| {
        let area =
            of.area.map(|Object(AreaBody { min_m: [min_x_m, min_y_m], max_m: [max_x_m, max_y_m] })| {
                pb::GridArea { min_x_m, min_y_m, max_x_m, max_y_m }
            });
        let asked = asked(&map, (of.level, of.ignore_keep_outs), of.min_revision, of.map_uuid);
        let GridBody { min_z_m, max_z_m, cell_m, tell_unknown, .. } = of;
        Ok(pb::ProjectGridRequest { asked, area, min_z_m, max_z_m, cell_m, tell_unknown })
    };
    let (map, question): (_, GridQuestion) = asking.question(&service, message).await?;
    let answered = service.ask(&map, question).await?;
    let version = answered.version;
    let response = pb::ProjectGridResponse::from(answered);
    let head = GridHead {
        cell_m: response.cell_m,
        origin_m: [response.origin_x_m, response.origin_y_m],
        size: [response.cells_x, response.cells_y],
        cells_occupied: response.cells_occupied,
        cells_free: response.free.as_ref().map(|_| response.cells_free),
    };
    let cells = (response.cells_x * response.cells_y) as usize;
    let mut arrays = vec![
        ("occupied", Array::Bits(response.occupied, cells)),
        ("tops_m", Array::Floats(response.tops_m_f32le)),
    ];
    arrays.extend(response.free.map(|free| ("free", Array::Bits(free, cells))));
    Answer { head, version, arrays }.respond(form).await
}
