//! How blocks of a map are given out: by the server, or by a replica.

use std::num::NonZeroU8;

use uuid::Uuid;

use crate::error::{Reason, ServiceError};
use crate::limits::Limits;
use crate::map_service::MapService;
use crate::observer::Outcome;
use crate::request::{BlockAnswer, BlockBytes, BlockForm, BlockRequest, BlockVoxels, MapVersion};
use crate::work::{check_not_stopped, ended_early};
use mrol_map::map::{
    CellBox, ContentVersion, DISTANCE_CAP_MAX, DistanceBlock, MapName, MultiResolutionMap, Region,
    VoxelSelection, margin_of,
};
use mrol_map::util::StopSignal;
use mrol_map::voxel::{Lattice, VoxelSet};

/// Name under which the memory is reserved, for refusals.
const BLOCK: &str = "a block";

impl MapService {
    /// A part of a level as masks of 8 x 8 x 8 voxels, or the distance of each of its cells from what is occupied, at
    /// one revision.
    ///
    /// # Errors
    /// `InvalidArgument` for a level that is none, a dense block that is no box of finite sides, a cap that is none;
    /// `ResourceExhausted` for more than `block_bytes_max` or `block_cells_max`, or where there is no memory for it;
    /// `NotFound`.
    pub async fn get_block(&self, map: &MapName, request: BlockRequest) -> Result<BlockAnswer, ServiceError> {
        let work = async {
            let map = self.map(map).await?;
            map.check_level(request.level)?;
            let inner = self.inner.clone();
            let make = move |stop: StopSignal<'_>| {
                let reserve = |bytes| inner.budget.reserve_transient(bytes, BLOCK);
                request.answer_in(&map.map, map.uuid, &inner.settings.limits, reserve, stop)
            };
            self.inner.lanes.blocks.run(&self.asker, make).await?
        };
        self.observed("GetBlock", Some(map), work, |_| Outcome::Read).await
    }
}

/// A dense block that is within the limits.
#[derive(Debug, Clone, Copy)]
struct DenseBlock {
    cells: CellBox,
    cap: NonZeroU8,
}

impl BlockRequest {
    /// The answer of `map`, whose uuid is `map_uuid`; the level is one of its own. What `reserve` gives for the bytes
    /// of memory that it takes is held until it is made.
    ///
    /// # Errors
    /// See [`MapService::get_block`].
    pub fn answer_in<M>(
        &self,
        map: &MultiResolutionMap,
        map_uuid: Uuid,
        limits: &Limits,
        reserve: impl Fn(u64) -> Result<M, ServiceError>,
        stop: StopSignal<'_>,
    ) -> Result<BlockAnswer, ServiceError> {
        let (level, lattice) = (self.level, map.lattice());
        let (voxels, version) = match self.form {
            BlockForm::Sparse { region } => {
                let selection = VoxelSelection::from(region);
                let most = limits.block_bytes().0 / BlockBytes::OF_BLOCK;
                let copy = Copy::of(map, level, &selection, most, &reserve, stop)?;
                limits.check_block_bytes(copy.voxels.blocks().len() * BlockBytes::OF_BLOCK)?;
                (BlockVoxels::Sparse(BlockBytes::of(copy.voxels.blocks())), copy.version)
            }
            BlockForm::Dense { region, cap_m } => {
                let dense = DenseBlock::new(region, cap_m, lattice, level)?.within(limits)?;
                let selection = VoxelSelection::from(Some(dense.around().region(lattice, level)));
                let copy = Copy::of(map, level, &selection, usize::MAX, &reserve, stop)?;
                let _memory = reserve(DistanceBlock::bytes_max(&dense.cells, dense.cap))?;
                let block = DistanceBlock::of(&copy.voxels, &dense.cells, dense.cap, stop);
                (BlockVoxels::Dense(block.ok_or_else(|| ended_early(stop))?), copy.version)
            }
        };
        let ContentVersion { revision, hash } = version;
        let version = MapVersion { revision, map_uuid, content_hash: Some(hash) };
        Ok(BlockAnswer { level, resolution_m: lattice.resolution_m(level), voxels, version })
    }

    /// The cells that the answer depends on; none where that is everything.
    ///
    /// # Errors
    /// As for the answer.
    pub fn cells(&self, lattice: &Lattice) -> Result<Option<CellBox>, ServiceError> {
        match self.form {
            BlockForm::Sparse { region } => Ok(VoxelSelection::from(region).cells(lattice, self.level)),
            BlockForm::Dense { region, cap_m } => {
                Ok(Some(DenseBlock::new(region, cap_m, lattice, self.level)?.around()))
            }
        }
    }
}

/// Voxels of a level, copied out of the map at one revision.
struct Copy<M> {
    voxels: VoxelSet,
    version: ContentVersion,
    _memory: M,
}

impl<M> Copy<M> {
    fn of(
        map: &MultiResolutionMap,
        level: u32,
        selection: &VoxelSelection,
        most: usize,
        reserve: impl Fn(u64) -> Result<M, ServiceError>,
        stop: StopSignal<'_>,
    ) -> Result<Self, ServiceError> {
        let long_read = map.long_read();
        let view = long_read.view();
        let _memory = reserve(view.selected_bytes_max(level, selection))?;
        let (parts, version) = (view.selected_blocks(level, selection, most, stop), view.version());
        drop(view);
        drop(long_read);
        // All of it is of one revision: the copy alone is made under the locks.
        let voxels = parts.joined(stop);
        check_not_stopped(stop)?;
        Ok(Self { voxels, version, _memory })
    }
}

impl DenseBlock {
    fn new(region: Region, cap_m: Option<f64>, lattice: &Lattice, level: u32) -> Result<Self, ServiceError> {
        let Region::Box { min_m, max_m } = region else {
            let message = "region must be a box: a dense block has a distance for each of its cells";
            return Err(ServiceError::new(Reason::BadRegion, message));
        };
        if !min_m.iter().chain(&max_m).all(|c| c.is_finite()) {
            let message =
                format!("box must have finite sides for a dense block, got {min_m:?} and {max_m:?}");
            return Err(ServiceError::new(Reason::BadRegion, message));
        }
        let cap = match cap_m {
            None => DISTANCE_CAP_MAX,
            Some(cap_m) => cap_of(cap_m, lattice.resolution_m(level))?,
        };
        Ok(Self { cells: CellBox::of_centers(min_m, max_m, lattice, level), cap })
    }

    /// The cells that its distances depend on.
    fn around(&self) -> CellBox {
        self.cells.grown(margin_of(self.cap))
    }

    /// # Errors
    /// When it has more cells, or more that its distances depend on, than the limits allow.
    fn within(self, limits: &Limits) -> Result<Self, ServiceError> {
        let (cells, around) = (self.cells.cells(), self.around().cells());
        limits.check_block_bytes(usize::try_from(cells).unwrap_or(usize::MAX))?;
        let most = limits.block_cells_max;
        if around <= most as u64 {
            return Ok(self);
        }
        let message = format!(
            "the block and what lies within {} cells of it have {around} cells, block_cells_max is {most}: ask for a \
             smaller box, a coarser level or a smaller cap_m",
            margin_of(self.cap)
        );
        Err(ServiceError::new(Reason::BlockTooLarge, message))
    }
}

/// The least cap that tells all distances below `cap_m`, in quarters of cells of `resolution_m`.
fn cap_of(cap_m: f64, resolution_m: f64) -> Result<NonZeroU8, ServiceError> {
    let quarters = (4.0 * cap_m / resolution_m).ceil().min(DISTANCE_CAP_MAX.get().into());
    NonZeroU8::new(quarters as u8).filter(|_| cap_m > 0.0).ok_or_else(|| {
        ServiceError::new(Reason::BadCap, format!("cap_m must be more than 0 meters, got {cap_m}"))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use mrol_map::map::{MapContents, MapSettings};
    use mrol_map::voxel::VoxelKey;
    use std::cell::Cell;

    /// A floor of 40 x 40 voxels of 0.1 m.
    fn floor() -> MultiResolutionMap {
        let voxels = (0..1600).filter_map(|i| VoxelKey::new([i % 40, i / 40, 0])).collect();
        MultiResolutionMap::restore(MapSettings::new(0.1, 4), MapContents::at(1, voxels)).unwrap()
    }

    fn answer(request: BlockRequest, limits: &Limits) -> Result<BlockAnswer, ServiceError> {
        request.answer_in(&floor(), Uuid::nil(), limits, |_| Ok(()), StopSignal::NEVER)
    }

    fn dense(max_m: [f64; 3], cap_m: f64) -> BlockRequest {
        let region = Region::cuboid([0.0; 3], max_m).unwrap();
        BlockRequest { level: 0, form: BlockForm::Dense { region, cap_m: Some(cap_m) } }
    }

    #[test]
    fn a_cap_tells_all_distances_below_it() {
        for (cap_m, cap) in [(0.001, 1), (0.025, 1), (0.026, 2), (1.0, 40), (6.4, 255), (f64::INFINITY, 255)]
        {
            assert_eq!(cap_of(cap_m, 0.1).unwrap().get(), cap, "{cap_m}");
        }
        for bad in [0.0, -0.0, -1.0, f64::NAN, f64::NEG_INFINITY] {
            let error = cap_of(bad, 0.1).unwrap_err();
            assert_eq!(error.reason, Reason::BadCap, "{error}");
        }
    }

    #[test]
    fn limits_hold_to_the_last_cell_and_block() {
        let everything = BlockRequest { level: 0, form: BlockForm::Sparse { region: None } };
        let most = |block_bytes_max, block_cells_max| Limits {
            block_bytes_max,
            block_cells_max,
            ..Limits::default()
        };
        // 5 x 5 blocks; 10 x 10 x 10 cells, and one more on each side.
        for (request, bytes, cells) in [(everything, 25 * 72, 0), (dense([1.0; 3], 0.075), 1000, 1728)] {
            assert!(answer(request, &most(bytes, cells)).is_ok());
            let error = answer(request, &most(bytes - 1, cells)).unwrap_err();
            assert_eq!(error.reason, Reason::BlockTooLarge);
            assert!(error.message.contains(&format!("block_bytes_max is {}", bytes - 1)), "{error}");
            if cells > 0 {
                let error = answer(request, &most(bytes, cells - 1)).unwrap_err();
                assert!(error.message.contains("1728 cells, block_cells_max is 1727"), "{error}");
            }
        }
    }

    #[test]
    fn memory_is_reserved_before_anything_is_made() {
        for request in
            [BlockRequest { level: 2, form: BlockForm::Sparse { region: None } }, dense([1.0; 3], 1.0)]
        {
            let asked = Cell::new(0);
            let refuse = |bytes| {
                asked.set(bytes);
                Err::<(), _>(ServiceError::new(Reason::MemoryFull, "no"))
            };
            let error =
                request.answer_in(&floor(), Uuid::nil(), &Limits::default(), refuse, StopSignal::NEVER);
            assert_eq!(error.unwrap_err().reason, Reason::MemoryFull);
            assert!(asked.get() > 0);
        }
    }

    #[test]
    fn a_block_that_nobody_waits_for_is_given_up() {
        let gone = || true;
        for request in
            [BlockRequest { level: 0, form: BlockForm::Sparse { region: None } }, dense([1.0; 3], 1.0)]
        {
            let stop = StopSignal::when(&gone);
            let error = request.answer_in(&floor(), Uuid::nil(), &Limits::default(), |_| Ok(()), stop);
            assert_eq!(error.unwrap_err().reason, Reason::CallerGone);
        }
    }

    #[test]
    fn a_dense_block_is_a_box_of_finite_sides() {
        let ball = Region::ball([0.0; 3], 1.0).unwrap();
        let endless = Region::cuboid([0.0; 3], [1.0, f64::INFINITY, 1.0]).unwrap();
        for region in [ball, endless] {
            let request = BlockRequest { level: 0, form: BlockForm::Dense { region, cap_m: None } };
            let error = answer(request, &Limits::default()).unwrap_err();
            assert_eq!(error.reason, Reason::BadRegion, "{error}");
        }
        // What is finite and goes on beyond the map ends there, and is too large.
        let error = answer(dense([1e300; 3], 1.0), &Limits::default()).unwrap_err();
        assert_eq!(error.reason, Reason::BlockTooLarge, "{error}");
    }
}
