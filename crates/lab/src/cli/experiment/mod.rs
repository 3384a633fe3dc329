//! `mrol-lab experiment`: repeats the paper's experiments, with plots and tables as results.

mod attack;
mod carving;
mod command;
mod convergence;
mod deskewing;
mod free_space;
mod lookup;
mod mapping;
mod rounds;
mod scaling;
mod searches;
mod set_option;
mod simulation;
mod verdicts;

pub(in crate::cli) use attack::Attackers;
pub(in crate::cli) use command::Experiment;
