use std::collections::{BTreeMap, BTreeSet};

use proptest::prelude::*;

use super::*;
use crate::map::{KeepOuts, MapView, PausingView};
use crate::planning::tests::{SeenMap, seen_history_and_level};
use crate::util::StopSignal;
use crate::voxel::VoxelKey;

/// What is known of each voxel, looked at one by one.
struct BruteForce<'a> {
    seen: &'a SeenMap,
    view: &'a MapView<'a>,
    level: u32,
}

impl BruteForce<'_> {
    fn keep_outs(&self) -> &KeepOuts {
        self.view.keep_outs().unwrap()
    }

    fn is_occupied(&self, voxel: VoxelKey) -> bool {
        let center_m = self.seen.map.lattice().center_m(voxel, self.level);
        self.view.contains(voxel, self.level) || self.keep_outs().contains(center_m)
    }

    fn is_free(&self, voxel: VoxelKey) -> bool {
        !self.is_occupied(voxel) && self.seen.is_seen_through(voxel, self.level)
    }

    fn is_unknown(&self, voxel: VoxelKey) -> bool {
        !self.is_occupied(voxel) && !self.seen.is_seen_through(voxel, self.level)
    }

    fn frontier(&self, low: [f64; 3], high: [f64; 3]) -> BTreeSet<VoxelKey> {
        let voxel_m = self.seen.map.lattice().resolution_m(self.level);
        let range =
            |axis: usize| (low[axis] / voxel_m).floor() as i32 - 1..=(high[axis] / voxel_m).ceil() as i32 + 1;
        let all = range(2).flat_map(|z| range(1).flat_map(move |y| range(0).map(move |x| [x, y, z])));
        let is_inside = |voxel: &VoxelKey| {
            let center_m = self.seen.map.lattice().center_m(*voxel, self.level);
            (0..3).all(|axis| low[axis] <= center_m[axis] && center_m[axis] <= high[axis])
        };
        let is_frontier = |voxel: &VoxelKey| {
            self.is_free(*voxel) && {
                let mut beside = (0..6).map(|side| {
                    let mut index = voxel.index();
                    index[side / 2] += if side % 2 == 0 { 1 } else { -1 };
                    VoxelKey::new(index).unwrap()
                });
                beside.any(|voxel| self.is_unknown(voxel))
            }
        };
        all.filter_map(VoxelKey::new).filter(is_inside).filter(is_frontier).collect()
    }
}

/// Voxels that hang together by faces, edges or corners.
fn clusters(mut left: BTreeSet<VoxelKey>) -> Vec<BTreeSet<VoxelKey>> {
    let mut clusters = Vec::new();
    while let Some(first) = left.pop_first() {
        let (mut cluster, mut to_look_at) = (BTreeSet::from([first]), vec![first]);
        while let Some(voxel) = to_look_at.pop() {
            let touching: Vec<_> = left
                .iter()
                .copied()
                .filter(|other| (0..3).all(|axis| (other.index()[axis] - voxel.index()[axis]).abs() <= 1))
                .collect();
            for other in touching {
                left.remove(&other);
                cluster.insert(other);
                to_look_at.push(other);
            }
        }
        clusters.push(cluster);
    }
    clusters
}

/// What a test compares of a frontier: size, bounds in voxels, and the sum of indices.
type Seen = (u64, [i64; 3], [i64; 3], [i64; 3]);

fn seen_of(frontier: &Frontier, voxel_m: f64) -> Seen {
    let whole = |c: [f64; 3]| c.map(|c| (c / voxel_m).round() as i64);
    let sum = frontier.center_m.map(|c| ((c / voxel_m - 0.5) * frontier.voxels as f64).round() as i64);
    (frontier.voxels, whole(frontier.min_m), whole(frontier.max_m), sum)
}

fn seen_of_all(cluster: &BTreeSet<VoxelKey>) -> Seen {
    let along = |axis: usize| cluster.iter().map(move |voxel| i64::from(voxel.index()[axis]));
    let [low, high, sum] = [
        std::array::from_fn(|axis| along(axis).min().unwrap()),
        std::array::from_fn(|axis| along(axis).max().unwrap() + 1),
        std::array::from_fn(|axis| along(axis).sum()),
    ];
    (cluster.len() as u64, low, high, sum)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    #[test]
    fn frontiers_are_those_of_a_look_at_every_voxel_and_can_be_seen(
        (history, level) in seen_history_and_level(),
        low in prop::array::uniform3(-8.0f64..2.0),
        size in prop::array::uniform3(0.0f64..8.0),
        size_min in 1u64..6,
        standoff in prop_oneof![Just(None), (0.2f64..4.0).prop_map(Some)],
    ) {
        let seen = history.map();
        let mut view = PausingView::from(seen.map.view().with_viewpoints().with_keep_outs());
        let voxel_m = seen.map.lattice().resolution_m(level);
        let high = std::array::from_fn(|axis| low[axis] + size[axis]);
        let standoff_m = standoff.map(|voxels| voxels * voxel_m);
        let request = FrontierRequest {
            level, min_m: low, max_m: high, size_min, frontiers_max: 1000, standoff_m, cells_max: 1_000_000,
        };
        let told = list_frontiers(&mut view, &request, StopSignal::NEVER).unwrap();
        let first = FrontierRequest { frontiers_max: 2, ..request };
        let some = list_frontiers(&mut view, &first, StopSignal::NEVER).unwrap();
        let all = BruteForce { seen: &seen, view: view.view(), level };
        let voxels = all.frontier(low, high);
        prop_assert_eq!(told.voxels_total, voxels.len() as u64);
        let count = |all: &mut dyn Iterator<Item = Seen>| {
            let mut counted = BTreeMap::<Seen, usize>::new();
            all.for_each(|one| *counted.entry(one).or_default() += 1);
            counted
        };
        let expected = clusters(voxels.clone());
        let expected = count(&mut expected.iter().filter(|cluster| cluster.len() as u64 >= size_min).map(seen_of_all));
        prop_assert_eq!(count(&mut told.frontiers.iter().map(|of| seen_of(of, voxel_m))), expected);
        prop_assert!(told.frontiers.is_sorted_by(|a, b| a.voxels >= b.voxels));
        prop_assert_eq!(told.frontiers_total, told.frontiers.len() as u64);

        // As many as are asked for, the first of them.
        prop_assert_eq!(&some.frontiers[..], &told.frontiers[..told.frontiers.len().min(2)]);
        prop_assert_eq!(some.frontiers_total, told.frontiers_total);

        let voxel_at = |at_m: [f64; 3]| VoxelKey::new(at_m.map(|c| (c / voxel_m).floor() as i32)).unwrap();
        for FrontierView { map_from_view, target_m, yaw_rad, elevation_rad } in told.frontiers.iter().filter_map(|of| of.view) {
            prop_assert!(voxels.contains(&voxel_at(target_m)));
            let from_m: [f64; 3] = map_from_view.translation.vector.into();
            let way: [f64; 3] = std::array::from_fn(|axis| target_m[axis] - from_m[axis]);
            let length_m = way.iter().map(|c| c * c).sum::<f64>().sqrt();
            let most_m = standoff_m.unwrap_or(STANDOFF_VOXELS * voxel_m);
            prop_assert!(length_m <= most_m + 1e-9 && length_m > 0.0);
            for step in 0..=200 {
                // Not on a border, which the line may share with a voxel that it is not in.
                let at_m = std::array::from_fn(|axis| from_m[axis] + way[axis] * (f64::from(step) + 0.37) / 201.0);
                prop_assert!(all.is_free(voxel_at(at_m)), "{:?} on the way to {:?}", at_m, target_m);
                prop_assert!(!all.keep_outs().contains(at_m));
            }
            // It looks along x, with y level.
            let look = map_from_view.rotation * nalgebra::Vector3::x();
            let told = [yaw_rad.cos() * elevation_rad.cos(), yaw_rad.sin() * elevation_rad.cos(), elevation_rad.sin()];
            for axis in 0..3 {
                prop_assert!((look[axis] - way[axis] / length_m).abs() < 1e-9);
                prop_assert!((look[axis] - told[axis]).abs() < 1e-9);
            }
            prop_assert!((map_from_view.rotation * nalgebra::Vector3::y()).z.abs() < 1e-9);
        }
    }
}

#[test]
fn what_makes_no_box_or_distance_is_named() {
    let map = crate::map::MultiResolutionMap::new(crate::map::MapSettings::new(0.1, 2)).unwrap();
    let request = FrontierRequest {
        level: 0,
        min_m: [0.0; 3],
        max_m: [1.0; 3],
        size_min: 1,
        frontiers_max: 10,
        standoff_m: None,
        cells_max: 1000,
    };
    let ask = |request: FrontierRequest| {
        list_frontiers(&mut map.view().with_viewpoints().into(), &request, StopSignal::NEVER)
    };
    assert_eq!(ask(request), Ok(Frontiers::default()));
    assert_eq!(ask(FrontierRequest { max_m: [0.01; 3], ..request }), Ok(Frontiers::default()));
    let said = |request| ask(request).unwrap_err().to_string();
    assert!(
        said(FrontierRequest { cells_max: 999, ..request })
            .starts_with("box: 1000 voxels of level 0, at most 999")
    );
    for max_m in [[-1.0, 1.0, 1.0], [f64::NAN, 1.0, 1.0], [1.0, f64::INFINITY, 1.0]] {
        assert!(said(FrontierRequest { max_m, ..request }).starts_with("box: min_m must be finite"));
    }
    for standoff_m in [0.0, -1.0, f64::NAN, 25.7] {
        let told = said(FrontierRequest { standoff_m: Some(standoff_m), ..request });
        assert!(told.starts_with("standoff_m must lie above 0 and at most 25.6"), "{told}");
    }
    let far = FrontierRequest { min_m: [-1e300; 3], max_m: [1e300; 3], ..request };
    assert!(said(far).starts_with("box: "));
}

#[test]
fn a_stopped_search_looks_at_the_signal_in_proportion_to_the_box() {
    let map = crate::map::MultiResolutionMap::new(crate::map::MapSettings::new(0.1, 2)).unwrap();
    let looks = |side_m: f64| {
        let looks = std::cell::Cell::new(0);
        let never = || looks.replace(looks.get() + 1) == usize::MAX;
        let request = FrontierRequest {
            level: 0,
            min_m: [0.0; 3],
            max_m: [side_m; 3],
            size_min: 1,
            frontiers_max: 10,
            standoff_m: None,
            cells_max: 10_000_000,
        };
        list_frontiers(&mut map.view().with_viewpoints().into(), &request, StopSignal::when(&never)).unwrap();
        looks.get()
    };
    assert!(looks(6.4) >= 4 * looks(3.2), "{} and {}", looks(6.4), looks(3.2));
}
