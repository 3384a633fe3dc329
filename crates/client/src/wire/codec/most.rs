//! How many elements lists may have, whatever is set.
//!
//! These bound the memory for what is refused in the end. What a server answers is bounded by its settings, which are
//! far below them.

/// Links of a body at most, whatever `body_parts_max` is.
pub const LINKS_MAX: usize = 65_536;
/// Regions in which voxels do not count at most, whatever `ignored_regions_max` is.
pub const IGNORED_MAX: usize = 4_096;
/// Poses of one message: of the shortest, a message that is as large as may be has fewer.
const POSES_MAX: usize = 1 << 19;
/// Elements of any other list.
const OTHERS_MAX: usize = 65_536;

/// Elements of the field `name`, in all of a message.
pub(super) fn elements_max(name: &str) -> usize {
    match name {
        "links" => LINKS_MAX,
        "ignored" => IGNORED_MAX,
        "poses" => POSES_MAX,
        _ => OTHERS_MAX,
    }
}
