//! `mrol-lab bench soak`: runs a server under a fleet's load for hours, and checks that its memory does not grow and
//! nothing fails.

mod command;
mod report;

pub(super) use command::Soak;
