//! The batch of voxels that the kernels of a look-up take at once.

/// Points that take each step together: two words of answers.
pub(super) const BATCH: usize = 128;

/// Where a batch of points falls: indices of the view's level, axis by axis, and shards.
pub(super) struct Batch {
    pub(super) index: [[i32; BATCH]; 3],
    pub(super) shard: [i32; BATCH],
}

impl Batch {
    pub(super) const EMPTY: Self = Self { index: [[0; BATCH]; 3], shard: [0; BATCH] };
}

/// How a batch of voxels is looked up.
pub(super) trait LookupKernel {
    /// A bit for each voxel of the batch: is it occupied?
    ///
    /// # Safety
    /// Needs AVX2; the view must still live.
    unsafe fn look_up(&self, batch: &Batch, points: usize) -> [u64; BATCH / 64];
}
