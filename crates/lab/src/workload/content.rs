//! [`Workload`]: content of a map, with queries about it.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::queries::{Order, Queries};
use super::ride::{self, Surface};
use super::room::Room;
use super::scatter::Scatter;
use super::shots::{EVERYWHERE_DEG, ShotLayout, Shots};
use super::site::Site;
use mrol_map::geometry::{Point, Pose};
use mrol_map::map::{MapSettings, MapSettingsError, MappedScan, MultiResolutionMap, RobotName, ScanRecord};
use mrol_map::voxel::{VoxelKey, VoxelSet};

/// Content of a map, with queries about it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Workload {
    /// The surfaces of a room, of the size of the paper's map.
    Room(Room),
    /// Rolling terrain of any size.
    Site(Site),
    /// Randomly generated voxels, as in the paper's first experiment.
    Scatter(Scatter),
}

impl Workload {
    /// Side of the workload's voxels, meters.
    pub fn resolution_m(&self) -> f64 {
        match self {
            Self::Room(_) => Room::RESOLUTION_M,
            Self::Site(_) => Site::RESOLUTION_M,
            Self::Scatter(_) => Scatter::RESOLUTION_M,
        }
    }

    /// Iterates over the workload's voxels, in disjoint pieces of at most some hundred thousand voxels.
    pub fn pieces(self) -> Box<dyn Iterator<Item = VoxelSet>> {
        match self {
            Self::Room(room) => Box::new(std::iter::once(room.voxels())),
            Self::Site(site) => Box::new(site.pieces()),
            Self::Scatter(scatter) => Box::new(std::iter::once(scatter.voxels())),
        }
    }

    /// Makes `count` points to query; for a sweep at most as many as there are voxels. Scattered voxels have no surface
    /// for a sensor to see: there the order is random.
    pub fn queries(&self, order: Order, count: usize, seed: u64) -> Queries {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        match (self, order) {
            (Self::Room(room), Order::Random) => room.random_queries(count, &mut random),
            (Self::Room(room), Order::Scan) => ride::queries(room, count, &mut random),
            (Self::Site(site), Order::Random) => site.random_queries(count, &mut random),
            (Self::Site(site), Order::Scan) => ride::queries(site, count, &mut random),
            (Self::Scatter(scatter), Order::Random | Order::Scan) => {
                scatter.random_queries(count, &mut random)
            }
            (_, Order::Sweep) => self.sweep(count, &mut random),
        }
    }

    /// Makes rays from places on the sensor's path: in a room in all directions, on a site those that its sensor looks
    /// in. Scattered voxels have no path; all places are in their middle.
    pub fn shots(&self, layout: ShotLayout) -> Shots {
        match self {
            Self::Room(room) => Shots::of(layout, EVERYWHERE_DEG, |place| room.sensor(place)),
            Self::Site(site) => Shots::of(layout, Site::SIGHT.elevation_deg, |place| site.sensor(place)),
            Self::Scatter(_) => Shots::of(layout, EVERYWHERE_DEG, |_| Scatter::middle()),
        }
    }

    /// The queries' points in the map frame.
    pub fn map_points(&self, order: Order, count: usize, seed: u64) -> Vec<Point> {
        let Queries { points, map_from_points } = self.queries(order, count, seed);
        points.into_iter().map(|point| Point::from(map_from_points * point.to_f64())).collect()
    }

    /// Makes a point in each voxel, away from its border.
    fn sweep(&self, count: usize, random: &mut ChaCha8Rng) -> Queries {
        let indices: Box<dyn Iterator<Item = [i32; 3]>> = match *self {
            Self::Room(room) => Box::new(room.indices()),
            Self::Site(site) => Box::new(site.indices()),
            Self::Scatter(scatter) => {
                Box::new(scatter.voxels().iter().map(VoxelKey::index).collect::<Vec<_>>().into_iter())
            }
        };
        let mut inside = |i: i32| (f64::from(i) + random.random_range(0.1..0.9)) * self.resolution_m();
        Queries::of_map_points(indices.take(count).map(|index| index.map(&mut inside)))
    }

    /// Builds the map of the workload with `settings`.
    ///
    /// # Errors
    /// When a setting is out of range.
    pub fn map(self, settings: MapSettings) -> Result<MultiResolutionMap, MapSettingsError> {
        let map = MultiResolutionMap::new(settings)?;
        self.pieces().for_each(|voxels| add(&map, voxels));
        Ok(map)
    }
}

/// Inserts voxels into a map, as a scan would.
pub fn add(map: &MultiResolutionMap, voxels: VoxelSet) {
    let Ok(robot) = RobotName::new("bench") else { return };
    let pose = MappedScan::new(robot, Pose::identity());
    map.committer().insert_scan(ScanRecord::of_voxels(pose, voxels));
}

#[cfg(test)]
mod tests {
    use super::*;
    use mrol_map::map::Lookup;

    fn workloads() -> [Workload; 3] {
        [Workload::Room(Room), Workload::Site(Site::of(50_000, 1)), Workload::Scatter(Scatter::of(20_000, 1))]
    }

    fn map_of(workload: Workload) -> MultiResolutionMap {
        workload.map(MapSettings::new(workload.resolution_m(), 4)).unwrap()
    }

    fn occupied(map: &MultiResolutionMap, queries: &Queries) -> f64 {
        let quantize = map.lattice().from_points(&queries.map_from_points);
        let hits = map.view().count(&queries.points, &quantize, 0, Lookup::Exact);
        hits as f64 / queries.points.len() as f64
    }

    #[test]
    fn one_seed_gives_one_workload() {
        for workload in workloads() {
            for order in [Order::Random, Order::Scan, Order::Sweep] {
                assert_eq!(workload.queries(order, 1000, 3), workload.queries(order, 1000, 3));
                assert_ne!(workload.queries(order, 1000, 3), workload.queries(order, 1000, 4));
            }
        }
    }

    #[test]
    fn pieces_are_disjoint_and_as_many_as_wished() {
        for (workload, wish) in workloads().into_iter().zip([150_000.0, 50_000.0, 20_000.0]) {
            let in_pieces: usize = workload.pieces().map(|piece| piece.len()).sum();
            assert_eq!(in_pieces, map_of(workload).voxels(0));
            assert!((in_pieces as f64 / wish - 1.0).abs() < 0.05, "{workload:?}: {in_pieces}");
        }
    }

    #[test]
    fn scans_see_the_surface_and_random_points_mostly_miss_it() {
        for workload in &workloads()[..2] {
            let map = map_of(*workload);
            let [random, scan] =
                [Order::Random, Order::Scan].map(|order| occupied(&map, &workload.queries(order, 50_000, 1)));
            assert!((0.02..0.4).contains(&random), "{workload:?}: {random}");
            assert!(scan > 0.8, "{workload:?}: {scan}");
        }
    }

    #[test]
    fn a_sweep_meets_each_voxel_once() {
        for workload in workloads() {
            let map = map_of(workload);
            let sweep = workload.queries(Order::Sweep, usize::MAX, 1);
            assert_eq!((sweep.points.len(), occupied(&map, &sweep)), (map.voxels(0), 1.0));
            assert_eq!(
                sweep.first_of_each_voxel(|pose| map.lattice().from_points(pose), usize::MAX).points.len(),
                map.voxels(0)
            );
        }
    }

    #[test]
    fn the_first_point_of_each_voxel_is_kept_and_no_other() {
        let workload = Workload::Room(Room);
        let map = map_of(workload);
        let first = workload
            .queries(Order::Scan, 20_000, 1)
            .first_of_each_voxel(|pose| map.lattice().from_points(pose), 5000);
        let (voxels, _) =
            VoxelSet::of_points(&first.points, &map.lattice().from_points(&first.map_from_points));
        assert_eq!((first.points.len(), voxels.len()), (5000, 5000));
    }
}
