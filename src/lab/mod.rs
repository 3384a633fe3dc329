//! Everything that simulates, measures or compares: what `mrol demo`, `bench` and `experiment` are made of.
//!
//! Nothing of the daemon names it, and the image is built without it. In the order of a reading:
//!
//! * [`simulate`]: buildings, sensors and tours through them; a small feature of its own, for tests and examples.
//! * [`workload`]: what is put into a map, and what it is asked.
//! * [`rivals`]: other structures that answer the same question, with the same transform.
//! * [`measure`]: what look-ups, insertions, alignments, journals and starts cost.
//! * [`experiment`]: the paper's experiments (IV).
//! * `fleet`: a server under the load of planners and robots.
//! * [`report`]: results as tables and plots in files.
//!
//! What `measure` and `experiment` time runs in this process, without a network.

#[cfg(feature = "lab")]
pub mod experiment;
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
