//! Intrinsics of a camera: from a pixel and its depth to a point.

use std::str::FromStr;

use nalgebra::Point3;

/// The intrinsics of a pinhole camera, pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Intrinsics {
    /// Focal length along a row and along a column.
    pub focal: [f64; 2],
    /// Where the optical axis meets the image: column and row, 0 in the middle of the first pixel.
    pub center: [f64; 2],
}

/// A text that has no intrinsics.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "must be \"fx fy cx cy\", four numbers of pixels, finite and the focal lengths not 0, such as \"525 525 319.5 239.5\""
)]
pub struct IntrinsicsError;

impl Intrinsics {
    /// What a pixel sees whose depth along the optical axis is `depth_m`, meters, in the camera's frame: x right,
    /// y down, z ahead.
    pub fn point(&self, column: usize, row: usize, depth_m: f64) -> Point3<f64> {
        let Self { focal: [fx, fy], center: [cx, cy] } = *self;
        Point3::new((column as f64 - cx) / fx * depth_m, (row as f64 - cy) / fy * depth_m, depth_m)
    }
}

impl Intrinsics {
    /// True where the optical axis meets an image of so many columns and rows: those of other sizes have other
    /// intrinsics.
    pub fn fits(&self, size: [u32; 2]) -> bool {
        let is_within = |(center, size): (&f64, u32)| (-0.5..=f64::from(size) - 0.5).contains(center);
        self.center.iter().zip(size).all(is_within)
    }
}

impl FromStr for Intrinsics {
    type Err = IntrinsicsError;

    /// Reads `fx fy cx cy`. A negative focal length mirrors, as that of ICL-NUIM's images does.
    fn from_str(text: &str) -> Result<Self, IntrinsicsError> {
        let words = text.split([' ', ',']).filter(|word| !word.is_empty());
        let numbers: Vec<f64> =
            words.map(str::parse).collect::<Result<_, _>>().map_err(|_| IntrinsicsError)?;
        let is_focal = |focal: f64| focal.is_normal();
        match numbers[..] {
            [fx, fy, cx, cy] if is_focal(fx) && is_focal(fy) && cx.is_finite() && cy.is_finite() => {
                Ok(Self { focal: [fx, fy], center: [cx, cy] })
            }
            _ => Err(IntrinsicsError),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pixel_and_its_depth_are_a_point() {
        let camera: Intrinsics = "500 -250, 319.5 239.5".parse().unwrap();
        assert_eq!(camera.point(319, 239, 2.0), Point3::new(-0.002, 0.004, 2.0));
        assert_eq!(camera.point(569, 0, 2.0).x, 0.998);
        assert!(camera.fits([640, 480]) && camera.fits([320, 240]));
        assert!(!camera.fits([319, 480]) && !camera.fits([640, 239]));
    }

    #[test]
    fn what_is_no_camera_is_refused() {
        for none in [
            "",
            "500 500 320",
            "0 500 320 240",
            "500 500 320 240 1",
            "a 500 320 240",
            "inf 1 1 1",
            "1 1 nan 1",
        ] {
            assert_eq!(none.parse::<Intrinsics>(), Err(IntrinsicsError), "{none}");
        }
    }
}
