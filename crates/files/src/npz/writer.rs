//! Writing the arrays of a map.

use std::io::{self, Seek, Write};

use mrol_map::map::MapOrigin;
use mrol_map::voxel::VoxelKey;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

/// Bytes that are written at once.
const BYTES_AT_ONCE: usize = 1 << 16;
/// Bytes from which an archive has wide numbers for the sizes of a file.
const LARGE_BYTES: u64 = u32::MAX as u64 / 2;
/// The numbers of an array begin at a multiple of this, as numpy writes them.
const ALIGNMENT: usize = 64;

/// The voxels of a level of a map, as the arrays of a file.
#[derive(Debug, Clone, Copy)]
pub struct VoxelArrays<'a> {
    /// The voxels.
    pub keys: &'a [VoxelKey],
    /// Side of a voxel, meters.
    pub resolution_m: f64,
    /// Where the map's frame lies in that of a survey.
    pub origin: Option<MapOrigin>,
    /// Level of the voxels in their map.
    pub level: u32,
    /// Revision of the map.
    pub revision: u64,
}

impl VoxelArrays<'_> {
    /// Writes the arrays; equal voxels give equal files. Calls `progress` with the rows that were written, of twice as
    /// many as there are voxels: first the points, then the indices.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn write(&self, file: impl Write + Seek, mut progress: impl FnMut(usize)) -> io::Result<()> {
        let mut archive = ZipWriter::new(file);
        let count = self.keys.len();
        let origin_m = self.origin.map_or([0.0; 3], |origin| origin.position_m);
        let point = |key: &VoxelKey| {
            let index = key.index();
            [0, 1, 2].map(|axis| (f64::from(index[axis]) + 0.5) * self.resolution_m + origin_m[axis])
        };
        let rows = format!("({count}, 3)");
        begin(&mut archive, "points", "<f8", &rows, count as u64 * 24)?;
        write_rows(&mut archive, self.keys.iter().map(point), f64::to_le_bytes, &mut progress)?;
        begin(&mut archive, "indices", "<i4", &rows, count as u64 * 12)?;
        let mut later = |written| progress(count + written);
        write_rows(&mut archive, self.keys.iter().map(|key| key.index()), i32::to_le_bytes, &mut later)?;
        begin(&mut archive, "resolution", "<f8", "()", 8)?;
        archive.write_all(&self.resolution_m.to_le_bytes())?;
        begin(&mut archive, "origin", "<f8", "(3,)", 24)?;
        archive.write_all(origin_m.map(f64::to_le_bytes).as_flattened())?;
        begin(&mut archive, "level", "<i8", "()", 8)?;
        archive.write_all(&i64::from(self.level).to_le_bytes())?;
        begin(&mut archive, "revision", "<u8", "()", 8)?;
        archive.write_all(&self.revision.to_le_bytes())?;
        archive.finish().map_err(io::Error::from)?.flush()
    }
}

/// Begins an array of so many bytes.
fn begin(
    archive: &mut ZipWriter<impl Write + Seek>,
    name: &str,
    element: &str,
    shape: &str,
    bytes: u64,
) -> io::Result<()> {
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Stored)
        .large_file(bytes > LARGE_BYTES);
    archive.start_file(format!("{name}.npy"), options)?;
    let mut header = format!("{{'descr': '{element}', 'fortran_order': False, 'shape': {shape}, }}");
    // Ten bytes are before it, and its last one ends the line.
    let length = (10 + header.len() + 1).next_multiple_of(ALIGNMENT) - 10;
    header.push_str(&" ".repeat(length - 1 - header.len()));
    archive.write_all(b"\x93NUMPY\x01\x00")?;
    archive.write_all(&(length as u16).to_le_bytes())?;
    archive.write_all(header.as_bytes())?;
    archive.write_all(b"\n")
}

/// Writes the numbers of rows, and reports how many rows were written.
fn write_rows<T: Copy, const N: usize>(
    archive: &mut impl Write,
    rows: impl Iterator<Item = [T; 3]>,
    bytes_of: impl Fn(T) -> [u8; N],
    progress: &mut impl FnMut(usize),
) -> io::Result<()> {
    let mut buffer = Vec::with_capacity(BYTES_AT_ONCE + 3 * N);
    for (written, row) in rows.enumerate() {
        row.into_iter().for_each(|number| buffer.extend(bytes_of(number)));
        if buffer.len() >= BYTES_AT_ONCE {
            archive.write_all(&buffer)?;
            buffer.clear();
            progress(written);
        }
    }
    archive.write_all(&buffer)
}
