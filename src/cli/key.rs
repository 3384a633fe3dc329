//! `mrol key`: keys for callers.

use std::fmt::{self, Display};
use std::path::PathBuf;

use clap::{Subcommand, ValueEnum};
use serde::Serialize;

use super::error::CliError;
use super::output::Output;
use super::parse;
use crate::access::{Key, KeyName, Scope, Secret, add_to_file, to_toml};
use crate::map::MapName;
use crate::service::MapReach;

const EXAMPLES: &str = "\
EXAMPLES:
  mrol key new --name planner --scope read --file keys.toml
  mrol key new --name r1 --scope write --maps hall,office --file keys.toml
  mrol serve --keys-file keys.toml               asks for keys, and reads the file again when it changes
  MROL_KEY=mrol_... mrol maps list               shows one; or --key-file FILE, --key SECRET

read: everything that changes nothing. write: scans, deletions and undo as well. admin: makes, restores and deletes maps
as well.

The secret is printed once and kept nowhere: the file holds its hash. To take a key back, take its table out of the
file; what was begun with it ends.";

/// Make keys for callers of the server
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
    /// The file of keys to add it to [default: it is printed]
    #[arg(long, value_name = "FILE")]
    file: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum ScopeName {
    Read,
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
    #[serde(skip)]
    toml: Option<String>,
}

impl Keys {
    pub(super) fn run(self, output: &Output) -> Result<(), CliError> {
        let Action::New(new) = self.action;
        new.run(output)
    }
}

impl NewKey {
    fn run(self, output: &Output) -> Result<(), CliError> {
        let secret = Secret::random().map_err(CliError::failed)?;
        let (digest, scope) = (secret.digest(), self.scope.into());
        let reach = self.maps.clone().map_or(MapReach::Every, MapReach::from_iter);
        let key = Key::new(self.name.clone(), digest, scope, reach);
        if let Some(file) = &self.file {
            add_to_file(file, &key).map_err(CliError::failed)?;
        }
        output.print(&Made {
            name: self.name.to_string(),
            secret: secret.reveal().to_owned(),
            sha256: digest.to_string(),
            scope,
            maps: self.maps.map(|maps| maps.iter().map(ToString::to_string).collect()),
            toml: self.file.is_none().then(|| to_toml(&key)),
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
            ScopeName::Write => Self::Write,
            ScopeName::Admin => Self::Admin,
        }
    }
}

fn name(text: &str) -> Result<KeyName, String> {
    KeyName::new(text).ok_or_else(|| format!("a name is 1 to 64 of [A-Za-z0-9_.-], got {text:?}"))
}
