//! Tests of the service as a whole.

mod elsewhere;
mod forwarding;
mod leading;
mod looks;
#[cfg(feature = "shuttle")]
mod modeled;
mod sleeping;
mod turns;
mod two_nodes;
