//! Changes that are not scans: deletions, undo and keep-outs.

mod completed_request;
mod deletion;
mod digest;
mod keep_out;
mod keep_out_expiry;
mod not_seen_since;
mod robot_known;
mod undo;
