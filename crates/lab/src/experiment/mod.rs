//! The paper's experiments (IV), and measurements of convergence and scaling.

pub mod carving;
pub mod convergence;
pub mod deskewing;
pub mod drift;
pub mod exact_rays;
pub mod free_space;
pub mod mapping;
pub mod rounds;
pub mod stages;
pub mod verdicts;
