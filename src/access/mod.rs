//! Who may do what: the operations, the scope that each takes.

mod operation;
mod scope;

pub use operation::{Operation, Route};
pub use scope::Scope;
