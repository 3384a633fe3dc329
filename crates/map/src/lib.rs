//! The core of the map server: Ryde and Corso, *Fast Voxel Maps with Counting Bloom Filters* (IROS 2012).
//!
//! It knows no runtime, no protocol and no serialization. In reading order, which is also the order of the layers but
//! for the last line, on which all of them stand: no two modules name each other, and a test says so.
//!
//! * [`voxel`], [`bloom`], [`geometry`]: keys, lattice and blocks (paper II-B, III); counting Bloom filters (II-A);
//!   points and poses.
//! * [`scan`], [`visibility`]: point-cloud files; what scans saw through.
//! * [`map`]: the map itself (II, III) and its look-ups.
//! * [`align`], [`planning`]: sequential alignment (III-A, III-B); what planners ask of a map: does a body fit, rays,
//!   the nearest voxels, the map from above.
//! * [`mapping`]: a scan enters a map, from its guess to the inserted voxels (III-B). Begin here to see the whole
//!   before its parts.
//! * [`sync`], [`util`]: ranked locks; small tools that know nothing of maps.
//!
//! ```
//! use mrol_map::geometry::{Point, Pose};
//! use mrol_map::map::{Lookup, MapSettings, MultiResolutionMap, RobotName, ScanRecord, MappedScan};
//! use mrol_map::voxel::VoxelSet;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let map = MultiResolutionMap::new(MapSettings::new(0.05, 4))?;
//! let scan = [Point::new(1.0, 2.0, 0.5), Point::new(1.0, 2.1, 0.5)];
//! let map_from_sensor = Pose::translation(0.0, 0.0, 1.0);
//!
//! let (voxels, _out_of_range) = VoxelSet::of_points(&scan, &map.lattice().from_points(&map_from_sensor));
//! let pose = MappedScan::new(RobotName::new("r1")?, map_from_sensor);
//! let committed = map.committer().insert_scan(ScanRecord::of_voxels(pose, voxels));
//! assert_eq!((committed.revision, committed.added), (1, 2));
//!
//! let quantize = map.lattice().from_points(&map_from_sensor);
//! let view = map.view_of(&scan, &map_from_sensor);
//! assert_eq!(view.count(&scan, &quantize, 0, Lookup::Bloom), 2);
//! # Ok(())
//! # }
//! ```

pub mod align;
pub mod bloom;
pub mod geometry;
pub mod map;
pub mod mapping;
pub mod planning;
pub mod scan;
pub mod sync;
pub mod util;
pub mod visibility;
pub mod voxel;
