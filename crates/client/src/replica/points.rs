//! Look-ups of points in a replica.

use super::copy::Copied;
use super::error::ReplicaError;
use super::handle::{Replica, check_level};
use mrol_map::geometry::Pose;
use mrol_map::map::MultiResolutionMap;
use mrol_map::util::StopSignal;
use mrol_map::voxel::VoxelKey;
use mrol_service::{PointAnswer, PointQuery, Reason, ServiceError};

impl Replica {
    /// Says of each point whether its voxel is occupied, or with `keep_out` whether it lies in a keep-out, all at one
    /// revision; `min_revision` is not waited for.
    ///
    /// # Errors
    /// Of a copy that is older than the options allow; for a point in no voxel or outside of the region that is copied,
    /// named by its place; a level that is none; another uuid than the map's; a `min_revision` that the copy has not.
    pub fn query_points(&self, query: &PointQuery) -> Result<PointAnswer, ReplicaError> {
        self.shared.check_age(self.age_max)?;
        let Copied { map, map_uuid, .. } = self.shared.copied.read().clone();
        check_level(query.level, &map)?;
        if query.map_uuid.is_some_and(|uuid| uuid != map_uuid) {
            let message = format!("map_uuid is {map_uuid}: the map was deleted and made again");
            return Err(ServiceError::new(Reason::MapReplaced, message).into());
        }
        self.check_region(query, &map)?;
        let map_from_points = query.map_from_points.unwrap_or_else(Pose::identity);
        let view = map.view_of(query.points.as_slice(), &map_from_points);
        let view = if query.keep_out { view.with_keep_outs() } else { view };
        if query.min_revision.is_some_and(|least| least > view.revision()) {
            let message = format!("min_revision was not reached: the copy is at {}", view.revision());
            return Err(ServiceError::new(Reason::RevisionNotReached, message).into());
        }
        let mut answer = query.answer_in(view, None, map_uuid, map.lattice(), StopSignal::NEVER)?;
        // The hash of a part is not the map's.
        answer.version.content_hash = answer.version.content_hash.filter(|_| self.region.is_none());
        Ok(answer)
    }

    /// Refuses points of whose voxels the replica knows nothing.
    fn check_region(&self, query: &PointQuery, map: &MultiResolutionMap) -> Result<(), ReplicaError> {
        let Some(region) = &self.region else { return Ok(()) };
        let lattice = map.lattice();
        let quantize = lattice.from_points(&query.map_from_points.unwrap_or_else(Pose::identity));
        // A region that holds the outermost finest voxels of a coarser one holds all of it.
        let is_outside = |point| {
            quantize.index(point).is_some_and(|index| {
                let first = index.map(|i| i >> query.level << query.level);
                let last = first.map(|i| i + ((1 << query.level) - 1));
                let corner = |n: usize| std::array::from_fn(|axis| [first, last][n >> axis & 1][axis]);
                let center = |voxel| lattice.center_m(voxel, 0);
                !(0..8).all(|n| VoxelKey::new(corner(n)).is_some_and(|voxel| region.contains(center(voxel))))
            })
        };
        let Some(place) = query.points.as_slice().iter().position(|&point| is_outside(point)) else {
            return Ok(());
        };
        let message = format!("points[{place}] is outside of the region that the replica copies");
        Err(ServiceError::new(Reason::PointOutOfRange, message).into())
    }
}
