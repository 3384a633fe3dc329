//! Small tools that know nothing of maps: bits of a word, a prefetch, a hash of words, how long
//! things take, the stop signal of long work.

pub mod bits;
mod clock;
#[cfg(target_arch = "x86_64")]
pub mod cpu;
mod digest;
mod durations;
mod excerpt;
mod keyword;
mod prefetch;
mod sorting;
mod stop_signal;

pub use clock::unix_time_ns;
pub use digest::{Digest, mixed};
pub use durations::{Durations, SharedDurations};
pub use excerpt::excerpt;
pub use keyword::{Keyword, words};
pub use prefetch::prefetch;
pub use sorting::{sort_by_key_giving_way, sort_by_key_until};
pub use stop_signal::{GiveWay, StopSignal};
