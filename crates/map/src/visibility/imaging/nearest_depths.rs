//! Nearest depths: how deep the nearest point lies in each pixel of a cube map, and which pixels points tell enough of.

use crate::visibility::directions::{CubeMap, Pixel, Projection};
use crate::visibility::image::TILE_PIXELS;
use crate::visibility::thresholds::Thresholds;

/// What may be lost where a number of parts is computed.
const ROUNDING: f32 = 0.01;

/// The depth of the nearest point in each pixel, and in each of the parts into which wide pixels are divided.
pub(super) struct NearestDepths {
    map: CubeMap,
    /// Columns, and rows, of parts in a pixel.
    parts: usize,
    /// The parts as pixels of their own.
    map_of_parts: CubeMap,
    /// Of each part, tile by tile; infinite where no point is.
    depths_m: Vec<f32>,
    /// Of each tile of the map: whether some point lies in it.
    is_touched: Vec<bool>,
    thresholds: Thresholds,
}

/// How deep the pixels of a tile were seen, meters; none of those that were not.
pub(super) type SeenTile = [Option<f32>; TILE_PIXELS];

impl NearestDepths {
    /// Of points at `offsets` from the sensor.
    pub(super) fn of(map: CubeMap, offsets: &[[f32; 3]], thresholds: &Thresholds) -> Self {
        let thresholds = *thresholds;
        let parts = (map.pitch() / thresholds.spacing_max).ceil().max(1.0) as usize;
        let map_of_parts = CubeMap::new(map.tiles() * parts);
        let depths_m = vec![f32::INFINITY; map_of_parts.tiles_of_all_faces() * TILE_PIXELS];
        let is_touched = vec![false; map.tiles_of_all_faces()];
        let mut depths = Self { map, parts, map_of_parts, depths_m, is_touched, thresholds };
        for Projection { face, pixel, depth_m } in offsets.iter().filter_map(|&it| map_of_parts.project(it)) {
            let part = depths.at((face, pixel));
            depths.depths_m[part] = depths.depths_m[part].min(depth_m);
            depths.is_touched[map.place(face, pixel.map(|i| i / parts)).0] = true;
        }
        depths
    }

    pub(super) fn map(&self) -> CubeMap {
        self.map
    }

    /// How many tiles some point lies in.
    pub(super) fn touched_tiles(&self) -> usize {
        self.is_touched.iter().filter(|is_touched| **is_touched).count()
    }

    /// The largest depth, meters.
    pub(super) fn max(&self) -> f32 {
        self.depths_m.iter().copied().filter(|depth| depth.is_finite()).fold(0.0, f32::max)
    }

    /// How far each pixel was seen, tile by tile: as far as the nearest of its parts, where half of these were seen or
    /// more. So what was seen ends within half a pixel of where it does. Of a scan whose points lie `spacing` from each
    /// other as a rule, too far for that, all parts have to be seen.
    pub(super) fn seen_tiles(&self, spacing: f32) -> Vec<SeenTile> {
        let all = self.parts * self.parts;
        let least = if spacing <= self.thresholds.sparse { all.div_ceil(2) } else { all };
        let mut tiles = vec![[None; TILE_PIXELS]; self.map.tiles_of_all_faces()];
        for (face, pixel) in self.map.all_pixels() {
            let (tile, place) = self.map.place(face, pixel);
            // What no point is in is looked at by none: most of it.
            if self.is_touched[tile] {
                tiles[tile][place] = self.seen_parts((face, pixel), least);
            }
        }
        tiles
    }

    /// How deep a pixel was seen, where `least` of its parts were.
    fn seen_parts(&self, (face, pixel): Pixel, least: usize) -> Option<f32> {
        let [column, row] = pixel.map(|i| i * self.parts);
        let parts =
            (0..self.parts * self.parts).map(|i| (face, [column + i % self.parts, row + i / self.parts]));
        let seen = parts.filter_map(|part| self.seen_m(part));
        let (count, depth_m) = seen.fold((0, f32::INFINITY), |(count, all), part| (count + 1, all.min(part)));
        (count >= least).then_some(depth_m)
    }

    /// How deep a part was seen: up to its own nearest point, or to the nearer of two that it lies between, since
    /// points are not where parts are.
    fn seen_m(&self, part: Pixel) -> Option<f32> {
        self.point_m(part).or_else(|| {
            let [beside, above] = [[1, 0], [0, 1]].map(|step| self.seen_between_m(part, step));
            beside.into_iter().chain(above).reduce(f32::min)
        })
    }

    fn seen_between_m(&self, part: Pixel, [right, up]: [isize; 2]) -> Option<f32> {
        let part_rad = self.map_of_parts.pitch() * self.map_of_parts.angle_of_step(part.1, [right, up]);
        // Two points tell of what is between them that lie at most two of the widest parts from each other.
        let steps = (2.0 * self.thresholds.spacing_max / part_rad + ROUNDING) as isize;
        let point_m = |step: isize| self.point_m(self.map_of_parts.beside(part, [right * step, up * step])?);
        let (before, before_m) = (1..steps).find_map(|step| Some((step, point_m(-step)?)))?;
        let after_m = (1..=steps - before).find_map(point_m)?;
        Some(before_m.min(after_m))
    }

    /// The depth of the nearest point in a part.
    fn point_m(&self, part: Pixel) -> Option<f32> {
        Some(self.depths_m[self.at(part)]).filter(|depth_m| depth_m.is_finite())
    }

    fn at(&self, (face, part): Pixel) -> usize {
        let (tile, part) = self.map_of_parts.place(face, part);
        tile * TILE_PIXELS + part
    }
}
