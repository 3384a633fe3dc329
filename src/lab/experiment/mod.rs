//! The paper's experiments (IV), and measurements of convergence and scaling.

pub mod carving;
pub mod convergence;
pub mod deskewing;
pub mod drift;
pub mod hostile_guesses;
pub mod mapping;
pub mod stages;
