//! Shards: the occupied voxel lists of the paper (II), and all levels of one part of space (III).
//!
//! Begin with [`OccupiedVoxelList`], one level, and `shard`, all of them; `sharding` cuts space into regions and deals
//! them out to shards, `bounds` and `tier_view` serve it, `capacity_schedule` and `filter_room` say how filters grow.

mod bounds;
mod capacity_schedule;
mod filter_room;
mod occupied_voxel_list;
mod shard;
mod shard_level;
mod sharding;
mod tier_view;

pub(in crate::map) use capacity_schedule::CapacitySchedule;
pub use occupied_voxel_list::OccupiedVoxelList;
pub(in crate::map) use occupied_voxel_list::tier_of;
pub(in crate::map) use shard::{Shard, levels_of};
pub(in crate::map) use shard_level::ShardLevel;
pub use sharding::SHARDS;
pub(in crate::map) use sharding::{Sharding, ShardsTouched, shard_of_region};
pub(crate) use tier_view::TierView;
