//! Filling, with the widest kernel that the machine has.

use super::scalar::fill_scalar;
#[cfg(target_arch = "x86_64")]
use super::{avx2, avx512};
use crate::bloom::counters::Counters;
#[cfg(target_arch = "x86_64")]
use crate::util::cpu::{Avx2, Avx512};

/// Counts `keys`, which are absent, with `hashes` hashes each and sets their bits of the plane.
pub(in crate::bloom) fn fill(plane: &mut [u64], counters: &mut Counters, hashes: u32, keys: &[u64]) {
    #[cfg(target_arch = "x86_64")]
    if let Some(cpu) = Avx512::detect() {
        return avx512::fill(cpu, plane, counters, hashes, keys);
    } else if let Some(cpu) = Avx2::detect() {
        return avx2::fill(cpu, plane, counters, hashes, keys);
    }
    fill_scalar(plane, counters, hashes, keys);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bloom::rates::HASHES_MAX;
    use proptest::prelude::*;

    type Kernel = fn(&mut [u64], &mut Counters, u32, &[u64]);

    fn wide_kernels() -> Vec<Kernel> {
        #[cfg_attr(not(target_arch = "x86_64"), expect(unused_mut, reason = "there is no other variant"))]
        let mut kernels: Vec<Kernel> = vec![fill];
        #[cfg(target_arch = "x86_64")]
        if Avx2::detect().is_some() {
            kernels.push(|plane, counters, hashes, keys| {
                avx2::fill(Avx2::detect().expect("AVX2"), plane, counters, hashes, keys);
            });
        }
        kernels
    }

    proptest! {
        /// Into so few words, some of them at a time, that counters saturate.
        #[test]
        fn the_wide_twins_are_the_scalar_one(
            keys in prop::collection::vec(any::<u64>(), 0..700),
            at_once in 1usize..70,
            hashes in 1u32..=HASHES_MAX,
            words in 1usize..40,
        ) {
            let empty = || (vec![0; words], Counters::zero(words));
            let (mut plane_scalar, mut counters_scalar) = empty();
            fill_scalar(&mut plane_scalar, &mut counters_scalar, hashes, &keys);
            for fill in wide_kernels() {
                let (mut plane, mut counters) = empty();
                keys.chunks(at_once).for_each(|keys| fill(&mut plane, &mut counters, hashes, keys));
                prop_assert_eq!(&plane, &plane_scalar);
                prop_assert!(counters.iter().eq(counters_scalar.iter()));
            }
        }
    }

    #[test]
    fn counters_saturate_and_stay() {
        let (mut plane, mut counters) = (vec![0], Counters::zero(1));
        fill(&mut plane, &mut counters, 1, &[7; 14]);
        assert_eq!(counters.iter().sum::<u64>(), 14);
        fill(&mut plane, &mut counters, 1, &[7; 14]);
        assert_eq!((counters.iter().sum::<u64>(), plane[0].count_ones()), (15, 1));
    }
}
