//! The whole command line, and how it is run.

use std::process::ExitCode;

use clap::{CommandFactory, Parser, Subcommand};

#[cfg(feature = "logs")]
use super::log;
use super::{
    block, check, classify, cluster, completions, config, delete, doctor, events, export, frontiers, grid,
    health, import, insert, keepout, key, lab, localize, man, map, maps, nearest, observers, query, rays,
    snapshot, undo, watch,
};
use crate::demo::Demo;
use mrol::build_info;
use mrol::console::{CliError, Output, Serve, runtime};

const EXAMPLES: &str = "\
EXAMPLES:
  mrol demo                     see it work: two simulated robots, a planner, the real daemon
  mrol serve                    run the daemon: HTTP on 127.0.0.1:7333, gRPC on 127.0.0.1:7334
  mrol maps create office --resolution 0.05 --levels 5
  mrol insert scans/ --map office
  mrol query --map office --point 1.0,2.5,0.3
  mrol map scans/ --resolution 0.05 --out office.mrol      no daemon needed

`mrol COMMAND --help` explains a command, with examples.

EXIT CODES:
  0  success
  1  the command failed
  2  the command line is wrong
  3  insert, localize: at least one scan was answered and not accepted";

/// A networked multi-resolution voxel map: robots send scans, planners ask about points
#[derive(Debug, Parser)]
#[command(name = "mrol", version, long_version = build_info::DESCRIPTION, after_help = EXAMPLES)]
pub(super) struct CommandLine {
    /// Print results as JSON, an object a line, for programs
    #[arg(long, global = true)]
    json: bool,
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Serve(Serve),
    Demo(Demo),
    Map(map::Map),
    Insert(insert::Insert),
    #[cfg(feature = "logs")]
    Log(log::Log),
    Localize(localize::Localize),
    Query(query::Query),
    Check(check::Check),
    Rays(rays::CastRays),
    Nearest(nearest::Nearest),
    Classify(classify::Classify),
    Frontiers(frontiers::ListFrontiers),
    Grid(grid::DrawGrid),
    Block(block::Block),
    Observers(observers::Observers),
    Events(events::Events),
    Delete(delete::Delete),
    Undo(undo::Undo),
    Keepout(keepout::KeepOuts),
    Watch(watch::Watch),
    Maps(maps::Maps),
    Cluster(cluster::Cluster),
    Health(health::Health),
    Key(key::Keys),
    Snapshot(snapshot::TakeSnapshots),
    Restore(snapshot::Restore),
    Export(export::Export),
    Import(import::Import),
    Doctor(doctor::Doctor),
    Config(config::Settings),
    Completions(completions::Completions),
    Man(man::Man),
    #[command(flatten)]
    Lab(lab::Lab),
}

/// Runs the command line of this process and returns its exit code.
pub(crate) fn run() -> ExitCode {
    let CommandLine { json, command } = match CommandLine::try_parse() {
        Ok(parsed) => parsed,
        Err(unparsed) => {
            // Help for a pipe that was closed is no failure.
            let _ = unparsed.print();
            return ExitCode::from(unparsed.exit_code().clamp(0, 2) as u8);
        }
    };
    match command.run(Output::new(json)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => error.report(),
    }
}

impl Command {
    fn run(self, output: Output) -> Result<(), CliError> {
        match self {
            Self::Serve(serve) => runtime::block_on(serve.run(output)),
            Self::Demo(demo) => runtime::block_on(demo.run(output)),
            Self::Map(map) => map.run(output),
            Self::Insert(insert) => runtime::block_on(insert.run(output)),
            #[cfg(feature = "logs")]
            Self::Log(log) => log.run(&output),
            Self::Localize(localize) => runtime::block_on(localize.run(output)),
            Self::Query(query) => runtime::block_on(query.run(output)),
            Self::Check(check) => runtime::block_on(check.run(output)),
            Self::Rays(rays) => runtime::block_on(rays.run(output)),
            Self::Nearest(nearest) => runtime::block_on(nearest.run(output)),
            Self::Classify(classify) => runtime::block_on(classify.run(output)),
            Self::Frontiers(frontiers) => runtime::block_on(frontiers.run(output)),
            Self::Grid(grid) => runtime::block_on(grid.run(output)),
            Self::Block(block) => runtime::block_on(block.run(output)),
            Self::Observers(observers) => runtime::block_on(observers.run(output)),
            Self::Events(events) => runtime::block_on(events.run(output)),
            Self::Delete(delete) => runtime::block_on(delete.run(output)),
            Self::Undo(undo) => runtime::block_on(undo.run(output)),
            Self::Keepout(keepout) => runtime::block_on(keepout.run(output)),
            Self::Watch(watch) => runtime::block_on(watch.run(output)),
            Self::Cluster(cluster) => cluster.run(output),
            Self::Maps(maps) => runtime::block_on(maps.run(output)),
            Self::Health(health) => runtime::block_on(health.run(output)),
            Self::Key(key) => key.run(&output),
            Self::Snapshot(snapshot) => runtime::block_on(snapshot.run(output)),
            Self::Restore(restore) => runtime::block_on(restore.run(output)),
            Self::Export(export) => runtime::block_on(export.run(output)),
            Self::Import(import) => import.run(output),
            Self::Doctor(doctor) => doctor.run(output),
            Self::Config(config) => config.run(&output),
            Self::Completions(completions) => completions.run(CommandLine::command(), &output),
            Self::Man(man) => man.run(CommandLine::command(), &output),
            Self::Lab(lab) => lab.run(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        CommandLine::command().debug_assert();
    }

    #[test]
    fn variables_of_options_are_told_from_settings() {
        fn variables(command: &clap::Command, found: &mut std::collections::BTreeSet<String>) {
            let names = command.get_arguments().filter_map(|argument| argument.get_env());
            found.extend(names.map(|name| name.to_string_lossy().into_owned()));
            command.get_subcommands().for_each(|command| variables(command, found));
        }
        let mut found = std::collections::BTreeSet::new();
        variables(&CommandLine::command(), &mut found);
        let known = mrol::config::VARIABLES_OF_COMMANDS.iter().map(|name| format!("MROL_{name}"));
        assert_eq!(found, known.collect());
    }

    /// The words of an example, as a shell takes them apart.
    fn words_of(example: &str) -> Vec<String> {
        let parts = example.split('"').enumerate();
        parts
            .flat_map(|(i, part)| match i % 2 {
                0 => part.split_whitespace().map(str::to_owned).collect(),
                _ => vec![part.to_owned()],
            })
            .collect()
    }

    /// The commands of a command, and theirs.
    fn with_inner(command: &clap::Command) -> Vec<&clap::Command> {
        command.get_subcommands().flat_map(|command| [vec![command], with_inner(command)].concat()).collect()
    }

    #[test]
    fn every_example_is_a_command_line() {
        for command in with_inner(&CommandLine::command()) {
            let help = command.get_after_help().map(ToString::to_string).unwrap_or_default();
            let examples =
                help.lines().filter_map(|line| line.strip_prefix("  ")).filter(|line| line.contains("mrol "));
            for example in examples.filter(|line| line.starts_with("mrol ") || line.starts_with("MROL_")) {
                // Behind it stands what it does, or another program.
                let alone =
                    example.split("  ").next().and_then(|line| line.split(" | ").next()).unwrap_or_default();
                let alone =
                    alone.split(" > ").next().and_then(|line| line.split(" && ").next()).unwrap_or_default();
                let words = words_of(&alone[alone.find("mrol ").unwrap()..]);
                let parsed = CommandLine::try_parse_from(words);
                assert!(parsed.is_ok(), "{example}: {}", parsed.unwrap_err());
            }
        }
    }

    #[test]
    fn every_command_says_what_it_does_and_shows_examples() {
        for command in CommandLine::command().get_subcommands() {
            assert!(command.get_about().is_some(), "{}", command.get_name());
            let examples = command.get_after_help().map(ToString::to_string).unwrap_or_default();
            assert!(examples.starts_with("EXAMPLES:\n"), "{}", command.get_name());
        }
    }
}
