//! What a transform says against what was told before.

use std::fmt::{self, Display, Formatter};

use mrol_map::util::excerpt;

/// Two poses of a frame that are as close as this are told as the same.
pub(super) const SAME_M: f64 = 1e-3;
/// Two poses of a frame whose directions are as close as this are told as the same, degrees.
pub(super) const SAME_DEG: f64 = 0.1;

/// What a transform says against what was told before.
#[derive(Debug, Clone, PartialEq)]
pub enum Contradiction {
    /// A frame hangs on another parent than before.
    OtherParent {
        /// The frame.
        child: String,
        /// Its parents, by name.
        parents: [String; 2],
    },
    /// A frame that does not move is elsewhere than was told before.
    Elsewhere {
        /// The parent.
        parent: String,
        /// The frame.
        child: String,
        /// How far, meters.
        off_m: f64,
        /// How far turned, degrees.
        off_deg: f64,
    },
    /// A frame that does not move is told to move as well; it counts as one that does not.
    FixedAndMoving {
        /// The parent.
        parent: String,
        /// The frame.
        child: String,
    },
}

impl Display for Contradiction {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::OtherParent { child, parents: [one, other] } => write!(
                f,
                "frame {:?} hangs on {:?} and on {:?}: two publishers tell of it, and each scan is put by what was told last",
                excerpt(child),
                excerpt(one),
                excerpt(other),
            ),
            Self::Elsewhere { parent, child, off_m, off_deg } => write!(
                f,
                "frame {:?} is fixed in {:?} at two poses, {off_m:.3} m and {off_deg:.1} degrees apart: each \
                 scan is put by what was told last before it; is one of two publishers wrong?",
                excerpt(child),
                excerpt(parent),
            ),
            Self::FixedAndMoving { parent, child } => write!(
                f,
                "frame {:?} is told by /tf and by /tf_static in {:?}: it counts as fixed",
                excerpt(child),
                excerpt(parent),
            ),
        }
    }
}
