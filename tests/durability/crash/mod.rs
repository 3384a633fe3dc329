//! `kill -9` at random moments, round after round.

mod remaker;
mod renaming;
mod rounds;
