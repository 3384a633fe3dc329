//! What `mrol bench` and `mrol experiment` measure: workloads, other structures to compare with, and the clock.
//!
//! Everything here runs in this process on one thread, without a network; the load generator lives with the command
//! line, which knows the client.

pub mod align;
pub mod compare;
pub mod convergence;
pub mod drift;
pub mod growth;
pub mod insert;
pub mod journal;
pub mod mapping;
pub mod readers;
pub mod stages;
pub mod start;
pub mod stopwatch;
pub mod structures;
pub mod workload;
