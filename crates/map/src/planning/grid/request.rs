//! The request: which part of the map, which band of height, how large the cells.

use crate::util::Keyword;

/// What to draw.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GridRequest {
    /// Level of the voxels.
    pub level: u32,
    /// Which part of the map, seen from above.
    pub area: GridArea,
    /// Lowest and highest height, meters: voxels count that reach between them, by more than a border; where the two
    /// are the same, the voxel there. Infinite ones are fine.
    pub band_m: [f64; 2],
    /// What these heights count from.
    pub band_from: BandFrom,
    /// Side of a cell, meters: a whole number of the level's voxels.
    pub cell_m: f64,
    /// True where cells without a voxel are told apart: free ones and unknown ones. It takes more time.
    pub tells_unknown: bool,
    /// Most cells of the grid.
    pub cells_max: usize,
}

/// What the heights of a band count from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum BandFrom {
    /// The floor that robots stand on: in each column of voxels the top of the voxels that the floor lies in. Of a band
    /// without bounds it does not matter, and no floor is looked for.
    #[default]
    Floor,
    /// z = 0 of the map, where usually the first scan's sensor was.
    Map,
}

impl Keyword for BandFrom {
    const ALL: &'static [Self] = &[Self::Floor, Self::Map];

    fn as_str(self) -> &'static str {
        match self {
            Self::Floor => "floor",
            Self::Map => "map",
        }
    }
}

/// Part of a map, seen from above.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum GridArea {
    /// A rectangle, meters; borders of cells lie at whole multiples of a cell's side, and every cell that it meets
    /// belongs to the grid.
    Rectangle {
        /// Smallest x and y.
        min_m: [f64; 2],
        /// Largest x and y.
        max_m: [f64; 2],
    },
    /// As much as has voxels in the band.
    Occupied,
}

/// Why a grid cannot be drawn.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum GridError {
    /// A rectangle with corners that are not finite or in the wrong order.
    #[error("area.min_m must be finite and not exceed area.max_m in x or y, got {0:?} and {1:?}")]
    Rectangle([f64; 2], [f64; 2]),
    /// A corner that no map of this resolution reaches.
    #[error("area.{field} must lie within {min_m} m and {max_m} m, as the map does, got {value:?}")]
    Range {
        /// The corner.
        field: &'static str,
        /// Its x and y, meters.
        value: [f64; 2],
        /// The smallest coordinate of the map, meters.
        min_m: f64,
        /// The largest.
        max_m: f64,
    },
    /// A band with NaN or in the wrong order.
    #[error("min_z_m must be at most max_z_m, got {} and {}", .0[0], .0[1])]
    Band([f64; 2]),
    /// A band in which no map of this resolution can have a voxel.
    #[error("min_z_m and max_z_m must have a height of {min_m}..{end_m} m between them, as the map has, got {} and {}", .band_m[0], .band_m[1])]
    BandRange {
        /// The band, meters.
        band_m: [f64; 2],
        /// The smallest coordinate of the map, meters.
        min_m: f64,
        /// One past the largest.
        end_m: f64,
    },
    /// A band from the floor, of a map that does not know where its sensors were.
    #[error(
        "band_from is floor, and the map has neither viewpoints nor a trajectory, below which a floor could be: with \
         band_from map min_z_m and max_z_m count from z = 0 of the map"
    )]
    NoPoses,
    /// A band from the floor, where none was found.
    #[error(
        "band_from is floor, and no floor was found below any of {places} places of the map's sensors, within 5 m: that \
         is a surface of 4 m² at least that rises by at most 25 %; with band_from map min_z_m and max_z_m count from \
         z = 0 of the map"
    )]
    NoFloor {
        /// How many places were looked below.
        places: usize,
    },
    /// A cell that is no whole number of voxels.
    #[error("cell_m must be a whole number of voxels of {voxel_m} m, got {cell_m}")]
    Cell {
        /// The cell's side, meters.
        cell_m: f64,
        /// Side of a voxel of the level, meters.
        voxel_m: f64,
    },
    /// Too many cells.
    #[error("a grid may have {most} cells, the area has {cells} of {cell_m} m")]
    Cells {
        /// Number of cells of the area.
        cells: f64,
        /// The cell's side, meters.
        cell_m: f64,
        /// Most cells.
        most: usize,
    },
}
