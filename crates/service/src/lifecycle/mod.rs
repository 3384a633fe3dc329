//! Operations on maps as a whole: they are made, described, listed, deleted and saved, as map files too.

mod map_file;
mod operations;

#[cfg(test)]
pub(crate) use map_file::from_file;
