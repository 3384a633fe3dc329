//! A robot that maps a scene as a server with its settings would.

use std::collections::BTreeSet;

use mrol_map::geometry::{Point, Pose};
use mrol_map::map::{MapSettings, MultiResolutionMap, RobotName};
use mrol_map::mapping::{
    CarvingSettings, FilteredPoints, Guess, MappingSettings, RayEnds, Scan, ScanMapper, Sightings,
    StationarySettings,
};
use mrol_map::scan::PointFilter;
use mrol_map::util::StopSignal;
use mrol_map::voxel::VoxelKey;

pub(crate) struct Robot {
    pub(crate) map: MultiResolutionMap,
    sightings: Sightings,
    settings: MappingSettings,
    filter: PointFilter,
}

impl Robot {
    pub(crate) fn new(resolution_m: f64, filter: PointFilter, carves: bool) -> Self {
        let carving = carves.then(CarvingSettings::default);
        let stationary = Some(StationarySettings::default());
        Self {
            map: MultiResolutionMap::new(MapSettings::new(resolution_m, 5)).unwrap(),
            sightings: Sightings::default(),
            settings: MappingSettings { carving, stationary, ..MappingSettings::default() },
            filter,
        }
    }

    /// Maps a scan from near `truth`.
    ///
    /// # Errors
    /// Why it is refused.
    pub(crate) fn map(&self, points: &[Point], truth: &Pose) -> Result<(), String> {
        let robot = RobotName::new("r").unwrap();
        let ends = RayEnds { points, times_s: None };
        let filtered = FilteredPoints::of(ends, self.filter, &robot, false).unwrap();
        let scan = Scan {
            no_returns: filtered.no_returns(),
            beyond: filtered.beyond(),
            of_robot: filtered.of_robot(),
            guess: Guess::Pose(*truth),
            at_guess: self.map.is_empty(),
            ..Scan::new(&robot, filtered.surroundings().points)
        };
        let mapper = ScanMapper::new(&self.map, &self.sightings, self.settings);
        let located = mapper.map_scan(&scan, StopSignal::NEVER).unwrap().located;
        if located.is_accepted() { Ok(()) } else { Err(located.alignment.reason) }
    }

    /// The finest voxels.
    pub(crate) fn voxels(&self) -> BTreeSet<VoxelKey> {
        self.map.view().voxels().iter().collect()
    }

    /// How many voxels are free.
    pub(crate) fn free<'a>(&self, voxels: impl IntoIterator<Item = &'a VoxelKey>) -> usize {
        let view = self.map.view().with_viewpoints();
        let seen = view.viewpoints().unwrap();
        let is_free = |voxel: &&VoxelKey| {
            !view.contains(**voxel, 0) && seen.is_free(view.lattice().center_m(**voxel, 0))
        };
        voxels.into_iter().filter(is_free).count()
    }
}
