//! The map from above.

use super::scope::{Of, answered, asked_of};
use crate::wire::pb;
use crate::wire::values::{bitmap_of, bytes_of, count_from, numbers_of, required, words_of};
use mrol_map::map::MapName;
use mrol_map::planning::{BandFrom, Grid, GridArea};
use mrol_service::{AtVersion, GridQuestion, GridScope, GridTile, Reason, ServiceError};

impl TryFrom<pb::ProjectGridRequest> for Of<GridQuestion> {
    type Error = ServiceError;

    fn try_from(request: pb::ProjectGridRequest) -> Result<Self, ServiceError> {
        let (map, asked) = asked_of(request.asked)?;
        let area = request.area.map_or(GridArea::Occupied, |area| GridArea::Rectangle {
            min_m: [area.min_x_m, area.min_y_m],
            max_m: [area.max_x_m, area.max_y_m],
        });
        let band_from = match pb::BandFrom::try_from(request.band_from) {
            Ok(pb::BandFrom::Unspecified | pb::BandFrom::Floor) => BandFrom::Floor,
            Ok(pb::BandFrom::Map) => BandFrom::Map,
            Err(_) => {
                let message = format!("band_from must be 0, 1 (floor) or 2 (map), got {}", request.band_from);
                return Err(ServiceError::new(Reason::BadGrid, message));
            }
        };
        let low_m = request.min_z_m.unwrap_or(f64::NEG_INFINITY);
        let high_m = request.max_z_m.unwrap_or(f64::INFINITY);
        let scope = GridScope {
            area,
            band_m: [low_m, high_m],
            band_from,
            cell_m: request.cell_m,
            tells_unknown: request.tell_unknown,
        };
        Ok((map, GridQuestion { asked, scope }))
    }
}

impl From<(&MapName, GridQuestion)> for pb::ProjectGridRequest {
    fn from((map, GridQuestion { asked, scope }): (&MapName, GridQuestion)) -> Self {
        let GridScope { area, band_m: [low_m, high_m], band_from, cell_m, tells_unknown: tell_unknown } =
            scope;
        let area = match area {
            GridArea::Occupied => None,
            GridArea::Rectangle { min_m: [min_x_m, min_y_m], max_m: [max_x_m, max_y_m] } => {
                Some(pb::GridArea { min_x_m, min_y_m, max_x_m, max_y_m })
            }
        };
        let asked = Some((map, asked).into());
        let band_from = pb::BandFrom::from(band_from).into();
        Self { asked, area, min_z_m: Some(low_m), max_z_m: Some(high_m), cell_m, tell_unknown, band_from }
    }
}

impl From<BandFrom> for pb::BandFrom {
    fn from(from: BandFrom) -> Self {
        match from {
            BandFrom::Floor => Self::Floor,
            BandFrom::Map => Self::Map,
        }
    }
}

impl From<AtVersion<Grid>> for pb::ProjectGridResponse {
    fn from(AtVersion { answer, version }: AtVersion<Grid>) -> Self {
        let cells = answer.cells();
        let Grid {
            cell_m,
            origin_m: [origin_x_m, origin_y_m],
            size: [x, y],
            occupied,
            tops_m,
            free,
            floor_m,
        } = answer;
        let ones = |words: &[u64]| words.iter().map(|word| u64::from(word.count_ones())).sum();
        let (cells_occupied, cells_free) = (ones(&occupied), free.as_deref().map_or(0, ones));
        Self {
            cell_m,
            origin_x_m,
            origin_y_m,
            cells_x: x as u64,
            cells_y: y as u64,
            occupied: bitmap_of(occupied, cells),
            cells_occupied,
            tops_m_f32le: bytes_of(tops_m),
            version: Some(version.into()),
            free: free.map(|free| bitmap_of(free, cells)),
            cells_free,
            floor_min_m: floor_m.map(|[low, _]| low),
            floor_max_m: floor_m.map(|[_, high]| high),
        }
    }
}

impl TryFrom<pb::ProjectGridResponse> for AtVersion<Grid> {
    type Error = ServiceError;

    fn try_from(response: pb::ProjectGridResponse) -> Result<Self, ServiceError> {
        let size = [response.cells_x, response.cells_y].map(count_from);
        let cells = size[0].saturating_mul(size[1]);
        let grid = Grid {
            cell_m: response.cell_m,
            origin_m: [response.origin_x_m, response.origin_y_m],
            size,
            occupied: words_of(&response.occupied, cells, "occupied")?,
            tops_m: numbers_of(&response.tops_m_f32le, cells, "tops_m_f32le")?,
            free: response.free.map(|free| words_of(&free, cells, "free")).transpose()?,
            floor_m: response.floor_min_m.zip(response.floor_max_m).map(|(low, high)| [low, high]),
        };
        answered(grid, response.version)
    }
}

impl From<GridTile> for pb::GridTile {
    fn from(tile: GridTile) -> Self {
        let GridTile { origin_m: [origin_x_m, origin_y_m], size, tiles, first, grid, .. } = tile;
        let ([cells_x, cells_y], [first_x, first_y]) =
            (size.map(|cells| cells as u64), first.map(|cell| cell as u64));
        Self {
            origin_x_m,
            origin_y_m,
            cells_x,
            cells_y,
            tiles: tiles as u64,
            first_x,
            first_y,
            grid: Some(grid.into()),
            failure: None,
        }
    }
}

/// The last message of tiles over HTTP that end early.
impl From<pb::Failure> for pb::GridTile {
    fn from(failure: pb::Failure) -> Self {
        Self { failure: Some(failure), ..Self::default() }
    }
}

/// A tile alone does not say whether it is the last one: the reader counts.
impl TryFrom<pb::GridTile> for GridTile {
    type Error = ServiceError;

    fn try_from(tile: pb::GridTile) -> Result<Self, ServiceError> {
        if let Some(failure) = tile.failure {
            return Err(ServiceError::new(Reason::UnexpectedField, failure.message));
        }
        Ok(Self {
            origin_m: [tile.origin_x_m, tile.origin_y_m],
            size: [tile.cells_x, tile.cells_y].map(count_from),
            tiles: count_from(tile.tiles),
            first: [tile.first_x, tile.first_y].map(count_from),
            is_last: false,
            grid: required(tile.grid, "grid")?.try_into()?,
        })
    }
}
