//! Blocks out of a replica.

use super::copy::Copied;
use super::error::ReplicaError;
use super::handle::{Replica, check_level};
use mrol_map::map::CellBox;
use mrol_map::util::StopSignal;
use mrol_map::voxel::Lattice;
use mrol_service::{BlockAnswer, BlockRequest, Limits, Reason, ServiceError};

impl Replica {
    /// A part of a level as it is stored, or the distance of each of its cells from what is occupied, at one revision:
    /// as [`Client::get_block`](crate::Client::get_block), under the default limits of a server. A dense block takes
    /// some milliseconds and more: not for an async thread.
    ///
    /// # Errors
    /// Of a copy that is older than the options allow; for a level that is none, a part that is not all in the region
    /// that is copied (of a dense block with what lies within its cap), a block beyond the limits, and a dense block
    /// that is no box of finite sides.
    pub fn get_block(&self, request: &BlockRequest) -> Result<BlockAnswer, ReplicaError> {
        self.shared.check_age(self.age_max)?;
        let Copied { map, map_uuid, .. } = self.shared.copied.read().clone();
        check_level(request.level, &map)?;
        self.check_cells(request.cells(map.lattice())?, map.lattice(), request.level)?;
        let limits = Limits::default();
        let mut answer = request.answer_in(&map, map_uuid, &limits, |_| Ok(()), StopSignal::NEVER)?;
        // The hash of a part is not the map's.
        answer.version.content_hash = answer.version.content_hash.filter(|_| self.region.is_none());
        Ok(answer)
    }

    /// Refuses cells of which the replica does not know everything. A region that holds the corners of a box holds all
    /// of it.
    fn check_cells(&self, cells: Option<CellBox>, lattice: &Lattice, level: u32) -> Result<(), ReplicaError> {
        let Some(region) = &self.region else { return Ok(()) };
        let is_copied = |cells: CellBox| {
            cells.cells() == 0
                || cells.corners_m(lattice, level).into_iter().all(|corner| region.contains(corner))
        };
        if cells.is_some_and(is_copied) {
            return Ok(());
        }
        let message =
            "the block and what its distances depend on must lie in the region that the replica copies";
        Err(ServiceError::new(Reason::BadRegion, message).into())
    }
}
