//! `mrol completions`: what a shell completes on the command line.

use std::fmt;

use clap_complete::Shell;
use serde::Serialize;

use mrol::console::CliError;
use mrol::console::Output;

const EXAMPLES: &str = "\
EXAMPLES:
  source <(mrol completions bash)                                            this shell alone
  mrol completions bash > ~/.local/share/bash-completion/completions/mrol    every bash from now on
  mrol completions zsh > ~/.zfunc/_mrol                                      with fpath+=~/.zfunc before compinit
  mrol completions fish > ~/.config/fish/completions/mrol.fish";

/// Print the script by which a shell completes commands and options
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Completions {
    /// The shell
    shell: Shell,
}

impl Completions {
    /// Prints what completes `command`, the whole command line.
    pub(super) fn run(&self, mut command: clap::Command, output: &Output) -> Result<(), CliError> {
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut command, "mrol", &mut script);
        output.print(&Script { script: String::from_utf8_lossy(&script).trim_end() })
    }
}

#[derive(Debug, Serialize)]
struct Script<'a> {
    script: &'a str,
}

impl fmt::Display for Script<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.script)
    }
}
