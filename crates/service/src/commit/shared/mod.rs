//! How the worker of a map that several nodes share makes changes: those that it orders itself where this node leads,
//! and those that the log has from the others.
//!
//! `act` is what a node is told to do: to join, to follow (`catch_up`), to take the lead over or to hand it over
//! (`lead`). `order` puts changes into the log; `own_history` compares what the log has with what this node made
//! before.

mod act;
mod catch_up;
mod lead;
mod order;
mod own_history;
