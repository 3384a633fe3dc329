//! Mapping: a scan enters a map (paper III-B).
//!
//! [`ScanMapper::map_scan`] is the whole loop, and reads like the paper: the scan is located by aligning it to the map
//! from a guess, judged, turned into a record of voxels and moments, and inserted with its pose. A server, which has to
//! make the record durable before it is visible, calls [`ScanMapper::locate`], [`ScanMapper::recover`] and
//! [`ScanMapper::decide`] by themselves and inserts through its commit queue.
//!
//! Begin with `map_scan`, the loop, `decision`, what becomes of a scan, and `scan_mapper`, its steps; a [`Scan`] goes
//! in, a [`ScanOutcome`] comes out. `recovery` finds robots again whose scans were refused, and `carving` takes out
//! what a scan saw through.

mod carving;
mod decision;
mod deskew;
mod error;
mod filtered_points;
mod guess;
mod located_scan;
mod lost_robots;
mod map_scan;
mod odometry;
mod ray_ends;
mod recovered;
mod recovery;
mod recovery_settings;
mod resolved_guess;
mod scan;
mod scan_mapper;
mod scan_prior;
mod sensor_mount;
mod sightings;
mod stationary;
mod viewpoints;

pub use carving::{
    CARVING_GRAZING_MAX_DEG, CARVING_GRAZING_MIN_DEG, CARVING_MARGIN_MAX, CARVING_RANGE_MAX_M, Carving,
    CarvingSettings, CarvingSettingsError,
};
pub use decision::Decision;
pub use deskew::{DeskewSettings, deskewed};
pub use error::MappingError;
pub use filtered_points::FilteredPoints;
pub use guess::Guess;
pub use located_scan::{LocatedScan, ScanOutcome};
pub use lost_robots::{LOST_ROBOTS_MAX, LostRobots, SearchTask};
pub use odometry::{ODOMETRY_SHARE_MAX, OdometrySettings, OdometrySettingsError};
pub use ray_ends::RayEnds;
pub use recovered::Recovered;
pub use recovery_settings::RecoverySettings;
pub use scan::Scan;
pub use scan_mapper::{MappingSettings, ScanMapper};
pub use sensor_mount::{SENSOR_HEIGHT_MAX_M, SensorAxes, SensorMount};
pub use sightings::{SIGHTINGS_MAX, Sighting, Sightings};
pub use stationary::StationarySettings;
pub use viewpoints::{VIEWPOINT_BYTES_MAX_DEFAULT, ViewpointSettings};
