//! Which scan files are read: their extensions and largest sizes.

/// Most bytes a scan file may have: 89 million packed points.
pub(super) const FILE_BYTES_MAX: u64 = 1 << 30;

/// Most points a header may declare.
pub(super) const POINTS_MAX: u64 = 100_000_000;

/// Most bytes of a file in which its header must end.
pub(super) const HEADER_BYTES_MAX: usize = 1 << 20;

/// The extensions that [`read_points`](super::read_points) knows.
pub(super) const EXTENSIONS: [&str; 7] = [".ply", ".pcd", ".xyz", ".npy", ".bin", ".f32", ".3d"];
