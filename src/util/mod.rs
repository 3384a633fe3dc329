//! Small tools that know nothing of maps: bits of a word, a prefetch, how long things take, the
//! stop signal of long work, what was built.

pub(crate) mod bits;
#[cfg(feature = "server")]
pub(crate) mod build;
#[cfg(feature = "client")]
mod clock;
#[cfg(target_arch = "x86_64")]
pub(crate) mod cpu;
mod durations;
mod excerpt;
mod keyword;
mod prefetch;
mod sorting;
mod stop_signal;

#[cfg(feature = "client")]
pub(crate) use clock::unix_time_ns;
pub use durations::{Durations, SharedDurations};
pub use excerpt::excerpt;
pub use keyword::{Keyword, words};
pub(crate) use prefetch::prefetch;
pub(crate) use sorting::sort_by_key_until;
pub use stop_signal::StopSignal;
