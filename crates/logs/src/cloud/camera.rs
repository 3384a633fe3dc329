//! How a camera projects what it sees: a pinhole.

use crate::message::CameraInfo;

/// How a camera projects what it sees: a pinhole, in pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// Rows of its images.
    pub height: u32,
    /// Pixels of a row.
    pub width: u32,
    /// Focal length along a row and along a column.
    pub focal: [f64; 2],
    /// Where the axis meets the image: column and row, 0 in the middle of the first pixel.
    pub center: [f64; 2],
}

/// Why it is not known how a camera projects what it sees.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum NoCamera {
    /// A camera that was not calibrated.
    #[error("its CameraInfo has the focal lengths {0} and {1}, which are none: is the camera calibrated?")]
    Focal(f64, f64),
    /// A lens that distorts, and images that may be distorted.
    #[error(
        "its CameraInfo says that the lens distorts (d), and the topic's name does not say that the images are rectified \
         (rect): let image_proc rectify them"
    )]
    Distorted,
}

impl Camera {
    /// The camera of images, which are rectified where their topic's name says so or the lens needs none of it.
    ///
    /// # Errors
    /// When it was not calibrated, or the images may be distorted.
    pub fn of(info: &CameraInfo, topic: &str) -> Result<Self, NoCamera> {
        let is_straight = info.distortion.iter().all(|&number| number == 0.0);
        if !is_straight && !topic.contains("rect") {
            return Err(NoCamera::Distorted);
        }
        let [k_x, _, k_cx, _, k_y, k_cy, ..] = info.intrinsics;
        let [p_x, _, p_cx, _, _, p_y, p_cy, ..] = info.projection;
        // Drivers of cameras without a calibration to rectify by leave out the projection.
        let [x, y, center_x, center_y] =
            if p_x == 0.0 { [k_x, k_y, k_cx, k_cy] } else { [p_x, p_y, p_cx, p_cy] };
        if ![x, y].iter().all(|focal| *focal > 0.0 && focal.is_finite()) {
            return Err(NoCamera::Focal(x, y));
        }
        Ok(Self { height: info.height, width: info.width, focal: [x, y], center: [center_x, center_y] })
    }
}
