//! A grid as the two files that the `map_server` of ROS and Nav2 reads: an image and its description.

use super::occupancy_grid::Grid;

/// Gray values, as `map_server` writes them: p is occupied with probability (255 - p) / 255.
const OCCUPIED: u8 = 0;
const UNKNOWN: u8 = 205;
const FREE: u8 = 254;

/// Probabilities above and below which a cell is occupied and free. The latter just below that of [`UNKNOWN`], 0.1961.
const OCCUPIED_ABOVE: f64 = 0.65;
const FREE_BELOW: f64 = 0.196;

impl Grid {
    /// A binary PGM image, a byte a cell: the row of the largest y comes first, as rows of images do. Cells that are
    /// not occupied are free, but for unknown ones where the grid tells them.
    pub fn to_pgm(&self) -> Vec<u8> {
        let [width, height] = self.size;
        let mut image = format!("P5\n{width} {height}\n255\n").into_bytes();
        image.reserve_exact(self.cells());
        for y in (0..height).rev() {
            image.extend((0..width).map(|x| self.gray(y * width + x)));
        }
        image
    }

    fn gray(&self, number: usize) -> u8 {
        if self.is_occupied(number) {
            OCCUPIED
        } else if self.is_unknown(number) {
            UNKNOWN
        } else {
            FREE
        }
    }

    /// The description that lies beside the image, in YAML: its file name, the side of a cell, and where in the map
    /// frame its lower left corner is.
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
