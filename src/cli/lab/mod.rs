//! The commands of the lab: `demo`, `bench` and `experiment`.

mod bench;
mod demo;
mod experiment;
mod sequence;

use clap::Subcommand;

use super::error::CliError;
use super::output::Output;
use super::runtime;
use crate::lab::fleet::FleetError;
use crate::lab::report::ReportError;

/// The commands that simulate, measure and compare.
#[derive(Debug, Subcommand)]
pub(super) enum Lab {
    Demo(demo::Demo),
    Bench(bench::Bench),
    Experiment(experiment::Experiment),
}

impl From<FleetError> for CliError {
    fn from(error: FleetError) -> Self {
        match error {
            FleetError::Client(error) => error.into(),
            FleetError::Server(error) => error.into(),
            FleetError::Usage(message) => Self::usage(message),
            FleetError::Failed(message) => Self::failed(message),
        }
    }
}

impl From<ReportError> for CliError {
    fn from(error: ReportError) -> Self {
        Self::failed(error)
    }
}

impl Lab {
    pub(super) fn run(self, output: Output) -> Result<(), CliError> {
        match self {
            Self::Demo(demo) => runtime::block_on(demo.run(output)),
            Self::Bench(bench) => bench.run(output),
            Self::Experiment(experiment) => experiment.run(output),
        }
    }
}
