//! `mrol man`: manual pages of all commands.

use std::fmt;
use std::path::PathBuf;

use serde::Serialize;

use mrol::console::CliError;
use mrol::console::Output;

const EXAMPLES: &str = "\
EXAMPLES:
  mrol man ~/.local/share/man/man1        man mrol, man mrol-serve, ... from now on
  mrol man /tmp && man /tmp/mrol-map.1    one page, once";

/// Write the manual pages of all commands into a folder
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Man {
    /// The folder, which is made if it is not there: mrol.1, mrol-serve.1 and so on
    #[arg(value_name = "FOLDER")]
    folder: PathBuf,
}

impl Man {
    /// Writes the pages of `command`, the whole command line.
    pub(super) fn run(&self, command: clap::Command, output: &Output) -> Result<(), CliError> {
        let Self { folder } = self;
        std::fs::create_dir_all(folder).map_err(CliError::writing(folder))?;
        clap_mangen::generate_to(command, folder).map_err(CliError::writing(folder))?;
        output.print(&Written { folder })
    }
}

#[derive(Debug, Serialize)]
struct Written<'a> {
    folder: &'a PathBuf,
}

impl fmt::Display for Written<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{0}: try man {0}/mrol.1", self.folder.display())
    }
}
