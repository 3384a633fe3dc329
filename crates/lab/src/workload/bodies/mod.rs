//! Bodies that planners ask about, and the poses they ask about.

pub(crate) mod arm;
pub(crate) mod cart;
pub(crate) mod place;
