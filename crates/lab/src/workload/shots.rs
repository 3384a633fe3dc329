//! Rays from many places, each looking about.

use std::f64::consts::TAU;

use nalgebra::{Point3, Vector3};

use mrol_map::geometry::{Point, Pose, translation_m};

/// All directions from straight down to straight up, degrees.
pub(super) const EVERYWHERE_DEG: (f64, f64) = (-90.0, 90.0);

/// Revolutions of the sensor from place to place.
const TURNS_APART: usize = 5;

/// How many rays there are, and how they are laid out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ShotLayout {
    /// Number of places.
    pub places: usize,
    /// Number of azimuths at each place.
    pub azimuths: usize,
    /// Number of elevations at each azimuth.
    pub rings: usize,
}

/// Rays in the map frame: place after place, azimuth after azimuth, ring after ring.
#[derive(Debug, Clone, PartialEq)]
pub struct Shots {
    /// Where each begins, meters.
    pub origins: Vec<Point>,
    /// The unit vector along which each leads.
    pub directions: Vec<Point>,
}

impl Shots {
    /// The rays of a layout between two elevations, from the poses of the sensor in its revolutions.
    pub(super) fn of(layout: ShotLayout, elevation_deg: (f64, f64), sensor: impl Fn(usize) -> Pose) -> Self {
        let ShotLayout { places, azimuths, rings } = layout;
        let rays = azimuths * rings;
        let mut shots = Self {
            origins: Vec::with_capacity(places * rays),
            directions: Vec::with_capacity(places * rays),
        };
        for map_from_sensor in (0..places).map(|place| sensor(place * TURNS_APART)) {
            let origin = Point::from(Point3::from(translation_m(&map_from_sensor)));
            for ray in 0..rays {
                let [azimuth, ring] = [ray / rings, ray % rings].map(|i| i as f64 + 0.5);
                let azimuth = azimuth / azimuths as f64 * TAU;
                let elevation = elevation_deg.0 + (elevation_deg.1 - elevation_deg.0) * ring / rings as f64;
                let direction = map_from_sensor.rotation * unit_vector(azimuth, elevation.to_radians());
                shots.origins.push(origin);
                shots.directions.push(Point::from(Point3::from(direction)));
            }
        }
        shots
    }
}

fn unit_vector(azimuth: f64, elevation: f64) -> Vector3<f64> {
    let ((sin, cos), (up, along)) = (azimuth.sin_cos(), elevation.sin_cos());
    Vector3::new(cos * along, sin * along, up)
}
