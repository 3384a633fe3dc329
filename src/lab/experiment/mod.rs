//! The paper's experiments (IV), and how far an alignment reaches.

pub mod convergence;
pub mod drift;
pub mod mapping;
pub mod stages;
