//! `mrol key list`: lists keys.

use std::fmt;
use std::fmt::Display;
use std::path::PathBuf;
use std::time::SystemTime;

use serde::Serialize;

use mrol::access::{Expiry, KeyEntry, list_file};
use mrol::console::CliError;
use mrol::console::Output;

#[derive(Debug, clap::Args)]
pub(super) struct ListKeys {
    /// The file of keys, which is not changed
    #[arg(long, value_name = "FILE")]
    file: PathBuf,
}

/// A key without its secret or hash, to be printed.
#[derive(Serialize)]
struct Listed {
    name: String,
    scope: String,
    maps: Option<Vec<String>>,
    robots: Option<Vec<String>>,
    expires: Option<String>,
    expired: bool,
    /// When the former secret of a rotation expires.
    former_expires: Option<String>,
}

impl ListKeys {
    pub(super) fn run(self, output: &Output) -> Result<(), CliError> {
        for entry in list_file(&self.file).map_err(CliError::failed)? {
            output.print(&Listed::of(entry, SystemTime::now()))?;
        }
        Ok(())
    }
}

impl Listed {
    fn of(entry: KeyEntry, now: SystemTime) -> Self {
        let (expires, former) = (entry.expires(), entry.former_expires());
        Self {
            name: entry.name,
            scope: entry.scope,
            maps: entry.maps,
            robots: entry.robots,
            expires: expires.map(|expires| expires.to_string()),
            expired: expires.is_some_and(|expires| expires.is_past(now)),
            former_expires: former
                .filter(|former: &Expiry| !former.is_past(now))
                .map(|former| former.to_string()),
        }
    }
}

impl Display for Listed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let all =
            |names: &Option<Vec<String>>, all: &str| names.as_ref().map_or(all.to_owned(), |n| n.join(","));
        let (maps, robots) = (all(&self.maps, "every map"), all(&self.robots, "every robot"));
        write!(f, "{}: {}, {maps}, {robots}", self.name, self.scope)?;
        match &self.expires {
            Some(expires) if self.expired => write!(f, ", expired {expires}")?,
            Some(expires) => write!(f, ", until {expires}")?,
            None => {}
        }
        match &self.former_expires {
            Some(former) => write!(f, ", former secret until {former}"),
            None => Ok(()),
        }
    }
}
