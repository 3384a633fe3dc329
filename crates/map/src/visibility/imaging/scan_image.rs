//! The image of a scan that is being aligned: the nearest point in each direction, made in one pass.

use super::density::PointDensity;
use crate::geometry::Point;
use crate::visibility::directions::{CubeMap, FACES, Projection};
use crate::visibility::image::{Sight, sight};
use crate::visibility::thresholds::Thresholds;

/// Tiles along the side of a face, at most: pixels of 0.5 to 1 degree.
const TILES: usize = 13;
/// Points that tell how fine they can be.
const POINTS_OF_DENSITY: usize = 1 << 15;

/// The depth of the nearest point of a scan in each pixel of a cube around its sensor.
///
/// Unlike a [`RangeImage`](crate::visibility::RangeImage) it is not kept, so that it need not be small: it tells what
/// the points say and nothing of what lies between them.
#[derive(Debug, Clone)]
pub struct ScanImage {
    map: CubeMap,
    /// Along each face's axis, meters, face by face and row by row; infinite where no point is.
    depths_m: Vec<f32>,
}

impl ScanImage {
    /// The image of a scan of `points` (sensor frame, meters).
    ///
    /// Its pixels are as fine as the points lie: between rings that meet a floor at a small angle, finer ones would see
    /// it farther away than it is.
    pub fn of(points: &[Point]) -> Self {
        let some = points.iter().step_by(points.len().div_ceil(POINTS_OF_DENSITY).max(1));
        let offsets: Vec<[f32; 3]> = some.map(|point| point.xyz()).collect();
        let density = PointDensity::no_finer_than(TILES, &offsets, &Thresholds::DEFAULT);
        let map = density.map_or(CubeMap::new(TILES), |density| density.map);
        let mut image = Self { map, depths_m: vec![f32::INFINITY; FACES * map.pixels() * map.pixels()] };
        for point in points {
            let Some(Projection { face, pixel, depth_m }) = map.project(point.xyz()) else { continue };
            let place = image.place(face, pixel);
            image.depths_m[place] = image.depths_m[place].min(depth_m);
        }
        image
    }

    /// What the scan tells of the point at `offset` from the sensor, in its frame, meters.
    pub fn sight(&self, offset: [f32; 3], tolerance_m: f32) -> Sight {
        let depth_m = |(face, pixel)| {
            Some(self.depths_m[self.place(face, pixel)]).filter(|depth_m| depth_m.is_finite())
        };
        sight(self.map, depth_m, offset, tolerance_m)
    }

    fn place(&self, face: usize, [column, row]: [usize; 2]) -> usize {
        (face * self.map.pixels() + row) * self.map.pixels() + column
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A wall across the x axis, a point every 0.5 degrees.
    fn wall(x: f32) -> Vec<Point> {
        let angles = || (-60..=60).map(|i| (i as f32 * 0.5f32.to_radians()).tan());
        angles().flat_map(|y| angles().map(move |z| Point::new(x, x * y, x * z))).collect()
    }

    #[test]
    fn a_wall_agrees_with_itself_is_before_what_is_behind_and_contradicts_what_is_before_it() {
        let image = ScanImage::of(&wall(4.0));
        let told = |x: f32| image.sight([x, 0.3 * x, -0.2 * x], 0.1);
        assert_eq!([told(4.0), told(4.09), told(3.91)], [Sight::Agrees; 3]);
        assert_eq!(told(3.5), Sight::Contradicts);
        assert_eq!(told(4.5), Sight::Hidden);
        assert_eq!(image.sight([-3.0, 0.0, 0.0], 0.1), Sight::NotSeen, "nobody looked behind");
        assert_eq!(image.sight([0.0; 3], 0.1), Sight::NotSeen);
    }

    #[test]
    fn an_edge_of_the_cube_changes_nothing() {
        // The edge between two faces lies in the middle of the wall.
        let turn = nalgebra::Rotation3::from_axis_angle(&nalgebra::Vector3::z_axis(), 0.785f32);
        let turned = |point: [f32; 3]| <[f32; 3]>::from(turn * nalgebra::Vector3::from(point));
        let points: Vec<_> = wall(4.0).iter().map(|point| Point::from(turned(point.xyz()))).collect();
        let image = ScanImage::of(&points);
        for y in -10..=10 {
            let y = y as f32 * 0.01;
            assert_eq!(image.sight(turned([4.0, y, 0.1]), 0.1), Sight::Agrees);
            assert_eq!(image.sight(turned([3.5, y, 0.1]), 0.1), Sight::Contradicts);
        }
    }
}
