//! The coordinate that a column, property or field holds.

/// The axis, 0 to 2, of a property or field called `name`.
pub(super) fn axis(name: &str) -> Option<usize> {
    match name {
        "x" => Some(0),
        "y" => Some(1),
        "z" => Some(2),
        _ => None,
    }
}
