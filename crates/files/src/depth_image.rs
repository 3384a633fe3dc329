//! Depth images as PNG files, as the RGB-D sets of TUM and ICL-NUIM have them: a scan each.

use std::io::{self, BufReader};
use std::path::Path;

use nalgebra::Point3;
use png::{BitDepth, ColorType, DecodingError};

use crate::regular_file::open_regular;
use mrol_map::scan::Intrinsics;

/// Most pixels of an image, more than 3840 x 2160.
const PIXELS_MAX: u64 = 1 << 23;
/// Bytes of a pixel.
const PIXEL_BYTES: usize = 2;
/// Most bytes that the decoder may hold beside the image: a few rows.
const DECODER_BYTES_MAX: usize = 64 << 20;

/// How a PNG of depths is read: the camera, and what its numbers are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DepthImages {
    /// How a pixel and its depth are a point.
    pub intrinsics: Intrinsics,
    /// Steps of a meter: 1000 of depths in millimeters, 5000 in the sets of TUM and ICL-NUIM.
    pub steps_per_m: f64,
}

/// Why a depth image cannot be read; whoever has the file's name puts it before the message.
#[derive(Debug, thiserror::Error)]
pub enum DepthImageError {
    /// The file cannot be read.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// The file is no PNG, or was damaged.
    #[error("no PNG that can be read: {0}")]
    Content(DecodingError),
    /// The image has no depths, such as the colors beside them.
    #[error(
        "a depth image has one channel of 16 bits a pixel, and this one has {channels} of {bits}: is it a color image?"
    )]
    NoDepths {
        /// Channels of a pixel.
        channels: usize,
        /// Bits of a channel.
        bits: u8,
    },
    /// The image is not one of this camera.
    #[error(
        "an image of {width} x {height} pixels, and the camera's axis meets it at {:?}, outside of it: are these the \
         intrinsics of images of this size?",
        center
    )]
    OtherCamera {
        /// Pixels of a row.
        width: u32,
        /// Rows.
        height: u32,
        /// Column and row where the axis meets the image.
        center: [f64; 2],
    },
    /// The image is larger than a camera's.
    #[error("{width} x {height} pixels, at most {PIXELS_MAX} are read")]
    TooLarge {
        /// Pixels of a row.
        width: u32,
        /// Rows.
        height: u32,
    },
}

impl DepthImages {
    /// What the pixels of the PNG file at `path` met, row by row, in the camera's frame (x right, y down, z ahead),
    /// meters. Depths are along z; a depth of 0 says that there is none, and gives the point 0 0 0, which says that
    /// nothing returned.
    ///
    /// # Errors
    /// When the file cannot be read, is damaged, is too large, or has no depths.
    pub fn read(&self, path: &Path) -> Result<Vec<Point3<f64>>, DepthImageError> {
        let limits = png::Limits { bytes: DECODER_BYTES_MAX };
        let decoder = png::Decoder::new_with_limits(BufReader::new(open_regular(path)?.0), limits);
        let mut image = decoder.read_info()?;
        let (color, depth) = image.output_color_type();
        if (color, depth) != (ColorType::Grayscale, BitDepth::Sixteen) {
            return Err(DepthImageError::NoDepths { channels: color.samples(), bits: depth as u8 });
        }
        let (width, height) = image.info().size();
        if u64::from(width) * u64::from(height) > PIXELS_MAX {
            return Err(DepthImageError::TooLarge { width, height });
        }
        if !self.intrinsics.fits([width, height]) {
            return Err(DepthImageError::OtherCamera { width, height, center: self.intrinsics.center });
        }
        let mut bytes = vec![0; width as usize * height as usize * PIXEL_BYTES];
        image.next_frame(&mut bytes)?;
        let rows = bytes.chunks_exact(width as usize * PIXEL_BYTES).enumerate();
        Ok(rows.flat_map(|(v, row)| self.points_of_row(v, row)).collect())
    }

    fn points_of_row(self, row: usize, pixels: &[u8]) -> impl Iterator<Item = Point3<f64>> {
        let (pixels, _) = pixels.as_chunks::<PIXEL_BYTES>();
        pixels.iter().enumerate().map(move |(column, &pixel)| {
            let depth_m = f64::from(u16::from_be_bytes(pixel)) / self.steps_per_m;
            self.intrinsics.point(column, row, depth_m)
        })
    }
}

impl From<DecodingError> for DepthImageError {
    fn from(error: DecodingError) -> Self {
        match error {
            DecodingError::IoError(error) if error.kind() != io::ErrorKind::UnexpectedEof => Self::Io(error),
            error => Self::Content(error),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TUM: DepthImages =
        DepthImages { intrinsics: Intrinsics { focal: [525.0; 2], center: [0.5, 0.5] }, steps_per_m: 5000.0 };

    fn written(color: ColorType, depth: BitDepth, size: [u32; 2], pixels: &[u8]) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, size[0], size[1]);
        encoder.set_color(color);
        encoder.set_depth(depth);
        encoder.write_header().unwrap().write_image_data(pixels).unwrap();
        bytes
    }

    fn read(bytes: &[u8]) -> Result<Vec<Point3<f64>>, DepthImageError> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("depth.png");
        std::fs::write(&path, bytes).unwrap();
        TUM.read(&path)
    }

    fn three_by_two() -> Vec<u8> {
        let depths: Vec<u8> =
            [5000_u16, 10_000, 0, 2625, 5250, 65_535].iter().flat_map(|d| d.to_be_bytes()).collect();
        written(ColorType::Grayscale, BitDepth::Sixteen, [3, 2], &depths)
    }

    #[test]
    fn pixels_are_points_row_by_row_and_no_depth_is_no_return() {
        let points = read(&three_by_two()).unwrap();
        assert_eq!(points.len(), 6);
        assert_eq!(points[0], Point3::new(-0.5 / 525.0, -0.5 / 525.0, 1.0));
        assert_eq!(points[2], Point3::origin());
        assert_eq!(points[4], Point3::new(0.5 / 525.0 * 1.05, 0.5 / 525.0 * 1.05, 1.05));
        assert_eq!(points[5].z, 13.107);
    }

    #[test]
    fn what_is_no_depth_image_is_refused_in_words() {
        let refused = |bytes: &[u8]| read(bytes).unwrap_err().to_string();
        let color = refused(&written(ColorType::Rgb, BitDepth::Eight, [1, 1], &[1, 2, 3]));
        assert!(color.contains("3 of 8") && color.contains("color image"), "{color}");
        let shades = refused(&written(ColorType::Grayscale, BitDepth::Eight, [1, 1], &[1]));
        assert!(shades.contains("1 of 8"), "{shades}");
        assert!(refused(b"").contains("no PNG"), "{}", refused(b""));
        assert!(refused(b"ply\n").contains("no PNG"));
        let large = written(ColorType::Grayscale, BitDepth::Sixteen, [4096, 2049], &vec![0; 4096 * 2049 * 2]);
        let other = DepthImages { intrinsics: Intrinsics { focal: [525.0; 2], center: [319.5, 1.0] }, ..TUM };
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("depth.png");
        std::fs::write(&path, three_by_two()).unwrap();
        let told = other.read(&path).unwrap_err().to_string();
        assert!(told.contains("3 x 2 pixels") && told.contains("[319.5, 1.0], outside"), "{told}");
        assert!(refused(&large).contains("4096 x 2049 pixels, at most 8388608"));
    }

    #[test]
    fn a_damaged_image_is_an_error_or_the_same() {
        let whole = three_by_two();
        let expected = read(&whole).unwrap();
        for k in 0..whole.len() {
            assert!(read(&whole[..k]).is_err() || k >= whole.len() - 12, "cut at {k}");
            let mut flipped = whole.clone();
            flipped[k] ^= 0x40;
            if let Ok(points) = read(&flipped) {
                assert_eq!(points, expected, "byte {k}");
            }
        }
    }
}
