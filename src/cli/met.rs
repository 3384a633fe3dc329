//! What something met, in words.

/// A voxel or a keep-out.
pub(super) fn met(voxel: Option<[i32; 3]>, keep_out: Option<&str>) -> String {
    match (voxel, keep_out) {
        (_, Some(name)) => format!("keep-out {name}"),
        (Some([x, y, z]), None) => format!("voxel ({x}, {y}, {z})"),
        (None, None) => "nothing".to_owned(),
    }
}
