//! The command `experiment`: which experiment is run.

use clap::Subcommand;

use super::{
    attack, carving, convergence, deskewing, free_space, lookup, mapping, rounds, scaling, searches,
    simulation, verdicts,
};
use mrol::console::error::CliError;
use mrol::console::output::Output;
use mrol::console::runtime;

const EXAMPLES: &str = "\
EXAMPLES:
  mrol-lab experiment lookup --out results/        experiment 1 of the paper: lookup.svg, lookup.csv
  mrol-lab experiment scaling --out results/       cost a point against the size of the map: scaling.svg, .csv, .md
  mrol-lab experiment simulation --out results/    experiment 2 of the paper: poses with the filter, without, with a small one
  mrol-lab experiment mapping scans/ --resolution 0.05 --out results/
                                               experiment 3 of the paper: time and growth, scan by scan
  mrol-lab experiment convergence scans/0000.ply scans/0001.ply --truth poses.txt --resolution 0.1 --out results/
                                               share of alignments that find the pose, against how far off the guess is
  mrol-lab experiment deskewing --out results/     poses of a lidar that moves while it turns
  mrol-lab experiment free-space hall/ --truth hall/poses.txt --resolution 0.1 --peer-scans scans.bin
                                               what is known to be free, beside OctoMap
  mrol-lab experiment rounds                       what a map keeps of a robot that drives the same way for an hour
  mrol-lab experiment carving                      what a map loses of what is taken away, and keeps of what stands
  mrol-lab experiment searches hall/:0.1:hall      whether lost robots are found, and what that takes
  mrol-lab experiment attack --seconds 120         what honest callers wait for while others ask for all they can
  mrol-lab experiment verdicts hall/:0.1:hall office/:0.04:office
                                               wrong poses accepted and right ones refused; simulated places too

Everything is measured when it is asked for, on one core; give the machine nothing else to do meanwhile.";

/// Repeat the paper's experiments, and see how cost and alignments scale: plots and tables
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(in crate::cli) struct Experiment {
    #[command(subcommand)]
    which: Which,
}

#[derive(Debug, Subcommand)]
enum Which {
    Attack(attack::AttackExperiment),
    Carving(carving::Carving),
    Convergence(convergence::Convergence),
    Deskewing(deskewing::Deskewing),
    FreeSpace(free_space::FreeSpace),
    Lookup(lookup::Lookup),
    Mapping(mapping::Mapping),
    Rounds(rounds::Rounds),
    Scaling(scaling::Scaling),
    Searches(searches::SearchExperiment),
    Simulation(simulation::Simulation),
    Verdicts(verdicts::Verdicts),
}

impl Experiment {
    pub(in crate::cli) fn run(self, output: Output) -> Result<(), CliError> {
        match self.which {
            Which::Attack(attack) => runtime::block_on(attack.run(output)),
            Which::Carving(carving) => carving.run(&output),
            Which::Convergence(convergence) => convergence.run(&output),
            Which::Deskewing(deskewing) => deskewing.run(&output),
            Which::FreeSpace(free_space) => free_space.run(&output),
            Which::Lookup(lookup) => lookup.run(&output),
            Which::Mapping(mapping) => mapping.run(&output),
            Which::Rounds(rounds) => rounds.run(&output),
            Which::Scaling(scaling) => scaling.run(&output),
            Which::Searches(searches) => searches.run(&output),
            Which::Simulation(simulation) => simulation.run(&output),
            Which::Verdicts(verdicts) => verdicts.run(&output),
        }
    }
}
