//! Clouds of depth images.

use super::camera::Camera;
use super::error::CloudError;
use super::raw_cloud::{Cloud, check_points};
use crate::message::Image;
use mrol_map::geometry::Point;
use mrol_map::util::excerpt;

/// Meters of a step of a depth in whole numbers (REP 118).
const STEP_M: f64 = 1e-3;

/// What a pixel of a depth image is (REP 118).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Depth {
    /// Millimeters, 0 where there is none.
    Millimeters,
    /// Meters, NaN where there is none.
    Meters,
}

impl Depth {
    fn of_encoding(encoding: &str) -> Option<Self> {
        match encoding {
            "16UC1" | "mono16" => Some(Self::Millimeters),
            "32FC1" => Some(Self::Meters),
            _ => None,
        }
    }

    fn bytes(self) -> usize {
        match self {
            Self::Millimeters => 2,
            Self::Meters => 4,
        }
    }

    /// The depth of a pixel, meters; NaN where there is none.
    fn read(self, pixel: &[u8], is_big_endian: bool) -> f64 {
        match (self, pixel) {
            (Self::Millimeters, &[a, b, ..]) => {
                let steps =
                    if is_big_endian { u16::from_be_bytes([a, b]) } else { u16::from_le_bytes([a, b]) };
                if steps == 0 { f64::NAN } else { f64::from(steps) * STEP_M }
            }
            (Self::Meters, &[a, b, c, d, ..]) => {
                let bytes = [a, b, c, d];
                let depth_m =
                    if is_big_endian { f32::from_be_bytes(bytes) } else { f32::from_le_bytes(bytes) };
                if depth_m > 0.0 { f64::from(depth_m) } else { f64::NAN }
            }
            _ => f64::NAN,
        }
    }
}

/// True of an encoding of depths.
pub(crate) fn is_depth(encoding: &str) -> bool {
    Depth::of_encoding(encoding).is_some()
}

impl Cloud {
    /// What the pixels of a depth image met, row by row; not finite where nothing returned.
    ///
    /// # Errors
    /// When its pixels are no depths, its size is not that of the camera, its rows do not lie within its data, or it
    /// has more than [`POINTS_MAX`](super::POINTS_MAX) pixels.
    pub(super) fn of_depth_image(image: &Image<'_>, camera: &Camera) -> Result<Self, CloudError> {
        let depth = Depth::of_encoding(image.encoding)
            .ok_or_else(|| CloudError::Encoding(excerpt(image.encoding)))?;
        let &Image { height, width, step, data, .. } = image;
        if [height, width] != [camera.height, camera.width] {
            let camera = [camera.width, camera.height];
            return Err(CloudError::OtherCamera { image: [width, height], camera });
        }
        let (pixel_bytes, row_bytes) = (depth.bytes(), width as usize * depth.bytes());
        let needed = u128::from(height.saturating_sub(1)) * u128::from(step) + row_bytes as u128;
        if (step as usize) < row_bytes || needed > data.len() as u128 {
            return Err(CloudError::DataShort { height, width, needed, len: data.len() });
        }
        check_points(height as usize * width as usize)?;
        let mut points = Vec::with_capacity(height as usize * width as usize);
        for (v, row) in data.chunks(step.max(1) as usize).take(height as usize).enumerate() {
            let pixels = row[..row_bytes].chunks_exact(pixel_bytes).enumerate();
            points.extend(pixels.map(|(u, pixel)| {
                let depth_m = depth.read(pixel, image.is_big_endian);
                Point::from(camera.intrinsics.point(u, v, depth_m))
            }));
        }
        let frame = image.header.frame.to_owned();
        Ok(Self { stamp_ns: image.header.stamp_ns, frame, points, times: None, rings: Vec::new() })
    }
}
