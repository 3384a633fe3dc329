//! The command line: its commands and options, and how each is run.

use std::process::ExitCode;

use clap::{Parser, Subcommand};

use super::{bench, experiment};
use mrol::console::Serve;
use mrol::console::{CliError, Output, runtime};

const EXAMPLES: &str = "\
EXAMPLES:
  mrol-lab bench lookup
  mrol-lab experiment lookup --out results/

`mrol-lab COMMAND --help` explains a command, with examples.";

/// Measure mrol on this machine, and repeat the paper's experiments
#[derive(Debug, Parser)]
#[command(name = "mrol-lab", version, after_help = EXAMPLES)]
struct CommandLine {
    /// Print results as JSON, an object a line, for programs
    #[arg(long, global = true)]
    json: bool,
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Bench(bench::Bench),
    Experiment(experiment::Experiment),
    /// The server, as `mrol serve`: what is measured in a process of its own
    #[command(hide = true)]
    Serve(Box<Serve>),
    /// The attackers of `experiment attack`, in a process of their own
    #[command(hide = true)]
    Attackers(experiment::Attackers),
}

/// Runs the command line of this process and returns its exit code.
pub fn run() -> ExitCode {
    let CommandLine { json, command } = match CommandLine::try_parse() {
        Ok(parsed) => parsed,
        Err(unparsed) => {
            // Help for a pipe that was closed is no failure.
            let _ = unparsed.print();
            return ExitCode::from(unparsed.exit_code().clamp(0, 2) as u8);
        }
    };
    let output = Output::new(json);
    let done = match command {
        Command::Bench(bench) => bench.run(output),
        Command::Experiment(experiment) => experiment.run(output),
        Command::Attackers(attackers) => runtime::block_on(attackers.run(output)),
        Command::Serve(serve) => runtime::block_on(serve.run(output)),
    };
    done.map_or_else(CliError::report, |()| ExitCode::SUCCESS)
}
