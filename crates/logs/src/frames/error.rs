//! Why a transform is not taken, or not known.

use std::fmt::{self, Display, Formatter};

use super::track::Outside;
use mrol_map::util::excerpt;

/// Nanoseconds that are printed as seconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Seconds(pub i64);

impl Display for Seconds {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(f, "{:.3}", self.0 as f64 * 1e-9)
    }
}

/// Why a transform is not taken into the tree.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum BadTransform {
    /// Numbers that are no pose.
    #[error("the transform from {child:?} to {parent:?} has numbers that are no pose")]
    NoPose {
        /// The parent.
        parent: String,
        /// The child.
        child: String,
    },
    /// A name that is empty, too long, or cannot be told.
    #[error("a frame's name must have 1 to {max} bytes and no control characters, got {len} bytes: {begin:?}", max = super::NAME_BYTES_MAX)]
    Name {
        /// Bytes of the name.
        len: usize,
        /// How it begins.
        begin: String,
    },
    /// The child would be its own ancestor.
    #[error(
        "frame {child} cannot be a child of {parent}: that lies below it, and frames would go in a circle"
    )]
    Circle {
        /// The parent.
        parent: String,
        /// The child.
        child: String,
    },
    /// There are too many frames between it and the root.
    #[error("frame {0} is left out: there are {max} frames above it, which is the most", max = super::DEPTH_MAX)]
    TooDeep(String),
    /// There are too many frames.
    #[error("frame {0} is left out: there are {max} frames, which is the most", max = super::FRAMES_MAX)]
    TooMany(String),
}

/// Why it is not known where one frame is in another at a time.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NoTransform {
    /// A frame that nobody tells of.
    #[error("there is no frame {frame:?}, only {known}")]
    Unknown {
        /// The frame.
        frame: String,
        /// Those that there are.
        known: String,
    },
    /// Two frames of different trees.
    #[error("frames {a} and {b} are not connected: they end at {root_a} and {root_b}")]
    NotConnected {
        /// The one.
        a: String,
        /// The other.
        b: String,
        /// The root of the one.
        root_a: String,
        /// The root of the other.
        root_b: String,
    },
    /// A transform that was not told yet.
    #[error("where {child} is in {parent} was not told yet")]
    Never {
        /// The parent.
        parent: String,
        /// The child.
        child: String,
    },
    /// A transform that is told of other times alone.
    #[error(
        "where {child} is in {parent} is told at the nearest {off_s} s {side} it, and {max_s} s are bridged"
    )]
    OtherTime {
        /// The parent.
        parent: String,
        /// The child.
        child: String,
        /// How far from the time the nearest one is, seconds.
        off_s: Seconds,
        /// Before or after.
        side: &'static str,
        /// How far is bridged, seconds.
        max_s: Seconds,
    },
}

impl BadTransform {
    /// That the numbers of a transform are no pose; its names, which nobody looked at, are cut.
    pub(crate) fn no_pose(parent: &str, child: &str) -> Self {
        Self::NoPose { parent: excerpt(parent), child: excerpt(child) }
    }

    pub(super) fn name(name: &str) -> Self {
        Self::Name { len: name.len(), begin: excerpt(name) }
    }
}

impl NoTransform {
    /// That a track does not tell where `child` is in `parent` at a time.
    pub(crate) fn other_time(parent: &str, child: &str, outside: Option<Outside>, beyond_ns: i64) -> Self {
        let Some(Outside { off_ns }) = outside else {
            return Self::Never { parent: parent.to_owned(), child: child.to_owned() };
        };
        Self::OtherTime {
            parent: parent.to_owned(),
            child: child.to_owned(),
            off_s: Seconds(off_ns.saturating_abs()),
            side: if off_ns > 0 { "before" } else { "after" },
            max_s: Seconds(beyond_ns),
        }
    }
}
