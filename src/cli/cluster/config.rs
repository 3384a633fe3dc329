//! `mrol cluster config`: settings for a NATS server.

use std::collections::BTreeSet;
use std::fmt;
use std::fmt::Display;

use serde::Serialize;

use mrol::console::{CliError, Output};

const EXAMPLES: &str = "\
EXAMPLES:
  mrol cluster config --server n1 --host 10.0.0.1 --peers 10.0.0.1,10.0.0.2,10.0.0.3 > nats-server.conf
  nats-server -c nats-server.conf
  mrol cluster config --server n1 --host 127.0.0.1 --peers 127.0.0.1
                                                 one server by itself, to try things out: cluster.replicas must be 1

Do the same on the other hosts, each with its own --server and --host, and the same --peers. `mrol cluster check` looks whether
the servers that run have what is needed.";

/// Characters that a name or a host may have, at most.
const LENGTH_MAX: usize = 255;
/// How many servers may share a cluster: an odd number, so that the loss of one leaves a majority.
const PEERS: [usize; 3] = [1, 3, 5];

/// Print a nats-server.conf for one of the NATS servers
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct NatsConfig {
    /// Name of the NATS server, which no other has
    #[arg(long, value_name = "NAME", value_parser = server_name)]
    server: String,
    /// Address of this server's host, at which it listens: one of --peers
    #[arg(long, value_name = "HOST", value_parser = host)]
    host: String,
    /// Addresses of the hosts of all NATS servers, this one's among them: 1, 3 or 5
    #[arg(long, value_name = "HOSTS", value_delimiter = ',', required = true, value_parser = host)]
    peers: Vec<String>,
    /// Folder of the server for its streams
    #[arg(long, value_name = "DIR", default_value = "/var/lib/nats", value_parser = folder)]
    store_dir: String,
}

impl NatsConfig {
    pub(super) fn run(self, output: &Output) -> Result<(), CliError> {
        output.print(&Printed { nats_server_conf: self.text()? })
    }

    fn text(&self) -> Result<String, CliError> {
        let Self { server, host, peers, store_dir } = self;
        let count = peers.len();
        if !PEERS.contains(&count) {
            return Err(CliError::usage(format!(
                "--peers must name 1, 3 or 5 hosts, got {count}: most of the servers must run, so that 3 outlive the loss of \
                 one, and so do 4"
            )));
        }
        if let Some(again) = repeated(peers) {
            return Err(CliError::usage(format!(
                "--peers names {again} twice: each server has a host of its own"
            )));
        }
        if !peers.contains(host) {
            let all = peers.join(",");
            return Err(CliError::usage(format!("--host must be one of --peers ({all}), got {host}")));
        }
        let mut text = format!(
            "\
# NATS server {server}, of {count} that the nodes of a cluster of mrol share. Start it with
#
#     nats-server -c nats-server.conf
#
# and look with `mrol cluster check --nats nats://{host}:4222 --monitor http://127.0.0.1:8222` whether all is well.

# Each server has a name of its own, and keeps it.
server_name: \"{server}\"

# Where nodes connect: `mrol serve --cluster nats://{host}:4222,...`. Whoever reaches this port can change the maps: let a
# firewall keep others out, or ask for a password, which the nodes have in the address, nats://USER:PASSWORD@{host}:4222:
#
#     authorization {{ user: mrol, password: \"...\" }}
listen: \"{host}:4222\"

# The monitoring port, for this machine alone: it tells whether `sync_interval` is in force.
http: \"127.0.0.1:8222\"

# A message of a map's log takes 768 KiB at most, and its headers.
max_payload: 1MB

jetstream {{
    # A folder on a disk of its own, if there is one: every change waits for its sync.
    store_dir: \"{store_dir}\"
    # What is acknowledged is on the disk. Without this line NATS syncs every two minutes, and a loss of power at all
    # servers at once takes changes that were acknowledged.
    sync_interval: always
}}
"
        );
        if count > 1 {
            let routes: Vec<String> = peers.iter().map(|peer| format!("\"nats://{peer}:6222\"")).collect();
            text += &format!(
                "
cluster {{
    # The same on all servers.
    name: \"mrol\"
    # Where the other servers connect.
    listen: \"{host}:6222\"
    routes: [
        {}
    ]
}}
",
                routes.join("\n        ")
            );
        }
        Ok(text)
    }
}

fn repeated(peers: &[String]) -> Option<&String> {
    let mut seen = BTreeSet::new();
    peers.iter().find(|peer| !seen.insert(*peer))
}

/// Parses the name of a NATS server.
fn server_name(text: &str) -> Result<String, String> {
    let fits = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    match (1..=LENGTH_MAX).contains(&text.len()) && text.chars().all(fits) {
        true => Ok(text.to_owned()),
        false => Err(format!("must be 1 to {LENGTH_MAX} of [A-Za-z0-9_-], got {text:?}")),
    }
}

/// Parses a host without a port: a name, an IPv4 address, or an IPv6 address in brackets.
fn host(text: &str) -> Result<String, String> {
    let inner = text.strip_prefix('[').and_then(|text| text.strip_suffix(']'));
    let fits = match inner {
        Some(address) => address.parse::<std::net::Ipv6Addr>().is_ok(),
        None => text.chars().all(|c| c.is_ascii_alphanumeric() || c == '-' || c == '.' || c == '_'),
    };
    match (1..=LENGTH_MAX).contains(&text.len()) && fits {
        true => Ok(text.to_owned()),
        false => Err(format!(
            "must be a host's name or address without a port, [..] around one of IPv6, got {text:?}"
        )),
    }
}

/// Parses a folder that can stand between quotes.
fn folder(text: &str) -> Result<String, String> {
    match !text.is_empty() && !text.contains(['"', '\\', '\n', '\r']) {
        true => Ok(text.to_owned()),
        false => Err(format!("must be a path without quotes, backslashes and line breaks, got {text:?}")),
    }
}

#[derive(Serialize)]
struct Printed {
    nats_server_conf: String,
}

impl Display for Printed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.nats_server_conf.trim_end())
    }
}
