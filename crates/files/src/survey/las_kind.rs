//! Kinds of LAS files.

/// Whether points are compressed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LasKind {
    /// `.las`: 20 bytes a point.
    Las,
    /// `.laz`: compressed.
    Laz,
}
