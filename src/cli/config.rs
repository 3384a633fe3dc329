//! `mrol config`: prints the effective settings.

use clap::Subcommand;

use mrol::config::Config;
use mrol::console::CliError;
use mrol::console::Output;
use mrol::console::ServeOptions;

const EXAMPLES: &str = "\
EXAMPLES:
  mrol config print                              every setting of the daemon with its value and meaning, as TOML
  mrol config print > mrol.toml                  a file to start from
  MROL_LIMITS__MAPS_MAX=4 mrol config print --config mrol.toml --durability 200ms
  mrol config schema > mrol.schema.json          the JSON schema of such a file, for editors

`print` takes the options of `mrol serve`, and prints what it would run with: defaults, then the file, then MROL_... variables,
then options.";

/// Show the settings that `mrol serve` would run with
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Settings {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// Print every setting
    Print(Box<ServeOptions>),
    /// Print the JSON schema of a file of settings
    Schema,
}

impl Settings {
    pub(super) fn run(self, output: &Output) -> Result<(), CliError> {
        let options = match self.action {
            Action::Print(options) => options,
            Action::Schema => return output.object(&Config::schema()),
        };
        let config = options.config().map_err(CliError::usage)?;
        for constant in &config.constants_set {
            output.note(format!("{constant} is a constant, and what is set of it does not count"));
        }
        if output.is_json() {
            return output.object(&config);
        }
        output.say(config.to_toml().trim_end())
    }
}
