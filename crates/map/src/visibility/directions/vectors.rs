//! Lengths and directions of offsets from the sensor, in f32.

pub(in crate::visibility) fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2]
}

pub(in crate::visibility) fn norm(a: [f32; 3]) -> f32 {
    dot(a, a).sqrt()
}

pub(in crate::visibility) fn distance(a: [f32; 3], b: [f32; 3]) -> f32 {
    norm(std::array::from_fn(|axis| a[axis] - b[axis]))
}

pub(in crate::visibility) fn between(a: [f32; 3], b: [f32; 3], share: f32) -> [f32; 3] {
    std::array::from_fn(|axis| a[axis] + (b[axis] - a[axis]) * share)
}

/// Two directions at right angles to each other and to `offset`, of length 1.
pub(in crate::visibility) fn across(offset: [f32; 3]) -> [[f32; 3]; 2] {
    let offset = nalgebra::Vector3::from(offset);
    let other = nalgebra::Vector3::ith(offset.iamin(), 1.0);
    let right = offset.cross(&other).normalize();
    [right.into(), offset.cross(&right).normalize().into()]
}
