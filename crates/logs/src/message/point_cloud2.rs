//! `sensor_msgs/PointCloud2`.

use super::header::Header;
use crate::cdr::{CdrError, Cursor};

/// A cloud whose points have the fields that it names.
#[derive(Debug, Clone, PartialEq)]
pub struct PointCloud2<'a> {
    /// When, and in which frame.
    pub header: Header<'a>,
    /// Rows of an organized cloud, else 1.
    pub height: u32,
    /// Points of a row.
    pub width: u32,
    /// What a point has.
    pub fields: Vec<PointField<'a>>,
    /// Numbers in `data` have their highest byte first.
    pub is_big_endian: bool,
    /// Bytes from a point to the next.
    pub point_step: u32,
    /// Bytes from a row to the next.
    pub row_step: u32,
    /// The points.
    pub data: &'a [u8],
}

/// What a point has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PointField<'a> {
    /// Such as `x` or `intensity`.
    pub name: &'a str,
    /// Bytes from the begin of the point.
    pub offset: u32,
    /// Its type; none of a number that ROS does not define.
    pub field_type: Option<FieldType>,
}

/// Type of a field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FieldType {
    /// Signed, of 8 bits.
    I8,
    /// Not signed, of 8 bits.
    U8,
    /// Signed, of 16 bits.
    I16,
    /// Not signed, of 16 bits.
    U16,
    /// Signed, of 32 bits.
    I32,
    /// Not signed, of 32 bits.
    U32,
    /// Of single precision.
    F32,
    /// Of double precision.
    F64,
    /// Signed, of 64 bits: not in the definition of ROS, and written by some drivers as type 9.
    I64,
    /// Not signed, of 64 bits: as type 10.
    U64,
}

impl FieldType {
    /// The type that ROS numbers so.
    pub fn of_number(number: u8) -> Option<Self> {
        const TYPES: [FieldType; 10] = [
            FieldType::I8,
            FieldType::U8,
            FieldType::I16,
            FieldType::U16,
            FieldType::I32,
            FieldType::U32,
            FieldType::F32,
            FieldType::F64,
            FieldType::I64,
            FieldType::U64,
        ];
        TYPES.get(usize::from(number).checked_sub(1)?).copied()
    }

    /// Bytes of a number.
    pub fn bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 | Self::I64 | Self::U64 => 8,
        }
    }

    /// True of whole numbers.
    pub fn is_integer(self) -> bool {
        !matches!(self, Self::F32 | Self::F64)
    }
}

/// Least bytes of a field's description: an empty name, an offset, a type, a number of elements.
const FIELD_BYTES: usize = 4 + 4 + 1 + 4;

impl<'a> PointCloud2<'a> {
    /// Reads a message. Whether fields and points lie within its data is looked at where they are read.
    ///
    /// # Errors
    /// When it is cut off, or no CDR.
    pub fn read(message: &'a [u8]) -> Result<Self, CdrError> {
        let mut cursor = Cursor::new(message)?;
        let header = Header::read(&mut cursor)?;
        let (height, width) = (cursor.u32()?, cursor.u32()?);
        let count = cursor.count(FIELD_BYTES)?;
        let mut field = || {
            let (name, offset) = (cursor.string()?, cursor.u32()?);
            let field_type = FieldType::of_number(cursor.u8()?);
            cursor.u32()?;
            Ok(PointField { name, offset, field_type })
        };
        let fields = (0..count).map(|_| field()).collect::<Result<_, CdrError>>()?;
        let is_big_endian = cursor.u8()? != 0;
        let (point_step, row_step) = (cursor.u32()?, cursor.u32()?);
        let bytes = cursor.count(1)?;
        let data = cursor.bytes(bytes)?;
        Ok(Self { header, height, width, fields, is_big_endian, point_step, row_step, data })
    }

    /// The field of this name.
    pub fn field(&self, name: &str) -> Option<&PointField<'a>> {
        self.fields.iter().find(|field| field.name == name)
    }
}
