//! A networked multi-resolution voxel map: Ryde and Corso, *Fast Voxel Maps with Counting Bloom Filters*
//! (IROS 2012), as a server.
//!
//! In reading order, which is also the order of the layers. The first two lines name crates; within a crate no two
//! modules name each other, and a test says so.
//!
//! * [`mrol_map`], the core, knows no runtime, no protocol and no serialization. Its modules are here too: [`voxel`],
//!   [`bloom`], [`geometry`], [`map`], [`align`], [`scan`], [`visibility`],
//!   [`planning`], [`mapping`] and [`util`]. Begin with [`mapping`] to see the
//!   whole before its parts: a scan enters a map, from its guess to the inserted voxels (paper III-B).
//! * [`store`]: map files. [`service`]: the operations, once for every protocol. [`client`]: the client, its [`wire`]
//!   format and a replica of a map.
//! * [`access`]: the operations by name, and who may ask for each. [`telemetry`]: metrics, audit, log. [`admission`]:
//!   what is done at once is bounded. [`middleware`], [`config`]: what every request passes; settings. [`json`],
//!   [`grpc`], [`http`]: adapters. [`server`]: the daemon. [`console`]: what commands read and say, and how the daemon
//!   is run. [`offline`]: mapping without a server.
//!
//! The commands and the demonstration are modules of the program (`src/main.rs`), so that a change of one builds no
//! more than that.
//!
//! What measures and compares is a program of its own, in `crates/lab`.
//!
//! Where to find what:
//!
//! * Where a scan is aligned: [`align::align`], which a server calls as [`align::align_until`]; without a guess,
//!   [`align::localize`]. The whole loop of a scan is [`mapping::ScanMapper::map_scan`].
//! * What *overlap* and *undetermined* mean: [`align`]. All verdicts: [`align::Verdict`].
//! * Where a point is quantized and looked up: [`voxel`], [`map::MapView`].
//! * What is there after `kill -9` or a loss of power: [`store`]. With the default durability, every acknowledged
//!   change.
//! * Where a limit is: [`service::Limits`] for those of the server, each a setting of the section `limits`;
//!   [`map::MapSettings`] for the ranges of a map's settings.

pub mod access;
pub mod admission;
pub mod build_info;
pub mod config;
pub mod console;
pub mod grpc;
pub mod http;
pub mod json;
pub mod middleware;
pub mod offline;
pub mod server;
pub mod telemetry;

pub use mrol_client as client;
pub use mrol_client::wire;
pub use mrol_map::{align, bloom, geometry, map, mapping, planning, scan, util, visibility, voxel};
pub use mrol_service as service;
pub use mrol_store as store;
