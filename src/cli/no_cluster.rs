//! In the place of `cluster`, where the program was built without clusters: what to do about it.

use mrol::console::{CliError, Output};
use mrol::server::ServerError;

/// Look at a cluster of servers that share maps (not in this program: it was built without the feature `cluster`)
#[derive(Debug, clap::Args)]
pub(super) struct Cluster {
    #[arg(hide = true, trailing_var_arg = true, allow_hyphen_values = true)]
    _words: Vec<String>,
}

impl Cluster {
    /// Refused.
    pub(super) fn run(self, _: Output) -> Result<(), CliError> {
        Err(ServerError::NoClusters.into())
    }
}
