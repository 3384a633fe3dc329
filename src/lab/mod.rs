//! The lab: simulation, benchmarks and experiments, behind `mrol demo`, `mrol bench` and `mrol experiment`.
//!
//! The daemon does not use it, and the container image is built without it. In reading order:
//!
//! * [`simulate`]: buildings, sensors and tours through them; a small feature of its own, for tests and examples.
//! * [`workload`]: what is put into a map, and what it is asked.
//! * [`rivals`]: other structures that answer the same question, with the same transform.
//! * [`measure`]: what look-ups, insertions, alignments, journals and starts cost.
//! * [`experiment`]: the paper's experiments (IV).
//! * [`explore`]: a robot that maps a building by itself.
//! * `fleet`: a server under the load of planners and robots.
//! * [`report`]: results as tables and plots in files.
//!
//! What `measure` and `experiment` time runs in this process, without a network. Benchmarks of single kernels are in
//! `benches/`.

#[cfg(feature = "lab")]
pub mod experiment;
#[cfg(feature = "lab")]
pub mod explore;
#[cfg(feature = "lab")]
pub(crate) mod fleet;
#[cfg(feature = "lab")]
pub mod measure;
#[cfg(feature = "lab")]
pub mod report;
#[cfg(feature = "lab")]
pub mod rivals;
pub mod simulate;
#[cfg(feature = "lab")]
pub mod workload;
