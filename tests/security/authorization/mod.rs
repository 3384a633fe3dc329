//! Who may do what: every RPC and every route has a rule, and the rule holds.

mod asking;
mod audit;
mod browsers;
mod disclosure;
mod early;
pub(crate) mod keyring;
mod lifetimes;
mod listening;
mod paths;
mod reloading;
mod requests;
mod robots;
mod table;
mod turns;
