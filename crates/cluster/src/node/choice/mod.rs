//! Who is to lead a map.
//!
//! Reading order: `known` is what a node knows when it chooses; `claiming` says whether it claims to lead, `opening`
//! when one that has claimed takes over, and `handing` to whom one that leads gives the lead; `choose` is the whole of
//! it.

mod choose;
mod claiming;
mod handing;
mod known;
mod opening;
#[cfg(test)]
mod tests;

pub(super) use choose::choose;
pub(super) use known::{Choice, Known};
