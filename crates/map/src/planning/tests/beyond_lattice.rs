//! Places beyond what voxel keys reach: no question about one is answered as if nothing were there.

use crate::geometry::Point;
use crate::map::{MapSettings, MultiResolutionMap};
use crate::planning::*;
use crate::util::StopSignal;

const NEVER: StopSignal<'static> = StopSignal::NEVER;

/// A planner of an empty map of voxels of 1 mm, which reaches 1048.576 m along each axis.
fn planner() -> Planner {
    Planner::new(MultiResolutionMap::new(MapSettings::new(0.001, 4)).unwrap().into())
}

fn surroundings() -> [Surroundings; 2] {
    [Unknown::Occupied, Unknown::Free].map(|unknown| Surroundings { unknown, ..Surroundings::ALL_VOXELS })
}

fn ball() -> Body {
    let spheres = vec![Sphere { center_m: [0.1, 0.0, 0.0], radius_m: 0.05 }];
    Body::new(vec![Link { spheres, ..Link::default() }]).unwrap()
}

fn pose_at([x, y, z]: [f32; 3]) -> [f32; 7] {
    [x, y, z, 0.0, 0.0, 0.0, 1.0]
}

/// Places out of reach along each axis, on either side, and one whose body alone reaches out.
const BEYOND: [[f32; 3]; 6] = [
    [1200.0, 0.0, 0.0],
    [0.0, -1049.0, 0.0],
    [0.0, 0.0, 5e4],
    [3e38, 0.0, 0.0],
    [1048.5, 0.0, 0.0],
    [0.0, 0.0, 1048.57],
];

fn assert_beyond<A: std::fmt::Debug>(answer: Result<A, PlanningError>, names: &str) {
    let told = answer.unwrap_err();
    let is_range = matches!(told, PlanningError::BodyRange { .. } | PlanningError::SphereRange { .. });
    let text = told.to_string();
    assert!(is_range && text.starts_with(names) && text.contains("-1048.576..1048.576 m"), "{text}");
}

#[test]
fn a_pose_beyond_the_lattice_is_refused_at_every_level_by_every_kind_of_answer() {
    let (planner, body) = (planner(), ball());
    let view = planner.view().with_viewpoints();
    for (at, surroundings, level) in BEYOND
        .into_iter()
        .flat_map(|at| surroundings().map(|of| (at, of)))
        .zip([0, 1, 3].into_iter().cycle())
        .map(|((at, of), level)| (at, of, level))
    {
        let numbers = [pose_at([0.0; 3]), pose_at(at)].concat();
        let configurations = Configurations::new(&numbers, 1).unwrap();
        let question = PoseQuestion { body: &body, configurations, level, surroundings: &surroundings };
        let names = "configurations[1].links[0] reaches beyond";
        assert_beyond(view.bodies_meet(&question, NEVER), names);
        assert_beyond(view.first_hits(&question, NEVER), names);
        assert_beyond(view.clearances(&question, 0.05, NEVER), names);
    }
}

#[test]
fn a_sphere_beyond_the_lattice_is_refused() {
    let planner = planner();
    let view = planner.view().with_viewpoints();
    for (at, surroundings) in BEYOND.into_iter().flat_map(|at| surroundings().map(|of| (at, of))) {
        let sphere = |center_m| Sphere { center_m, radius_m: 0.05 };
        let spheres = [sphere([0.0; 3]), sphere([1.0; 3]), sphere(at)];
        let groups = SphereGroups::new(&spheres, &[1, 2]).unwrap();
        let question = SphereQuestion { groups, padding_m: 0.05, level: 0, surroundings: &surroundings };
        assert_beyond(view.spheres_meet(&question, NEVER), "spheres[2] reaches beyond");
        assert_beyond(view.first_sphere_hits(&question, NEVER), "spheres[2] reaches beyond");
        assert_beyond(view.sphere_clearances(&question, 0.05, NEVER), "spheres[2] reaches beyond");
    }
}

#[test]
fn a_motion_that_leads_beyond_the_lattice_is_refused() {
    let (planner, body) = (planner(), ball());
    let view = planner.view().with_viewpoints();
    for surroundings in surroundings() {
        let numbers =
            [[0.0; 3], [0.1, 0.0, 0.0], [1048.3, 0.0, 0.0], [1048.6, 0.0, 0.0]].map(pose_at).concat();
        let configurations = Configurations::new(&numbers, 1).unwrap();
        let question = MotionQuestion {
            body: &body,
            configurations,
            lengths: &[2, 2],
            step_m: Some(0.05),
            clearance_max_m: None,
            level: 0,
            surroundings: &surroundings,
        };
        assert_beyond(view.check_motions(&question, NEVER), "configurations[3].links[0] reaches beyond");
    }
}

#[test]
fn a_link_far_from_its_frame_is_within_the_lattice_where_its_parts_are() {
    let planner = planner();
    let view = planner.view();
    // Further from the origin of its frame than the lattice reaches along an axis.
    let spheres = vec![Sphere { center_m: [900.0, 900.0, 0.0], radius_m: 0.1 }];
    let body = Body::new(vec![Link { spheres, ..Link::default() }, Link::default()]).unwrap();
    // A link without parts is nowhere.
    let numbers = [pose_at([0.0; 3]), pose_at([1e9; 3]), pose_at([1.0; 3]), pose_at([1e9; 3])].concat();
    let configurations = Configurations::new(&numbers, 2).unwrap();
    let surroundings = Surroundings::ALL_VOXELS;
    let question = PoseQuestion { body: &body, configurations, level: 0, surroundings: &surroundings };
    assert_eq!(view.bodies_meet(&question, NEVER), Ok(Some(vec![0])));
    let question = MotionQuestion {
        body: &body,
        configurations: Configurations::new(&numbers, 2).unwrap(),
        lengths: &[2],
        step_m: Some(0.5),
        clearance_max_m: None,
        level: 0,
        surroundings: &surroundings,
    };
    assert!(view.check_motions(&question, NEVER).unwrap().unwrap()[0].is_free());
}

#[test]
fn room_that_would_reach_beyond_the_lattice_is_refused_where_unknown_voxels_count() {
    let (planner, body) = (planner(), ball());
    let view = planner.view().with_viewpoints();
    let [careful, trusting] = surroundings();
    let spheres = [Sphere { center_m: [1048.5, 0.0, 0.0], radius_m: 0.05 }];
    let numbers = [pose_at([1048.4, 0.0, 0.0]), pose_at([1048.4, 0.1, 0.0])].concat();
    let room_m = |surroundings: &Surroundings, most_m: f32| {
        let groups = SphereGroups::new(&spheres, &[1]).unwrap();
        let question = SphereQuestion { groups, padding_m: 0.0, level: 0, surroundings };
        let configurations = Configurations::new(&numbers, 1).unwrap();
        let poses = PoseQuestion { body: &body, configurations, level: 0, surroundings };
        let motions = MotionQuestion {
            body: &body,
            configurations,
            lengths: &[2],
            step_m: None,
            clearance_max_m: Some(most_m),
            level: 0,
            surroundings,
        };
        [
            view.sphere_clearances(&question, most_m, NEVER).map(|_| ()),
            view.clearances(&poses, most_m, NEVER).map(|_| ()),
            view.check_motions(&motions, NEVER).map(|_| ()),
        ]
    };
    assert_eq!(room_m(&trusting, 0.06), [Ok(()), Ok(()), Ok(())]);
    assert_eq!(room_m(&careful, 0.02), [Ok(()), Ok(()), Ok(())]);
    for told in room_m(&careful, 0.06) {
        let told = told.unwrap_err().to_string();
        assert!(told.contains("m around it that count") && !told.contains("with 0 m"), "{told}");
    }
}

#[test]
fn points_rays_and_boxes_beyond_the_lattice_are_refused() {
    let planner = planner();
    let map = planner.map();
    let view = map.view().with_viewpoints();
    let limits = "-1048.576..1048.576 m";
    let refused = |told: String, names: &str| {
        assert!(told.starts_with(names) && told.contains(limits), "{told}");
    };
    for at in [[1200.0f32, 0.0, 0.0], [0.0, -1049.0, 0.0], [0.0, 0.0, f32::NAN]] {
        let points = [Point::new(0.0, 0.0, 0.0), Point::from(at)];
        let nearest = NearestRequest { points: &points, level: 0, radius_m: 0.05, to: MeasuredTo::Cubes };
        refused(find_nearest(&view, &nearest, NEVER).unwrap_err().to_string(), "points[1]");
        refused(classify_points(&view, &points, 0, NEVER).unwrap_err().to_string(), "points[1]");
        let ends = [Point::new(1.0, 0.0, 0.0), Point::from(at)];
        for cast in [cast_rays, cast_rays_in_sight] {
            let origins = [Point::new(0.0, 0.0, 0.0)];
            let from_there = Rays { origins: &points, toward: Toward::Ends(&[Point::new(1.0, 1.0, 1.0); 2]) };
            refused(cast(&view, &from_there, 0, NEVER).unwrap_err().to_string(), "origins[1]");
            let leads_there = Rays { origins: &origins, toward: Toward::Ends(&ends) };
            let told = cast(&view, &leads_there, 0, NEVER).unwrap_err().to_string();
            assert!(told.starts_with("ends[1]"), "{told}");
        }
    }
    drop(view);
    let grid = |band_m, area| {
        let request = GridRequest {
            level: 0,
            area,
            band_m,
            band_from: BandFrom::Map,
            cell_m: 0.1,
            tells_unknown: true,
            cells_max: 1000,
        };
        project_grid(&mut map.view().with_viewpoints().into(), &request, NEVER)
    };
    let area = GridArea::Rectangle { min_m: [0.0; 2], max_m: [1.0; 2] };
    for band_m in [[1100.0, 1101.0], [-2e3, -1.9e3], [f64::INFINITY; 2]] {
        refused(grid(band_m, area).unwrap_err().to_string(), "min_z_m and max_z_m");
        refused(grid(band_m, GridArea::Occupied).unwrap_err().to_string(), "min_z_m and max_z_m");
    }
    assert!(grid([-1e9, 1e9], area).is_ok());
    let frontiers = |min_m, max_m| {
        let request = FrontierRequest {
            level: 0,
            min_m,
            max_m,
            size_min: 1,
            frontiers_max: 10,
            standoff_m: None,
            cells_max: 1_000_000,
        };
        list_frontiers(&mut map.view().with_viewpoints().into(), &request, NEVER)
    };
    for (min_m, max_m) in [([1100.0; 3], [1101.0; 3]), ([1048.5, 0.0, 0.0], [1048.6, 0.1, 0.1])] {
        refused(frontiers(min_m, max_m).unwrap_err().to_string(), "box:");
    }
    assert!(frontiers([1048.5, 0.0, 0.0], [1048.576, 0.1, 0.1]).is_ok());
}
