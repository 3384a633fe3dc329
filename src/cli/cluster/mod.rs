//! `mrol cluster`: the nodes that share maps by way of NATS, looked at and changed.
//!
//! Reading order: `nats` is how a command reaches NATS; `table` is how columns are printed; `known` finds what a
//! command names; `status`, `moving`, `copies`, `adopt`, `check`, `config`, `keep` and `forget` are the
//! commands; `command` puts them together.

mod adopt;
mod check;
mod command;
mod config;
mod copies;
mod forget;
mod keep;
mod known;
mod moving;
mod nats;
mod status;
mod table;

pub(super) use command::Cluster;
