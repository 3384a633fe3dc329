//! Fleets: a server, in this process or another, under the load of planners that query, robots that map, and
//! whoever watches.

mod address;
pub(crate) mod attack;
mod c_client;
mod cpu;
mod error;
mod http;
mod ledger;
mod load;
mod member;
mod memory;
mod pace;
mod planner;
mod process;
pub(crate) mod questions;
mod relay;
mod robot;
mod spectator;
mod stalled;
mod surveyor;
mod tally;
mod target;

pub(crate) use address::{GrpcAddress, HttpAddress};
pub(crate) use c_client::CClient;
pub(crate) use error::FleetError;
pub(crate) use ledger::Ledger;
pub(crate) use load::{Answered, Load, Question};
pub(crate) use member::{Fleet, Member, Working};
pub(crate) use memory::{Trend, resident_bytes};
pub(crate) use planner::Planner;
pub(crate) use process::{ANY_PORT, ServerProcess};
pub(crate) use relay::Relay;
pub(crate) use robot::{Robot, Seen, TURN_POINTS};
pub(crate) use spectator::Spectator;
pub(crate) use stalled::StalledWatch;
pub(crate) use surveyor::Surveyor;
pub(crate) use tally::Tally;
pub(crate) use target::Target;
