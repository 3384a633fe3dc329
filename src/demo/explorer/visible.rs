//! What there is to see: the voxels that a robot can see from where it can stand.

use std::collections::BTreeSet;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::standing::{pose_at, stands_free};
use super::ways::{Grid, Ways};
use mrol_map::voxel::{Lattice, VoxelKey};
use mrol_simulate::{Scene, SpinningLidar};

/// Distance between the places from which it looks, in places of the grid.
const LOOK_EVERY: usize = 5;

/// The voxels that a sensor can see from all places where the robot can get to.
#[derive(Debug, Clone)]
pub(crate) struct Visible {
    /// The voxels of one level with a surface in them that was hit at least twice.
    pub voxels: BTreeSet<VoxelKey>,
}

impl Visible {
    /// What `lidar` sees of `scene`, without noise, by a robot that starts at a place, in voxels of `level`.
    pub(crate) fn of(
        scene: &Scene,
        lidar: &SpinningLidar,
        start: [f64; 2],
        lattice: &Lattice,
        level: u32,
    ) -> Self {
        const REACH_M: f64 = 16.0;
        let grid = Grid::around([start.map(|c| c - REACH_M), start.map(|c| c + REACH_M)]);
        let ways =
            Ways::from(grid, |_, place| if stands_free(scene, place) { 1.0 } else { f64::INFINITY }, start);
        let places: Vec<[f64; 2]> = ways.reached(LOOK_EVERY).map(|(_, _, place)| place).collect();
        let lidar = SpinningLidar { noise_m: 0.0, dropout: 0.0, ..lidar.clone() };
        let mut random = ChaCha8Rng::seed_from_u64(0);
        let (mut once, mut voxels) = (BTreeSet::new(), BTreeSet::new());
        for &place in &places {
            let pose = pose_at(place);
            let quantize = lattice.from_points(&pose);
            for point in lidar.scan(scene, &pose, &mut random) {
                let Some(voxel) = quantize.key(point).map(|voxel| voxel.ancestor(level)) else { continue };
                if !once.insert(voxel) {
                    voxels.insert(voxel);
                }
            }
        }
        Self { voxels }
    }
}

/// True where the body really met nothing at any of the places along a path.
pub(crate) fn never_collided(scene: &Scene, path: &[[f64; 3]]) -> bool {
    let between = path.windows(2).flat_map(|pair| {
        [0.0, 0.5]
            .map(|share| [0, 1].map(|axis: usize| pair[0][axis] + (pair[1][axis] - pair[0][axis]) * share))
    });
    between.into_iter().all(|place| stands_free(scene, place))
}
