//! How a camera projects what it sees: a pinhole.

use crate::message::CameraInfo;
use mrol_map::scan::Intrinsics;

/// How a camera projects what it sees: a pinhole, in pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// Rows of its images.
    pub height: u32,
    /// Pixels of a row.
    pub width: u32,
    /// How a pixel and its depth are a point.
    pub intrinsics: Intrinsics,
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
    /// An image that is a part of what the camera sees, or coarser: how its pixels lie differs between drivers.
    #[error(
        "its CameraInfo says that images are a part of what the camera sees, or coarser (roi from {offset:?}, binning \
         {binning:?}): record whole images"
    )]
    Part {
        /// Column and row at which the images begin.
        offset: [u32; 2],
        /// Pixels that are one, along a row and along a column.
        binning: [u32; 2],
    },
    /// Numbers of images of another size.
    #[error(
        "its CameraInfo has images of {size:?} pixels, and the camera's axis meets them at {center:?}, outside of them: \
         are these the intrinsics of images of this size?"
    )]
    Center {
        /// Column and row where the axis meets the image.
        center: [f64; 2],
        /// Columns and rows.
        size: [u32; 2],
    },
    /// Pixels whose rows and columns are not square to each other.
    #[error("its CameraInfo has the skew {0}, and images without one are read: let image_proc rectify them")]
    Skew(f64),
}

impl Camera {
    /// The camera of images, which are rectified where their topic's name says so or the lens needs none of it.
    ///
    /// # Errors
    /// When it was not calibrated, or the images may be distorted, skewed or a part of what it sees.
    pub fn of(info: &CameraInfo, topic: &str) -> Result<Self, NoCamera> {
        let is_straight = info.distortion.iter().all(|&number| number == 0.0);
        if !is_straight && !topic.contains("rect") {
            return Err(NoCamera::Distorted);
        }
        let CameraInfo { offset, binning, .. } = *info;
        if offset != [0; 2] || binning.iter().any(|&pixels| pixels > 1) {
            return Err(NoCamera::Part { offset, binning });
        }
        let [k_x, k_skew, k_cx, _, k_y, k_cy, ..] = info.intrinsics;
        let [p_x, p_skew, p_cx, _, _, p_y, p_cy, ..] = info.projection;
        let (of_lens, of_rectified) = ([k_x, k_y, k_cx, k_cy, k_skew], [p_x, p_y, p_cx, p_cy, p_skew]);
        // Some drivers leave out one of the two.
        let [x, y, center_x, center_y, skew] = match topic.contains("rect") {
            true if p_x != 0.0 => of_rectified,
            false if k_x == 0.0 => of_rectified,
            _ => of_lens,
        };
        if skew != 0.0 {
            return Err(NoCamera::Skew(skew));
        }
        if ![x, y].iter().all(|focal| *focal > 0.0 && focal.is_finite()) {
            return Err(NoCamera::Focal(x, y));
        }
        let intrinsics = Intrinsics { focal: [x, y], center: [center_x, center_y] };
        let size = [info.width, info.height];
        match intrinsics.fits(size) {
            true => Ok(Self { height: info.height, width: info.width, intrinsics }),
            false => Err(NoCamera::Center { center: intrinsics.center, size }),
        }
    }
}
