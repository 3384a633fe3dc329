//! Voxels of a frontier that hang together.

/// A bit a voxel of a window.
#[derive(Debug, Clone)]
pub(super) struct Bits(Vec<u64>);

/// The places of the voxels of a cluster in their window, ascending.
pub(super) type Cluster = Vec<u32>;

/// The voxels of a window that are frontier and in no cluster yet.
#[derive(Debug)]
pub(super) struct FrontierBits {
    left: Bits,
    /// What leads to the next row and to the next layer; the window has a rim of one voxel that is no frontier.
    strides: [usize; 2],
    /// Words before this one have no bit left.
    next_word: usize,
}

impl Bits {
    pub(super) fn new(count: usize) -> Self {
        Self(vec![0; count.div_ceil(64)])
    }

    #[inline]
    pub(super) fn get(&self, place: usize) -> bool {
        self.0[place / 64] >> (place % 64) & 1 == 1
    }

    #[inline]
    pub(super) fn set(&mut self, place: usize) {
        self.0[place / 64] |= 1 << (place % 64);
    }

    /// Clears a bit; true where it was set.
    #[inline]
    fn take(&mut self, place: usize) -> bool {
        let (word, bit) = (&mut self.0[place / 64], 1 << (place % 64));
        let was_set = *word & bit != 0;
        *word &= !bit;
        was_set
    }
}

impl FrontierBits {
    pub(super) fn new(left: Bits, strides: [usize; 2]) -> Self {
        Self { left, strides, next_word: 0 }
    }

    /// Number of voxels that are left.
    pub(super) fn count(&self) -> u64 {
        self.left.0.iter().map(|word| u64::from(word.count_ones())).sum()
    }

    /// Takes the first voxel that is left and all that hang together with it: each touches another one, at a corner at
    /// least.
    pub(super) fn take_cluster(&mut self) -> Option<Cluster> {
        let words = &self.left.0[self.next_word..];
        self.next_word += words.iter().position(|word| *word != 0)?;
        let first = self.next_word * 64 + self.left.0[self.next_word].trailing_zeros() as usize;
        self.left.take(first);
        let mut cluster = vec![first as u32];
        let mut looked_at = 0;
        while let Some(&place) = cluster.get(looked_at) {
            looked_at += 1;
            for beside in self.around(place as usize) {
                if self.left.take(beside) {
                    cluster.push(beside as u32);
                }
            }
        }
        cluster.sort_unstable();
        Some(cluster)
    }

    /// The 26 places around one.
    fn around(&self, place: usize) -> [usize; 26] {
        std::array::from_fn(|n| {
            let n = if n < 13 { n } else { n + 1 };
            let [x, y, z] = [n % 3, n / 3 % 3, n / 9];
            place + x + y * self.strides[0] + z * self.strides[1] - 1 - self.strides[0] - self.strides[1]
        })
    }
}
