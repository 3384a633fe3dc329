//! The command `mrol key`.

use std::fmt;
use std::fmt::Display;
use std::num::NonZeroU32;
use std::path::PathBuf;

use clap::{Subcommand, ValueEnum};
use serde::Serialize;

use super::{change, list, name::name};
use mrol::access::{Expiry, Key, KeyLimits, KeyName, Scope, Secret, add_to_file, to_toml};
use mrol::console::CliError;
use mrol::console::Output;
use mrol::console::parse;
use mrol_map::map::{MapName, RobotName};
use mrol_service::AllowedMaps;

const EXAMPLES: &str = "\
EXAMPLES:
  mrol key new --name planner --scope read --file keys.toml
  mrol key new --name r1 --scope insert --maps hall,office --robots r1 --expires 2027-01-31 --file keys.toml
  mrol key list --file keys.toml                 every key: scope, maps, robots and expiry; secrets are not stored
  mrol key rotate --name r1 --file keys.toml     a new secret; the former one is valid for 24 more hours
  mrol key revoke --name r1 --file keys.toml     its streams and requests end
  mrol serve --keys-file keys.toml               needs keys, and reads the file again when it changes
  MROL_KEY=mrol_... mrol maps list               uses a key; or --key-file FILE, --key SECRET

Scopes, each with all rights of the one before:
  read     everything that changes nothing, including downloads of whole maps and metrics
  insert   scans of the key's robots, and undo of those
  write    deletions, keep-outs, and undo of any scan
  admin    create, restore and delete maps
Without --maps and --robots a key is valid for all of them.

The secret is printed once, on the first line, and not stored: the file holds its hash. The file is created if it does
not exist; it is replaced atomically, by one command at a time, and its comments are kept. A running server reads it
again by itself. Without --file, `mrol key new` changes no file, and prints the entry to put into one after the secret.";

/// Make, list, rotate and revoke the keys of callers of the server
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Keys {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// Make a key, and print its secret
    New(NewKey),
    /// List the keys: scope, maps, robots and expiry
    List(list::ListKeys),
    /// Remove a key from its file
    Revoke(change::RevokeKey),
    /// Replace the secret of a key, and print the new one
    Rotate(change::RotateKey),
}

#[derive(Debug, clap::Args)]
struct NewKey {
    /// Name of the key's holder: 1 to 64 of [A-Za-z0-9_.-]; the log and metrics show it
    #[arg(long, value_parser = name)]
    name: KeyName,
    /// What the key allows
    #[arg(long, value_enum)]
    scope: ScopeName,
    /// The maps that the key is valid for, separated by commas [default: every map]
    #[arg(long, value_name = "MAPS", value_delimiter = ',', value_parser = parse::map_name)]
    maps: Option<Vec<MapName>>,
    /// The robots whose scans the key may send and undo, separated by commas [default: every robot]
    #[arg(long, value_name = "ROBOTS", value_delimiter = ',', value_parser = parse::robot_name)]
    robots: Option<Vec<RobotName>>,
    /// When the key expires: 2027-01-31T12:00:00Z, or 2027-01-31 for the first moment of that day, UTC [default: never]
    #[arg(long, value_name = "TIME", value_parser = expiry)]
    expires: Option<Expiry>,
    /// Most requests a second with the key [default: limits.caller_requests_per_s_max of the server]
    #[arg(long, value_name = "N")]
    requests_per_s_max: Option<NonZeroU32>,
    /// Most requests in a burst, where requests a second are limited [default: 100]
    #[arg(long, value_name = "N", requires = "requests_per_s_max")]
    burst_max: Option<NonZeroU32>,
    /// Most requests with the key in work at a time [default: limits.caller_requests_at_once_max of the server]
    #[arg(long, value_name = "N")]
    requests_at_once_max: Option<NonZeroU32>,
    /// The file of keys to add it to, created if it does not exist [default: the entry is printed for you to add]
    #[arg(long, value_name = "FILE")]
    file: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum ScopeName {
    Read,
    Insert,
    Write,
    Admin,
}

/// A new key, to be printed.
#[derive(Serialize)]
struct Made {
    name: String,
    secret: String,
    sha256: String,
    scope: Scope,
    maps: Option<Vec<String>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    robots: Option<Vec<String>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    expires: Option<String>,
    #[serde(skip)]
    toml: Option<String>,
}

impl Keys {
    pub(crate) fn run(self, output: &Output) -> Result<(), CliError> {
        match self.action {
            Action::New(new) => new.run(output),
            Action::List(list) => list.run(output),
            Action::Revoke(revoke) => revoke.run(output),
            Action::Rotate(rotate) => rotate.run(output),
        }
    }
}

impl NewKey {
    fn run(self, output: &Output) -> Result<(), CliError> {
        let secret = Secret::random().map_err(CliError::failed)?;
        let key = self.key(&secret);
        if let Some(file) = &self.file {
            add_to_file(file, &key).map_err(CliError::failed)?;
        }
        output.print(&Made {
            name: self.name.to_string(),
            secret: secret.reveal().to_owned(),
            sha256: secret.digest().to_string(),
            scope: self.scope.into(),
            maps: self.maps.map(|maps| maps.iter().map(ToString::to_string).collect()),
            robots: self.robots.map(|robots| robots.iter().map(|robot| robot.as_str().to_owned()).collect()),
            expires: self.expires.map(|expires| expires.to_string()),
            toml: self.file.is_none().then(|| to_toml(&key)),
        })
    }

    fn key(&self, secret: &Secret) -> Key {
        let allowed_maps = self.maps.clone().map_or(AllowedMaps::Every, AllowedMaps::from_iter);
        let key = Key::new(self.name.clone(), secret.digest(), self.scope.into(), allowed_maps);
        let key = match &self.robots {
            Some(robots) => key.for_robots(robots.iter().cloned()),
            None => key,
        };
        let key = match self.expires {
            Some(expires) => key.until(expires),
            None => key,
        };
        key.with_limits(KeyLimits {
            requests_per_s_max: self.requests_per_s_max,
            burst_max: self.burst_max,
            requests_at_once_max: self.requests_at_once_max,
        })
    }
}

impl Display for Made {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.secret)?;
        self.toml.as_ref().map_or(Ok(()), |toml| write!(f, "\n\n{}", toml.trim_end()))
    }
}

impl From<ScopeName> for Scope {
    fn from(name: ScopeName) -> Self {
        match name {
            ScopeName::Read => Self::Read,
            ScopeName::Insert => Self::Insert,
            ScopeName::Write => Self::Write,
            ScopeName::Admin => Self::Admin,
        }
    }
}

fn expiry(text: &str) -> Result<Expiry, String> {
    Expiry::parse(text).ok_or_else(|| {
        format!("a time is 2027-01-31 or, with its offset, 2027-01-31T12:00:00Z, got {text:?}")
    })
}
