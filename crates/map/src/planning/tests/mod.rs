//! Planners' answers against brute force over all voxels, by the one definition of when a ball meets a cube; through
//! changes of the map, at all levels.

mod beyond_lattice;
mod brute_force;
mod examples;
mod in_sight;
mod made;
mod maps;
mod poses_and_motions;
mod seen_maps;
mod stop;

pub(super) use maps::{RESOLUTION_M, history_and_level, point};
pub(super) use seen_maps::{SeenMap, seen_history_and_level};
