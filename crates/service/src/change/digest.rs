//! What tells one request from another under the same id.

use sha2::{Digest as _, Sha256};

use mrol_map::geometry::{rotation_xyzw, translation_m};
use mrol_map::map::Region;

/// The beginning of the SHA-256 hash of what was asked for. A checksum would not do: with one it takes a few equations
/// to make a request that another is then mistaken for. Every field has its length before it.
#[derive(Debug, Clone)]
pub(super) struct Digest(Sha256);

impl Digest {
    /// The digest of a request of that kind, with none of its fields yet.
    pub(super) fn new(kind: &str) -> Self {
        Self(Sha256::new()).bytes(kind.as_bytes())
    }

    pub(super) fn bytes(mut self, bytes: &[u8]) -> Self {
        self.0.update((bytes.len() as u64).to_le_bytes());
        self.0.update(bytes);
        self
    }

    pub(super) fn number(self, number: u64) -> Self {
        self.bytes(&number.to_le_bytes())
    }

    pub(super) fn numbers(self, numbers: &[f64]) -> Self {
        numbers.iter().fold(self, |digest, number| digest.number(number.to_bits()))
    }

    pub(super) fn region(self, region: &Region) -> Self {
        match region {
            Region::Box { min_m, max_m } => self.bytes(b"box").numbers(min_m).numbers(max_m),
            Region::Sphere { center_m, radius_m } => {
                self.bytes(b"sphere").numbers(center_m).numbers(&[*radius_m])
            }
            Region::OrientedBox(of) => {
                let (pose, size_m) = (of.map_from_box(), of.size_m());
                let digest = self.bytes(b"oriented_box").numbers(&translation_m(pose));
                digest.numbers(&one_of_two(rotation_xyzw(pose))).numbers(&size_m)
            }
        }
    }

    /// The first eight bytes of the hash.
    pub(super) fn finish(self) -> u64 {
        let hash = self.0.finalize();
        u64::from_le_bytes(std::array::from_fn(|i| hash[i]))
    }
}

/// Of the two quaternions that are one rotation, that whose last number that is not zero is positive.
fn one_of_two(xyzw: [f64; 4]) -> [f64; 4] {
    let last = xyzw.into_iter().rev().find(|number| *number != 0.0).unwrap_or_default();
    // Adding zero makes 0 of -0.
    xyzw.map(|number| number * last.signum() + 0.0)
}

/// What data folders of version 3 and before have in its place: a checksum and the number of bytes. A request that was
/// answered then is still known by it; none is answered under it any more.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct FormerDigest {
    checksum: u32,
    bytes: u32,
}

impl FormerDigest {
    pub(super) fn bytes(self, bytes: &[u8]) -> Self {
        let length = self.bytes.wrapping_add(bytes.len() as u32);
        Self { checksum: crc32c::crc32c_append(self.checksum, bytes), bytes: length }
    }

    pub(super) fn number(self, number: u64) -> Self {
        self.bytes(&number.to_le_bytes())
    }

    pub(super) fn numbers(self, numbers: &[f64]) -> Self {
        numbers.iter().fold(self, |digest, number| digest.number(number.to_bits()))
    }

    pub(super) fn finish(self) -> u64 {
        u64::from(self.bytes) << 32 | u64::from(self.checksum)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rotation_is_the_same_whichever_of_its_two_quaternions_says_it() {
        let of = |xyzw: [f64; 4]| {
            let pose = mrol_map::geometry::pose([1.0, 2.0, 3.0], xyzw).unwrap();
            let region = Region::oriented_box(pose, [1.0, 2.0, 3.0]).unwrap();
            Digest::new("deletion").region(&region).finish()
        };
        assert_eq!(of([0.0, 0.6, 0.0, 0.8]), of([0.0, -0.6, 0.0, -0.8]));
        assert_eq!(of([0.0, 0.0, 1.0, 0.0]), of([0.0, 0.0, -1.0, -0.0]));
        assert_ne!(of([0.0, 0.6, 0.0, 0.8]), of([0.0, -0.6, 0.0, 0.8]));
    }

    #[test]
    fn fields_are_told_apart_by_their_kind_and_their_borders() {
        let of = |kind: &str, fields: &[&[u8]]| {
            fields.iter().fold(Digest::new(kind), |digest, field| digest.bytes(field)).finish()
        };
        assert_eq!(of("undo", &[b"ab", b"c"]), of("undo", &[b"ab", b"c"]));
        assert_ne!(of("undo", &[b"ab", b"c"]), of("undo", &[b"a", b"bc"]));
        assert_ne!(of("undo", &[b"ab"]), of("deletion", &[b"ab"]));
    }
}
