//! The fields of a protobuf message, read from its bytes without decoding them, so that they can be counted before
//! memory is taken.

use crate::codec::Unreadable;
use mrol_map::util::StopSignal;

/// Fields, or numbers, that are read between two checks of the stop signal: a millisecond or so.
pub(super) const FIELDS_PER_STOP_CHECK: usize = 4096;
/// Bytes in which varints are counted between two checks of the stop signal.
const BYTES_PER_STOP_CHECK: usize = 1 << 20;

/// The value of a field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Value<'a> {
    /// A varint (wire type 0).
    Varint(u64),
    /// A fixed 64-bit number (wire type 1).
    Fixed64(u64),
    /// Bytes, a text, a message, or packed numbers (wire type 2).
    Bytes(&'a [u8]),
    /// A fixed 32-bit number (wire type 5).
    Fixed32,
}

/// Iterator over the fields of a message, in order, with their numbers.
#[derive(Debug, Clone)]
pub(super) struct Fields<'a>(&'a [u8]);

impl<'a> Fields<'a> {
    pub(super) fn of(message: &'a [u8]) -> Self {
        Self(message)
    }

    fn field(&mut self) -> Option<(u64, Value<'a>)> {
        let key = varint(&mut self.0)?;
        let value = match key & 7 {
            0 => Value::Varint(varint(&mut self.0)?),
            1 => {
                let (bytes, rest) = self.0.split_first_chunk()?;
                self.0 = rest;
                Value::Fixed64(u64::from_le_bytes(*bytes))
            }
            2 => {
                let length = usize::try_from(varint(&mut self.0)?).ok()?;
                Value::Bytes(self.0.split_off(..length)?)
            }
            5 => self.0.split_off(..4).map(|_| Value::Fixed32)?,
            // Groups (deprecated in protobuf) do not occur in this format.
            _ => return None,
        };
        Some((key >> 3, value))
    }
}

impl<'a> Iterator for Fields<'a> {
    type Item = Result<(u64, Value<'a>), Unreadable>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.0.is_empty() {
            return None;
        }
        let left = self.0.len();
        Some(self.field().ok_or_else(|| {
            self.0 = &[];
            format!("the field {left} bytes before the end of its message is none, or is cut short")
        }))
    }
}

/// Reads the repeated field `number` of varints, packed or not, each converted by `value_of`; incomplete once stopped.
/// The list is allocated for `count` values.
pub(super) fn varints<T>(
    message: &[u8],
    number: u64,
    count: usize,
    value_of: impl Fn(u64) -> T,
    stop: StopSignal<'_>,
) -> Result<Vec<T>, Unreadable> {
    let mut values = Vec::with_capacity(count);
    for field in stop.paced(Fields::of(message), FIELDS_PER_STOP_CHECK) {
        match field? {
            (n, Value::Bytes(mut packed)) if n == number => {
                while !packed.is_empty() && !stop.is_stopped() {
                    for _ in 0..FIELDS_PER_STOP_CHECK {
                        if packed.is_empty() {
                            break;
                        }
                        let value = varint(&mut packed);
                        values.push(value_of(value.ok_or_else(|| format!("field {number} is cut short"))?));
                    }
                }
            }
            (n, Value::Varint(value)) if n == number => values.push(value_of(value)),
            (n, _) if n == number => return Err(format!("field {number} is of another kind")),
            _ => {}
        }
    }
    Ok(values)
}

/// The bytes of the field `number` of a message; of the last one where it is repeated.
pub(super) fn bytes_of<'b>(
    message: &'b [u8],
    number: u64,
    stop: StopSignal<'_>,
) -> Result<&'b [u8], Unreadable> {
    let mut last = &[][..];
    for field in stop.paced(Fields::of(message), FIELDS_PER_STOP_CHECK) {
        match field? {
            (n, Value::Bytes(bytes)) if n == number => last = bytes,
            (n, _) if n == number => return Err(format!("field {number} is of another kind")),
            _ => {}
        }
    }
    Ok(last)
}

/// Decodes a zigzag-encoded number, whose small values of both signs are short.
pub(super) fn unzigzag(zigzag: u64) -> i64 {
    (zigzag >> 1) as i64 ^ -((zigzag & 1) as i64)
}

/// Counts the values of the repeated varint field `number`, packed or not.
pub(super) fn count_varints(message: &[u8], number: u64, stop: StopSignal<'_>) -> Result<usize, Unreadable> {
    let ends = |packed: &[u8]| packed.iter().filter(|&&byte| byte < 128).count();
    let mut count = 0;
    for field in stop.paced(Fields::of(message), FIELDS_PER_STOP_CHECK) {
        count += match field? {
            (n, Value::Bytes(packed)) if n == number => {
                stop.pieces(packed, BYTES_PER_STOP_CHECK).map(ends).sum()
            }
            (n, Value::Varint(_)) if n == number => 1,
            _ => 0,
        };
    }
    Ok(count)
}

/// Counts the bytes of the field `number`, over all its occurrences.
pub(super) fn count_bytes(message: &[u8], number: u64, stop: StopSignal<'_>) -> Result<usize, Unreadable> {
    let mut count = 0;
    for field in stop.paced(Fields::of(message), FIELDS_PER_STOP_CHECK) {
        if let (n, Value::Bytes(bytes)) = field?
            && n == number
        {
            count += bytes.len();
        }
    }
    Ok(count)
}

/// Takes a varint from the front of `bytes`; none where it is truncated or longer than 64 bits.
fn varint(bytes: &mut &[u8]) -> Option<u64> {
    let mut value = 0u64;
    for shift in (0..64).step_by(7) {
        let byte = *bytes.split_off_first()?;
        if shift == 63 && byte > 1 {
            return None;
        }
        value |= u64::from(byte & 127) << shift;
        if byte < 128 {
            return Some(value);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pb;
    use prost::Message;

    #[test]
    fn fields_are_read_as_they_were_written() {
        let message = pb::Snapshot {
            uuid: vec![7; 16].into(),
            levels: 300,
            block_keys: vec![1, 2],
            withdrawn: vec![pb::WithdrawnChange { change: 1, revision: 2 }; 2],
            ..pb::Snapshot::default()
        };
        let bytes = message.encode_to_vec();
        let fields: Vec<_> = Fields::of(&bytes).map(Result::unwrap).collect();
        assert_eq!(fields[0], (1, Value::Bytes(&[7; 16])));
        assert_eq!(fields[1], (3, Value::Varint(300)));
        assert!(matches!(fields[2], (7, Value::Bytes(keys)) if keys.len() == 16));
        assert_eq!(fields.iter().filter(|(number, _)| *number == 11).count(), 2);
        for cut in 1..bytes.len() {
            // Between two fields a message may end.
            let _ = Fields::of(&bytes[..cut]).map_while(Result::ok).count();
        }
        assert!(Fields::of(&bytes[..5]).last().unwrap().is_err());
    }

    #[test]
    fn numbers_are_counted_packed_and_one_by_one() {
        let message = pb::Voxels { key_gaps: vec![1, 300, 1 << 40], octrees: vec![1; 9].into() };
        let bytes = message.encode_to_vec();
        let count_varints = |message: &[u8]| count_varints(message, 1, StopSignal::NEVER);
        let count_bytes = |message: &[u8], number| count_bytes(message, number, StopSignal::NEVER);
        assert_eq!(count_varints(&bytes), Ok(3));
        assert_eq!(count_bytes(&bytes, 2), Ok(9));
        assert_eq!(count_varints(&[8, 1, 8, 2, 8, 3]), Ok(3));
        assert!(count_varints(&[8]).is_err() && count_bytes(&[10, 200], 1).is_err());
    }

    #[test]
    fn numbers_are_read_packed_and_one_by_one() {
        let numbers = vec![0, -1, 1, i64::MIN, i64::MAX, 1 << 40];
        let message =
            pb::Moments { numbers: numbers.clone(), forms: vec![5; 3].into(), ..Default::default() };
        let bytes = message.encode_to_vec();
        let read = |bytes: &[u8], number| varints(bytes, number, 0, unzigzag, StopSignal::NEVER);
        assert_eq!(read(&bytes, 2), Ok(numbers));
        assert_eq!(bytes_of(&bytes, 3, StopSignal::NEVER), Ok(&[5; 3][..]));
        assert_eq!(read(&[16, 1, 16, 2, 18, 1, 3], 2), Ok(vec![-1, 1, -2]));
        let too_large = [18, 10, 255, 255, 255, 255, 255, 255, 255, 255, 255, 2];
        assert!(
            read(&too_large, 2).is_err()
                && read(&[18, 1, 200], 2).is_err()
                && read(&[21, 0, 0, 0, 0], 2).is_err()
        );
        assert!(bytes_of(&[24, 1], 3, StopSignal::NEVER).is_err());
    }
}
