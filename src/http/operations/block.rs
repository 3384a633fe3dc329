//! `GET /v1/maps/{map}/block?level=&form=sparse|dense&min=x,y,z&max=x,y,z&cap_m=`: a part of a level, as masks of
//! blocks of voxels or as the distance of each cell. JSON, or with `accept: application/octet-stream` bytes and
//! headers.

use std::fmt::Write;

use axum::body::Bytes;
use axum::extract::State;
use axum::http::{HeaderMap, HeaderName, HeaderValue, header};
use axum::response::{IntoResponse, Response};
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

use crate::http::adapter::Adapter;
use crate::http::error::HttpError;
use crate::http::forms::BlockBytes;
use crate::http::forms::{Map, Numbers3, Numbers7, Params, RegionParams};
use crate::http::headers;
use crate::http::middleware::Service;
use crate::http::pieces;
use crate::http::pieces::Pieces;
use crate::json::{ByKeyword, JsonVersion, VoxelIndex, described_by_words};
use mrol_client::wire::required;
use mrol_map::map::DistanceBlock;
use mrol_map::util::Keyword;
use mrol_map::voxel::{BlockMask, VoxelKey};
use mrol_service::{BlockAnswer, BlockForm, BlockRequest, BlockVoxels, MapService, Reason, ServiceError};

/// Which part of the map, in which form.
#[derive(Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct BlockParams {
    /// The level, 0 the finest; 0 without.
    #[serde(default)]
    level: u32,
    /// Occupied voxels by block, or how far each cell is from the nearest of them; `sparse` without.
    #[param(value_type = Form, inline, required = false)]
    #[serde(default)]
    form: ByKeyword<Form>,
    /// Smallest coordinates `x,y,z` of a box along the map's axes, meters; together with `max`.
    #[param(value_type = Option<Numbers3>, inline)]
    min: Option<String>,
    /// Largest coordinates `x,y,z`.
    #[param(value_type = Option<Numbers3>, inline)]
    max: Option<String>,
    /// Center and orientation `x,y,z,qx,qy,qz,qw` of a box with any orientation; together with `size`, in the
    /// place of `min` and `max`.
    #[param(value_type = Option<Numbers7>, inline)]
    map_from_box: Option<String>,
    /// Its sides `x,y,z`, meters.
    #[param(value_type = Option<Numbers3>, inline)]
    size: Option<String>,
    /// Of a dense block: the least distance that is not told apart from larger ones, meters.
    cap_m: Option<f64>,
}

/// The word for the form of a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum Form {
    #[default]
    Sparse,
    Dense,
}

impl Keyword for Form {
    const ALL: &'static [Self] = &[Self::Sparse, Self::Dense];

    fn as_str(self) -> &'static str {
        match self {
            Self::Sparse => "sparse",
            Self::Dense => "dense",
        }
    }
}

described_by_words!(Form);

/// What stands before the voxels of a block.
#[derive(Serialize, ToSchema)]
struct BlockHead {
    /// The level.
    level: u32,
    /// Side of a voxel of the level, meters.
    resolution_m: f64,
    #[serde(flatten)]
    version: JsonVersion,
    #[serde(flatten)]
    cells: Option<BlockCells>,
}

/// Which cells a dense block has.
#[derive(Serialize, ToSchema)]
struct BlockCells {
    /// Indices of the first cell.
    #[schema(value_type = VoxelIndex)]
    origin: [i32; 3],
    /// Numbers of cells along x, y and z.
    #[schema(value_type = VoxelIndex)]
    size: [usize; 3],
    /// The distance that stands for all that are as large or larger.
    cap: u8,
}

/// A part of a level.
#[derive(ToSchema)]
#[expect(dead_code, reason = "the answer is written in pieces; this describes it")]
struct BlockResponse {
    #[serde(flatten)]
    head: BlockHead,
    /// Of a sparse block: blocks of 8 x 8 x 8 voxels, without empty ones.
    #[schema(nullable = false)]
    blocks: Option<Vec<SparseBlock>>,
    /// Of a dense block: how far each cell's center is from the nearest occupied cube, in quarters of a cell;
    /// x fastest, then y.
    #[schema(nullable = false)]
    distances: Option<Vec<u8>>,
}

/// A block of 8 x 8 x 8 voxels.
#[derive(ToSchema)]
#[expect(dead_code, reason = "the answer is written in pieces; this describes it")]
struct SparseBlock {
    /// Its indices, in units of blocks.
    #[schema(value_type = VoxelIndex)]
    block: [i32; 3],
    /// A bit a voxel, in Morton order: 64 bytes, two hexadecimal digits each.
    #[schema(pattern = "^[0-9a-f]{128}$")]
    mask: String,
}

/// Gives out a part of a level as it is stored.
///
/// Bytes where the request has `accept: application/octet-stream`. At most `limits.block_bytes_max`.
#[utoipa::path(
    get,
    path = "/v1/maps/{map}/block",
    params(BlockParams),
    responses((
        status = 200,
        description = "Answered",
        content((BlockResponse = "application/json"), (BlockBytes = "application/octet-stream")),
        headers(
            ("mrol-level" = u32, description = "With bytes: the level."),
            ("mrol-resolution-m" = f64, description = "With bytes: side of a voxel, meters."),
            ("mrol-origin" = String, description = "With bytes: `i,j,k` of the first cell of a dense block."),
            ("mrol-size" = String, description = "With bytes: numbers of its cells along each axis."),
            ("mrol-cap" = u8, description = "With bytes: the distance that stands for all that are as large or larger."),
            ("mrol-revision" = u64, description = "With bytes: the revision."),
            ("mrol-map-uuid" = String, description = "With bytes: the uuid of the map."),
            ("mrol-content-hash" = String, description = "With bytes: the hash of the finest voxels.")
        )
    ))
)]
pub(crate) async fn get(
    State(adapter): State<Adapter>,
    Service(service): Service,
    Map(map): Map,
    Params(params): Params<BlockParams>,
    headers: HeaderMap,
) -> Result<Response, HttpError> {
    let answer = service.get_block(&map, params.try_into()?).await?;
    match wants_bytes(&headers) {
        true => Ok(as_bytes(answer)),
        false => as_json(answer, &adapter, &service).await,
    }
}

/// True where the client takes bytes.
fn wants_bytes(headers: &HeaderMap) -> bool {
    let accepted = headers.get_all(header::ACCEPT).iter().filter_map(|value| value.to_str().ok());
    let mut kinds = accepted.flat_map(|value| value.split(','));
    kinds.any(|kind| kind.split(';').next().is_some_and(|kind| kind.trim() == "application/octet-stream"))
}

impl TryFrom<BlockParams> for BlockRequest {
    type Error = ServiceError;

    fn try_from(params: BlockParams) -> Result<Self, ServiceError> {
        let BlockParams { level, form: ByKeyword(form), min, max, map_from_box, size, cap_m } = params;
        let region = RegionParams { min, max, map_from_box, size }.region()?;
        let form = match (form, cap_m) {
            (Form::Sparse, None) => BlockForm::Sparse { region },
            (Form::Sparse, Some(_)) => {
                let message = "cap_m is for form=dense: a sparse block has no distances";
                return Err(ServiceError::new(Reason::UnexpectedField, message));
            }
            (Form::Dense, cap_m) => BlockForm::Dense {
                region: required(region, "the box of a dense block, min and max,")?,
                cap_m,
            },
        };
        Ok(Self { level, form })
    }
}

/// Items that are written to JSON at once, and the bytes of one at most: half a MiB.
const BLOCKS: Pieces = Pieces { field: "blocks", items: 2_048, item_bytes: 256 };
const DISTANCES: Pieces = Pieces { field: "distances", items: 128 << 10, item_bytes: 4 };

async fn as_json(
    answer: BlockAnswer,
    adapter: &Adapter,
    service: &MapService,
) -> Result<Response, HttpError> {
    let BlockAnswer { level, resolution_m, voxels, version } = answer;
    let mut head = BlockHead { level, resolution_m, version: version.into(), cells: None };
    match voxels {
        BlockVoxels::Sparse(blocks) => {
            let count = blocks.len();
            let copied_bytes = count * size_of::<(VoxelKey, BlockMask)>();
            let kept = adapter.admission.keep(copied_bytes + BLOCKS.bytes(count))?;
            let copy = move || blocks.blocks().collect::<Result<Vec<_>, _>>();
            let blocks = service.convert(copy).await??;
            let write = move |text: &mut String, item: usize| write_block(text, &blocks[item]);
            Ok(pieces::response(service, BLOCKS.of(&head, count, write)?, kept))
        }
        BlockVoxels::Dense(DistanceBlock { origin, size, cap, distances }) => {
            head.cells = Some(BlockCells { origin, size, cap: cap.get() });
            let count = distances.len();
            let kept = adapter.admission.keep(count + DISTANCES.bytes(count))?;
            let write = move |text: &mut String, item: usize| text.push_str(&distances[item].to_string());
            Ok(pieces::response(service, DISTANCES.of(&head, count, write)?, kept))
        }
    }
}

/// Appends `{"block":[i,j,k],"mask":"..."}`: the mask's bytes as they are in the form of bytes, two hexadecimal digits
/// each.
fn write_block(text: &mut String, (block, mask): &(VoxelKey, BlockMask)) {
    let [x, y, z] = block.index();
    // Writing to a String cannot fail.
    let _ = write!(text, "{{\"block\":[{x},{y},{z}],\"mask\":\"");
    for byte in mask.to_le_bytes() {
        let _ = write!(text, "{byte:02x}");
    }
    text.push_str("\"}");
}

fn as_bytes(answer: BlockAnswer) -> Response {
    let mut all = headers::of_version(&answer.version);
    all.insert(header::CONTENT_TYPE, HeaderValue::from_static("application/octet-stream"));
    let mut say = |name, text: String| {
        if let Ok(text) = HeaderValue::try_from(text) {
            all.insert(HeaderName::from_static(name), text);
        }
    };
    say("mrol-level", answer.level.to_string());
    say("mrol-resolution-m", answer.resolution_m.to_string());
    let bytes: Bytes = match answer.voxels {
        BlockVoxels::Sparse(blocks) => blocks.into_bytes(),
        BlockVoxels::Dense(DistanceBlock { origin: [x, y, z], size: [xs, ys, zs], cap, distances }) => {
            say("mrol-origin", format!("{x},{y},{z}"));
            say("mrol-size", format!("{xs},{ys},{zs}"));
            say("mrol-cap", cap.to_string());
            distances.into()
        }
    };
    (all, bytes).into_response()
}

#[cfg(test)]
mod tests {
    use super::*;
    use mrol_map::voxel::Cell;

    #[test]
    fn a_block_is_written_as_its_indices_and_its_bytes() {
        let mut mask = BlockMask::EMPTY;
        // The ninth cell, in Morton order: the lowest bit of the second byte.
        mask.insert(Cell::of([2, 0, 0]).1);
        let mut text = String::new();
        write_block(&mut text, &(VoxelKey::new([-1, 0, 7]).unwrap(), mask));
        assert_eq!(text, format!("{{\"block\":[-1,0,7],\"mask\":\"0001{}\"}}", "0".repeat(124)));
        assert!(text.len() <= BLOCKS.item_bytes);
    }

    #[test]
    fn who_takes_bytes_says_so() {
        let asks = |value: &'static str| {
            wants_bytes(&HeaderMap::from_iter([(header::ACCEPT, HeaderValue::from_static(value))]))
        };
        assert!(asks("application/octet-stream") && asks("text/html, application/octet-stream;q=0.9"));
        assert!(!asks("*/*") && !asks("application/json") && !wants_bytes(&HeaderMap::new()));
    }
}
