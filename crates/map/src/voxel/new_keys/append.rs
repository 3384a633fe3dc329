//! Whole registers behind the keys of a vector, however many of theirs count.
#![expect(unsafe_code, reason = "writes to a vector's spare room")]

use super::super::block::CELLS;

/// Appends to `keys` the keys that `write` writes where it is told to, as many as it says.
///
/// # Safety
/// `write` must write them all, and nothing beyond [`CELLS`] + `lanes` keys.
#[inline(always)]
pub(super) unsafe fn append(keys: &mut Vec<u64>, lanes: usize, write: impl FnOnce(*mut u64) -> usize) {
    keys.reserve(CELLS + lanes);
    // SAFETY: the room is there, and so many keys are written.
    unsafe {
        let written = write(keys.as_mut_ptr().add(keys.len()));
        keys.set_len(keys.len() + written);
    }
}
