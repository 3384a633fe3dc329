//! The command `bench`: which benchmark is run.

use clap::Subcommand;

use super::{
    align, growth, insert, journal, lookup, memory, nearest, planning, questions, rays, readers, replica,
    serve, soak, start, watch,
};
use mrol::console::error::CliError;
use mrol::console::output::Output;
use mrol::console::runtime;

const EXAMPLES: &str = "\
EXAMPLES:
  mrol-lab bench lookup                                   this map against other structures, in a simulated room
  mrol-lab bench lookup --workload site --order scan      the same on ten million voxels, as a sensor asks
  mrol-lab bench lookup --voxels map.ply --points scan.ply --resolution 0.05
  mrol-lab bench insert --workload site
  mrol-lab bench journal --workload site                  what it costs that nothing is lost
  mrol-lab bench growth --workload site                   memory, and who waits, while ten million voxels go in
  mrol-lab bench memory --workload site                   bytes a voxel, with filters and moments and without
  mrol-lab bench start --workload site                    a start with ten million voxels
  mrol-lab bench align scans/ --resolution 0.05
  mrol-lab bench rays                                     a panorama of a million rays in the room
  mrol-lab bench nearest --queries 100000                 how far points are from the nearest voxel
  mrol-lab bench readers --workload site                  readers beside each other, and beside a writer
  mrol-lab bench planning --workload site                 an arm among ten million voxels
  mrol-lab bench questions                                planners' questions to a server, beside scans
  mrol-lab bench serve                                    a load of point queries on a server of its own
  mrol-lab bench replica                                  a copy of a map that follows, and its queries
  mrol-lab bench watch                                    fifty who follow a map that is mapped
  mrol-lab bench soak                                     an hour under a fleet's load: memory, errors

Figures are medians of several runs; give the machine nothing else to do meanwhile. `mrol-lab bench WHAT --help`
explains each.";

/// Measure look-ups, insertions, alignments and a server's answers on this machine
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(in crate::cli) struct Bench {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, Subcommand)]
enum What {
    Lookup(lookup::Lookup),
    Insert(insert::Insert),
    Growth(growth::Growth),
    Memory(memory::Memory),
    Journal(journal::Journal),
    Align(align::Align),
    Planning(planning::Planning),
    Questions(questions::QuestionBench),
    Rays(rays::Rays),
    Nearest(nearest::Nearest),
    Readers(readers::Readers),
    Replica(replica::ReplicaBench),
    Serve(serve::Serve),
    Soak(soak::Soak),
    Start(start::Start),
    Watch(watch::WatchBench),
}

impl Bench {
    pub(in crate::cli) fn run(self, output: Output) -> Result<(), CliError> {
        match self.what {
            What::Lookup(lookup) => lookup.run(&output),
            What::Insert(insert) => insert.run(&output),
            What::Growth(growth) => growth.run(&output),
            What::Memory(memory) => memory.run(&output),
            What::Journal(journal) => runtime::block_on(journal.run(output)),
            What::Align(align) => align.run(&output),
            What::Planning(planning) => planning.run(&output),
            What::Questions(questions) => runtime::block_on(questions.run(output)),
            What::Rays(rays) => rays.run(&output),
            What::Nearest(nearest) => nearest.run(&output),
            What::Readers(readers) => readers.run(&output),
            What::Start(start) => start.run(&output),
            What::Serve(serve) => runtime::block_on(serve.run(output)),
            What::Soak(soak) => runtime::block_on(soak.run(output)),
            What::Replica(replica) => runtime::block_on(replica.run(output)),
            What::Watch(watch) => runtime::block_on(watch.run(output)),
        }
    }
}
