//! Orientations: the rotations that a search considers.

use std::collections::BTreeSet;
use std::f64::consts::PI;

use nalgebra::{UnitQuaternion, UnitVector3, Vector3};

use super::dilated::DilatedLevels;
use super::normals::{SURFACES_MAX, dominant_normals};
use super::settings::LocalizationSettings;
use super::supervision::{Unbuilt, check};
use crate::align::gravity::Gravity;
use crate::geometry::Point;
use crate::util::StopSignal;
use crate::voxel::{Cell, Lattice, VoxelKey, VoxelSet};

/// A family of rotations: an axis of the sensor points, up to a tilt, along an axis of the map, and the sensor
/// is turned about it by any angle.
///
/// With z for the common axis, map_from_sensor = map_from_z * Rz(yaw) * exp(tilt_x, tilt_y, 0) * z_from_sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Orientation {
    map_from_z: UnitQuaternion<f64>,
    z_from_sensor: UnitQuaternion<f64>,
}

impl Orientation {
    /// All rotations that turn the direction `sensor` (sensor frame) to within the tilt tolerance of `map` (map frame).
    pub(super) fn bringing(sensor: UnitVector3<f64>, map: UnitVector3<f64>) -> Self {
        let to_z = |axis: UnitVector3<f64>| {
            // Between opposite vectors any perpendicular axis will do.
            UnitQuaternion::rotation_between_axis(&axis, &Vector3::z_axis())
                .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI))
        };
        Self { map_from_z: to_z(map).inverse(), z_from_sensor: to_z(sensor) }
    }

    /// The rotation at a yaw and a tilt, radians.
    pub(super) fn turned(&self, yaw: f64, [tilt_x, tilt_y]: [f64; 2]) -> UnitQuaternion<f64> {
        self.map_from_z
            * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw)
            * UnitQuaternion::from_scaled_axis(Vector3::new(tilt_x, tilt_y, 0.0))
            * self.z_from_sensor
    }
}

/// The families of a search.
#[derive(Debug)]
pub(super) struct Orientations {
    pub(super) families: Vec<Orientation>,
    /// Tolerance of the common axis, each way in x and y, radians.
    pub(super) tilt_max_rad: f64,
    /// True when the families certainly contain the scan's rotation.
    pub(super) all: bool,
}

/// Number of dominant normals of the map that are tried; most maps have a floor and a wall.
const MAP_DIRECTIONS: usize = 2;
/// Number of dominant normals of the scan that are tried; most scans have no more.
const SCAN_DIRECTIONS: usize = 4;
/// Points of a scan that are quantized between two checks of the stop signal.
const POINTS_PER_STOP_CHECK: usize = 16 << 10;

impl Orientations {
    /// The families of a search: one about the direction of gravity where it is known. Otherwise those that bring one
    /// of the scan's dominant surfaces parallel to one of the map's, either way round; then the search is not
    /// exhaustive.
    pub(super) fn of(
        points: &[Point],
        levels: &DilatedLevels,
        gravity: Option<&Gravity>,
        settings: &LocalizationSettings,
        stop: StopSignal<'_>,
    ) -> Result<Self, Unbuilt> {
        if let Some(gravity) = gravity {
            return Ok(Self {
                families: vec![Orientation::bringing(gravity.in_sensor, gravity.in_map)],
                tilt_max_rad: settings.gravity_tolerance_deg.to_radians(),
                all: true,
            });
        }
        let field = levels.finest();
        let some = field.some_occupied(SURFACES_MAX, stop)?;
        let of_map = dominant_normals(&some, &|voxel| field.is_occupied(voxel), MAP_DIRECTIONS, stop)?;
        let voxels = voxels_of(points, field.resolution_m(), stop)?;
        let stride = voxels.len().div_ceil(SURFACES_MAX).max(1);
        let some: Vec<VoxelKey> =
            voxels.iter().step_by(stride).map(|(block, cell)| cell.voxel(*block)).collect();
        let is_seen = |voxel: VoxelKey| voxels.contains(&Cell::of(voxel.index()));
        let of_scan = dominant_normals(&some, &is_seen, SCAN_DIRECTIONS, stop)?;
        let either_way = |map: UnitVector3<f64>| {
            of_scan.iter().flat_map(move |scan| [*scan, -*scan].map(|scan| Orientation::bringing(scan, map)))
        };
        Ok(Self {
            families: of_map.into_iter().flat_map(either_way).collect(),
            tilt_max_rad: settings.surface_tolerance_deg.to_radians(),
            all: false,
        })
    }
}

/// The voxels of a scan in its own frame, block by block. Above the lattice's coarsest resolution the result is empty.
fn voxels_of(
    points: &[Point],
    resolution_m: f64,
    stop: StopSignal<'_>,
) -> Result<BTreeSet<(VoxelKey, Cell)>, Unbuilt> {
    let mut voxels = BTreeSet::new();
    let Ok(lattice) = Lattice::new(resolution_m, 1) else { return Ok(voxels) };
    for points in points.chunks(POINTS_PER_STOP_CHECK) {
        check(stop)?;
        let some = VoxelSet::of_points(points, &lattice.from_map()).0;
        voxels.extend(some.iter().map(|voxel| Cell::of(voxel.index())));
    }
    Ok(voxels)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_untilted_rotation_brings_the_axes_together_at_any_yaw() {
        let axes =
            [Vector3::z_axis(), -Vector3::z_axis(), UnitVector3::new_normalize(Vector3::new(1.0, 2.0, -3.0))];
        for (sensor, map) in axes.into_iter().flat_map(|a| axes.map(|b| (a, b))) {
            let orientation = Orientation::bringing(sensor, map);
            for yaw in [0.0, 1.0, 4.0] {
                assert!((orientation.turned(yaw, [0.0; 2]) * sensor).angle(&map) < 1e-6);
                let tilted = orientation.turned(yaw, [0.03, -0.04]) * sensor;
                assert!((tilted.angle(&map) - 0.05).abs() < 1e-6);
            }
        }
    }
}
