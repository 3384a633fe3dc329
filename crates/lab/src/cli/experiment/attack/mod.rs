//! `mrol-lab experiment attack`: what honest callers wait for while others ask for all that they may.

mod attackers;
mod command;
mod report;

pub(in crate::cli) use attackers::Attackers;
pub(super) use command::AttackExperiment;
