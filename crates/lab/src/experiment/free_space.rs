//! Experiment on free space: what viewpoints say of the voxels that another library calls free or occupied, from the
//! same scans.

use std::fs::File;
use std::io::{self, BufWriter, Read, Write};
use std::path::Path;
use std::time::Instant;

use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use crate::workload::Scan;
use mrol_map::geometry::Pose;
use mrol_map::map::{MapView, MultiResolutionMap, RobotName};
use mrol_map::mapping::{Guess, MappingError, MappingSettings, Scan as ScanToMap, ScanMapper, Sightings};
use mrol_map::util::StopSignal;
use mrol_map::visibility::{SensorModel, SensorRays};
use mrol_map::voxel::VoxelKey;

/// The first bytes of a file of scans.
const SCANS_MAGIC: &[u8; 8] = b"mrolscan";
/// The first bytes of a file of states.
const STATES_MAGIC: &[u8; 8] = b"mrolstat";
/// Bytes of a voxel in a file of states.
const STATE_BYTES: usize = 13;

/// Writes scans with their poses for another library. All numbers are little-endian:
///
/// ```text
/// "mrolscan"
/// f64   side of a voxel, meters
/// f64   range up to which scans are believed to see, meters
/// u64   number of scans, then for each
///       f32 x 3   where it was taken, map frame, meters
///       u64       number of points, then for each
///                 f32 x 3   map frame, meters
/// ```
///
/// # Errors
/// When the file cannot be written.
pub fn write_scans(path: &Path, resolution_m: f64, range_m: f64, scans: &[(&Scan, Pose)]) -> io::Result<()> {
    let mut file = BufWriter::new(File::create(path)?);
    file.write_all(SCANS_MAGIC)?;
    file.write_all(&resolution_m.to_le_bytes())?;
    file.write_all(&range_m.to_le_bytes())?;
    file.write_all(&(scans.len() as u64).to_le_bytes())?;
    for (scan, map_from_sensor) in scans {
        let mut write_m =
            |place: [f64; 3]| place.iter().try_for_each(|&c| file.write_all(&(c as f32).to_le_bytes()));
        write_m(map_from_sensor.translation.vector.into())?;
        file.write_all(&(scan.points.len() as u64).to_le_bytes())?;
        for point in &scan.points {
            let in_map: [f64; 3] = (map_from_sensor * point.to_f64()).into();
            in_map.iter().try_for_each(|&c| file.write_all(&(c as f32).to_le_bytes()))?;
        }
    }
    file.flush()
}

/// What another library says of the voxels of a map.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct PeerStates {
    /// Bytes of memory that it takes.
    pub memory_bytes: u64,
    /// Voxels that it calls free.
    pub free: Vec<VoxelKey>,
    /// Voxels that it calls occupied.
    pub occupied: Vec<VoxelKey>,
}

impl PeerStates {
    /// Reads what a peer wrote. All numbers are little-endian:
    ///
    /// ```text
    /// "mrolstat"
    /// u64   bytes of memory
    /// u64   number of voxels, then for each
    ///       i32 x 3   its index
    ///       u8        0 free, 1 occupied
    /// ```
    ///
    /// # Errors
    /// When the file cannot be read, or is none of those.
    pub fn read(path: &Path) -> io::Result<Self> {
        let bytes = std::fs::read(path)?;
        Self::parse(&bytes).ok_or_else(|| {
            let message = format!("{} is no file of states of a peer", path.display());
            io::Error::new(io::ErrorKind::InvalidData, message)
        })
    }

    fn parse(mut bytes: &[u8]) -> Option<Self> {
        let (mut magic, mut number) = ([0; 8], [0; 8]);
        bytes.read_exact(&mut magic).ok().filter(|()| magic == *STATES_MAGIC)?;
        bytes.read_exact(&mut number).ok()?;
        let mut states = Self { memory_bytes: u64::from_le_bytes(number), ..Self::default() };
        bytes.read_exact(&mut number).ok()?;
        let (voxels, rest) = bytes.as_chunks::<STATE_BYTES>();
        if !rest.is_empty() || voxels.len() as u64 != u64::from_le_bytes(number) {
            return None;
        }
        for voxel in voxels {
            let along = |axis: usize| i32::from_le_bytes(std::array::from_fn(|i| voxel[axis * 4 + i]));
            let of_state = if voxel[12] == 0 { &mut states.free } else { &mut states.occupied };
            of_state.push(VoxelKey::new([along(0), along(1), along(2)])?);
        }
        Some(states)
    }
}

/// Maps scans at their poses, as a robot's that knows them; of a known sensor, or of an unknown one.
///
/// # Errors
/// For a scan without a point within the map's range.
pub fn map_at_poses(
    map: &MultiResolutionMap,
    scans: &[(&Scan, Pose)],
    settings: MappingSettings,
    (robot, sensor): (&RobotName, Option<SensorModel>),
    step: impl Fn(),
) -> Result<(), MappingError> {
    let sightings = Sightings::default();
    let mapper = ScanMapper::new(map, &sightings, settings);
    for (scan, map_from_sensor) in scans {
        let scan = ScanToMap {
            sensor: sensor.and_then(|model| SensorRays::confirmed(&model, &scan.points).ok()),
            guess: Guess::Pose(*map_from_sensor),
            at_guess: true,
            ..ScanToMap::new(robot, &scan.points)
        };
        mapper.map_scan(&scan, StopSignal::NEVER)?;
        step();
    }
    Ok(())
}

/// How many of some voxels are in each state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct States {
    /// Something is there.
    pub occupied: usize,
    /// A viewpoint saw through its center, and nothing is there.
    pub free: usize,
    /// All others.
    pub unknown: usize,
}

impl States {
    /// The states of finest voxels in a view that has viewpoints.
    pub fn of(view: &MapView<'_>, voxels: &[VoxelKey]) -> Self {
        let mut states = Self::default();
        let mut cache = view.viewpoints().map(|viewpoints| viewpoints.cache());
        for &voxel in voxels {
            let center_m = view.lattice().center_m(voxel, 0);
            let state = if view.contains(voxel, 0) {
                &mut states.occupied
            } else if cache.as_mut().is_some_and(|cache| cache.is_free(center_m)) {
                &mut states.free
            } else {
                &mut states.unknown
            };
            *state += 1;
        }
        states
    }

    /// All of them.
    pub fn total(&self) -> usize {
        self.occupied + self.free + self.unknown
    }
}

/// Voxels classified a second on one core, millions: in the order of the list, and in none.
pub fn speeds(view: &MapView<'_>, voxels: &[VoxelKey], seed: u64) -> [f64; 2] {
    let mut voxels = voxels.to_vec();
    let timed = |voxels: &[VoxelKey]| {
        let start = Instant::now();
        let states = std::hint::black_box(States::of(view, voxels));
        states.total() as f64 / start.elapsed().as_secs_f64() / 1e6
    };
    let in_order = timed(&voxels);
    voxels.shuffle(&mut ChaCha8Rng::seed_from_u64(seed));
    [in_order, timed(&voxels)]
}
