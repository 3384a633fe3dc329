//! `mrol cluster`, with its commands.

use clap::Subcommand;

use super::{adopt, check, config, copies, forget, keep, moving, status};
use mrol::console::{CliError, Output};

const EXAMPLES: &str = "\
EXAMPLES:
  mrol cluster config --server n1 --host 10.0.0.1 --peers 10.0.0.1,10.0.0.2,10.0.0.3 > nats-server.conf
                                                 settings for one of the three NATS servers
  mrol cluster status --nats nats://10.0.0.1:4222    who is there, who leads which map, who is behind
  mrol cluster check --config mrol.toml          is everything as it must be? The exit code says so
  mrol cluster move office n2 --config mrol.toml     node n2 is to lead map office
  mrol cluster copies office n1,n3 --config mrol.toml    nodes n1 and n3 hold map office, and no others
  mrol cluster adopt ./mrol-data --config mrol.toml  take the maps of a server into the cluster
  mrol cluster keep n2 office --config mrol.toml     where histories differ: n2's copy becomes the map
  mrol cluster forget n3 --config mrol.toml      node n3 left for good

A command reaches NATS as a node does: by the section `cluster` of --config FILE, MROL_CLUSTER__... variables, and --nats,
which comes last. `mrol cluster COMMAND --help` explains a command. To make a server a node: `mrol serve --help`.";

/// Look at a cluster of servers that share maps, and change who leads and who holds them
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(in crate::cli) struct Cluster {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    Status(status::Status),
    Check(check::Check),
    Move(moving::MoveLead),
    Copies(copies::SetCopies),
    Adopt(adopt::Adopt),
    Keep(keep::Keep),
    Forget(forget::Forget),
    Config(config::NatsConfig),
}

impl Cluster {
    pub(in crate::cli) fn run(self, output: Output) -> Result<(), CliError> {
        match self.action {
            Action::Status(status) => status.run(&output),
            Action::Check(check) => check.run(&output),
            Action::Move(moving) => moving.run(output),
            Action::Copies(copies) => copies.run(output),
            Action::Adopt(adopt) => adopt.run(output),
            Action::Keep(keep) => keep.run(&output),
            Action::Forget(forget) => forget.run(&output),
            Action::Config(config) => config.run(&output),
        }
    }
}
