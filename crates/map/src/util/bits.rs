//! Bits of a word.

/// Calls `f` with the number of each bit that is set, ascending.
#[inline(always)]
pub fn for_each_bit(mut bits: u64, mut f: impl FnMut(u32)) {
    while bits != 0 {
        f(bits.trailing_zeros());
        bits &= bits - 1;
    }
}

/// True where `is` is of the number of a bit that is set; it is asked in ascending order, until it is.
#[inline(always)]
pub fn any_bit(mut bits: u64, mut is: impl FnMut(u32) -> bool) -> bool {
    while bits != 0 {
        if is(bits.trailing_zeros()) {
            return true;
        }
        bits &= bits - 1;
    }
    false
}
