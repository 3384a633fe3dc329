//! Tests of the service as a whole.

mod looks;
#[cfg(feature = "shuttle")]
mod modeled;
mod sleeping;
mod turns;
