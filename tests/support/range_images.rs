//! Range images of a few bytes.

use mrol::geometry::Point;
use mrol::visibility::{RangeImage, SeenRange};

/// What a scan saw that saw a wall `distance_m` ahead, through a small window.
pub fn through_a_window(distance_m: f32) -> RangeImage {
    // As many as the coarse pixels of so small an image need.
    let points: Vec<_> = (0..160).map(|i| Point::new(distance_m, 0.1 * (i % 4) as f32, 0.1)).collect();
    let range = SeenRange { min_m: 0.01, max_m: 1000.0 };
    RangeImage::of_points(&points, range, 100).unwrap()
}
