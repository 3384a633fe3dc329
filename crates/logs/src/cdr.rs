//! A cursor over a message in CDR, the encoding of ROS 2 (OMG DDS-XTypes, plain CDR version 1).

/// Why bytes are no message.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CdrError {
    /// The message ends before a value.
    #[error("it ends at byte {len}, a value needs bytes {from} to {to}")]
    End {
        /// First byte of the value, from the end of the encapsulation header.
        from: usize,
        /// The byte behind it.
        to: usize,
        /// Bytes that the message has.
        len: usize,
    },
    /// A list that has more elements than bytes are left for.
    #[error("a list says it has {count} elements of {bytes} bytes or more, and {left} bytes are left")]
    Count {
        /// Number of elements that the message claims.
        count: u32,
        /// Least bytes of an element.
        bytes: usize,
        /// Bytes left.
        left: usize,
    },
    /// A list that has more elements than are read.
    #[error("the list {what} has {count} elements, and {max} are read")]
    TooMany {
        /// Its name.
        what: &'static str,
        /// Its elements.
        count: usize,
        /// Elements that are read, at most.
        max: usize,
    },
    /// An encapsulation other than plain CDR.
    #[error("its encapsulation is {0:#06x}, and plain CDR (0x0000, 0x0001) is read")]
    Encapsulation(u16),
    /// A string that is not UTF-8.
    #[error("a string at byte {0} is not UTF-8")]
    Utf8(usize),
    /// A frame's name that is longer than any that is read, or cannot be told.
    #[error(
        "the name of its frame has {len} bytes; names of {max} bytes without control characters are read"
    )]
    FrameName {
        /// Bytes of the name.
        len: usize,
        /// Bytes that are read, at most.
        max: usize,
    },
}

/// A cursor over the values of a message. Values are aligned by their size, from the end of the encapsulation header
/// on.
#[derive(Debug, Clone)]
pub struct Cursor<'a> {
    body: &'a [u8],
    at: usize,
    is_little: bool,
}

/// Bytes of the encapsulation header.
const HEADER: usize = 4;

macro_rules! number {
    ($($name:ident)*) => {$(
        /// The next number of this type.
        ///
        /// # Errors
        /// When the message ends before it.
        pub fn $name(&mut self) -> Result<$name, CdrError> {
            let bytes = self.aligned()?;
            Ok(if self.is_little { $name::from_le_bytes(bytes) } else { $name::from_be_bytes(bytes) })
        }
    )*};
}

impl<'a> Cursor<'a> {
    /// A cursor at the first value of a message, its encapsulation header included.
    ///
    /// # Errors
    /// When the header is missing, or of another encoding.
    pub fn new(message: &'a [u8]) -> Result<Self, CdrError> {
        let (header, body) = message.split_first_chunk::<HEADER>().ok_or(CdrError::End {
            from: 0,
            to: HEADER,
            len: message.len(),
        })?;
        match u16::from_be_bytes([header[0], header[1]]) {
            kind @ (0 | 1) => Ok(Self { body, at: 0, is_little: kind == 1 }),
            kind => Err(CdrError::Encapsulation(kind)),
        }
    }

    number! { u8 u16 u32 u64 i32 f32 f64 }

    /// So many bytes, as they are.
    ///
    /// # Errors
    /// When the message ends before their last.
    pub fn bytes(&mut self, count: usize) -> Result<&'a [u8], CdrError> {
        let to = self.at.saturating_add(count);
        let bytes =
            self.body.get(self.at..to).ok_or(CdrError::End { from: self.at, to, len: self.body.len() })?;
        self.at = to;
        Ok(bytes)
    }

    /// The number of elements of a list whose elements have at least `bytes` bytes each: never more than there is room
    /// for in the rest of the message.
    ///
    /// # Errors
    /// When the message ends before the number, or the list would not fit.
    pub fn count(&mut self, bytes: usize) -> Result<usize, CdrError> {
        let count = self.u32()?;
        let left = self.body.len() - self.at;
        match (count as usize).checked_mul(bytes) {
            Some(all) if all <= left => Ok(count as usize),
            _ => Err(CdrError::Count { count, bytes, left }),
        }
    }

    /// A string.
    ///
    /// # Errors
    /// When the message ends before its end, or it is not UTF-8.
    pub fn string(&mut self) -> Result<&'a str, CdrError> {
        let count = self.count(1)?;
        let at = self.at;
        let bytes = self.bytes(count)?;
        // The NUL at the end counts, and is missing where a string of no characters has the length 0.
        let text = bytes.strip_suffix(&[0]).unwrap_or(bytes);
        std::str::from_utf8(text).map_err(|_| CdrError::Utf8(at))
    }

    /// `N` numbers in a row.
    ///
    /// # Errors
    /// When the message ends before the last.
    pub fn f64s<const N: usize>(&mut self) -> Result<[f64; N], CdrError> {
        let mut numbers = [0.0; N];
        for number in &mut numbers {
            *number = self.f64()?;
        }
        Ok(numbers)
    }

    /// True where numbers have their lowest byte first.
    pub fn is_little(&self) -> bool {
        self.is_little
    }

    /// The next `N` bytes at a multiple of `N`.
    fn aligned<const N: usize>(&mut self) -> Result<[u8; N], CdrError> {
        let from = self.at.next_multiple_of(N);
        let to = from + N;
        let bytes = self.body.get(from..to).and_then(|bytes| bytes.try_into().ok());
        let bytes = bytes.ok_or(CdrError::End { from, to, len: self.body.len() })?;
        self.at = to;
        Ok(bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn numbers_are_aligned_and_of_either_byte_order() {
        let little = [0, 1, 0, 0, 7, 0xff, 0xff, 0xff, 1, 2, 3, 4];
        let mut cursor = Cursor::new(&little).unwrap();
        assert_eq!((cursor.u8(), cursor.u32()), (Ok(7), Ok(0x0403_0201)));
        assert_eq!(cursor.u8(), Err(CdrError::End { from: 8, to: 9, len: 8 }));
        let big = [0, 0, 0, 0, 7, 0, 1, 2, 0x3f, 0x80, 0, 0];
        let mut cursor = Cursor::new(&big).unwrap();
        assert_eq!((cursor.u8(), cursor.u16(), cursor.f32()), (Ok(7), Ok(0x0102), Ok(1.0)));
    }

    #[test]
    fn a_list_that_claims_more_than_is_there_is_refused_before_anything_is_allocated() {
        let message = [0, 1, 0, 0, 0xff, 0xff, 0xff, 0xff, 1, 2, 3, 4];
        let refused = Cursor::new(&message).unwrap().count(8).unwrap_err();
        assert_eq!(refused, CdrError::Count { count: u32::MAX, bytes: 8, left: 4 });
        assert!(Cursor::new(&message).unwrap().string().is_err());
    }

    #[test]
    fn strings_end_with_a_nul_or_are_empty() {
        let message = [0, 1, 0, 0, 3, 0, 0, 0, b'a', b'b', 0, 0, 0, 0, 0, 0];
        let mut cursor = Cursor::new(&message).unwrap();
        assert_eq!((cursor.string(), cursor.string()), (Ok("ab"), Ok("")));
        let not_utf8 = [0, 1, 0, 0, 2, 0, 0, 0, 0xff, 0];
        assert_eq!(Cursor::new(&not_utf8).unwrap().string(), Err(CdrError::Utf8(4)));
    }

    #[test]
    fn other_encodings_are_refused_by_their_number() {
        assert_eq!(Cursor::new(&[0, 7, 0, 0]).unwrap_err(), CdrError::Encapsulation(7));
        assert_eq!(Cursor::new(&[0, 1]).unwrap_err(), CdrError::End { from: 0, to: 4, len: 2 });
    }

    proptest! {
        /// What is asked of any bytes, in any order, is a value or an error, and never behind the end.
        #[test]
        fn no_bytes_and_no_order_of_questions_break_it(
            message in prop::collection::vec(any::<u8>(), 0..64),
            questions in prop::collection::vec(0..9u8, 0..32),
        ) {
            let Ok(mut cursor) = Cursor::new(&message) else { return Ok(()) };
            for question in questions {
                let before = cursor.at;
                let failed = match question {
                    0 => cursor.u8().is_err(),
                    1 => cursor.u16().is_err(),
                    2 => cursor.u32().is_err(),
                    3 => cursor.u64().is_err(),
                    4 => cursor.f32().is_err(),
                    5 => cursor.f64().is_err(),
                    6 => cursor.string().is_err(),
                    7 => cursor.count(3).is_err(),
                    _ => cursor.bytes(5).is_err(),
                };
                prop_assert!(cursor.at <= cursor.body.len());
                prop_assert!(cursor.at > before || failed || question == 6);
            }
        }

        /// Numbers are what a writer by the same rules wrote.
        #[test]
        fn numbers_come_back(a in any::<u8>(), b in any::<u64>(), c in any::<u16>(), d in any::<i32>(), big in any::<bool>()) {
            let mut message = vec![0, u8::from(!big), 0, 0, a, 0, 0, 0, 0, 0, 0, 0];
            if big {
                message.extend(b.to_be_bytes());
                message.extend(c.to_be_bytes());
                message.extend([0, 0]);
                message.extend(d.to_be_bytes());
            } else {
                message.extend(b.to_le_bytes());
                message.extend(c.to_le_bytes());
                message.extend([0, 0]);
                message.extend(d.to_le_bytes());
            }
            let mut cursor = Cursor::new(&message).unwrap();
            prop_assert_eq!((cursor.u8(), cursor.u64(), cursor.u16(), cursor.i32()), (Ok(a), Ok(b), Ok(c), Ok(d)));
        }
    }
}
