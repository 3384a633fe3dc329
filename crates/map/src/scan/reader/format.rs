//! Formats of scan files, by extension.

use std::path::Path;

use super::coordinates::Coordinates;
use super::error::{Problem, ReadError};
use super::{pcd, ply, text};
use crate::geometry::Point;

/// The extension of `path` without its dot, in lower case.
fn extension(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default()
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Format {
    Ply,
    Pcd,
    Xyz,
    F32,
}

impl Format {
    pub(super) fn named_by(path: &Path) -> Result<Self, ReadError> {
        let unknown = || ReadError::Extension { path: path.to_owned(), extension: extension(path) };
        Self::of(path).ok_or_else(unknown)
    }

    pub(super) fn of(path: &Path) -> Option<Self> {
        match extension(path).as_str() {
            "ply" => Some(Self::Ply),
            "pcd" => Some(Self::Pcd),
            "xyz" => Some(Self::Xyz),
            "f32" => Some(Self::F32),
            _ => None,
        }
    }

    pub(super) fn points<C: Coordinates>(self, bytes: &[u8]) -> Result<Vec<C>, Problem> {
        match self {
            Self::Ply => ply::points(bytes),
            Self::Pcd => pcd::points(bytes),
            Self::Xyz => text::points(bytes),
            Self::F32 => packed_points(bytes),
        }
    }
}

fn packed_points<C: Coordinates>(bytes: &[u8]) -> Result<Vec<C>, Problem> {
    let points: &[Point] = bytemuck::try_cast_slice(bytes).map_err(|_| {
        let (size, whole) = (Point::BYTES, bytes.len() / Point::BYTES);
        Problem::new(format!(
            "{} bytes are not whole points of {size} bytes, point {whole} is cut short",
            bytes.len()
        ))
    })?;
    Ok(points.iter().map(|point| C::of_singles(point.xyz())).collect())
}
