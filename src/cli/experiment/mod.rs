//! `mrol experiment`: the paper's experiments again, as plots and tables.

mod chart;
mod lookup;
mod scaling;
mod spread;
mod table;

use clap::Subcommand;

use super::error::CliError;
use super::output::Output;

const EXAMPLES: &str = "\
EXAMPLES:
  mrol experiment lookup --out results/        experiment 1 of the paper: lookup.svg, lookup.csv
  mrol experiment scaling --out results/       cost a point against the size of the map: scaling.svg, .csv, .md

Everything is measured when it is asked for, on one core; give the machine nothing else to do meanwhile.";

/// Repeat the paper's first experiment, and see how cost grows with the map: plots and tables
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Experiment {
    #[command(subcommand)]
    which: Which,
}

#[derive(Debug, Subcommand)]
enum Which {
    Lookup(lookup::Lookup),
    Scaling(scaling::Scaling),
}

impl Experiment {
    pub(super) fn run(self, output: Output) -> Result<(), CliError> {
        match self.which {
            Which::Lookup(lookup) => lookup.run(&output),
            Which::Scaling(scaling) => scaling.run(&output),
        }
    }
}
