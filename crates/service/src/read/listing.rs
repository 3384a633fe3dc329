//! Which voxels of a level are occupied, one by one or counted.

use crate::error::{Reason, ServiceError};
use crate::map_service::MapService;
use crate::maps::HostedMap;
use crate::observer::Outcome;
use crate::request::{ListingRequest, VoxelListing};
use crate::work::check_not_stopped;
use mrol_map::map::MapName;
use mrol_map::util::StopSignal;
use mrol_map::voxel::VoxelKey;

impl MapService {
    /// The occupied voxels of a level that are asked for, or their number, all at one revision.
    ///
    /// # Errors
    /// `InvalidArgument` for a level that is none; `ResourceExhausted` when more than `listed_voxels_max` are to be
    /// listed; `NotFound`.
    pub async fn list_voxels(
        &self,
        map: &MapName,
        request: ListingRequest,
    ) -> Result<VoxelListing, ServiceError> {
        let work = async {
            let map = self.map(map).await?;
            map.check_level(request.level)?;
            let most = self.limits().listed_voxels_max;
            let list = move |stop: StopSignal<'_>| match request.count_only {
                true => map.count(&request, most, stop),
                false => map.list(&request, most, stop),
            };
            self.inner.lanes.queries.run(&self.asker, list).await?
        };
        self.observed("ListVoxels", Some(map), work, |_| Outcome::Read).await
    }
}

impl HostedMap {
    /// The voxels that are asked for, at most `most` of them.
    pub(crate) fn list(
        &self,
        request: &ListingRequest,
        most: usize,
        stop: StopSignal<'_>,
    ) -> Result<VoxelListing, ServiceError> {
        let ListingRequest { level, selection, keep_out, .. } = *request;
        let long_read = self.map.long_read();
        let view = long_read.view();
        let view = if keep_out { view.with_keep_outs() } else { view };
        // How many there are of a whole level is known: nothing is copied of more than may be listed.
        let whole = if selection.is_everything() { view.count_voxels(level, &selection, stop) } else { 0 };
        if whole > most {
            return Err(listing_too_large(level, whole, most));
        }
        let (copy, version) = (view.level_voxels(level, &selection, most, stop), view.version());
        let keep_outs = view.keep_outs().cloned().unwrap_or_default();
        drop(view);
        drop(long_read);
        if copy.len() > most {
            return Err(listing_too_large(level, copy.len(), most));
        }
        let kept_out = keep_outs.voxels_of(level, &selection, self.map.lattice(), most, stop);
        check_not_stopped(stop)?;
        let kept_out = kept_out.map_err(|_| keep_outs_too_large(level, most))?;
        let mut keys = Vec::with_capacity((copy.len() + kept_out.len()).min(most));
        let is_other = |key: &VoxelKey| kept_out.is_empty() || !kept_out.contains(*key);
        copy.for_some(stop, |some| {
            keys.extend(some.iter().copied().filter(is_other));
            stop.give_way();
        });
        check_not_stopped(stop)?;
        let found = keys.len() + kept_out.len();
        if found > most {
            return Err(listing_too_large(level, found, most));
        }
        keys.extend(kept_out.iter());
        let (resolution_m, voxels_total) = (self.map.lattice().resolution_m(level), keys.len());
        Ok(VoxelListing { resolution_m, voxels_total, keys, version: self.version(version) })
    }

    /// The number of voxels that are asked for. Those of keep-outs are found out as for a listing, which gives its
    /// locks back before it looks at shapes: at most `most` are counted then.
    pub(crate) fn count(
        &self,
        request: &ListingRequest,
        most: usize,
        stop: StopSignal<'_>,
    ) -> Result<VoxelListing, ServiceError> {
        let ListingRequest { level, selection, keep_out, .. } = *request;
        if keep_out {
            let listing = self.list(request, most, stop)?;
            return Ok(VoxelListing { keys: Vec::new(), ..listing });
        }
        let long_read = self.map.long_read();
        let view = long_read.view();
        let (voxels_total, version) = (view.count_voxels(level, &selection, stop), view.version());
        check_not_stopped(stop)?;
        let resolution_m = self.map.lattice().resolution_m(level);
        Ok(VoxelListing { resolution_m, voxels_total, keys: Vec::new(), version: self.version(version) })
    }
}

fn listing_too_large(level: u32, found: usize, most: usize) -> ServiceError {
    let message = format!(
        "level {level} has {found} voxels there or more, listed_voxels_max is {most}: ask for a region or a coarser level"
    );
    ServiceError::new(Reason::ListingTooLarge, message)
}

fn keep_outs_too_large(level: u32, most: usize) -> ServiceError {
    let message = format!(
        "the keep-outs take more of level {level} there than listed_voxels_max, which is {most}, allows to look through: ask \
         for a region, a coarser level, or without keep_out"
    );
    ServiceError::new(Reason::ListingTooLarge, message)
}
