//! Placeholders of the lab's commands in a program that was built for the daemon alone.

use clap::Subcommand;

use super::error::CliError;
use super::output::Output;

const EXAMPLES: &str = "\
EXAMPLES:
  cargo run --release -- demo      from the sources: a program with all commands";

/// The commands that this program does not have.
#[derive(Debug, Subcommand)]
pub(super) enum Lab {
    /// Not in this program, which was built without the lab: see the daemon at work
    Demo(Ignored),
    /// Not in this program, which was built without the lab: measure it on this machine
    Bench(Ignored),
    /// Not in this program, which was built without the lab: repeat the paper's experiments
    Experiment(Ignored),
}

/// Any arguments of a command that this program does not have.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Ignored {
    #[arg(hide = true, trailing_var_arg = true, allow_hyphen_values = true)]
    arguments: Vec<String>,
}

impl Lab {
    pub(super) fn run(self, _output: Output) -> Result<(), CliError> {
        let (name, ignored) = match self {
            Self::Demo(ignored) => ("demo", ignored),
            Self::Bench(ignored) => ("bench", ignored),
            Self::Experiment(ignored) => ("experiment", ignored),
        };
        let command = [name.to_owned()].into_iter().chain(ignored.arguments).collect::<Vec<_>>().join(" ");
        Err(CliError::usage(format!(
            "`mrol {name}` is not in this program: it was built without the feature `lab`, as in the container image, \
             which holds the daemon alone. From the sources, `cargo run --release -- {command}` runs it."
        )))
    }
}
