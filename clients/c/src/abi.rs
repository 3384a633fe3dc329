//! The structs of mrol.h, field by field in the same order: a test compares every offset.

use std::ffi::c_char;
use std::time::Duration;

use mrol_client::ReplicaStatus;
use mrol_client::geometry::pose;
use mrol_client::map::Lookup;
use mrol_client::service::{PointAnswer, ServiceError};

use crate::failure::Failure;
use crate::memory::{self, Question};

/// Version of the interface: `MROL_ABI_VERSION`.
pub(crate) const VERSION: u32 = 3;
/// Bytes of a reason and of a message, with their zero: `MROL_REASON_BYTES`, `MROL_MESSAGE_BYTES`.
pub(crate) const REASON_BYTES: usize = 48;
pub(crate) const MESSAGE_BYTES: usize = 464;

/// `mrol_error`.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct Error {
    code: i32,
    reserved: u32,
    reason: [u8; REASON_BYTES],
    message: [u8; MESSAGE_BYTES],
}

impl Error {
    pub(crate) fn of(failure: &Failure) -> Self {
        Self {
            code: failure.code as i32,
            reserved: 0,
            reason: terminated(&failure.reason),
            message: terminated(&failure.message),
        }
    }

    #[cfg(test)]
    pub(crate) fn message(&self) -> String {
        let text = std::ffi::CStr::from_bytes_until_nul(&self.message).unwrap();
        text.to_str().unwrap().to_owned()
    }
}

/// `mrol_replica`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[repr(C)]
pub struct ReplicaHandle {
    pub(crate) number: u64,
}

impl ReplicaHandle {
    /// No replica.
    pub(crate) const NONE: Self = Self { number: 0 };
}

/// `mrol_map_version`.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct MapVersion {
    map_uuid: [u8; 16],
    pub(crate) revision: u64,
    content_hash: u64,
    has_content_hash: u8,
    reserved: [u8; 7],
}

impl From<mrol_client::service::MapVersion> for MapVersion {
    fn from(version: mrol_client::service::MapVersion) -> Self {
        Self {
            map_uuid: version.map_uuid.into_bytes(),
            revision: version.revision,
            content_hash: version.content_hash.map_or(0, |hash| hash.to_bits()),
            has_content_hash: version.content_hash.is_some().into(),
            reserved: [0; 7],
        }
    }
}

/// `mrol_replica_options`.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct Options {
    pub(crate) struct_size: usize,
    pub(crate) address: *const c_char,
    pub(crate) map: *const c_char,
    pub(crate) key: *const c_char,
    pub(crate) ca_file: *const c_char,
    pub(crate) certificate_file: *const c_char,
    pub(crate) private_key_file: *const c_char,
    pub(crate) open_timeout_ms: u64,
    pub(crate) silence_timeout_ms: u64,
    pub(crate) blocks_max: u64,
    pub(crate) region_min_m: [f64; 3],
    pub(crate) region_max_m: [f64; 3],
    pub(crate) has_region: u8,
    pub(crate) with_filter: u8,
    pub(crate) without_viewpoints: u8,
    pub(crate) reserved: [u8; 5],
    pub(crate) age_max_ms: u64,
}

// SAFETY: it begins with its size, and any bytes are one.
unsafe impl Question for Options {
    const NAME: &'static str = "options";
    const BYTES_MIN: usize = std::mem::offset_of!(Self, age_max_ms);
}

/// `mrol_point_query`.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct PointQuery {
    pub(crate) struct_size: usize,
    pub(crate) xyz: *const f32,
    pub(crate) count: usize,
    pub(crate) map_from_points: *const f64,
    pub(crate) level: u32,
    pub(crate) lookup: i32,
    pub(crate) keep_out: u8,
    pub(crate) reserved: [u8; 7],
}

// SAFETY: it begins with its size, and any bytes are one.
unsafe impl Question for PointQuery {
    const NAME: &'static str = "query";
    const BYTES_MIN: usize = size_of::<Self>();
}

impl PointQuery {
    /// The question in domain types, about points that stay where they are.
    ///
    /// # Safety
    /// The points and the pose are there, and nobody writes them before the question is dropped.
    pub(crate) unsafe fn parse(self) -> Result<mrol_client::service::PointQuery, Failure> {
        let lookup = match self.lookup {
            0 => Lookup::Exact,
            1 => Lookup::Bloom,
            other => return Err(Failure::argument(format!("query.lookup must be 0 or 1, got {other}"))),
        };
        // SAFETY: as the caller promises.
        let numbers = unsafe { memory::numbers::<7>(self.map_from_points, "query.map_from_points") }?;
        let map_from_points = numbers.map(|[x, y, z, qx, qy, qz, qw]| pose([x, y, z], [qx, qy, qz, qw]));
        let map_from_points = map_from_points.transpose().map_err(ServiceError::from)?;
        // SAFETY: as the caller promises.
        let points = unsafe { memory::points(self.xyz, self.count, "query") }?;
        if self.reserved != [0; 7] {
            return Err(Failure::argument("query.reserved must be zero"));
        }
        Ok(mrol_client::service::PointQuery {
            points,
            map_from_points,
            level: self.level,
            lookup,
            min_revision: None,
            map_uuid: None,
            keep_out: memory::flag(self.keep_out, "query.keep_out")?,
        })
    }
}

/// `mrol_answer`.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct Answer {
    version: MapVersion,
    asked: u64,
    positive: u64,
    reserved: [u64; 4],
}

impl Answer {
    /// The answer about so many, without its arrays.
    pub(crate) fn of(version: mrol_client::service::MapVersion, asked: usize, positive: u64) -> Self {
        Self { version: version.into(), asked: asked as u64, positive, reserved: [0; 4] }
    }

    /// The answer to a question about points, without its bitmap.
    pub(crate) fn to_points(answer: &PointAnswer) -> Self {
        Self::of(answer.version, answer.points, answer.points_occupied as u64)
    }
}

/// `mrol_replica_status`.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct Status {
    pub(crate) version: MapVersion,
    head_revision: u64,
    resets: u64,
    is_connected: u8,
    has_ended: u8,
    reserved: [u8; 2],
    age_ms: u32,
    last_error: [u8; MESSAGE_BYTES],
}

impl Status {
    /// The status of a replica whose server was heard so long ago; of one that `is_whole` with the map's content hash.
    pub(crate) fn of(status: &ReplicaStatus, age: Duration, is_whole: bool) -> Self {
        let version = mrol_client::service::MapVersion {
            revision: status.version.revision,
            map_uuid: status.map_uuid,
            content_hash: is_whole.then_some(status.version.hash),
        };
        Self {
            version: version.into(),
            head_revision: status.head_revision,
            resets: status.resets,
            is_connected: status.is_connected.into(),
            has_ended: status.has_ended.into(),
            reserved: [0; 2],
            age_ms: u32::try_from(age.as_millis()).unwrap_or(u32::MAX),
            last_error: terminated(status.last_error.as_deref().unwrap_or_default()),
        }
    }
}

/// The text with a zero behind it: cut off between two characters where it is too long, and at a zero.
pub(crate) fn terminated<const BYTES: usize>(text: &str) -> [u8; BYTES] {
    let text = text.split('\0').next().unwrap_or_default();
    let end = (0..BYTES).rev().find(|&end| text.is_char_boundary(end)).unwrap_or_default();
    let kept = &text.as_bytes()[..end];
    let mut bytes = [0; BYTES];
    bytes[..kept.len()].copy_from_slice(kept);
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bodies::{BodyHandle, LinkParts};
    use crate::clients::ClientHandle;
    use crate::options::{ClientOptions, CredentialFiles};
    use crate::questions::frontiers::FrontierNumbers;
    use crate::questions::grid::GridShape;
    use crate::questions::regions::RegionNumbers;
    use crate::questions::{
        ClassifyPlaces, ClassifyQuestion, CollisionPlaces, FrontierPlaces, FrontierQuestion, GridPlaces,
        GridQuestion, MotionCheck, MotionPlaces, NearestPlaces, NearestQuestion, PoseCheck, RayPlaces,
        RayQuestion, Scope, SphereCheck,
    };
    use crate::scans::{Localization, Localized, Scan, ScanOutcome};

    #[test]
    fn long_texts_are_cut_off_between_characters() {
        assert_eq!(&terminated::<8>("abc"), b"abc\0\0\0\0\0");
        assert_eq!(&terminated::<4>("abcd"), b"abc\0");
        assert_eq!(&terminated::<4>("ab\u{e4}"), b"ab\0\0");
        assert_eq!(&terminated::<6>("ab\0cd"), b"ab\0\0\0\0");
    }

    /// Lines as tests/layout.c prints them: struct, field, offset, and the struct's size.
    macro_rules! layout {
        ($($name:literal $of:ty { $($field:ident)* })*) => {
            [$($(format!("{}.{} {}", $name, stringify!($field), std::mem::offset_of!($of, $field)),)*
             format!("{} {}", $name, size_of::<$of>()),)*]
        };
    }

    #[test]
    fn the_header_lays_structs_out_as_this_file_does() {
        let own = layout! {
            "mrol_error" Error { code reserved reason message }
            "mrol_replica" ReplicaHandle { number }
            "mrol_map_version" MapVersion { map_uuid revision content_hash has_content_hash reserved }
            "mrol_replica_options" Options {
                struct_size address map key ca_file certificate_file private_key_file open_timeout_ms silence_timeout_ms
                blocks_max region_min_m region_max_m has_region with_filter without_viewpoints reserved age_max_ms
            }
            "mrol_point_query" PointQuery { struct_size xyz count map_from_points level lookup keep_out reserved }
            "mrol_answer" Answer { version asked positive reserved }
            "mrol_replica_status" Status { version head_revision resets is_connected has_ended reserved age_ms last_error }
            "mrol_client" ClientHandle { number }
            "mrol_credentials" CredentialFiles { key ca_file certificate_file private_key_file }
            "mrol_client_options" ClientOptions { struct_size address credentials timeout_ms }
            "mrol_scan" Scan { struct_size robot session scan_id xyz count guess motion gravity timestamp_ns point_times_s has_scan_id has_timestamp at_guess force reserved }
            "mrol_scan_answer" ScanOutcome { version map_from_sensor overlap information new_voxels carved_voxels points_skipped is_accepted is_replayed is_stationary has_information reserved verdict reason }
            "mrol_localization" Localization { struct_size xyz count gravity time_limit_ms seed }
            "mrol_localization_answer" Localized { map_from_sensor overlap agreement candidates is_accepted is_cut_short reserved verdict reason }
            "mrol_body" BodyHandle { number }
            "mrol_link" LinkParts { spheres spheres_count points points_count padding_m reserved }
            "mrol_region" RegionNumbers { kind reserved numbers }
            "mrol_scope" Scope { level ignore_keep_outs reserved }
            "mrol_pose_check" PoseCheck { struct_size scope body configurations count ignored ignored_count clearance_max_m unknown_is_occupied reserved }
            "mrol_sphere_check" SphereCheck { struct_size scope spheres count sizes groups ignored ignored_count padding_m clearance_max_m unknown_is_occupied reserved }
            "mrol_collisions" CollisionPlaces { struct_size capacity colliding hit_links hit_parts hit_voxels clearances_m nearest_links hit_keep_outs }
            "mrol_motion_check" MotionCheck { struct_size scope body configurations count lengths motions ignored ignored_count step_m clearance_max_m unknown_is_occupied reserved }
            "mrol_motion_answers" MotionPlaces { struct_size capacity is_free first_hits clearances_m }
            "mrol_ray_question" RayQuestion { struct_size scope origins origins_count directions ends count range_m unknown_is_occupied reserved }
            "mrol_ray_answers" RayPlaces { struct_size capacity hit distances_m voxels keep_outs }
            "mrol_nearest_question" NearestQuestion { struct_size scope points count radius_m to reserved }
            "mrol_nearest_answers" NearestPlaces { struct_size capacity found distances_m voxels away keep_outs }
            "mrol_classify_question" ClassifyQuestion { struct_size scope points count }
            "mrol_classify_answers" ClassifyPlaces { struct_size capacity is_occupied is_free }
            "mrol_frontier_question" FrontierQuestion { struct_size scope min_m max_m standoff_m size_min }
            "mrol_frontier" FrontierNumbers { voxels center_m min_m max_m view_m view_rotation target_m yaw_rad elevation_rad has_view reserved }
            "mrol_frontier_answers" FrontierPlaces { struct_size capacity frontiers }
            "mrol_grid_question" GridQuestion { struct_size scope area_min_m area_max_m min_z_m max_z_m cell_m has_area has_min_z has_max_z tell_unknown band_from reserved }
            "mrol_grid_shape" GridShape { cell_m origin_m cells floor_min_m floor_max_m }
            "mrol_grid_answers" GridPlaces { struct_size capacity shape occupied tops_m is_free }
        };
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
        let program = std::env::temp_dir().join(format!("mrol-layout-{}", std::process::id()));
        let compiled = std::process::Command::new("cc")
            .args([
                "-std=c99",
                "-Wall",
                "-Wextra",
                "-Werror",
                "-pedantic",
                "-Iinclude",
                "tests/layout.c",
                "-o",
            ])
            .arg(&program)
            .current_dir(folder)
            .status();
        assert!(compiled.unwrap().success());
        let said = std::process::Command::new(&program).output().unwrap().stdout;
        std::fs::remove_file(program).unwrap();
        assert_eq!(String::from_utf8(said).unwrap().lines().collect::<Vec<_>>(), own);
    }
}
