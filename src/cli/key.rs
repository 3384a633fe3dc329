//! `mrol key`: keys for callers.

mod change;
mod list;

use std::fmt::{self, Display};
use std::num::NonZeroU32;
use std::path::PathBuf;

use clap::{Subcommand, ValueEnum};
use serde::Serialize;

use super::error::CliError;
use super::output::Output;
use super::parse;
use crate::access::{Expiry, Key, KeyLimits, KeyName, Scope, Secret, add_to_file, to_toml};
use crate::map::{MapName, RobotName};
use crate::service::AllowedMaps;

const EXAMPLES: &str = "\
EXAMPLES:
  mrol key new --name planner --scope read --file keys.toml
  mrol key new --name r1 --scope insert --maps hall,office --robots r1 --expires 2027-01-31 --file keys.toml
  mrol key list --file keys.toml                 every key: scope, maps, robots and end; secrets are kept nowhere
  mrol key rotate --name r1 --file keys.toml     another secret; the former one counts for 24 hours more
  mrol key revoke --name r1 --file keys.toml     what was begun with it ends
  mrol serve --keys-file keys.toml               asks for keys, and reads the file again when it changes
  MROL_KEY=mrol_... mrol maps list               shows one; or --key-file FILE, --key SECRET

read: everything that changes nothing, downloads of whole maps and metrics among it. insert: scans as well, and undo of
those of its robots. write: deletions and undo of anything as well. admin: makes, restores and deletes maps as well. Without
--maps and --robots a key is for all of them.

The secret is printed once, on the first line, and kept nowhere: the file holds its hash. A file that is not there is made;
it is changed as a whole and by one command at a time, and comments in it stay. A server that runs reads it again by
itself. Without --file, `mrol key new` changes nothing: behind the secret it prints the entry to put into a file.";

/// Make, list, rotate and revoke the keys of callers of the server
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Keys {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// Make a key, and print its secret
    New(NewKey),
    /// Print what each key is for, and until when
    List(list::ListKeys),
    /// Take a key out of its file
    Revoke(change::RevokeKey),
    /// Give a key another secret, and print that
    Rotate(change::RotateKey),
}

#[derive(Debug, clap::Args)]
struct NewKey {
    /// Who it is for: 1 to 64 of [A-Za-z0-9_.-]; the log and metrics call its holder so
    #[arg(long, value_parser = name)]
    name: KeyName,
    /// What it is for
    #[arg(long, value_enum)]
    scope: ScopeName,
    /// The maps that it is for, separated by commas [default: every map]
    #[arg(long, value_name = "MAPS", value_delimiter = ',', value_parser = parse::map_name)]
    maps: Option<Vec<MapName>>,
    /// The robots whose scans it sends and undoes, separated by commas [default: every robot]
    #[arg(long, value_name = "ROBOTS", value_delimiter = ',', value_parser = parse::robot_name)]
    robots: Option<Vec<RobotName>>,
    /// When it ends: 2027-01-31T12:00:00Z, or 2027-01-31 for the first moment of that day, UTC [default: never]
    #[arg(long, value_name = "TIME", value_parser = expiry)]
    expires: Option<Expiry>,
    /// Requests a second of its holder [default: limits.caller_requests_per_s_max of the server]
    #[arg(long, value_name = "N")]
    requests_per_s_max: Option<NonZeroU32>,
    /// As many may come at once, where they are limited to some a second [default: 100]
    #[arg(long, value_name = "N", requires = "requests_per_s_max")]
    burst_max: Option<NonZeroU32>,
    /// Requests of its holder in work at a time [default: limits.caller_requests_at_once_max of the server]
    #[arg(long, value_name = "N")]
    requests_at_once_max: Option<NonZeroU32>,
    /// The file of keys to add it to, made where it is not there [default: the entry is printed for you to add]
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

/// A key that was made.
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
    pub(super) fn run(self, output: &Output) -> Result<(), CliError> {
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

fn name(text: &str) -> Result<KeyName, String> {
    KeyName::new(text).ok_or_else(|| format!("a name is 1 to 64 of [A-Za-z0-9_.-], got {text:?}"))
}

fn expiry(text: &str) -> Result<Expiry, String> {
    Expiry::parse(text).ok_or_else(|| {
        format!("a time is 2027-01-31 or, with its offset, 2027-01-31T12:00:00Z, got {text:?}")
    })
}
