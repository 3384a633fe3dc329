//! `GET /v1/maps/{map}/block?level=&form=sparse|dense&min=x,y,z&max=x,y,z&cap_m=`: a part of a level, as masks of blocks of
//! voxels or as the distance of each cell. JSON, or with `accept: application/octet-stream` bytes and headers.

use std::fmt::Write;

use axum::body::Bytes;
use axum::extract::State;
use axum::http::{HeaderMap, HeaderName, HeaderValue, header};
use axum::response::{IntoResponse, Response};
use serde::{Deserialize, Serialize};

use super::Adapter;
use super::error::HttpError;
use super::headers;
use super::middleware::Service;
use super::params::{Map, Params, RegionParams};
use super::pieces::{self, Pieces};
use crate::map::DistanceBlock;
use crate::service::{BlockAnswer, BlockForm, BlockRequest, BlockVoxels, Reason, ServiceError};
use crate::util::Keyword;
use crate::voxel::{BlockMask, VoxelKey};
use crate::wire::json::{ByKeyword, JsonVersion};
use crate::wire::required;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct BlockParams {
    #[serde(default)]
    level: u32,
    #[serde(default)]
    form: ByKeyword<Form>,
    min: Option<String>,
    max: Option<String>,
    map_from_box: Option<String>,
    size: Option<String>,
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

/// What stands before the voxels.
#[derive(Serialize)]
struct Head {
    level: u32,
    resolution_m: f64,
    #[serde(flatten)]
    version: JsonVersion,
    #[serde(flatten)]
    cells: Option<Cells>,
}

/// Which cells a dense block has.
#[derive(Serialize)]
struct Cells {
    origin: [i32; 3],
    size: [usize; 3],
    cap: u8,
}

pub(super) async fn get(
    State(adapter): State<Adapter>,
    Service(service): Service,
    Map(map): Map,
    Params(params): Params<BlockParams>,
    headers: HeaderMap,
) -> Result<Response, HttpError> {
    let answer = service.get_block(&map, params.try_into()?).await?;
    match wants_bytes(&headers) {
        true => Ok(as_bytes(answer)),
        false => as_json(answer, &adapter),
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

fn as_json(answer: BlockAnswer, adapter: &Adapter) -> Result<Response, HttpError> {
    let BlockAnswer { level, resolution_m, voxels, version } = answer;
    let mut head = Head { level, resolution_m, version: version.into(), cells: None };
    match voxels {
        BlockVoxels::Sparse(blocks) => {
            let count = blocks.len();
            let copied_bytes = count * size_of::<(VoxelKey, BlockMask)>();
            let kept = adapter.admission.keep(copied_bytes + BLOCKS.bytes(count))?;
            let blocks: Vec<_> = blocks.blocks().collect::<Result<_, _>>()?;
            let write = move |text: &mut String, item: usize| write_block(text, &blocks[item]);
            Ok(pieces::response(BLOCKS.of(&head, count, write)?, kept))
        }
        BlockVoxels::Dense(DistanceBlock { origin, size, cap, distances }) => {
            head.cells = Some(Cells { origin, size, cap: cap.get() });
            let count = distances.len();
            let kept = adapter.admission.keep(count + DISTANCES.bytes(count))?;
            let write = move |text: &mut String, item: usize| text.push_str(&distances[item].to_string());
            Ok(pieces::response(DISTANCES.of(&head, count, write)?, kept))
        }
    }
}

/// Appends `{"block":[i,j,k],"mask":"..."}`: the mask's bytes as they are in the form of bytes, two hexadecimal digits each.
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
    use crate::voxel::Cell;

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
