//! Alignment of a scan to the map (paper III-A, III-B), from a guess. Without a guess: [`localize`].
//!
//! [`align`], in `sequential`, reads like the paper's summary: a volumetric sample, an ascent on overlap at each level
//! from coarse to fine, and a sub-voxel stage. The last is the paper's ascent with all points, or a refinement on the
//! surfaces of the map.
//!
//! ```text
//! sequential      align, align_until    the composing function
//! sampled_scan    step 1                a volumetric sample (III-A)
//! stages          steps 2 to 5          an ascent at each level (ascent, overlap), and the sub-voxel stage (refine)
//! fit                                   how the scan fits at a pose, and what holds it there (information, slide)
//! verdict                               whether to believe the pose, and what is told of it
//! agreement       Rays, RayAgreement    the rays of a scan, and how many agree
//! evidence                              how much they saw of each other, and which side vouches for a pose
//! look            ray_agreement         what rays say of a scan at a pose, point by point
//! witnesses                             which earlier scans are asked, and what they met
//! marched                               what earlier scans must have seen, where they left no viewpoints
//! rivals, ends    Contest, Ends         which of several ends to believe, by rays and by what is known beforehand
//! elsewhere                             where else the scan may fit as well
//! sides                                 which surfaces earlier scans met from the other side
//! multi_start                           further guesses, where the first ends badly
//! localize                              no guess at all
//! ```
//!
//! *Overlap* is the share of all the scan's points that fall in occupied voxels of level 0 by the exact set, before the
//! scan is added ([`overlap`](fn@overlap)). [`Verdict`] says whether to believe the pose. It is *undetermined* where
//! the scan would fit as well at poses nearby: what it sees of the map, such as one blank wall, leaves a direction of
//! the pose open ([`PoseInformation`]).

mod agreement;
mod ascent;
mod elsewhere;
mod ends;
mod evidence;
mod extent;
mod fit;
mod gravity;
mod information;
pub mod localize;
mod look;
mod marched;
mod multi_start;
mod overlap;
mod prior;
mod refine;
mod rivals;
mod sampled_scan;
mod sequential;
mod settings;
mod sides;
mod slide;
mod stages;
#[cfg(test)]
mod tests;
mod verdict;
mod witnesses;

pub use agreement::{RayAgreement, RayCounts, Rival};
pub(crate) use evidence::agrees_both_ways;
pub use information::{Direction, PoseInformation};
pub use look::ray_agreement;
pub use overlap::{OccupiedVoxels, level_overlaps, overlap};
pub use prior::{PoseCovariance, PoseCovarianceError, PosePrior};
pub use sequential::{align, align_until, ascend, evaluate_at};
pub use settings::{
    AlignmentSettings, AlignmentSettingsError, Method, MultiStartSettings, RefinementSettings,
};
pub use verdict::{Alignment, Verdict};
