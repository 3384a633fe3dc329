//! Planners' questions to a server: a load of them, and scans that come in meanwhile.

mod batch;
mod load;
mod made;
mod scanner;

pub(crate) use load::{Pressure, Told};
pub(crate) use made::{Questions, rays};
pub(crate) use scanner::Scanner;
