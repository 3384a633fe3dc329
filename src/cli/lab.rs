//! Commands that are a program of their own now: they say where they went.

use clap::Subcommand;

use mrol::console::CliError;

const EXAMPLES: &str = "\
EXAMPLES:
  cargo run --release -p mrol-lab -- bench lookup
  cargo run --release -p mrol-lab -- experiment lookup --out results/";

/// The commands of the lab.
#[derive(Debug, Subcommand)]
pub(super) enum Lab {
    /// Moved to the program mrol-lab: measure the server on this machine
    Bench(Moved),
    /// Moved to the program mrol-lab: repeat the paper's experiments
    Experiment(Moved),
}

/// Any arguments of a command that moved.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Moved {
    #[arg(hide = true, trailing_var_arg = true, allow_hyphen_values = true)]
    arguments: Vec<String>,
}

impl Lab {
    pub(super) fn run(self) -> Result<(), CliError> {
        let (name, moved) = match self {
            Self::Bench(moved) => ("bench", moved),
            Self::Experiment(moved) => ("experiment", moved),
        };
        let command = [name.to_owned()].into_iter().chain(moved.arguments).collect::<Vec<_>>().join(" ");
        Err(CliError::usage(format!(
            "`mrol {name}` moved to a program of its own; from the sources: cargo run --release -p mrol-lab -- {command}"
        )))
    }
}
