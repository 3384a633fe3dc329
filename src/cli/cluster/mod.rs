//! `mrol cluster`: the nodes that share maps by way of NATS, looked at and changed.
//!
//! Reading order: `nats` is how a command reaches NATS; `table` is how columns are printed; `status`, `moving`,
//! `adopt`, `check`, `config`, `keep` and `forget` are the commands; `command` puts them together.

mod adopt;
mod check;
mod command;
mod config;
mod forget;
mod keep;
mod moving;
mod nats;
mod status;
mod table;

pub(super) use command::Cluster;
