//! Refinement of a pose on the surfaces of the map, below the size of a voxel.
//!
//! Takes the place of step 5 of the paper's III-B. Overlap is flat within a voxel; the Gaussian of the points in it is
//! not. Points are matched with the Gaussian of their voxel and the pose moves to where they lie on its surface: the
//! normal distributions transform (Biber and Strasser 2003; Magnusson 2009) in the form of voxelised GICP (Koide et al.
//! 2021), on moments that the map keeps and with voxels as coarse as the points around demand.

mod equations;
mod gaussian;
mod gaussians;
mod known_moments;
mod refinement;

pub(super) use gaussians::VoxelGaussians;
pub(super) use known_moments::KnownMoments;
pub(super) use refinement::{refine, surface_fit};
