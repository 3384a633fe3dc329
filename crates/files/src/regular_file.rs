//! Files that have an end.

use std::fs::File;
use std::io;
use std::path::Path;

/// Opens the file at `path`, with its length.
///
/// # Errors
/// When it cannot be opened, or is no regular file: whoever opens a named pipe waits for its writer.
pub fn open_regular(path: &Path) -> io::Result<(File, u64)> {
    let metadata = path.metadata()?;
    match metadata.is_file() {
        true => Ok((File::open(path)?, metadata.len())),
        false => {
            let problem = "not a regular file: write it to one first";
            Err(io::Error::new(io::ErrorKind::InvalidInput, problem))
        }
    }
}
