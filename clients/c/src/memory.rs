//! The memory of the program that calls. What can be checked of a pointer is checked here; the rest it promises.

mod arrays;

pub(crate) use arrays::{Array, Places, Plain, numbers_each, rows, span};

use std::ffi::c_char;
use std::mem::MaybeUninit;
use std::ptr;

use bytes::Bytes;
use mrol_client::geometry::Point;
use mrol_client::service::PointCloud;

use crate::failure::Failure;

/// Most points of one query: `MROL_POINTS_MAX`. A count that was never set is larger as a rule.
pub(crate) const POINTS_MAX: usize = 1 << 27;
/// Most bytes of a text, without its zero.
const TEXT_BYTES_MAX: usize = 4096;
/// Most bytes of a struct of a header to come.
const STRUCT_BYTES_MAX: usize = 1024;

// Points are the bytes that look-ups read, in the order of the network.
const _: () = assert!(cfg!(target_endian = "little"));

/// A struct that a program passes: one of an older or newer header than this library's too.
///
/// # Safety
/// It is `repr(C)`, its first field is a `usize`, its size in bytes, and any bytes are one of it.
pub(crate) unsafe trait Question: Copy {
    /// Its name in messages.
    const NAME: &'static str;
    /// Its size in the first header that had it.
    const BYTES_MIN: usize;
}

/// Reads a question: fields that its program does not know are zero, and those that this library does not know must be.
///
/// # Safety
/// `question` is NULL, or misaligned, or points to as many bytes as its first field says.
pub(crate) unsafe fn read_question<T: Question>(question: *const T) -> Result<T, Failure> {
    let name = T::NAME;
    check(question, name)?;
    // SAFETY: it is there, and aligned.
    let bytes = unsafe { question.cast::<usize>().read() };
    if !(T::BYTES_MIN..=STRUCT_BYTES_MAX).contains(&bytes) {
        let message = format!(
            "{name}.struct_size must lie in {}..={STRUCT_BYTES_MAX}, got {bytes}: it is sizeof the struct, which the \
             struct's _default function sets",
            T::BYTES_MIN
        );
        return Err(Failure::argument(message));
    }
    let known = bytes.min(size_of::<T>());
    let mut read = MaybeUninit::<T>::zeroed();
    // SAFETY: the program promises so many bytes, and there are as many to write.
    unsafe { ptr::copy_nonoverlapping(question.cast::<u8>(), read.as_mut_ptr().cast::<u8>(), known) };
    // SAFETY: the program promises these bytes too.
    let unknown = unsafe { std::slice::from_raw_parts(question.cast::<u8>().add(known), bytes - known) };
    if unknown.iter().any(|byte| *byte != 0) {
        let message = format!("{name} has fields that this library is too old for, and they are set");
        return Err(Failure::argument(message));
    }
    // SAFETY: any bytes are a question.
    Ok(unsafe { read.assume_init() })
}

/// Reads `COUNT` numbers; none where `numbers` is NULL.
///
/// # Safety
/// `numbers` is NULL, or misaligned, or points to so many.
pub(crate) unsafe fn numbers<const COUNT: usize>(
    numbers: *const f64,
    name: &str,
) -> Result<Option<[f64; COUNT]>, Failure> {
    if numbers.is_null() {
        return Ok(None);
    }
    check(numbers, name)?;
    // SAFETY: they are there, and aligned.
    Ok(Some(unsafe { numbers.cast::<[f64; COUNT]>().read() }))
}

/// Reads a text; none where `text` is NULL.
///
/// # Safety
/// `text` is NULL, or points to a text with a zero behind it.
pub(crate) unsafe fn text(text: *const c_char, name: &str) -> Result<Option<String>, Failure> {
    if text.is_null() {
        return Ok(None);
    }
    let mut bytes = Vec::new();
    // SAFETY: no byte behind the zero is read.
    while let byte @ 1.. = unsafe { text.add(bytes.len()).cast::<u8>().read() } {
        if bytes.len() == TEXT_BYTES_MAX {
            return Err(Failure::argument(format!("{name} has more than {TEXT_BYTES_MAX} bytes")));
        }
        bytes.push(byte);
    }
    String::from_utf8(bytes).map(Some).map_err(|_| Failure::argument(format!("{name} is not UTF-8")))
}

/// The points of a query, where they are.
///
/// # Safety
/// As [`points_of`].
pub(crate) unsafe fn points(xyz: *const f32, count: usize, name: &str) -> Result<PointCloud, Failure> {
    if count > POINTS_MAX {
        return Err(Failure::argument(format!("{name}.count must be at most {POINTS_MAX}, got {count}")));
    }
    // SAFETY: as the caller promises.
    unsafe { points_of(xyz, count, &format!("{name}.xyz")) }
}

/// The points of a program, where they are.
///
/// # Safety
/// `xyz` is NULL, or misaligned, or points to `count` points that nobody writes while the points are in use.
pub(crate) unsafe fn points_of(xyz: *const f32, count: usize, name: &str) -> Result<PointCloud, Failure> {
    struct Lent {
        xyz: *const u8,
        bytes: usize,
    }
    // SAFETY: it is read alone, by whichever thread.
    unsafe impl Send for Lent {}
    impl AsRef<[u8]> for Lent {
        fn as_ref(&self) -> &[u8] {
            // SAFETY: the program promises so many bytes.
            unsafe { std::slice::from_raw_parts(self.xyz, self.bytes) }
        }
    }
    if count > POINTS_MAX {
        return Err(Failure::argument(format!("{name}: at most {POINTS_MAX} of them, got {count}")));
    }
    if count == 0 {
        return Ok(Vec::new().into());
    }
    check(xyz, name)?;
    let lent = Lent { xyz: xyz.cast(), bytes: count * Point::BYTES };
    Ok(PointCloud::from_bytes(Bytes::from_owner(lent))?)
}

/// Where a value is to be written, as the program says.
pub(crate) struct Out<T> {
    to: *mut T,
    name: &'static str,
}

/// Where a value can be written.
pub(crate) struct Place<T>(*mut T);

impl<T> Out<T> {
    /// Nowhere.
    pub(crate) const NONE: Self = Self { to: ptr::null_mut(), name: "" };

    /// # Safety
    /// `to` is NULL, or misaligned, or points to memory for a `T` for as long as the place is in use.
    pub(crate) unsafe fn of(to: *mut T, name: &'static str) -> Self {
        Self { to, name }
    }

    /// The place, where there is one.
    pub(crate) fn optional(self) -> Result<Option<Place<T>>, Failure> {
        if self.to.is_null() { Ok(None) } else { self.required().map(Some) }
    }

    /// The place, which there must be.
    pub(crate) fn required(self) -> Result<Place<T>, Failure> {
        check(self.to, self.name)?;
        Ok(Place(self.to))
    }
}

impl<T: Copy> Place<T> {
    /// Writes `value` over whatever is there.
    pub(crate) fn write(&self, value: T) {
        // SAFETY: it was checked, and the program promises the rest.
        unsafe { self.0.write(value) };
    }
}

/// Where a bitmap is to be written, as the program says.
pub(crate) struct Bitmap {
    to: *mut u8,
    bytes: usize,
    name: &'static str,
}

impl Bitmap {
    /// # Safety
    /// `to` is NULL, or points to so many bytes for as long as the bitmap is in use.
    pub(crate) unsafe fn of(to: *mut u8, bytes: usize, name: &'static str) -> Self {
        Self { to, bytes, name }
    }

    /// The bitmap, where it has room for an answer about each point and overlaps none of them.
    pub(crate) fn for_answers_about(self, points: &PointCloud) -> Result<Self, Failure> {
        let (name, count) = (self.name, points.len());
        let needed = count.div_ceil(8);
        if self.bytes < needed {
            let message =
                format!("{name}_bytes must be at least {needed} for {count} points, got {}", self.bytes);
            return Err(Failure::argument(message));
        }
        if needed > 0 {
            check(self.to, name)?;
        }
        let asked = points.as_slice();
        if overlap((self.to.addr(), needed), (asked.as_ptr().addr(), size_of_val(asked))) {
            return Err(Failure::argument(format!("{name} overlaps what is asked about")));
        }
        Ok(self)
    }

    /// Writes the answers; the bytes behind them stay as they are.
    pub(crate) fn write(&self, answers: &[u8]) {
        let bytes = answers.len().min(self.bytes);
        // SAFETY: the program promises the memory, which nobody else has: it is no answer's.
        unsafe { ptr::copy_nonoverlapping(answers.as_ptr(), self.to, bytes) };
    }
}

/// Reads a flag.
pub(crate) fn flag(flag: u8, name: &str) -> Result<bool, Failure> {
    match flag {
        0 | 1 => Ok(flag == 1),
        other => Err(Failure::argument(format!("{name} must be 0 or 1, got {other}"))),
    }
}

/// True where two ranges (address, bytes) share a byte.
fn overlap((a, a_bytes): (usize, usize), (b, b_bytes): (usize, usize)) -> bool {
    a_bytes > 0 && b_bytes > 0 && a < b.saturating_add(b_bytes) && b < a.saturating_add(a_bytes)
}

/// Refuses NULL and what is not aligned.
fn check<T>(pointer: *const T, name: &str) -> Result<(), Failure> {
    if pointer.is_null() {
        return Err(Failure::argument(format!("{name} is NULL")));
    }
    if !pointer.is_aligned() {
        let (address, aligned) = (pointer.addr(), align_of::<T>());
        let message = format!("{name} is at address {address:#x}, which is no multiple of {aligned}");
        return Err(Failure::argument(message));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_overlap_where_they_share_a_byte() {
        for (a, b, shares) in [
            ((0, 4), (4, 4), false),
            ((0, 5), (4, 4), true),
            ((4, 4), (0, 5), true),
            ((4, 1), (0, 9), true),
            ((4, 0), (0, 9), false),
            ((usize::MAX - 1, 9), (usize::MAX - 1, 1), true),
        ] {
            assert_eq!((overlap(a, b), overlap(b, a)), (shares, shares), "{a:?} {b:?}");
        }
    }

    #[derive(Debug, Clone, Copy, PartialEq)]
    #[repr(C)]
    struct Asked {
        struct_size: usize,
        first: u64,
        second: u64,
    }

    // SAFETY: it begins with its size, and any bytes are one.
    unsafe impl Question for Asked {
        const NAME: &'static str = "asked";
        const BYTES_MIN: usize = 16;
    }

    /// Reads what the words are.
    fn read(words: &[u64]) -> Result<Asked, String> {
        // SAFETY: no test says that there are more words than there are.
        unsafe { read_question(words.as_ptr().cast()) }.map_err(|failure| failure.message)
    }

    #[test]
    fn a_question_of_an_older_or_newer_header_is_read() {
        let asked = |struct_size, first, second| Asked { struct_size, first, second };
        assert_eq!(read(&[16, 7, 9]), Ok(asked(16, 7, 0)), "it has no second field");
        assert_eq!(read(&[24, 7, 9]), Ok(asked(24, 7, 9)));
        assert_eq!(read(&[32, 7, 9, 0]), Ok(asked(32, 7, 9)), "what is unknown is not used");
        assert!(read(&[32, 7, 9, 1]).unwrap_err().contains("too old"));
        for bytes in [0, 15, STRUCT_BYTES_MAX as u64 + 1, u64::MAX] {
            assert!(read(&[bytes, 7, 9]).unwrap_err().contains("struct_size must lie in 16..=1024"));
        }
    }
}
