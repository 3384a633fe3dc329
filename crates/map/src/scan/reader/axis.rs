//! The coordinates that columns, properties and fields hold.

/// Names of the coordinates.
const AXES: [&str; 3] = ["x", "y", "z"];

/// Why names do not say where the coordinates are; the payload is the coordinate's name.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum AxisProblem {
    /// None has this name.
    Missing(&'static str),
    /// Two have this name.
    Twice(&'static str),
}

/// Where x, y and z are among `names`: in small letters, or in capitals where there is none in small ones.
pub(super) fn axes(names: &[&str]) -> Result<[usize; 3], AxisProblem> {
    let mut found = [0; 3];
    for (axis, found) in AXES.into_iter().zip(&mut found) {
        let has_small = names.contains(&axis);
        let is_axis = |name: &str| name == axis || !has_small && name.eq_ignore_ascii_case(axis);
        let mut places = (0..names.len()).filter(|&i| is_axis(names[i]));
        *found = places.next().ok_or(AxisProblem::Missing(axis))?;
        if places.next().is_some() {
            return Err(AxisProblem::Twice(axis));
        }
    }
    Ok(found)
}
