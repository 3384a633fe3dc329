//! `mrol cluster check`: is everything as it must be?
//!
//! Reading order: `monitor` asks NATS servers at their monitoring ports; `findings` judges what is seen at NATS;
//! `hashes` asks the nodes and compares contents; `command` puts them together.

mod command;
mod findings;
mod hashes;
mod monitor;

pub(super) use command::Check;
