//! Points of a request.

use bytes::Bytes;

use crate::error::{Reason, ServiceError};
use mrol_map::geometry::Point;

/// Points as they came from the wire: 12 bytes each, shared, never copied.
#[derive(Clone, PartialEq, Eq, Default)]
pub struct PointCloud(Bytes);

impl PointCloud {
    /// Points from little-endian f32 x y z.
    ///
    /// # Errors
    /// When the bytes are not a whole number of points.
    pub fn from_bytes(bytes: Bytes) -> Result<Self, ServiceError> {
        if !bytes.len().is_multiple_of(Point::BYTES) {
            let message = format!(
                "points must be a whole number of {}-byte points (x y z, little-endian f32), got {} bytes",
                Point::BYTES,
                bytes.len()
            );
            return Err(ServiceError::new(Reason::TruncatedPoints, message));
        }
        Ok(Self(bytes))
    }

    /// The points.
    pub fn as_slice(&self) -> &[Point] {
        bytemuck::cast_slice(&self.0)
    }

    /// The points' bytes, shared.
    pub fn into_bytes(self) -> Bytes {
        self.0
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.0.len() / Point::BYTES
    }

    /// True without a point.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

impl From<Vec<Point>> for PointCloud {
    fn from(points: Vec<Point>) -> Self {
        struct Owner(Vec<Point>);
        impl AsRef<[u8]> for Owner {
            fn as_ref(&self) -> &[u8] {
                bytemuck::cast_slice(&self.0)
            }
        }
        Self(Bytes::from_owner(Owner(points)))
    }
}

impl std::fmt::Debug for PointCloud {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} points", self.len())
    }
}
