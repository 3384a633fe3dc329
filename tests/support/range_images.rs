//! Range images of a few bytes.

use mrol::geometry::Point;
use mrol::visibility::{RangeImage, Sweep};

/// What a scan saw that saw a wall `distance_m` ahead, through a small window.
pub fn through_a_window(distance_m: f32) -> RangeImage {
    // As close to each other as the coarse pixels of so small an image need.
    let at = |i: usize| 0.01 * i as f32 * distance_m;
    let points: Vec<_> = (0..160).map(|i| Point::new(distance_m, at(i % 16), at(i / 16))).collect();
    RangeImage::of_points(&points, Sweep::standing(1000.0), 100).unwrap()
}
