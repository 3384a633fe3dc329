//! Counting Bloom filters (paper II-A) over u64 keys.

mod counters;
mod fill;
mod filter;
mod probe;
mod rates;

pub use filter::CountingBloomFilter;
pub use probe::Probe;
#[cfg(target_arch = "x86_64")]
pub(crate) use probe::{BITS_OF_HASH, HASH_BITS, HASH_MIX, HASH_NEXT, HASH_WORD};
pub use rates::{FilterSettings, FilterSettingsError, HASHES_MAX, expected_rate, ideal_false_positive_rate};
