//! Whether anybody waits for an answer still: work that takes long asks between its steps, and stops where nobody does.

use std::fmt::{Debug, Formatter};

/// Whether an answer is wanted still.
#[derive(Clone, Copy)]
pub struct Interest<'a>(Option<&'a dyn Fn() -> bool>);

impl<'a> Interest<'a> {
    /// It is wanted to the end.
    pub const LASTING: Interest<'static> = Interest(None);

    /// It is wanted until `is_lost` says otherwise; what was lost does not come back.
    pub fn until(is_lost: &'a dyn Fn() -> bool) -> Self {
        Self(Some(is_lost))
    }

    /// True once nobody wants the answer: whatever it would be, it goes nowhere.
    pub fn is_lost(self) -> bool {
        self.0.is_some_and(|is_lost| is_lost())
    }
}

/// Closures have no form to print.
impl Debug for Interest<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        f.write_str("Interest")
    }
}
