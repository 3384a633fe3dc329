//! Counting Bloom filters (paper II-A) over u64 keys.

mod counters;
mod filter;
mod probe;
mod rates;

pub use filter::CountingBloomFilter;
pub use probe::Probe;
pub(crate) use probe::{HASH_A, HASH_B, HASH_C};
pub use rates::{FilterSettings, FilterSettingsError, HASHES_MAX, expected_rate, unblocked_rate};
