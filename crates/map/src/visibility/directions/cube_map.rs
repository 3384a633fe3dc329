//! Directions as pixels of a cube around the sensor.

/// Faces of the cube.
pub(in crate::visibility) const FACES: usize = 6;
/// Tiles along the side of a face of pixels that are as fine as points lie: 0.28 degrees.
const TILES_MAX: usize = 40;
/// Pixels along the side of a tile.
pub(in crate::visibility) const TILE_SIDE: usize = 8;

/// The grid of pixels on each of the six faces of a cube around the sensor: `tiles` tiles of 8 x 8 pixels along each
/// side.
///
/// A direction lies on the face of its largest coordinate, at the quotients of the two others and that one. So a pixel
/// is found without a root and without an angle, and everything is computed in f32 in one order: the same pixel on
/// every machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::visibility) struct CubeMap {
    tiles: usize,
}

/// A pixel: its face, and its column and row there.
pub(in crate::visibility) type Pixel = (usize, [usize; 2]);

/// A pixel of a cube map, and how deep a point lies in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::visibility) struct Projection {
    /// Face 0..6: that of +x, -x, +y, -y, +z, -z.
    pub(in crate::visibility) face: usize,
    /// Column and row on the face.
    pub(in crate::visibility) pixel: [usize; 2],
    /// Distance along the face's axis, meters.
    pub(in crate::visibility) depth_m: f32,
}

impl CubeMap {
    pub(in crate::visibility) fn new(tiles: usize) -> Self {
        Self { tiles }
    }

    /// The map of pixels half as wide, or as wide as the finest that are of use.
    pub(in crate::visibility) fn finer(self) -> Self {
        Self { tiles: (2 * self.tiles).min(TILES_MAX.max(self.tiles)) }
    }

    /// Tiles along the side of a face.
    pub(in crate::visibility) fn tiles(self) -> usize {
        self.tiles
    }

    /// Pixels along the side of a face.
    pub(in crate::visibility) fn pixels(self) -> usize {
        self.tiles * TILE_SIDE
    }

    /// Tiles of all faces.
    pub(in crate::visibility) fn tiles_of_all_faces(self) -> usize {
        FACES * self.tiles * self.tiles
    }

    /// The side of a pixel at depth 1.
    pub(in crate::visibility) fn pitch(self) -> f32 {
        2.0 / self.pixels() as f32
    }

    /// Where the point at `offset` from the sensor, in its frame and finite, is seen; none of the sensor's own place.
    #[inline(always)]
    pub(in crate::visibility) fn project(self, offset: [f32; 3]) -> Option<Projection> {
        let (face, [u, v], depth_m) = face_of(offset)?;
        let half = (self.pixels() / 2) as f32;
        let last = self.pixels() - 1;
        let pixel = [u, v].map(|along| (((along + 1.0) * half) as usize).min(last));
        Some(Projection { face, pixel, depth_m })
    }

    /// How deep the point at `offset` lies on a face, along its axis: less than 0 of what lies behind.
    #[inline(always)]
    pub(in crate::visibility) fn depth_on(self, face: usize, offset: [f32; 3]) -> f32 {
        let along = offset[face / 2];
        if face.is_multiple_of(2) { along } else { -along }
    }

    /// The number of the tile that holds a pixel, and of the pixel in it.
    #[inline(always)]
    pub(in crate::visibility) fn place(self, face: usize, [column, row]: [usize; 2]) -> (usize, usize) {
        let tile = (face * self.tiles + row / TILE_SIDE) * self.tiles + column / TILE_SIDE;
        (tile, row % TILE_SIDE * TILE_SIDE + column % TILE_SIDE)
    }

    /// The pixels of the tile of a number, see [`CubeMap::place`].
    pub(in crate::visibility) fn pixels_of_tile(self, tile: usize) -> impl Iterator<Item = Pixel> {
        let (face, row, column) =
            (tile / self.tiles / self.tiles, tile / self.tiles % self.tiles, tile % self.tiles);
        let at = move |i: usize| [column * TILE_SIDE + i % TILE_SIDE, row * TILE_SIDE + i / TILE_SIDE];
        (0..TILE_SIDE * TILE_SIDE).map(move |i| (face, at(i)))
    }

    /// The pixels of all faces.
    pub(in crate::visibility) fn all_pixels(self) -> impl Iterator<Item = Pixel> {
        let side = self.pixels();
        (0..FACES).flat_map(move |face| (0..side * side).map(move |i| (face, [i % side, i / side])))
    }

    /// The pixel so many columns and rows away, on whatever face.
    #[inline(always)]
    pub(in crate::visibility) fn beside(
        self,
        (face, [column, row]): Pixel,
        [right, up]: [isize; 2],
    ) -> Option<Pixel> {
        let side = self.pixels();
        let moved = |at: usize, by: isize| at.checked_add_signed(by).filter(|&at| at < side);
        match (moved(column, right), moved(row, up)) {
            (Some(column), Some(row)) => Some((face, [column, row])),
            _ => self.across_an_edge((face, [column, row]), [right, up]),
        }
    }

    #[cold]
    fn across_an_edge(self, (face, [column, row]): Pixel, [right, up]: [isize; 2]) -> Option<Pixel> {
        let [u, v] =
            [(column, right), (row, up)].map(|(at, by)| (at as f32 + by as f32 + 0.5) * self.pitch() - 1.0);
        let Projection { face, pixel, .. } = self.project(self.on_face(face, [u, v]))?;
        Some((face, pixel))
    }

    /// The direction of the middle of a pixel, of depth 1.
    pub(in crate::visibility) fn direction(self, face: usize, pixel: [usize; 2]) -> [f32; 3] {
        self.on_face(face, self.middle(pixel))
    }

    /// Where on its face the middle of a pixel lies, -1 to 1 along each side.
    pub(in crate::visibility) fn middle(self, pixel: [usize; 2]) -> [f32; 2] {
        pixel.map(|i| (i as f32 + 0.5) * self.pitch() - 1.0)
    }

    /// The angle, radians, of a small step to the right or up from the middle of a pixel, for a length of 1 on the
    /// face: towards its edges less.
    pub(in crate::visibility) fn angle_of_step(self, pixel: [usize; 2], [right, _]: [isize; 2]) -> f32 {
        let [u, v] = self.middle(pixel);
        let along = if right != 0 { 1.0 + v * v } else { 1.0 + u * u };
        along.sqrt() / (1.0 + u * u + v * v)
    }

    /// Where on a face's plane the direction of `offset` lies (-1 to 1 along each side, and beyond it on others).
    pub(in crate::visibility) fn on_plane(self, face: usize, [x, y, z]: [f32; 3]) -> [f32; 2] {
        let (depth, u, v) = match face / 2 {
            0 => (x, y, z),
            1 => (y, z, x),
            _ => (z, x, y),
        };
        [u, v].map(|along| along / depth.abs())
    }

    /// The direction of depth 1 that lies at `u`, `v` of a face's plane (-1 to 1 along each side, and beyond it on
    /// others).
    pub(in crate::visibility) fn on_face(self, face: usize, [u, v]: [f32; 2]) -> [f32; 3] {
        let sign = if face.is_multiple_of(2) { 1.0 } else { -1.0 };
        match face / 2 {
            0 => [sign, u, v],
            1 => [v, sign, u],
            _ => [u, v, sign],
        }
    }
}

/// The face that the point at `offset` lies on, where on it (-1 to 1 along each side), and its distance along the
/// face's axis.
#[inline(always)]
fn face_of([x, y, z]: [f32; 3]) -> Option<(usize, [f32; 2], f32)> {
    let [ax, ay, az] = [x.abs(), y.abs(), z.abs()];
    let (axis, along, u, v) = if ax >= ay && ax >= az {
        (0, x, y, z)
    } else if ay >= az {
        (1, y, z, x)
    } else {
        (2, z, x, y)
    };
    let depth = along.abs();
    if depth == 0.0 {
        return None;
    }
    let scale = 1.0 / depth;
    Some((axis * 2 + usize::from(along < 0.0), [u * scale, v * scale], depth))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_middle_of_each_pixel_is_seen_in_it() {
        for tiles in [1, 3, 10] {
            let map = CubeMap::new(tiles);
            for face in 0..FACES {
                for row in 0..map.pixels() {
                    for column in 0..map.pixels() {
                        let direction = map.direction(face, [column, row]);
                        let seen = map.project(direction.map(|c| c * 3.0)).unwrap();
                        assert_eq!((seen.face, seen.pixel), (face, [column, row]));
                        assert!((seen.depth_m - 3.0).abs() < 1e-6);
                    }
                }
            }
        }
    }

    #[test]
    fn the_sensors_own_place_is_seen_nowhere() {
        assert_eq!(CubeMap::new(4).project([0.0; 3]), None);
    }
}
