//! Formats of scan files, by extension.

use std::path::Path;

use super::columns::Columns;
use super::coordinates::Coordinates;
use super::error::{Problem, ReadError};
use super::supported::EXTENSIONS;
use super::{bare, npy, pcd, ply, text, uos};

/// The extension of `path` without its dot, in lower case.
pub(super) fn extension(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default()
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Format {
    Ply,
    Pcd,
    Xyz,
    Npy,
    /// x y z and an intensity.
    Bin,
    F32,
    /// Text of 3DTK.
    Uos,
}

impl Format {
    pub(super) fn named_by(path: &Path) -> Result<Self, ReadError> {
        let extension = extension(path);
        let format = Self::of_extension(&extension);
        format.ok_or_else(|| ReadError::Extension {
            path: path.to_owned(),
            extension,
            supported: &EXTENSIONS,
        })
    }

    fn of_extension(extension: &str) -> Option<Self> {
        match extension {
            "ply" => Some(Self::Ply),
            "pcd" => Some(Self::Pcd),
            "xyz" => Some(Self::Xyz),
            "npy" => Some(Self::Npy),
            "bin" => Some(Self::Bin),
            "f32" => Some(Self::F32),
            "3d" => Some(Self::Uos),
            _ => None,
        }
    }

    /// The points of a file with these bytes, whose columns somebody named, or nobody.
    pub(super) fn points<C: Coordinates>(
        self,
        bytes: &[u8],
        columns: Option<Columns>,
    ) -> Result<Vec<C>, Problem> {
        match self {
            Self::Ply | Self::Pcd if columns.is_some() => {
                Err(Problem::new("the file's own header names its columns: leave --columns out"))
            }
            Self::Ply => ply::points(bytes),
            Self::Pcd => pcd::points(bytes),
            Self::Xyz => text::points(bytes, columns),
            Self::Npy => npy::points(bytes, columns),
            Self::Bin => bare::points(bytes, columns, Columns::xyz_and(1)),
            Self::F32 => bare::points(bytes, columns, Columns::xyz_and(0)),
            Self::Uos => uos::points(bytes, columns),
        }
    }
}
