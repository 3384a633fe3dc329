//! Dominant surface normals: the directions that most surfaces face.

use nalgebra::{Matrix3, UnitVector3, Vector3};

use super::supervision::{Unbuilt, check};
use crate::geometry::symmetric_eigen;
use crate::util::StopSignal;
use crate::voxel::VoxelKey;

/// Half width, in voxels, of the neighborhood that a plane is fitted to.
const WINDOW: i32 = 2;
/// Fewest voxels that make a surface.
const VOXELS_MIN: usize = 8;
/// How much flatter than wide the voxels of a surface are: smallest to middle eigenvalue.
const FLATNESS_MAX: f64 = 0.35;
/// Most voxels that a plane is fitted around.
pub(super) const SURFACES_MAX: usize = 2000;
/// Directions within this angle, degrees, are one cluster.
const SAME_DEG: f64 = 8.0;
/// Least angle, degrees, between two dominant directions.
const APART_DEG: f64 = 20.0;
/// Least share of the surfaces that a dominant direction has.
const SHARE_MIN: f64 = 0.04;
/// Surfaces that are fitted, or compared with all others, between two checks of the stop signal.
const SURFACES_PER_STOP_CHECK: usize = 64;

/// Up to `wish` dominant normals (without sign) of the surfaces around `voxels`, at most [`SURFACES_MAX`] of them; most
/// frequent first.
pub(super) fn dominant_normals(
    voxels: &[VoxelKey],
    is_occupied: &dyn Fn(VoxelKey) -> bool,
    wish: usize,
    stop: StopSignal<'_>,
) -> Result<Vec<UnitVector3<f64>>, Unbuilt> {
    let mut normals: Vec<Vector3<f64>> = Vec::new();
    for voxels in voxels.chunks(SURFACES_PER_STOP_CHECK) {
        check(stop)?;
        normals.extend(voxels.iter().filter_map(|voxel| normal_at(*voxel, is_occupied)));
    }
    let support_min = (normals.len() as f64 * SHARE_MIN).max(1.0) as usize;
    let mut directions = Vec::new();
    while directions.len() < wish {
        let support = |axis: &Vector3<f64>| normals.iter().filter(|n| are_near(n, axis, SAME_DEG)).count();
        // The first of the best, so that the order of voxels decides ties.
        let mut supports = Vec::with_capacity(normals.len());
        for normals in normals.chunks(SURFACES_PER_STOP_CHECK) {
            check(stop)?;
            supports.extend(normals.iter().map(|axis| (support(axis), *axis)));
        }
        let best = supports.into_iter().rev().max_by_key(|(count, _)| *count);
        let Some((_, mut axis)) = best.filter(|(count, _)| *count >= support_min) else { break };
        for _ in 0..3 {
            let about: Vec<_> = normals.iter().filter(|n| are_near(n, &axis, SAME_DEG)).copied().collect();
            axis = mean_axis(&about).unwrap_or(axis);
        }
        normals.retain(|normal| !are_near(normal, &axis, APART_DEG));
        directions.push(UnitVector3::new_normalize(axis));
    }
    Ok(directions)
}

/// True when two directions without sign differ by at most `degrees`.
fn are_near(a: &Vector3<f64>, b: &Vector3<f64>, degrees: f64) -> bool {
    a.dot(b).abs() >= degrees.to_radians().cos()
}

/// The normal of the plane through a voxel's neighborhood, where that is flat.
fn normal_at(voxel: VoxelKey, is_occupied: &dyn Fn(VoxelKey) -> bool) -> Option<Vector3<f64>> {
    let [x, y, z] = voxel.index();
    let span = |center: i32| center - WINDOW..=center + WINDOW;
    let window = span(z).flat_map(|z| span(y).flat_map(move |y| span(x).map(move |x| [x, y, z])));
    let there = window.filter(|index| VoxelKey::new(*index).is_some_and(is_occupied));
    let offsets: Vec<Vector3<f64>> =
        there.map(|[i, j, k]| Vector3::new(f64::from(i - x), f64::from(j - y), f64::from(k - z))).collect();
    if offsets.len() < VOXELS_MIN {
        return None;
    }
    let mean = offsets.iter().sum::<Vector3<f64>>() / offsets.len() as f64;
    let scatter = offsets.iter().map(|o| (o - mean) * (o - mean).transpose()).sum::<Matrix3<f64>>();
    let (order, eigen) = sorted_eigen(scatter)?;
    let flat = eigen.eigenvalues[order[0]] <= FLATNESS_MAX * eigen.eigenvalues[order[1]];
    flat.then(|| eigen.eigenvectors.column(order[0]).into_owned())
}

/// The axis that directions without sign have in common.
fn mean_axis(directions: &[Vector3<f64>]) -> Option<Vector3<f64>> {
    let (order, eigen) = sorted_eigen(directions.iter().map(|d| d * d.transpose()).sum())?;
    Some(eigen.eigenvectors.column(order[2]).into_owned())
}

/// Eigenvalues and eigenvectors, with the order that sorts the eigenvalues ascending.
fn sorted_eigen(
    symmetric: Matrix3<f64>,
) -> Option<([usize; 3], nalgebra::SymmetricEigen<f64, nalgebra::U3>)> {
    let eigen = symmetric_eigen(symmetric)?;
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
    Some((order, eigen))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    fn dominant_of(voxels: &[VoxelKey]) -> Vec<UnitVector3<f64>> {
        let all: HashSet<VoxelKey> = voxels.iter().copied().collect();
        let some: Vec<_> =
            voxels.iter().copied().step_by(voxels.len().div_ceil(SURFACES_MAX).max(1)).collect();
        dominant_normals(&some, &|key| all.contains(&key), 4, StopSignal::NEVER).unwrap()
    }

    /// A floor of 60 x 40 voxels with a wall of 60 x 20 along it and one of 40 x 10 across, about a turned axis.
    fn room(turn: f64) -> Vec<VoxelKey> {
        let (sin, cos) = turn.sin_cos();
        let at = |x: i32, y: i32, z: i32| {
            let (x, y, z) = (f64::from(x), f64::from(y), f64::from(z));
            let place = [x * cos - y * sin, x * sin + y * cos, z].map(|c| c.floor() as i32);
            VoxelKey::new(place).unwrap()
        };
        let floor = (0..60).flat_map(|x| (0..40).map(move |y| at(x, y, 0)));
        let along = (0..60).flat_map(|x| (0..20).map(move |z| at(x, 0, z)));
        let across = (0..40).flat_map(|y| (0..10).map(move |z| at(0, y, z)));
        let mut voxels: Vec<_> = floor.chain(along).chain(across).collect();
        voxels.sort_unstable();
        voxels.dedup();
        voxels
    }

    #[test]
    fn a_rooms_floor_and_walls_are_found_largest_first() {
        for turn in [0.0f64, 0.35] {
            let found = dominant_of(&room(turn));
            let expected = [
                Vector3::z(),
                Vector3::new(-turn.sin(), turn.cos(), 0.0),
                Vector3::new(turn.cos(), turn.sin(), 0.0),
            ];
            assert_eq!(found.len(), expected.len());
            for (found, expected) in found.iter().zip(&expected) {
                let degrees = found.dot(expected).abs().min(1.0).acos().to_degrees();
                assert!(degrees < 2.0, "{found:?} is {degrees} degrees off {expected:?}");
            }
        }
    }

    #[test]
    fn scattered_voxels_have_no_direction() {
        let voxels: Vec<_> =
            (0..500).map(|i| VoxelKey::new([i * 7, i * 5 % 91, i * 3 % 83]).unwrap()).collect();
        assert!(dominant_of(&voxels).is_empty());
        assert!(dominant_of(&[]).is_empty());
    }
}
