//! Directions as pixels of a cube around the sensor: what every other room counts in.

mod cube_map;
mod vectors;

pub(super) use cube_map::{CubeMap, FACES, Pixel, Projection, TILE_SIDE};
pub(super) use vectors::{across, between, distance, dot, norm};
