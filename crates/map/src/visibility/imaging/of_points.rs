//! The range image of a scan: as fine as its points lie and its bytes allow.

use super::density::PointDensity;
use super::nearest_depths::NearestDepths;
use super::ray_gaps::RayGaps;
use super::sensor_rays::SensorRays;
use super::sweep::Sweep;
use crate::geometry::Point;
use crate::visibility::directions::{CubeMap, Projection};
use crate::visibility::image::{DEPTH_MAX, NOT_SEEN, RangeImage, RaySpacing, Tile, tiles_max};
use crate::visibility::thresholds::Thresholds;

/// Tiles along the side of a face, finest first, fewer than an image's first byte has room for (`image/bytes.rs`):
/// pixels of 0.6 to 7 degrees.
const TILES: [usize; 14] = [25, 22, 20, 18, 16, 14, 12, 10, 8, 6, 5, 4, 3, 2];
/// So many points lie between two that are looked at one after the other where tiles are counted: those of all parts of
/// a scan come early, and too many tiles are soon found to be.
const POINTS_APART: usize = 61;
/// A gap that is so many times as wide as rays lie apart is no wider: what rounding adds.
const AS_WIDE: f32 = 1.01;

impl RangeImage {
    /// The image of at most `bytes_max` bytes of a scan whose rays ended at `points` (sensor frame, finite); none where
    /// nothing is seen.
    ///
    /// Points of the robot itself belong to them: what lies behind it was not seen. Pixels are as fine as `bytes_max`
    /// allows and as the points lie. Those in which the points lie far from each other are not seen.
    pub fn of_points(points: &[Point], sweep: Sweep, bytes_max: usize) -> Option<Self> {
        Self::of_points_by(points, sweep, bytes_max, None, &Thresholds::DEFAULT)
    }

    /// [`RangeImage::of_points`] of a sensor whose rays are known, or by other thresholds, for experiments.
    pub fn of_points_by(
        points: &[Point],
        sweep: Sweep,
        bytes_max: usize,
        sensor: Option<SensorRays>,
        thresholds: &Thresholds,
    ) -> Option<Self> {
        let offsets: Vec<_> = points.iter().filter_map(|point| sweep.limited(point.xyz())).collect();
        let density = match sensor {
            Some(sensor) => sensor.density(),
            None => PointDensity::of(&offsets, thresholds)?,
        };
        let PointDensity { map, spacing } = density;
        let rays = RaySpacing { moved_m: sweep.told_moved_m(), spacing };
        let of_depths = |depths: &NearestDepths| Self::of_depths(depths, rays, sweep.open_m);
        let mut best = match sensor {
            Some(sensor) => {
                let map = sensor.pixels_of_image(&offsets, bytes_max, thresholds)?;
                of_depths(&NearestDepths::of(map, &offsets, thresholds))
            }
            None => Self::by_trial(&offsets, bytes_max, thresholds, of_depths)?,
        };
        // Rays of a known sensor leave gaps as wide as they lie apart: the image tells of these as it is.
        let least = if sensor.is_some() { AS_WIDE * spacing } else { 0.0 };
        best.note_gaps(&RayGaps { map: map.finer(), spacing, least, offsets: &offsets, thresholds });
        (!best.tiles.is_empty()).then_some(best)
    }

    /// The image of an unknown sensor: those of several sizes of pixels are made, and what tells most is taken.
    fn by_trial(
        offsets: &[[f32; 3]],
        bytes_max: usize,
        thresholds: &Thresholds,
        of_depths: impl Fn(&NearestDepths) -> Self,
    ) -> Option<Self> {
        let depths = TILES.iter().map(|&tiles| NearestDepths::of(CubeMap::new(tiles), offsets, thresholds));
        let mut fitting =
            depths.filter(|depths| depths.touched_tiles() <= tiles_max(depths.map(), bytes_max));
        let first = of_depths(&fitting.next()?);
        // Coarser pixels tell more of a scan whose points lie further apart than the finest pixels.
        let coarser = fitting.take_while(|depths| depths.map().pitch() <= thresholds.spacing_max);
        let best = coarser
            .map(|depths| of_depths(&depths))
            .fold(first, |finer, coarser| finer.or_what_tells_more(coarser, thresholds.coarser_gain_min));
        Some(best)
    }

    /// Tells the gaps between rays in the tiles that were seen there: pixels and their parts are too wide to tell of
    /// them.
    fn note_gaps(&mut self, gaps: &RayGaps<'_>) {
        gaps.for_each(|direction, gap| {
            let Some(Projection { face, pixel, .. }) = self.map.project(direction) else { return };
            let (tile, pixel) = self.map.place(face, pixel);
            let kept = self.tiles.get_mut(usize::from(self.places[tile]));
            if let Some(tile) = kept.filter(|tile| tile.depth(pixel).is_some()) {
                tile.note_gap(gap);
            }
        });
    }

    /// The coarser image where it sees so many times as much, else this one.
    fn or_what_tells_more(self, coarser: Self, gain_min: f32) -> Self {
        if coarser.seen_area() > gain_min * self.seen_area() { coarser } else { self }
    }

    /// The part of the cube around the sensor in which something was seen, in squares of side 1 at depth 1.
    fn seen_area(&self) -> f32 {
        let seen: usize = self.tiles.iter().map(Tile::seen_pixels).sum();
        seen as f32 * self.map.pitch() * self.map.pitch()
    }

    fn of_depths(depths: &NearestDepths, rays: RaySpacing, open_m: f32) -> Self {
        let map = depths.map();
        let unit_m = (depths.max() / DEPTH_MAX).max(f32::MIN_POSITIVE);
        let (mut places, mut tiles) = (vec![NOT_SEEN; map.tiles_of_all_faces()], Vec::new());
        for (place, seen) in places.iter_mut().zip(depths.seen_tiles(rays.spacing)) {
            let depths = seen.map(|depth| depth.map(|depth_m| (depth_m / unit_m).min(DEPTH_MAX) as u16));
            if depths.iter().any(Option::is_some) {
                *place = tiles.len() as u16;
                tiles.push(Tile::new(&depths));
            }
        }
        Self { map, unit_m, rays, open_m, places, tiles }
    }
}

impl SensorRays {
    /// The finest pixels of which each has a ray where the sensor looks, and with which the image of points at
    /// `offsets` has room in `bytes_max`; none where no pixels have room.
    fn pixels_of_image(
        self,
        offsets: &[[f32; 3]],
        bytes_max: usize,
        thresholds: &Thresholds,
    ) -> Option<CubeMap> {
        let maps = TILES.iter().map(|&tiles| CubeMap::new(tiles));
        let mut wide = maps.filter(|&map| self.meet_all(map, thresholds));
        wide.find(|&map| touches_at_most(tiles_max(map, bytes_max), map, offsets))
    }
}

/// True where points at `offsets` lie in at most so many tiles of a map.
fn touches_at_most(most: usize, map: CubeMap, offsets: &[[f32; 3]]) -> bool {
    let (mut is_touched, mut touched) = (vec![false; map.tiles_of_all_faces()], 0);
    let in_turn = (0..POINTS_APART).flat_map(|first| offsets.iter().skip(first).step_by(POINTS_APART));
    in_turn.filter_map(|&offset| map.project(offset)).all(|Projection { face, pixel, .. }| {
        let (tile, _) = map.place(face, pixel);
        touched += usize::from(!std::mem::replace(&mut is_touched[tile], true));
        touched <= most
    })
}
