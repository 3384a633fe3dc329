//! One field of all points of a `PointCloud2`.

use super::error::CloudError;
use super::raw_cloud::TimeValues;
use crate::message::{FieldType, PointCloud2, PointField};
use mrol_map::util::excerpt;

/// Where the points of a cloud are in its data: looked at once, so that reading them cannot fail.
#[derive(Debug, Clone, Copy)]
pub(super) struct PointLayout {
    point_step: usize,
    row_step: usize,
    height: usize,
    width: usize,
}

/// A field of all points.
#[derive(Debug, Clone, Copy)]
pub(super) struct FieldColumn {
    pub(super) offset: usize,
    pub(super) field_type: FieldType,
    is_big_endian: bool,
}

impl PointLayout {
    /// # Errors
    /// When the points do not lie within the data, or rows overlap.
    pub(super) fn of(cloud: &PointCloud2<'_>) -> Result<Self, CloudError> {
        let (height, width, point_step) = (cloud.height, cloud.width, cloud.point_step);
        let row = u128::from(width) * u128::from(point_step);
        // Drivers of clouds of one row leave it at 0.
        let row_step = match cloud.row_step {
            0 => row,
            row_step if height > 1 => u128::from(row_step),
            _ => row,
        };
        if row_step < row {
            return Err(CloudError::RowStep { width, point_step, row_step: cloud.row_step });
        }
        let needed = match height {
            0 => 0,
            rows => u128::from(rows - 1) * row_step + row,
        };
        let len = cloud.data.len();
        // A point without a byte would let any number of points lie in no data.
        if needed > len as u128 || (point_step == 0 && height > 0 && width > 0) {
            return Err(CloudError::DataShort { height, width, needed: needed.max(1), len });
        }
        let (height, width) = if width == 0 { (0, 0) } else { (height as usize, width as usize) };
        Ok(Self { point_step: point_step as usize, row_step: row_step as usize, height, width })
    }

    pub(super) fn len(&self) -> usize {
        self.height * self.width
    }

    /// The bytes of each point.
    pub(super) fn points<'a>(self, data: &'a [u8]) -> impl Iterator<Item = &'a [u8]> + use<'a> {
        (0..self.height).flat_map(move |row| {
            let begin = row * self.row_step;
            data[begin..begin + self.width * self.point_step].chunks_exact(self.point_step)
        })
    }
}

impl FieldColumn {
    /// # Errors
    /// When the field is of no known type, or does not lie within a point.
    pub(super) fn of(cloud: &PointCloud2<'_>, field: &PointField<'_>) -> Result<Self, CloudError> {
        let field_type = field.field_type.ok_or_else(|| CloudError::FieldType(excerpt(field.name)))?;
        let end = u64::from(field.offset) + field_type.bytes() as u64;
        if end > u64::from(cloud.point_step) {
            let name = excerpt(field.name);
            return Err(CloudError::FieldOutside { name, end, point_step: cloud.point_step });
        }
        Ok(Self { offset: field.offset as usize, field_type, is_big_endian: cloud.is_big_endian })
    }

    /// The field of one point, whose bytes are `point`.
    fn bytes<const N: usize>(&self, point: &[u8]) -> [u8; N] {
        let mut bytes = [0; N];
        bytes.copy_from_slice(&point[self.offset..self.offset + N]);
        if self.is_big_endian {
            bytes.reverse();
        }
        bytes
    }

    /// The field of one point as f32, bit for bit where it is one.
    pub(super) fn f32(&self, point: &[u8]) -> f32 {
        match self.field_type {
            FieldType::F32 => f32::from_le_bytes(self.bytes(point)),
            FieldType::F64 => f64::from_le_bytes(self.bytes(point)) as f32,
            _ => self.i64(point) as f32,
        }
    }

    /// The field of one point as f64.
    fn f64(&self, point: &[u8]) -> f64 {
        match self.field_type {
            FieldType::F64 => f64::from_le_bytes(self.bytes(point)),
            _ => f64::from(self.f32(point)),
        }
    }

    /// A field of whole numbers of one point; 0 of others.
    pub(super) fn i64(&self, point: &[u8]) -> i64 {
        match self.field_type {
            FieldType::I8 => i64::from(i8::from_le_bytes(self.bytes(point))),
            FieldType::U8 => i64::from(u8::from_le_bytes(self.bytes(point))),
            FieldType::I16 => i64::from(i16::from_le_bytes(self.bytes(point))),
            FieldType::U16 => i64::from(u16::from_le_bytes(self.bytes(point))),
            FieldType::I32 => i64::from(i32::from_le_bytes(self.bytes(point))),
            FieldType::U32 => i64::from(u32::from_le_bytes(self.bytes(point))),
            FieldType::I64 => i64::from_le_bytes(self.bytes(point)),
            FieldType::U64 => u64::from_le_bytes(self.bytes(point)).try_into().unwrap_or(i64::MAX),
            FieldType::F32 | FieldType::F64 => 0,
        }
    }

    /// True where numbers have their lowest byte first.
    pub(super) fn is_little_f32_at(&self, offset: usize) -> bool {
        self.field_type == FieldType::F32 && !self.is_big_endian && self.offset == offset
    }

    /// The field of all points.
    pub(super) fn values<'a>(&self, points: impl Iterator<Item = &'a [u8]>) -> TimeValues {
        match self.field_type.is_integer() {
            true => TimeValues::Integers(points.map(|point| self.i64(point)).collect()),
            false => TimeValues::Floats(points.map(|point| self.f64(point)).collect()),
        }
    }
}
