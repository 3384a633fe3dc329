//! `mrol key revoke` and `mrol key rotate`.

use std::fmt;
use std::fmt::Display;
use std::path::PathBuf;
use std::time::{Duration, SystemTime};

use serde::Serialize;

use super::name::name;
use mrol::access::{Expiry, KeyName, Secret, revoke_in_file, rotate_in_file};
use mrol::console::CliError;
use mrol::console::Output;

#[derive(Debug, clap::Args)]
pub(super) struct RevokeKey {
    /// The name of the key, as `mrol key list` prints it
    #[arg(long, value_parser = name)]
    name: KeyName,
    /// The file of keys, which is changed
    #[arg(long, value_name = "FILE")]
    file: PathBuf,
}

#[derive(Debug, clap::Args)]
pub(super) struct RotateKey {
    /// The name of the key, as `mrol key list` prints it
    #[arg(long, value_parser = name)]
    name: KeyName,
    /// The file of keys, which is changed
    #[arg(long, value_name = "FILE")]
    file: PathBuf,
    /// Hours for which the former secret remains valid, so that no holder is locked out
    #[arg(long, value_name = "HOURS", default_value_t = 24, value_parser = clap::value_parser!(u32).range(1..=8760))]
    overlap_h: u32,
    /// Revoke the former secret at once, and that of a rotation in progress: for a secret that leaked
    #[arg(long, conflicts_with = "overlap_h")]
    end_former: bool,
}

#[derive(Serialize)]
struct Revoked {
    revoked: String,
}

#[derive(Serialize)]
struct Rotated {
    name: String,
    secret: String,
    former_expires: Option<String>,
}

impl RevokeKey {
    pub(super) fn run(self, output: &Output) -> Result<(), CliError> {
        revoke_in_file(&self.file, &self.name).map_err(CliError::failed)?;
        output.print(&Revoked { revoked: self.name.to_string() })
    }
}

impl RotateKey {
    pub(super) fn run(self, output: &Output) -> Result<(), CliError> {
        let secret = Secret::random().map_err(CliError::failed)?;
        let overlap = Duration::from_secs(u64::from(self.overlap_h) * 3600);
        let former = if self.end_former { None } else { Expiry::after(SystemTime::now(), overlap) };
        rotate_in_file(&self.file, &self.name, secret.digest(), former).map_err(CliError::failed)?;
        output.print(&Rotated {
            name: self.name.to_string(),
            secret: secret.reveal().to_owned(),
            former_expires: former.map(|former| former.to_string()),
        })
    }
}

impl Display for Revoked {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "revoked {}", self.revoked)
    }
}

impl Display for Rotated {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.secret)
    }
}
