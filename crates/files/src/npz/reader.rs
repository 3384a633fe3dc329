//! Reading the arrays of a map.

use std::io::{Read, Seek};

use mrol_map::util::excerpt;
use mrol_map::voxel::{RESOLUTION_MAX_M, RESOLUTION_MIN_M, VoxelKey, VoxelSet};
use zip::ZipArchive;
use zip::read::ZipFile;

use super::error::NpzError;
use super::rows::Rows;
use crate::collected_voxels::CollectedVoxels;

/// Names of arrays that messages repeat, at most.
const NAMES_TOLD_MAX: usize = 10;

/// A file of arrays.
pub struct NpzReader<R> {
    archive: ZipArchive<R>,
    /// What it has of a map.
    pub content: NpzContent,
    /// Where the map's frame lies in that of the points, meters; 0 0 0 where the file does not say.
    pub origin_m: [f64; 3],
}

/// What a file has of a map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum NpzContent {
    /// Indices of voxels of that side, meters.
    Voxels {
        /// Side of a voxel: a resolution that a map can have.
        resolution_m: f64,
    },
    /// Points alone.
    Points,
}

impl<R: Read + Seek> NpzReader<R> {
    /// Finds out what the file has.
    ///
    /// # Errors
    /// When it is no archive, or lacks what makes a map.
    pub fn new(file: R) -> Result<Self, NpzError> {
        let mut archive = ZipArchive::new(file)?;
        let resolution_m = few(&mut archive, "resolution", &[&[], &[1]])?;
        let origin_m = few(&mut archive, "origin", &[&[3]])?;
        let has = |name: &str| archive.index_for_name(&file_name(name)).is_some();
        let content = match resolution_m.as_deref() {
            Some(&[resolution_m]) if has("indices") => {
                if !(RESOLUTION_MIN_M..=RESOLUTION_MAX_M).contains(&resolution_m) {
                    return Err(NpzError::Resolution(resolution_m));
                }
                NpzContent::Voxels { resolution_m }
            }
            _ if has("points") => NpzContent::Points,
            _ => {
                let names = archive.file_names().filter_map(Result::ok).take(NAMES_TOLD_MAX);
                let names: Vec<String> = names.map(|name| excerpt(&name)).collect();
                return Err(NpzError::Lacking(if names.is_empty() {
                    "none".to_owned()
                } else {
                    names.join(", ")
                }));
            }
        };
        let origin_m = match origin_m.as_deref() {
            Some(&[x, y, z]) => [x, y, z],
            _ => [0.0; 3],
        };
        Ok(Self { archive, content, origin_m })
    }

    /// Bytes of the array that is read, as `progress` counts them.
    pub fn bytes(&mut self) -> u64 {
        let name = match self.content {
            NpzContent::Voxels { .. } => "indices",
            NpzContent::Points => "points",
        };
        entry(&mut self.archive, name).ok().flatten().map_or(0, |file| file.size())
    }

    /// The voxels of the indices, `2^coarser` times as wide as those of the file. Calls `progress` with the bytes that
    /// were read.
    ///
    /// # Errors
    /// When the array is not there, is cut off, or has an index of no voxel.
    pub fn read_voxels(&mut self, coarser: u32, mut progress: impl FnMut(u64)) -> Result<VoxelSet, NpzError> {
        let mut voxels = CollectedVoxels::default();
        let mut row = 0;
        self.rows("indices")?.for_each_part(|part, read| {
            for &index in part {
                let key = key_of(index).ok_or(NpzError::Index { row, index })?;
                voxels.add(key.ancestor(coarser));
                row += 1;
            }
            progress(read);
            Ok(())
        })?;
        Ok(voxels.into_set())
    }

    /// Calls `take` with the points, part by part, and with the bytes that were read.
    ///
    /// # Errors
    /// When the array is not there, or is cut off.
    pub fn read_points(&mut self, mut take: impl FnMut(&[[f64; 3]], u64)) -> Result<(), NpzError> {
        self.rows("points")?.for_each_part(|part, read| {
            take(part, read);
            Ok(())
        })
    }

    fn rows(&mut self, name: &'static str) -> Result<Rows<ZipFile<'_, R>>, NpzError> {
        let file = entry(&mut self.archive, name)?;
        Rows::of(name, file.ok_or_else(|| NpzError::array(name, "it is not there"))?)
    }
}

/// The numbers of an array of a few; none where it is not there.
fn few<R: Read + Seek>(
    archive: &mut ZipArchive<R>,
    name: &'static str,
    shapes: &[&[usize]],
) -> Result<Option<Vec<f64>>, NpzError> {
    entry(archive, name)?.map(|file| Rows::of(name, file)?.few(shapes)).transpose()
}

/// The file of an array; none where it is not there.
fn entry<'a, R: Read + Seek>(
    archive: &'a mut ZipArchive<R>,
    name: &'static str,
) -> Result<Option<ZipFile<'a, R>>, NpzError> {
    let Some(index) = archive.index_for_name(&file_name(name)) else { return Ok(None) };
    archive.by_index(index).map(Some).map_err(|error| NpzError::array(name, error))
}

fn file_name(array: &str) -> String {
    format!("{array}.npy")
}

fn key_of(index: [f64; 3]) -> Option<VoxelKey> {
    let is_whole = index.iter().all(|i| i.fract() == 0.0 && i.abs() < f64::from(i32::MAX));
    VoxelKey::new(index.map(|i| i as i32)).filter(|_| is_whole)
}
