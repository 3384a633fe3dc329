//! `mrol-lab bench questions`: puts planners' questions to a server.

mod command;
mod report;

pub(super) use command::QuestionBench;
