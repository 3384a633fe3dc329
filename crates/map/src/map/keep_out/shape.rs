//! The space that a keep-out takes.

use super::prism::{Prism, PrismError, is_near};
use crate::geometry::{rotation_xyzw, translation_m};
use crate::map::regions::{REGION_M_MAX, Region, RegionError};
use crate::util::Digest;

/// The space that a keep-out takes, in the map frame; borders belong to it. It is bounded.
#[derive(Debug, Clone, PartialEq)]
pub enum KeepOutShape {
    /// A box, an oriented box or a sphere.
    Region(Region),
    /// A polygon with a height.
    Prism(Prism),
}

/// Why numbers are not the shape of a keep-out.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum KeepOutShapeError {
    /// Not a region.
    #[error(transparent)]
    Region(#[from] RegionError),
    /// Not a prism.
    #[error(transparent)]
    Prism(#[from] PrismError),
    /// A box that goes on for ever, or as far as no map does.
    #[error(
        "the box of a keep-out must lie within {REGION_M_MAX:e} m, got {0:?} to {1:?}: no map goes as far"
    )]
    TooFar([f64; 3], [f64; 3]),
}

impl KeepOutShape {
    /// The shape of a region.
    ///
    /// # Errors
    /// For a box that reaches beyond [`REGION_M_MAX`].
    pub fn of_region(region: Region) -> Result<Self, KeepOutShapeError> {
        match region {
            Region::Box { min_m, max_m } if !min_m.into_iter().chain(max_m).all(is_near) => {
                Err(KeepOutShapeError::TooFar(min_m, max_m))
            }
            bounded => Ok(Self::Region(bounded)),
        }
    }

    /// True when the point lies inside or on the border.
    pub fn contains(&self, point_m: [f64; 3]) -> bool {
        match self {
            Self::Region(region) => region.contains(point_m),
            Self::Prism(prism) => prism.contains(point_m),
        }
    }

    /// How far the point lies from the shape, meters; 0 inside.
    pub fn distance_m(&self, point_m: [f64; 3]) -> f64 {
        match self {
            Self::Region(region) => region.distance_m(point_m),
            Self::Prism(prism) => prism.distance_m(point_m),
        }
    }

    /// The smallest box around it: (smallest, largest) coordinates, meters.
    pub fn bounds_m(&self) -> ([f64; 3], [f64; 3]) {
        match self {
            Self::Region(region) => region.bounds_m(),
            Self::Prism(prism) => prism.bounds_m(),
        }
    }

    /// A hash with all numbers of the shape, and of which kind it is.
    pub(super) fn add_to(&self, digest: Digest) -> Digest {
        match self {
            Self::Region(Region::Box { min_m, max_m }) => digest.word(1).numbers(min_m).numbers(max_m),
            Self::Region(Region::Sphere { center_m, radius_m }) => {
                digest.word(2).numbers(center_m).number(*radius_m)
            }
            Self::Region(Region::OrientedBox(of)) => {
                let placed = of.map_from_box();
                let digest = digest.word(3).numbers(&translation_m(placed)).numbers(&rotation_xyzw(placed));
                digest.numbers(&of.size_m())
            }
            Self::Prism(prism) => {
                let corners = prism.corners_m();
                let digest = digest.word(4).numbers(&prism.z_m()).word(corners.len() as u64);
                digest.numbers(corners.as_flattened())
            }
        }
    }

    /// The corners that were named, of a prism.
    pub fn corners(&self) -> usize {
        match self {
            Self::Region(_) => 0,
            Self::Prism(prism) => prism.corners_m().len(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_keep_out_is_bounded() {
        let of = |min_m, max_m| KeepOutShape::of_region(Region::cuboid(min_m, max_m).unwrap());
        assert!(of([-1e12; 3], [1e12; 3]).is_ok());
        for far in [f64::INFINITY, 1.1e12, f64::MAX] {
            let error = of([0.0; 3], [1.0, far, 1.0]).unwrap_err();
            assert!(error.to_string().contains("must lie within 1e12 m"), "{error}");
            assert!(of([-far, 0.0, 0.0], [1.0; 3]).is_err());
        }
        assert!(KeepOutShape::of_region(Region::ball([0.0; 3], 1e12).unwrap()).is_ok());
    }
}
