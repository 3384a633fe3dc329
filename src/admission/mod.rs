//! Who gets in, and what is kept while an answer is on its way.

mod held_body;

pub use held_body::HeldBody;
