//! Carving: what a scan saw through is no longer there, and leaves the map.
//!
//! A map that only grows keeps everything that ever stood or walked in it. A scan that looks through a voxel and sees
//! what lies behind it tells that the voxel is empty now. What it tells is believed of few voxels, for a wall that is
//! carved away is a worse map than one with a ghost in it:
//!
//! * never of one that the scan touches, or that lies within a margin of the surface that it shows, the surface between
//!   its points included;
//! * only where each direction in which the voxel lies was seen to end behind it;
//! * never at a rim: where a direction beside these was not seen, or ends in front of the voxel on another surface. A
//!   surface that is seen at a grazing angle is one rim beside the other, so nothing is carved in front of it or from
//!   it;
//! * not what is narrow as it is seen from the sensor, where its rays lie farther apart than it may be thick: poles,
//!   edges of tables;
//! * only as far as the points lie as close to each other as voxels do, or half as far again, and within a range.

mod carving_scan;
mod settings;
#[cfg(test)]
mod tests;
mod thin_things;

pub use carving_scan::Carving;
pub(super) use carving_scan::CarvingScan;
pub use settings::{
    CARVING_GRAZING_MAX_DEG, CARVING_GRAZING_MIN_DEG, CARVING_MARGIN_MAX, CARVING_RANGE_MAX_M,
    CarvingSettings, CarvingSettingsError,
};
