//! `POST /v1/maps/{map}/grid`: the map from above, as a 2-D grid; `/grid/tiles`: a large one in tiles.
//!
//! Tiles are a stream of messages, each the protobuf message `GridTile` that gRPC sends (`planning.proto`) behind its
//! length in four bytes, little-endian. Where they end early the last message says why.

use std::convert::Infallible;

use axum::body::{Body, Bytes};
use axum::extract::State;
use axum::http::header;
use axum::response::{IntoResponse, Response};
use serde::{Deserialize, Serialize};
use tokio_stream::StreamExt;
use utoipa::ToSchema;

use super::answer::{Array, Arrays};
use super::form::QuestionBody;
use super::handler::{AnswerOf, HttpQuestion, question_handler};
use super::scope::question_body;
use crate::http::adapter::Adapter;
use crate::http::error::HttpError;
use crate::http::forms::Map;
use crate::http::forms::Object;
use crate::http::forms::{GridTileBytes, QuestionBytes};
use crate::http::middleware::Service;
use crate::json::{ByKeyword, JsonVersion, Sizes2, Vector2, described};
use mrol_client::wire::{framed, pb};
use mrol_map::planning::BandFrom;
use mrol_service::{GridQuestion, ServiceError};

question_body! {
    /// Which part of the map is seen from above.
    #[schema(example = json!({"min_z_m": 0.2, "max_z_m": 1.5, "tell_unknown": true}))]
    pub(in crate::http) struct GridBody {
        /// The rectangle; that of the map without.
        #[schema(value_type = Option<AreaBody>)]
        area: Option<Object<AreaBody>>,
        /// Lower voxels do not count, meters.
        min_z_m: Option<f64>,
        /// Higher voxels do not count, meters.
        max_z_m: Option<f64>,
        /// Whether these heights count from the floor or from z = 0 of the map; `floor` without.
        #[schema(value_type = described::BandFrom, required = false)]
        #[serde(default)]
        band_from: ByKeyword<BandFrom>,
        /// Side of a cell, meters: a whole number of voxels; one without.
        cell_m: Option<f64>,
        /// Whether free cells are told from unknown ones; false without.
        #[serde(default)]
        tell_unknown: bool,
    }
}

/// A rectangle of the map frame, meters.
#[derive(Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
struct AreaBody {
    /// Smallest x and y.
    #[schema(value_type = Vector2)]
    min_m: [f64; 2],
    /// Largest x and y.
    #[schema(value_type = Vector2)]
    max_m: [f64; 2],
}

/// The map from above.
#[derive(Serialize, ToSchema)]
pub(in crate::http) struct GridHead {
    /// Side of a cell, meters.
    cell_m: f64,
    /// The corner of the first cell.
    #[schema(value_type = Vector2)]
    origin_m: [f64; 2],
    /// Numbers of cells along x and y.
    #[schema(value_type = Sizes2)]
    size: [u64; 2],
    /// How many cells are occupied.
    cells_occupied: u64,
    /// How many cells are free, where that is asked for.
    #[schema(nullable = false)]
    #[serde(skip_serializing_if = "Option::is_none")]
    cells_free: Option<u64>,
    /// The lowest and the highest floor of these cells, meters of the map frame, where heights count from the floor and
    /// it reaches any.
    #[schema(value_type = Option<Vector2>, nullable = false)]
    #[serde(skip_serializing_if = "Option::is_none")]
    floor_m: Option<[f64; 2]>,
}

/// The map from above, row by row from the smallest y.
#[derive(ToSchema)]
#[expect(dead_code, reason = "the answer is put together of its arrays; this describes it")]
struct GridResponse {
    #[serde(flatten)]
    head: GridHead,
    /// Whether each cell is occupied.
    occupied: Vec<bool>,
    /// The height of each cell's highest voxel in the map frame; null of a cell without one.
    tops_m: Vec<Option<f32>>,
    /// Whether each cell is free, where that is asked for.
    #[schema(nullable = false)]
    free: Option<Vec<bool>>,
    #[serde(flatten)]
    version: JsonVersion,
}

question_handler! {
    /// Projects the map from above to a 2-D grid.
    project_grid, "/v1/maps/{map}/grid", GridBody => GridResponse
}

impl HttpQuestion for GridBody {
    type Message = pb::ProjectGridRequest;
    type Question = GridQuestion;
    type Head = GridHead;

    fn into_message(self, scope: pb::Asked, _: &Bytes) -> Result<pb::ProjectGridRequest, ServiceError> {
        let area =
            self.area.map(|Object(AreaBody { min_m: [min_x_m, min_y_m], max_m: [max_x_m, max_y_m] })| {
                pb::GridArea { min_x_m, min_y_m, max_x_m, max_y_m }
            });
        let Self { min_z_m, max_z_m, cell_m, tell_unknown, .. } = self;
        let (asked, band_from) = (Some(scope), pb::BandFrom::from(self.band_from.0).into());
        Ok(pb::ProjectGridRequest { asked, area, min_z_m, max_z_m, cell_m, tell_unknown, band_from })
    }

    fn answered(answer: AnswerOf<Self>) -> (GridHead, Arrays) {
        let response = pb::ProjectGridResponse::from(answer);
        let head = GridHead {
            cell_m: response.cell_m,
            origin_m: [response.origin_x_m, response.origin_y_m],
            size: [response.cells_x, response.cells_y],
            cells_occupied: response.cells_occupied,
            cells_free: response.free.as_ref().map(|_| response.cells_free),
            floor_m: response.floor_min_m.zip(response.floor_max_m).map(|(low, high)| [low, high]),
        };
        let cells = (response.cells_x * response.cells_y) as usize;
        let mut arrays = vec![
            ("occupied", Array::Bits(response.occupied, cells)),
            ("tops_m", Array::Floats(response.tops_m_f32le)),
        ];
        arrays.extend(response.free.map(|free| ("free", Array::Bits(free, cells))));
        (head, arrays)
    }
}

/// Projects the map from above to a 2-D grid that comes in tiles, each at a revision of its own.
///
/// For grids that are too large for one answer, or take longer than one may. Where the tiles end before the last one,
/// which is known by their number, the last message says why.
#[utoipa::path(
    post,
    path = "/v1/maps/{map}/grid/tiles",
    request_body(content((GridBody = "application/json"), (QuestionBytes = "application/octet-stream"))),
    responses((status = 200, description = "Tiles", body = GridTileBytes, content_type = "application/octet-stream"))
)]
pub(in crate::http) async fn stream_grid(
    State(adapter): State<Adapter>,
    Service(service): Service,
    Map(map): Map,
    asking: QuestionBody<GridBody>,
) -> Result<Response, HttpError> {
    let (map, question) = asking.question(&service, map).await?;
    let tiles = service.grid_tiles(&map, question).await?.into_stream(adapter.admission.told_to_drain());
    let tiles = tiles.map(|tile| {
        let failure = |error: ServiceError| pb::GridTile::from(pb::Failure::from(error));
        Ok::<_, Infallible>(framed(&tile.map_or_else(failure, Into::into)))
    });
    let content_type = [(header::CONTENT_TYPE, "application/octet-stream")];
    Ok((content_type, Body::from_stream(tiles)).into_response())
}
