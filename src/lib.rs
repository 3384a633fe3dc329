//! A networked multi-resolution voxel map: Ryde and Corso, *Fast Voxel Maps with Counting Bloom Filters*
//! (IROS 2012), as a server.
//!
//! In reading order, which is also the order of the layers: no module names one above its own, and a test says so.
//!
//! * [`voxel`], [`bloom`], [`geometry`]: keys, lattice and blocks (paper II-B, III); counting Bloom filters (II-A);
//!   points and poses.
//! * [`map`], [`align`], [`scan`]: the map itself (II, III) and its look-ups; sequential alignment (III-A, III-B);
//!   point-cloud files.
//! * [`planning`]: what planners ask of a map: does a body fit, rays, the nearest voxels, the map from above.
//! * [`mapping`]: a scan enters a map, from its guess to the inserted voxels (III-B). Whoever wants to see the whole before its
//!   parts begins here.
//! * `store`: map files. `service`: the operations, once for every protocol.
//! * `wire`: between generated and domain types. `access`: the operations by name, and who may ask for each. `grpc`,
//!   `http`, `client`: adapters. `server`, `cli`: the daemon and the program.
//! * `lab`: what simulates, measures and compares. Nothing but `cli` names it.
//!
//! Where to find what:
//!
//! * Where a scan is aligned: [`align::align`], which a server calls as [`align::align_until`]; without a guess, [`align::localize`]. The whole loop of a scan is
//!   [`mapping::ScanMapper::map_scan`].
//! * What *overlap* and *undetermined* mean: [`align`]. All verdicts: [`align::Verdict`].
//! * Where a point is quantized and looked up: [`voxel`], [`map::MapView`].
//! * What is there after `kill -9` or a loss of power: `store`. With the default durability, every acknowledged change.
//! * Where a limit is: `service::Limits` for those of the server, each a setting of the section `limits`;
//!   [`map::MapSettings`] for the ranges of a map's settings.
//! * Where a benchmark is: `lab::measure` for `mrol bench`, `lab::experiment` for the paper's experiments, `benches/` for
//!   single kernels.
//!
//! The first three items of the reading order know no runtime, no protocol and no serialization, and are there without
//! any feature:
//!
//! ```
//! use mrol::geometry::{Point, Pose};
//! use mrol::map::{Lookup, MapSettings, MultiResolutionMap, RobotName, ScanRecord, MappedScan};
//! use mrol::voxel::VoxelSet;
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

// The simulated disk of the tests names the crate.
#[cfg(all(test, feature = "shuttle"))]
extern crate self as mrol;

#[cfg(feature = "server")]
pub mod access;
#[cfg(feature = "server")]
pub mod admission;
pub mod align;
pub mod bloom;
#[cfg(feature = "server")]
pub mod cli;
#[cfg(feature = "client")]
pub mod client;
#[cfg(feature = "server")]
pub mod config;
pub mod geometry;
#[cfg(feature = "server")]
pub mod grpc;
#[cfg(feature = "server")]
pub mod http;
#[cfg(feature = "simulate")]
pub mod lab;
pub mod map;
pub mod mapping;
#[cfg(feature = "server")]
pub mod middleware;
pub mod planning;
pub mod scan;
#[cfg(feature = "server")]
pub mod server;
#[cfg(feature = "client")]
pub mod service;
#[cfg(feature = "client")]
pub mod store;
mod sync;
#[cfg(feature = "server")]
pub mod telemetry;
pub mod util;
pub mod visibility;
pub mod voxel;
#[cfg(feature = "client")]
pub mod wire;
