//! The cap of distances, and how far around a box cells count for it.

use std::num::NonZeroU8;

/// The largest distance that a block can tell, in quarter cells.
pub const DISTANCE_CAP_MAX: NonZeroU8 = NonZeroU8::MAX;

/// How many cells around a box count for distances up to `cap`: a cube farther away is at least as far.
pub fn margin_of(cap: NonZeroU8) -> i32 {
    i32::from(cap.get().div_ceil(2)) / 2
}
