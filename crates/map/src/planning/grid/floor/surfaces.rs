//! What something can stand on: the tops of voxels that have none right above.

use hashbrown::HashMap;

use crate::map::{MapView, PausingView, SHARDS};
use crate::util::StopSignal;
use crate::voxel::VoxelKey;

/// Voxels between two checks of the stop signal.
const VOXELS_PER_STOP_CHECK: usize = 4096;

/// The voxels of a level that have none right above, column by column: their tops are what something can stand on.
#[derive(Debug)]
pub(super) struct Surfaces {
    /// The indices of the voxels, ascending by x, then y, then z.
    voxels: Vec<[i32; 3]>,
    /// Where the surfaces of a column begin in `voxels`.
    columns: HashMap<[i32; 2], u32>,
}

impl Surfaces {
    /// The surfaces of all voxels of `level`; once stopped, some of them. Others go first between the shards.
    pub(super) fn of(view: &mut PausingView<'_>, level: u32, stop: StopSignal<'_>) -> Self {
        let mut voxels = Vec::new();
        for shard in 0..SHARDS {
            view.give_way(stop);
            let view = view.view();
            let Some(list) = view.lists(level).nth(shard) else { continue };
            voxels.extend(stop.paced(list.iter(), VOXELS_PER_STOP_CHECK).map(VoxelKey::index).filter(
                |&[x, y, z]| VoxelKey::new([x, y, z + 1]).is_none_or(|above| !view.contains(above, level)),
            ));
        }
        voxels.sort_unstable();
        // A change between two shards may have been read twice.
        voxels.dedup();
        let mut columns = HashMap::new();
        for (number, [x, y, _]) in voxels.iter().enumerate() {
            columns.entry([*x, *y]).or_insert(number as u32);
        }
        Self { voxels, columns }
    }

    /// Number of surfaces.
    pub(super) fn len(&self) -> usize {
        self.voxels.len()
    }

    /// The index of the voxel under a surface.
    pub(super) fn voxel(&self, surface: u32) -> [i32; 3] {
        self.voxels[surface as usize]
    }

    /// The index of the lowest voxel of those without a gap from a surface down.
    pub(super) fn foot(&self, view: &MapView<'_>, level: u32, surface: u32) -> i32 {
        let [x, y, z] = self.voxel(surface);
        let is_there = |z: i32| VoxelKey::new([x, y, z]).is_some_and(|voxel| view.contains(voxel, level));
        (1..).map(|down| z - down).find(|z| !is_there(*z)).map_or(z, |gap| gap + 1)
    }

    /// The column that a surface belongs to.
    pub(super) fn column_of(&self, surface: u32) -> [i32; 2] {
        let [x, y, _] = self.voxel(surface);
        [x, y]
    }

    /// The surfaces of a column, from the lowest.
    pub(super) fn of_column(&self, column: [i32; 2]) -> impl Iterator<Item = u32> {
        let first = self.columns.get(&column).copied().unwrap_or(u32::MAX);
        let surfaces = self.voxels.get(first as usize..).unwrap_or_default();
        let count = surfaces.iter().take_while(|[x, y, _]| [*x, *y] == column).count() as u32;
        (0..count).map(move |number| first + number)
    }
}
