//! Experiment on verdicts: wrong poses that are accepted and right ones that are refused, and how rays agree at both.
//!
//! Real scans with true poses are aligned to maps of one, two and half of them, from guesses at five distances; scans
//! of other places too, which belong nowhere. Simulated places, drawn by seed, are those in which robots mistake
//! themselves: rectangular rooms in which a robot was turned unseen, whose furniture was moved, or that are full of
//! people, and aisles that repeat.

mod aisles;
mod outcomes;
mod rooms;
mod searches;
mod sequences;
mod sets;
mod trial;

pub use aisles::{PERIODS_M, aisle};
pub use outcomes::Outcomes;
pub use rooms::{Carved, PEOPLE, PIECES, RoomTrials, STEP_S, TURN_S, rooms};
pub use searches::{KindOfSearch, Searches};
pub use sequences::SequenceOutcomes;
pub use sets::{GUESSES, MapOf, Set, Trials};
pub use trial::random;
