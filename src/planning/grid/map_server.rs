//! A grid as the two files that the `map_server` of ROS and Nav2 reads: an image and its description.

use super::Grid;

/// What a cell without a voxel is said to be. The map holds what is occupied, and not what was seen to be free.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum NotOccupied {
    /// Free.
    #[default]
    Free,
    /// Unknown.
    Unknown,
}

/// Gray values, as `map_server` writes them: p is occupied with probability (255 - p) / 255.
const OCCUPIED: u8 = 0;
const UNKNOWN: u8 = 205;
const FREE: u8 = 254;

/// Probabilities above and below which a cell is occupied and free. The latter just below that of [`UNKNOWN`], 0.1961.
const OCCUPIED_ABOVE: f64 = 0.65;
const FREE_BELOW: f64 = 0.196;

impl Grid {
    /// A binary PGM image, a byte a cell: the row of the largest y comes first, as rows of images do.
    pub fn to_pgm(&self, not_occupied: NotOccupied) -> Vec<u8> {
        let other = match not_occupied {
            NotOccupied::Free => FREE,
            NotOccupied::Unknown => UNKNOWN,
        };
        let [width, height] = self.size;
        let mut image = format!("P5\n{width} {height}\n255\n").into_bytes();
        image.reserve_exact(self.cells());
        for y in (0..height).rev() {
            let cells = (0..width).map(|x| self.is_occupied(y * width + x));
            image.extend(cells.map(|is_occupied| if is_occupied { OCCUPIED } else { other }));
        }
        image
    }

    /// The description that lies beside the image, in YAML: its file name, the side of a cell, and where in the map frame its
    /// lower left corner is.
    pub fn to_yaml(&self, image_file: &str) -> String {
        let [x, y] = self.origin_m;
        let quoted = image_file.replace('\'', "''");
        format!(
            "image: '{quoted}'\nmode: trinary\nresolution: {}\norigin: [{x}, {y}, 0]\nnegate: 0\n\
             occupied_thresh: {OCCUPIED_ABOVE}\nfree_thresh: {FREE_BELOW}\n",
            self.cell_m
        )
    }
}
