//! Voxels and free space as an octree of OctoMap.

use std::fs::File;
use std::io::{BufWriter, Write};

use nalgebra::Point3;

use super::exported::OctreeCells;
use super::free_space::FreeSpace;
use super::source::Voxels;
use mrol::console::{CliError, NewFile, Output, count};
use mrol_files::FileKind;
use mrol_files::octree::{
    CELL_INDEX_MAX, CELL_INDEX_MIN, CellBlock, CellBlocks, CellState, Leaf, LeafError, Octree,
};
use mrol_map::geometry::Point;
use mrol_map::planning::PointState;
use mrol_map::voxel::{BLOCK_LEVELS, BLOCK_SIDE, BlockMask, Cell, VoxelKey, VoxelSet};

/// Cells that are asked whether they are free, at most: a few minutes, and a tree that fits into memory.
const CELLS_ASKED_MAX: u64 = 1 << 28;
/// Cells that are asked at once.
const CELLS_PER_QUESTION: usize = 1 << 16;
/// Blocks that wait for an answer, at most.
const BLOCKS_PER_QUESTION: usize = 1 << 12;

/// A tree of a level of a map.
pub(super) struct MapOctree {
    tree: Octree,
    resolution_m: f64,
    occupied: u64,
    free: u64,
}

impl MapOctree {
    /// The tree of occupied cells alone.
    ///
    /// # Errors
    /// When a voxel lies beyond a tree.
    pub(super) fn occupied(voxels: &Voxels) -> Result<Self, CliError> {
        check_range(voxels)?;
        let leaf = |key: &VoxelKey| Leaf { index: key.index(), level: 0, state: CellState::Occupied };
        let tree = Octree::of(voxels.keys.iter().map(leaf)).map_err(CliError::failed)?;
        Ok(Self { tree, resolution_m: voxels.resolution_m, occupied: voxels.keys.len() as u64, free: 0 })
    }

    /// The tree of occupied cells, and of those in the box around them that are free.
    ///
    /// # Errors
    /// When a voxel lies beyond a tree, the box has more cells than are asked, or the server refuses.
    pub(super) async fn with_free_space(
        voxels: &Voxels,
        free_space: &FreeSpace<'_>,
        output: &Output,
    ) -> Result<Self, CliError> {
        check_range(voxels)?;
        let (low, high) = bounds(&voxels.keys);
        check_box(voxels, low, high)?;
        let blocks = CellBlocks::within(low, high);
        let output = output.clone().with_bar_of(blocks.count_all() as usize, "blocks");
        let set: VoxelSet = voxels.keys.iter().copied().collect();
        let tree = Octree::default();
        let mut made = Self { tree, resolution_m: voxels.resolution_m, occupied: 0, free: 0 };
        let mut waiting = Waiting::default();
        for block in blocks {
            waiting.add(block, occupied_of(&set, block), voxels.resolution_m, free_space);
            if waiting.is_enough() {
                made.take(&mut waiting, free_space).await?;
            }
            output.step();
        }
        made.take(&mut waiting, free_space).await?;
        output.clear_bar();
        Ok(made)
    }

    /// Adds the blocks that waited.
    async fn take(&mut self, waiting: &mut Waiting, free_space: &FreeSpace<'_>) -> Result<(), CliError> {
        let Waiting { blocks, centers } = std::mem::take(waiting);
        let states = match centers.is_empty() {
            true => None,
            false => Some(free_space.states(&centers).await?),
        };
        let mut asked = 0;
        for (block, occupied, is_asked) in blocks {
            for index in block.cells() {
                if occupied.contains(Cell::of(index).1, 0) {
                    self.push(index, CellState::Occupied)?;
                } else if is_asked {
                    let state = states.as_ref().map(|states| states.state(asked));
                    asked += 1;
                    if state == Some(PointState::Free) {
                        self.push(index, CellState::Free)?;
                    }
                }
            }
        }
        Ok(())
    }

    fn push(&mut self, index: [i32; 3], state: CellState) -> Result<(), CliError> {
        match state {
            CellState::Occupied => self.occupied += 1,
            CellState::Free => self.free += 1,
        }
        self.tree.push(Leaf { index, level: 0, state }).map_err(|error: LeafError| CliError::failed(error))
    }

    /// Writes the tree, of probabilities or of states alone.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub(super) fn write(&self, kind: FileKind, out: &NewFile) -> Result<OctreeCells, CliError> {
        let has_probabilities = kind == FileKind::Ot;
        let write = || {
            let mut file = BufWriter::new(File::create(out.path())?);
            match has_probabilities {
                true => self.tree.write_full(self.resolution_m, &mut file)?,
                false => self.tree.write_binary(self.resolution_m, &mut file)?,
            }
            file.flush()
        };
        write().map_err(|problem| out.failed(problem))?;
        let Self { occupied, free, .. } = *self;
        Ok(OctreeCells { occupied, free, leaves: self.tree.len(), has_probabilities })
    }
}

/// Blocks of cells, with what is occupied of each, and the centers of those that are asked.
#[derive(Default)]
struct Waiting {
    /// The last is true where the cells that are not occupied are asked.
    blocks: Vec<(CellBlock, BlockMask, bool)>,
    centers: Vec<Point>,
}

impl Waiting {
    fn add(&mut self, block: CellBlock, occupied: BlockMask, resolution_m: f64, free_space: &FreeSpace<'_>) {
        let low_m = block.low().map(|i| f64::from(i) * resolution_m);
        let high_m = block.low().map(|i| f64::from(i + BLOCK_SIDE) * resolution_m);
        let is_asked = free_space.may_be_in(low_m, high_m);
        if is_asked {
            let center = |index: [i32; 3]| Point3::from(index.map(|i| (f64::from(i) + 0.5) * resolution_m));
            let others = block.cells().filter(|index| !occupied.contains(Cell::of(*index).1, 0));
            self.centers.extend(others.map(|index| Point::from(center(index))));
        }
        if is_asked || !occupied.is_empty() {
            self.blocks.push((block, occupied, is_asked));
        }
    }

    fn is_enough(&self) -> bool {
        self.centers.len() >= CELLS_PER_QUESTION || self.blocks.len() >= BLOCKS_PER_QUESTION
    }
}

fn occupied_of(set: &VoxelSet, block: CellBlock) -> BlockMask {
    let key = VoxelKey::new(block.low().map(|i| i >> BLOCK_LEVELS));
    let found = key.and_then(|key| set.blocks().binary_search_by_key(&key, |(key, _)| *key).ok());
    found.map_or(BlockMask::EMPTY, |at| set.blocks()[at].1)
}

/// The smallest and the largest indices of voxels; of none, of an empty box.
fn bounds(keys: &[VoxelKey]) -> ([i32; 3], [i32; 3]) {
    keys.iter().fold(([i32::MAX; 3], [i32::MIN; 3]), |(low, high), key| {
        let index = key.index();
        ([0, 1, 2].map(|a| low[a].min(index[a])), [0, 1, 2].map(|a| high[a].max(index[a])))
    })
}

/// Refuses voxels that no tree holds.
fn check_range(voxels: &Voxels) -> Result<(), CliError> {
    let cells = CELL_INDEX_MIN..=CELL_INDEX_MAX;
    let beyond = voxels.keys.iter().find(|key| !key.index().iter().all(|i| cells.contains(i)));
    match beyond {
        None => Ok(()),
        Some(key) => Err(CliError::failed(format!(
            "--level {}: voxel {:?} lies beyond an octree, whose cells have indices from {CELL_INDEX_MIN} to \
             {CELL_INDEX_MAX}: take a coarser --level",
            voxels.level,
            key.index()
        ))),
    }
}

/// Refuses a box of more cells than are asked.
fn check_box(voxels: &Voxels, low: [i32; 3], high: [i32; 3]) -> Result<(), CliError> {
    let cells_at = |coarser: u32| -> u64 {
        let along = |axis: usize| ((high[axis] >> coarser) - (low[axis] >> coarser) + 1) as u64;
        along(0) * along(1) * along(2)
    };
    if voxels.keys.is_empty() || cells_at(0) <= CELLS_ASKED_MAX {
        return Ok(());
    }
    let level = voxels.level;
    let fits = (level + 1..voxels.levels).find(|&coarser| cells_at(coarser - level) <= CELLS_ASKED_MAX);
    let coarser = fits.map_or(String::new(), |fits| format!("take --level {fits}, or "));
    let cells = count(cells_at(0) as usize);
    Err(CliError::failed(format!(
        "--level {level}: the box around the map has {cells} cells, and at most {CELLS_ASKED_MAX} are asked whether they \
         are free: {coarser}leave free space out by --no-free"
    )))
}
