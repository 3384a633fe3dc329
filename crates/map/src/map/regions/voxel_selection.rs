//! Which voxels of a level somebody asks for.

use super::cell_box::CellBox;
use super::frustum::Frustum;
use super::region::Region;
use crate::voxel::Lattice;

/// Voxels by where their centers lie: in all that is given here, everywhere where nothing is.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct VoxelSelection {
    /// A part of space.
    pub region: Option<Region>,
    /// What a camera sees.
    pub view: Option<Frustum>,
}

impl From<Option<Region>> for VoxelSelection {
    fn from(region: Option<Region>) -> Self {
        Self { region, view: None }
    }
}

impl VoxelSelection {
    /// True of all voxels.
    pub fn is_everything(&self) -> bool {
        self.region.is_none() && self.view.is_none()
    }

    /// True of voxels with this center (map frame, meters).
    pub fn contains(&self, center_m: [f64; 3]) -> bool {
        self.region.is_none_or(|region| region.contains(center_m))
            && self.view.is_none_or(|view| view.contains(center_m))
    }

    /// The cells of `level` that can be among them; none where that is all of them.
    pub fn cells(&self, lattice: &Lattice, level: u32) -> Option<CellBox> {
        let (min_m, max_m) = self.bounds_m();
        (!self.is_everything()).then(|| CellBox::of_centers(min_m, max_m, lattice, level))
    }

    /// False only when no voxel within `radius_m` of `center_m` is among them. What the bounds say is not looked at
    /// again.
    pub(in crate::map) fn may_meet(&self, center_m: [f64; 3], radius_m: f64) -> bool {
        self.view.is_none_or(|view| view.may_meet(center_m, radius_m))
    }

    /// A box around them: (smallest, largest) coordinates, map frame, meters; of none where they are in the wrong
    /// order.
    pub(in crate::map) fn bounds_m(&self) -> ([f64; 3], [f64; 3]) {
        let everywhere = ([f64::NEG_INFINITY; 3], [f64::INFINITY; 3]);
        let region = self.region.as_ref().map(Region::bounds_m);
        let view = self.view.as_ref().map(Frustum::bounds_m);
        [region, view].into_iter().flatten().fold(everywhere, |(min_m, max_m), (other_min_m, other_max_m)| {
            (
                std::array::from_fn(|axis| min_m[axis].max(other_min_m[axis])),
                std::array::from_fn(|axis| max_m[axis].min(other_max_m[axis])),
            )
        })
    }
}
