//! The attackers, in a process of their own of the lowest priority.

use std::time::Duration;

use crate::fleet::attack::{Aim, Assault, Attack};
use mrol::console::error::CliError;
use mrol::console::output::Output;

/// Attack a server for some time; prints what became of each attack, as JSON, an object a line
#[derive(Debug, clap::Args)]
pub(in crate::cli) struct Attackers {
    #[command(flatten)]
    aim: Aim,
    /// Which attacks
    #[arg(long, value_enum, value_delimiter = ',')]
    attacks: Vec<Attack>,
    /// How long, seconds
    #[arg(long)]
    seconds: f64,
    /// Seed of what is asked and sent
    #[arg(long)]
    seed: u64,
}

impl Attackers {
    pub(in crate::cli) async fn run(self, output: Output) -> Result<(), CliError> {
        let time = Duration::try_from_secs_f64(self.seconds).map_err(CliError::usage)?;
        let assault = Assault::new(self.aim, self.attacks, self.seed)?;
        // The caller begins to measure.
        output.object(&"ready")?;
        for damage in assault.work(time).await? {
            output.object(&damage)?;
        }
        Ok(())
    }
}
