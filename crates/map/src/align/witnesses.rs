//! Witnesses: the viewpoints that are asked about a scan, and what they met.

use std::cmp::Reverse;
use std::sync::Arc;

use nalgebra::Point3;

use super::agreement::{RayCounts, Rays, spread};
use super::marched;
use crate::geometry::{Point, Pose};
use crate::map::{Lookup, MultiResolutionMap};
use crate::util::StopSignal;
use crate::visibility::{Met, Sight, Viewpoint};

/// Viewpoints that are asked.
const VIEWPOINTS: usize = 8;
/// Viewpoints that are asked for each pose, at least.
const VIEWPOINTS_OF_POSE: usize = 2;
/// Viewpoints near a pose among which those are chosen that saw most of what the scan shows.
const NEAR: usize = 32;
/// Points that tell how much of it a viewpoint saw.
const POINTS_TO_CHOOSE: usize = 64;
/// What a viewpoint met counts where its image tells the place to so many of these tolerances.
const ERROR_MAX: f32 = 2.0;
/// The level whose voxels tell whether the map still holds what a viewpoint met.
const STILL_THERE_LEVEL: u32 = 2;
/// The viewpoints that are asked about a scan, the same for all poses that are compared.
#[derive(Debug)]
pub(super) struct Witnesses {
    pub(super) viewpoints: Vec<Arc<Viewpoint>>,
    /// What they met, and the map still holds.
    pub(super) met: Vec<MetInMap>,
}

/// A place that a viewpoint met, and the map still holds.
#[derive(Debug)]
pub(super) struct MetInMap {
    /// The place, map frame.
    pub(super) place_m: [f64; 3],
    /// As [`Met::error_m`].
    pub(super) error_m: f32,
}

impl Witnesses {
    /// The witnesses of a scan that was taken at one of some poses: for each, of the viewpoints near to it those that
    /// saw most of what the scan shows there.
    pub(super) fn of(rays: &Rays, map: &MultiResolutionMap, poses: &[Pose], stop: StopSignal<'_>) -> Self {
        let mut witnesses = Self { viewpoints: Vec::new(), met: Vec::new() };
        witnesses.add(rays, map, poses, stop);
        witnesses
    }

    /// Adds the witnesses of further poses.
    pub(super) fn add(
        &mut self,
        rays: &Rays,
        map: &MultiResolutionMap,
        poses: &[Pose],
        stop: StopSignal<'_>,
    ) {
        for pose in poses {
            let wish = VIEWPOINTS.div_ceil(poses.len()).max(VIEWPOINTS_OF_POSE);
            for viewpoint in viewpoints_for(rays, map, pose, wish, stop) {
                if !self.viewpoints.iter().any(|other| Arc::ptr_eq(other, &viewpoint)) {
                    self.viewpoints.push(viewpoint);
                }
            }
        }
        self.met = met(map, &self.viewpoints, rays.tolerance_m);
    }

    /// The share of what each witness met that another one contradicts, of what it says anything of: what moved, and
    /// what images are too coarse for.
    pub(super) fn contradicted_among_each_other(&self, tolerance_m: f32) -> f64 {
        let viewpoints = &self.viewpoints;
        let sights = viewpoints.iter().flat_map(|viewpoint| {
            let others = viewpoints.iter().filter(move |other| !Arc::ptr_eq(other, viewpoint));
            let few = spread(&viewpoint.met(ERROR_MAX * tolerance_m), POINTS_TO_CHOOSE);
            others.flat_map(move |other| {
                let of_met = |&Met { offset, error_m }: &Met| {
                    let place = viewpoint.map_from_sensor() * Point3::from(offset.map(f64::from));
                    other.image().sight(other.offset(place.into()), tolerance_m + error_m)
                };
                few.iter().map(of_met).collect::<Vec<_>>()
            })
        });
        RayCounts::of(sights).contradicted_share()
    }
}

/// For a pose, of the viewpoints near to it those that saw most of what the scan shows there.
fn viewpoints_for(
    rays: &Rays,
    map: &MultiResolutionMap,
    pose: &Pose,
    wish: usize,
    stop: StopSignal<'_>,
) -> Vec<Arc<Viewpoint>> {
    let distance_m = |viewpoint: &Viewpoint| {
        (viewpoint.map_from_sensor().translation.vector - pose.translation.vector).norm()
    };
    let in_map = rays.viewpoints.iter();
    let mut all: Vec<_> = in_map.map(|(revision, it)| (distance_m(it), revision, it)).collect();
    let nearest_first = |a: &(f64, u64, _), b: &(f64, u64, _)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
    if all.len() > NEAR {
        all.select_nth_unstable_by(NEAR, nearest_first);
        all.truncate(NEAR);
    }
    all.sort_unstable_by(nearest_first);
    let mut near: Vec<_> = all.into_iter().map(|(at_m, _, it)| (at_m, Arc::clone(it))).collect();
    let nearest_m = near.first().map_or(f64::INFINITY, |(distance_m, _)| *distance_m);
    let marched = marched::viewpoints_near(map, pose, nearest_m, wish, stop);
    near.extend(marched.into_iter().map(|viewpoint| (distance_m(&viewpoint), viewpoint)));
    let few = spread(&rays.points, POINTS_TO_CHOOSE);
    let tells = |viewpoint: &Viewpoint| {
        let sights = few.iter().map(|point| rays.sight_of(viewpoint, pose, *point));
        sights.filter(|sight| matches!(sight, Sight::Agrees | Sight::Contradicts)).count()
    };
    let mut ranked: Vec<_> = near.into_iter().map(|(_, it)| (tells(&it), it)).collect();
    ranked.sort_by_key(|(tells, _)| Reverse(*tells));
    // One that looked elsewhere makes little of what the others agree on.
    let most = ranked.first().map_or(0, |(tells, _)| *tells);
    ranked.retain(|(tells, _)| 2 * tells >= most);
    ranked.into_iter().take(wish).map(|(_, viewpoint)| viewpoint).collect()
}

/// What viewpoints met, the map still holds, and no other one of them saw through: at rims and on glass they differ.
fn met(map: &MultiResolutionMap, viewpoints: &[Arc<Viewpoint>], tolerance_m: f32) -> Vec<MetInMap> {
    let of_viewpoint = |viewpoint: &Arc<Viewpoint>| {
        let map_from_sensor = *viewpoint.map_from_sensor();
        let met = viewpoint.met(ERROR_MAX * tolerance_m);
        let in_map = |&Met { offset, error_m }: &Met| MetInMap {
            place_m: (map_from_sensor * Point3::from(offset.map(f64::from))).into(),
            error_m,
        };
        met.iter().map(in_map).collect::<Vec<_>>()
    };
    let met: Vec<MetInMap> = viewpoints.iter().flat_map(of_viewpoint).collect();
    let points: Vec<Point> = met.iter().map(|met| Point::from(Point3::from(met.place_m))).collect();
    let mut occupied = vec![0u64; points.len().div_ceil(64)];
    let level = STILL_THERE_LEVEL.min(map.lattice().levels() - 1);
    map.view().query(&points, &map.lattice().from_map(), level, Lookup::Exact, &mut occupied);
    let is_there = |i: usize| occupied[i / 64] >> (i % 64) & 1 == 1;
    let is_seen_through = |met: &MetInMap| {
        let sights = viewpoints.iter().map(|viewpoint| {
            viewpoint.image().sight(viewpoint.offset(met.place_m), tolerance_m + met.error_m)
        });
        sights.into_iter().any(|sight| sight == Sight::Contradicts)
    };
    let met = met.into_iter().enumerate().filter(|(i, met)| is_there(*i) && !is_seen_through(met));
    met.map(|(_, met)| met).collect()
}
