//! Arrays of a program: those that it asks about, and the places for those that answer.

use super::{POINTS_MAX, check, overlap};
use crate::failure::Failure;

/// Most numbers of one array, 4 GiB of floats.
const NUMBERS_MAX: usize = 1 << 30;

/// What may be read from and written to a program's memory.
///
/// # Safety
/// Any bytes are one.
pub(crate) unsafe trait Plain: Copy {}

// SAFETY: any bytes are a number.
unsafe impl Plain for u8 {}
// SAFETY: as above.
unsafe impl Plain for u32 {}
// SAFETY: as above.
unsafe impl Plain for u64 {}
// SAFETY: as above.
unsafe impl Plain for f32 {}
// SAFETY: any bytes are some of them.
unsafe impl<T: Plain, const COUNT: usize> Plain for [T; COUNT] {}

/// The elements of a program's array, where they are; `name` may be NULL where there are none.
///
/// # Safety
/// `from` is NULL, or misaligned, or points to `count` of them that nobody writes while they are in use.
pub(crate) unsafe fn span<'a, T: Plain>(
    from: *const T,
    count: usize,
    name: &str,
) -> Result<&'a [T], Failure> {
    if count > POINTS_MAX {
        return Err(Failure::argument(format!("{name}: at most {POINTS_MAX} of them, got {count}")));
    }
    if count == 0 {
        return Ok(&[]);
    }
    check(from, name)?;
    // SAFETY: they are there, and aligned.
    Ok(unsafe { std::slice::from_raw_parts(from, count) })
}

/// [`span`] of rows of `N` numbers.
///
/// # Safety
/// As [`span`].
pub(crate) unsafe fn rows<'a, const N: usize>(
    from: *const f32,
    count: usize,
    name: &str,
) -> Result<&'a [[f32; N]], Failure> {
    // SAFETY: as the caller promises; rows are aligned as numbers are.
    unsafe { span(from.cast(), count, name) }
}

/// The numbers of `count` elements with `each` numbers.
///
/// # Safety
/// As [`span`].
pub(crate) unsafe fn numbers_each<'a>(
    from: *const f32,
    (count, each): (usize, usize),
    name: &str,
) -> Result<&'a [f32], Failure> {
    let numbers = count.checked_mul(each).filter(|numbers| *numbers <= NUMBERS_MAX);
    let Some(numbers) = numbers.filter(|_| count <= POINTS_MAX) else {
        let message = format!("{name}: at most {NUMBERS_MAX} numbers, got {count} times {each}");
        return Err(Failure::argument(message));
    };
    if numbers == 0 {
        return Ok(&[]);
    }
    check(from, name)?;
    // SAFETY: they are there, and aligned.
    Ok(unsafe { std::slice::from_raw_parts(from, numbers) })
}

/// The memory for the arrays of one answer: none overlaps another, or what is asked about.
pub(crate) struct Places {
    /// Elements of each array.
    count: usize,
    /// Address and bytes of what is taken.
    taken: Vec<(usize, usize)>,
}

/// A place for an array.
pub(crate) struct Array<T> {
    to: *mut T,
    count: usize,
}

impl Places {
    /// Places for answers about `count` elements, where the program has room for `capacity`.
    pub(crate) fn new(count: usize, capacity: usize) -> Result<Self, Failure> {
        if capacity < count {
            let message = format!("answers.capacity must be at least {count}, got {capacity}");
            return Err(Failure::argument(message));
        }
        Ok(Self { count, taken: Vec::with_capacity(12) })
    }

    /// Nothing is written over this.
    pub(crate) fn beside<T>(mut self, asked: &[T]) -> Self {
        self.taken.push((asked.as_ptr().addr(), size_of_val(asked)));
        self
    }

    /// A place for an array with an element each; none where `to` is NULL, and not wanted.
    ///
    /// # Safety
    /// `to` is NULL, or misaligned, or points to so many for as long as the array is in use.
    pub(crate) unsafe fn array<T: Plain>(
        &mut self,
        to: *mut T,
        name: &str,
    ) -> Result<Option<Array<T>>, Failure> {
        self.place(to, self.count, name)
    }

    /// A place for a bitmap with a bit each; none where `to` is NULL.
    ///
    /// # Safety
    /// As [`Places::array`].
    pub(crate) unsafe fn bitmap(&mut self, to: *mut u8, name: &str) -> Result<Option<Array<u8>>, Failure> {
        self.place(to, self.count.div_ceil(8), name)
    }

    fn place<T: Plain>(&mut self, to: *mut T, count: usize, name: &str) -> Result<Option<Array<T>>, Failure> {
        if to.is_null() {
            return Ok(None);
        }
        check(to, name)?;
        let own = (to.addr(), count.saturating_mul(size_of::<T>()));
        if self.taken.iter().any(|taken| overlap(*taken, own)) {
            return Err(Failure::argument(format!("{name} overlaps what is asked about, or another array")));
        }
        self.taken.push(own);
        Ok(Some(Array { to, count }))
    }
}

impl<T: Plain> Array<T> {
    /// Writes the values; what is behind them stays as it is.
    pub(crate) fn write(&self, values: impl IntoIterator<Item = T>) {
        for (i, value) in values.into_iter().take(self.count).enumerate() {
            // SAFETY: the program promises so many, which nobody else has: they are no answer's, and nothing that is
            // asked.
            unsafe { self.to.add(i).write(value) };
        }
    }
}

impl Array<u8> {
    /// Writes bits: number i is bit i % 64 of word i / 64.
    pub(crate) fn write_bits(&self, words: &[u64]) {
        self.write(words.iter().flat_map(|word| word.to_le_bytes()));
    }
}
