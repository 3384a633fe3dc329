//! Planners' answers against brute force over all voxels, by the one definition of when a ball meets a cube; through changes
//! of the map, at all levels.

mod brute_force;
mod examples;
mod made;
mod poses_and_motions;
