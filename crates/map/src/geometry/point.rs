//! Points as they come over the wire.

use bytemuck::{Pod, Zeroable};

/// A point of three little-endian f32 (x, y, z in meters): the wire form *is* the memory form.
///
/// It has alignment 1, so that the bytes of a request, at whatever address the network left them, are a
/// `&[Point]` without a copy.
#[derive(Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub struct Point([[u8; 4]; 3]);

impl Point {
    /// Bytes of one point on the wire and in memory.
    pub const BYTES: usize = 12;

    /// The point (x, y, z), meters.
    #[inline]
    pub fn new(x: f32, y: f32, z: f32) -> Self {
        Self([x.to_le_bytes(), y.to_le_bytes(), z.to_le_bytes()])
    }

    /// The coordinates \[x, y, z\], meters.
    #[inline]
    pub fn xyz(self) -> [f32; 3] {
        self.0.map(f32::from_le_bytes)
    }

    /// True when no coordinate is NaN or infinite. Depth cameras use NaN for "no return".
    #[inline]
    pub fn is_finite(self) -> bool {
        self.xyz().iter().all(|c| c.is_finite())
    }

    /// The point in double precision.
    #[inline]
    pub fn to_f64(self) -> nalgebra::Point3<f64> {
        self.xyz().map(f64::from).into()
    }
}

impl From<[f32; 3]> for Point {
    #[inline]
    fn from([x, y, z]: [f32; 3]) -> Self {
        Self::new(x, y, z)
    }
}

impl From<nalgebra::Point3<f64>> for Point {
    fn from(p: nalgebra::Point3<f64>) -> Self {
        Self::new(p.x as f32, p.y as f32, p.z as f32)
    }
}

impl std::fmt::Debug for Point {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [x, y, z] = self.xyz();
        write!(f, "({x}, {y}, {z})")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_at_any_address_are_points() {
        let mut bytes = vec![0u8];
        bytes.extend([1.5f32, -2.0, 3.25].iter().flat_map(|c| c.to_le_bytes()));
        let points: &[Point] = bytemuck::cast_slice(&bytes[1..]);
        assert_eq!(points, &[Point::new(1.5, -2.0, 3.25)]);
    }
}
