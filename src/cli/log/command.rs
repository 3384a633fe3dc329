//! The command `mrol log`.

use std::path::PathBuf;

use super::file::LogFile;
use super::options::SourceOptions;
use super::report::{DamageLine, MissingLine, TopicLine, UseLine, topic_widths};
use mrol::console::{CliError, Output};

const EXAMPLES: &str = "\
EXAMPLES:
  mrol log run.mcap                        topics, and what `mrol map run.mcap` would use
  mrol log run.mcap --cloud /lidar_left    the same for other clouds
  mrol log run.mcap --json | jq .missing

Nothing is changed, and no server is needed. Logs of ROS 2 are read, compressed or not, without a summary, and up to
where they are good. Databases (.db3) take a program with the feature `bags`, as the released ones are.";

/// Say what a log of a robot has, which of it would be mapped and why, and what is missing
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Log {
    /// The log: .mcap, .db3, or the folder that ros2 bag recorded
    #[arg(value_name = "FILE")]
    log: PathBuf,
    #[command(flatten)]
    sources: SourceOptions,
}

impl Log {
    pub(crate) fn run(self, output: &Output) -> Result<(), CliError> {
        let file = LogFile::survey(&self.log, output)?;
        let widths = topic_widths(&file.survey.topics);
        output.say(TopicLine::head(widths))?;
        for summary in &file.survey.topics {
            output.print(&TopicLine::of(summary, widths))?;
        }
        for damage in &file.survey.damages {
            output.print(&DamageLine { damaged: damage.to_string() })?;
        }
        let plan = file.plan(&self.sources)?;
        output.say("")?;
        for used in plan.uses {
            output.print(&UseLine { used_for: used.purpose, source: used.source, why: used.why })?;
        }
        for missing in plan.missing.iter().chain(file.survey.oddities()) {
            output.print(&MissingLine { missing: missing.clone() })?;
        }
        Ok(())
    }
}
