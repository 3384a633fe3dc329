//! Small tools that know nothing of maps: bits of a word, a prefetch, the stop signal of long work.

pub(crate) mod bits;
mod prefetch;
mod stop_signal;

pub(crate) use prefetch::prefetch;
pub use stop_signal::StopSignal;
