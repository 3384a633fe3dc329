//! The lab: benchmarks and experiments, a program of its own.
//!
//! In reading order:
//!
//! * [`workload`]: what is put into a map, and what it is asked.
//! * [`rivals`]: other structures that answer the same question, with the same transform.
//! * [`measure`]: what look-ups, insertions, alignments, journals and starts cost.
//! * [`experiment`]: the paper's experiments (IV), and those on what goes beyond it.
//! * `fleet`: a server under the load of planners and robots.
//! * [`report`]: results as tables and plots in files.
//! * [`cli`]: the program, `mrol-lab bench` and `mrol-lab experiment`.
//!
//! What [`measure`] and [`experiment`] time runs in this process, without a network. Benchmarks of single kernels are
//! in `benches/`.

pub mod cli;
pub mod experiment;
mod fleet;
pub mod measure;
pub mod report;
pub mod rivals;
pub mod workload;
