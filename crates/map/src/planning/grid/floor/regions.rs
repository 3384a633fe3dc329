//! Regions of the floor: surfaces that can be driven to from each other.

use std::collections::VecDeque;

use hashbrown::HashMap;

use super::surfaces::Surfaces;

/// How far a surface may rise or fall along the way, as a share of the way, besides one voxel of rounding. Ramps of
/// garages and for wheelchairs and all but the steepest streets rise by 20 % and less; stairs rise by more than 50 %,
/// as banks, hoods and windscreens of cars do.
const SLOPE_MAX: f64 = 0.25;
/// Way over which the slope counts, and the widest gap between points of the floor that it is followed across, meters.
/// Over one column a step of one voxel has no slope yet, over a meter a flight of stairs has. The rings of a spinning
/// lidar on the floor are some decimeters apart, as far away as they show what is in the way.
const FOLLOWED_M: f64 = 1.0;
/// Most columns that these are: of voxels below 3 cm, so that gaps cost no more than the floor does.
const FOLLOWED_MAX: usize = 32;
/// Side of the squares by which the extent of a region is counted, meters: as wide as a robot is, and wider than most
/// gaps between points.
pub(super) const SQUARE_M: f64 = 0.5;
/// Least number of squares of a region that is a floor: 4 square meters. A desk, a roof of a car, the deck of a robot
/// and the head of a person have less, rooms and lanes have more.
pub(super) const SQUARES_MIN: usize = 16;
/// Columns between two pauses.
const COLUMNS_PER_PAUSE: usize = 4096;

/// The surface of no region.
const NONE: u32 = u32::MAX;

/// Surfaces that can be driven to from each other.
#[derive(Debug, Default)]
pub(super) struct Region {
    /// The surfaces, at most one a column.
    pub(super) surfaces: Vec<u32>,
    /// The squares that they lie in, up to [`SQUARES_MIN`].
    squares: Vec<[i64; 2]>,
    /// In how many places robots were on it.
    pub(super) visits: usize,
}

impl Region {
    /// True where it is large enough to be a floor.
    pub(super) fn is_floor(&self) -> bool {
        self.squares.len() >= SQUARES_MIN
    }
}

/// How a region got to a surface.
#[derive(Debug, Clone, Copy)]
struct Link {
    region: u32,
    /// The surface before it on the way from where the region began: itself where that is here.
    before: u32,
    /// Columns from there.
    columns: u32,
}

/// How near a column lies to the region that spreads.
#[derive(Debug, Clone, Copy)]
struct Reached {
    /// Columns to the surface it was reached from; 0 of a column with a surface of the region.
    gap: usize,
    /// That surface.
    from: u32,
}

/// The regions of a map's surfaces, as far as they were asked for.
#[derive(Debug)]
pub(super) struct Regions<'a> {
    surfaces: &'a Surfaces,
    voxel_m: f64,
    /// [`FOLLOWED_M`] in columns.
    followed: usize,
    links: Vec<Link>,
    pub(super) all: Vec<Region>,
    /// Columns that were looked at, of all regions.
    looked: usize,
    /// True once the search was ended.
    pub(super) is_ended: bool,
}

impl<'a> Regions<'a> {
    pub(super) fn new(surfaces: &'a Surfaces, voxel_m: f64) -> Self {
        let followed = ((FOLLOWED_M / voxel_m).round() as usize).clamp(1, FOLLOWED_MAX);
        let links = vec![Link { region: NONE, before: NONE, columns: 0 }; surfaces.len()];
        Self { surfaces, voxel_m, followed, links, all: Vec::new(), looked: 0, is_ended: false }
    }

    /// The number of the region that a surface belongs to, which spreads from there where it belongs to none yet.
    ///
    /// It spreads breadth-first over the eight columns around each, first without gaps and then over wider and wider
    /// ones. So what stands on the floor is judged by the floor right before it. `pause` is called now and then, and
    /// ends the work where it says false.
    pub(super) fn region_of(&mut self, surface: u32, pause: &mut impl FnMut() -> bool) -> usize {
        let known = self.links[surface as usize].region;
        if known != NONE {
            return known as usize;
        }
        let number = self.all.len();
        self.all.push(Region::default());
        self.spread(surface, number as u32, pause);
        number
    }

    fn spread(&mut self, seed: u32, region: u32, pause: &mut impl FnMut() -> bool) {
        let mut reached: HashMap<[i32; 2], Reached> = HashMap::new();
        // Columns to go on from, by their gaps.
        let mut waiting: Vec<VecDeque<[i32; 2]>> = vec![VecDeque::new(); self.followed];
        self.take(seed, Link { region, before: seed, columns: 0 });
        reached.insert(self.surfaces.column_of(seed), Reached { gap: 0, from: seed });
        waiting[0].push_back(self.surfaces.column_of(seed));
        while let Some(gap) = waiting.iter().position(|columns| !columns.is_empty()) {
            self.looked += 1;
            if self.looked.is_multiple_of(COLUMNS_PER_PAUSE) && !pause() {
                self.is_ended = true;
                return;
            }
            let Some(column) = waiting[gap].pop_front() else { continue };
            // Columns that were reached anew from nearer wait twice.
            let Some(&Reached { from, .. }) = reached.get(&column).filter(|at| at.gap == gap) else {
                continue;
            };
            for next in around(column) {
                let columns = gap + 1;
                let known = reached.get(&next).map_or(usize::MAX, |at| at.gap);
                if columns > known || known == 0 {
                    continue;
                }
                let link = Link { region, before: from, columns: columns as u32 };
                let gap = match self.continuing(next, link) {
                    Some(surface) => {
                        self.take(surface, link);
                        reached.insert(next, Reached { gap: 0, from: surface });
                        0
                    }
                    None if columns == known => continue,
                    None => {
                        reached.insert(next, Reached { gap: columns, from });
                        columns
                    }
                };
                let goes_further = gap == 0 || !self.ends_at(next, link);
                if let Some(columns) = waiting.get_mut(gap).filter(|_| goes_further) {
                    columns.push_back(next);
                }
            }
        }
    }

    fn take(&mut self, surface: u32, link: Link) {
        self.links[surface as usize] = link;
        let region = &mut self.all[link.region as usize];
        region.surfaces.push(surface);
        if !region.is_floor() {
            let column = self.surfaces.column_of(surface);
            let square = column.map(|i| (f64::from(i) * self.voxel_m / SQUARE_M).floor() as i64);
            if !region.squares.contains(&square) {
                region.squares.push(square);
            }
        }
    }

    /// The surface of a column by which a region goes on: the nearest in height, of two the higher one.
    fn continuing(&self, column: [i32; 2], link: Link) -> Option<u32> {
        let level = self.surfaces.voxel(link.before)[2];
        let free = |surface: &u32| self.links[*surface as usize].region == NONE;
        let rise = |surface: u32| self.surfaces.voxel(surface)[2] - level;
        let on =
            self.surfaces.of_column(column).filter(|surface| free(surface) && self.goes_on(*surface, link));
        on.min_by_key(|surface| (rise(*surface).abs(), -rise(*surface)))
    }

    /// True where a column has a surface that is about as high as what a region may reach, and yet does not go on by: a
    /// step, that is no gap.
    fn ends_at(&self, column: [i32; 2], link: Link) -> bool {
        let most = 1.0 + SLOPE_MAX * self.followed as f64;
        let rise = |surface: u32| self.surfaces.voxel(surface)[2] - self.surfaces.voxel(link.before)[2];
        self.surfaces.of_column(column).any(|surface| f64::from(rise(surface).abs()) <= most)
    }

    /// True where the way to a surface is nowhere too steep, as far back as the slope counts.
    fn goes_on(&self, surface: u32, link: Link) -> bool {
        let height = self.surfaces.voxel(surface)[2];
        let (mut at, mut way) = (link.before, link.columns as usize);
        loop {
            let rise = (height - self.surfaces.voxel(at)[2]).abs();
            if f64::from(rise) > 1.0 + SLOPE_MAX * way as f64 {
                return false;
            }
            let Link { before, columns, .. } = self.links[at as usize];
            way += columns as usize;
            if before == at || way > self.followed {
                return true;
            }
            at = before;
        }
    }
}

/// The eight columns around one, those beside it first.
pub(super) fn around([x, y]: [i32; 2]) -> [[i32; 2]; 8] {
    [[1, 0], [-1, 0], [0, 1], [0, -1], [1, 1], [-1, 1], [1, -1], [-1, -1]].map(|[dx, dy]| [x + dx, y + dy])
}
