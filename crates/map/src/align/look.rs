//! Looks: what rays say of a scan at a pose, point by point.

use nalgebra::Point3;

use super::agreement::{RayAgreement, RayCounts, Rays};
use super::sampled_scan::SampledScan;
use super::settings::AlignmentSettings;
use super::witnesses::{MetInMap, Witnesses};
use crate::geometry::{Point, Pose};
use crate::map::MultiResolutionMap;
use crate::util::StopSignal;
use crate::visibility::Sight;

/// How many times the deviation of as many single points the difference between two poses has that are equal in truth:
/// points beside each other are met or missed together. Of 800 and 8 times 500 points, from trials with exact rays.
pub(super) const CLUSTERING: f64 = 1.6;

/// What each point says of a scan at a pose: those of the scan, and those that the witnesses met.
#[derive(Debug)]
pub(super) struct Look {
    of_scan: Vec<Sight>,
    of_map: Vec<Sight>,
}

impl Look {
    /// What the rays of a scan at a pose and those of the witnesses say of it. Once `stop` is set, nothing.
    pub(super) fn of(rays: &Rays, pose: &Pose, witnesses: &Witnesses, stop: StopSignal<'_>) -> Self {
        if stop.is_stopped() {
            return Self { of_scan: Vec::new(), of_map: Vec::new() };
        }
        Self {
            of_scan: sights_of_scan(rays, pose, witnesses).collect(),
            of_map: sights_of_map(rays, pose, witnesses).collect(),
        }
    }

    /// How many points agree, and how many are contradicted.
    pub(super) fn agreement(&self) -> RayAgreement {
        RayAgreement {
            of_scan: RayCounts::of(self.of_scan.iter().copied()),
            of_map: RayCounts::of(in_view(self.of_map.iter().copied())),
        }
    }

    /// How much more this pose is contradicted than another one with the same witnesses, in standard deviations of the
    /// difference between two poses that are equal in truth: z = (a - b) / sqrt(a + b) / [`CLUSTERING`], of the points
    /// that contradict here alone (a) and there alone (b).
    pub(super) fn contradicted_more_than(&self, other: &Self) -> f64 {
        let pairs = self.of_scan.iter().zip(&other.of_scan).chain(self.of_map.iter().zip(&other.of_map));
        let (here, there) = pairs.fold((0.0, 0.0), |(here, there), (a, b)| {
            match (*a == Sight::Contradicts, *b == Sight::Contradicts) {
                (true, false) => (here + 1.0, there),
                (false, true) => (here, there + 1.0),
                _ => (here, there),
            }
        });
        if here + there == 0.0 { 0.0 } else { (here - there) / f64::sqrt(here + there) / CLUSTERING }
    }
}

/// What the witnesses say of each point of a scan at a pose.
fn sights_of_scan(rays: &Rays, pose: &Pose, witnesses: &Witnesses) -> impl Iterator<Item = Sight> {
    rays.points.iter().map(|point| {
        majority(witnesses.viewpoints.iter().map(|viewpoint| rays.sight_of(viewpoint, pose, *point)))
    })
}

/// What a scan at a pose says of each place that the witnesses met.
fn sights_of_map(rays: &Rays, pose: &Pose, witnesses: &Witnesses) -> impl Iterator<Item = Sight> {
    let sensor_from_map = pose.inverse();
    witnesses.met.iter().map(move |&MetInMap { place_m, error_m }| {
        let offset = sensor_from_map * Point3::from(place_m);
        rays.image.sight(offset.coords.map(|c| c as f32).into(), rays.tolerance_m + error_m)
    })
}

/// Those of what the scan looks at: new ground is what it shows and nobody saw; what it does not look at is nothing to
/// it.
fn in_view(sights: impl Iterator<Item = Sight>) -> impl Iterator<Item = Sight> {
    sights.filter(|sight| *sight != Sight::NotSeen)
}

/// True where a pose is contradicted `times` times as much as `agreement` says of another one, on one side at least.
/// One point more or less is chance.
pub(super) fn is_contradicted_times_as_much(
    rays: &Rays,
    pose: &Pose,
    witnesses: &Witnesses,
    agreement: &RayAgreement,
    times: f64,
) -> bool {
    let is_more = |here: RayCounts, there: RayCounts| {
        (there.contradicted + 1) as f64 >= times * (here.contradicted + 1) as f64
    };
    // Mostly one side tells.
    is_more(agreement.of_scan, RayCounts::of(sights_of_scan(rays, pose, witnesses)))
        || is_more(agreement.of_map, RayCounts::of(in_view(sights_of_map(rays, pose, witnesses))))
}

/// What most of those say that say anything; agreement of as many as contradict.
fn majority(sights: impl Iterator<Item = Sight>) -> Sight {
    let (agree, contradict) = sights.fold((0, 0), |(agree, contradict), sight| match sight {
        Sight::Agrees => (agree + 1, contradict),
        Sight::Contradicts => (agree, contradict + 1),
        Sight::Hidden | Sight::NotSeen => (agree, contradict),
    });
    match (agree, contradict) {
        (0, 0) => Sight::NotSeen,
        _ if agree >= contradict => Sight::Agrees,
        _ => Sight::Contradicts,
    }
}

/// How the rays of a scan of `points` (sensor frame, meters) at a pose and those of the map's viewpoints agree.
pub fn ray_agreement(
    map: &MultiResolutionMap,
    points: &[Point],
    map_from_sensor: &Pose,
    settings: &AlignmentSettings,
) -> RayAgreement {
    let scan = SampledScan::new(points, map.lattice(), settings, StopSignal::NEVER);
    let rays = Rays::of(map, &scan);
    let witnesses = Witnesses::of(&rays, map, &[*map_from_sensor], StopSignal::NEVER);
    Look::of(&rays, map_from_sensor, &witnesses, StopSignal::NEVER).agreement()
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::map::{MapSettings, RobotName};
    use crate::mapping::{Guess, MappingSettings, Scan, ScanMapper, Sightings, ViewpointSettings};

    /// A scan from (x, y) in a room of 8 x 6 m about the origin with a pillar, a ray every `step_deg`; sensor frame.
    fn scan(x: f32, y: f32, step_deg: f32) -> Vec<Point> {
        scan_of(&[(2.0, 1.5)], x, y, step_deg)
    }

    /// [`scan`] with pillars, 0.8 m wide, at the given places.
    fn scan_of(pillars: &[(f32, f32)], x: f32, y: f32, step_deg: f32) -> Vec<Point> {
        let steps = |from: f32, to: f32| {
            let count = ((to - from) / step_deg) as i32;
            (0..count).map(move |i| (from + i as f32 * step_deg).to_radians())
        };
        let rays = steps(-20.0, 20.0).flat_map(|elevation| steps(0.0, 360.0).map(move |at| (elevation, at)));
        rays.map(|(elevation, azimuth)| {
            let (sin, cos) = azimuth.sin_cos();
            let wall = |half: f32, from: f32, along: f32| (half.copysign(along) - from) / along;
            let to_pillar = |&(at_x, at_y): &(f32, f32)| {
                let (dx, dy) = (at_x - x, at_y - y);
                let (along, aside) = (dx * cos + dy * sin, dy * cos - dx * sin);
                let is_met = along > 0.0 && aside.abs() < 0.4;
                if is_met { along - (0.16 - aside * aside).sqrt() } else { f32::MAX }
            };
            let pillar = pillars.iter().map(to_pillar).fold(f32::MAX, f32::min);
            let range = wall(4.0, x, cos).min(wall(3.0, y, sin)).min(pillar);
            Point::new(range * cos, range * sin, range * elevation.tan())
        })
        .collect()
    }

    /// A map of scans from the places of `places`, whose rays lie `step_deg` apart.
    fn map_of(places: &[(f32, f32)], resolution_m: f64, step_deg: f32) -> MultiResolutionMap {
        let scans = places.iter().map(|&(x, y)| (scan(x, y, step_deg), x, y));
        map_with(scans.collect(), resolution_m)
    }

    /// A map of scans that were taken, not turned, at (x, y).
    fn map_with(scans: Vec<(Vec<Point>, f32, f32)>, resolution_m: f64) -> MultiResolutionMap {
        let map = MultiResolutionMap::new(MapSettings::new(resolution_m, 5)).unwrap();
        let (robot, sightings) = (RobotName::new("r").unwrap(), Sightings::default());
        let mapper = ScanMapper::new(&map, &sightings, MappingSettings::default());
        for (points, x, y) in scans {
            let pose = Pose::translation(x.into(), y.into(), 0.0);
            let scan = Scan { guess: Guess::Pose(pose), at_guess: true, ..Scan::new(&robot, &points) };
            mapper.map_scan(&scan, StopSignal::NEVER).unwrap();
        }
        map
    }

    #[test]
    fn a_true_pose_agrees_whatever_the_voxels_the_rays_and_the_number_of_scans() {
        let places = [(-2.0, -1.0), (-1.0, 0.5), (0.0, -1.5), (1.0, 0.0), (2.5, -2.0)];
        for resolution_m in [0.04, 0.1, 0.2] {
            for step_deg in [0.5, 1.0, 2.0] {
                for scans in [1, 2, places.len()] {
                    let map = map_of(&places[..scans], resolution_m, step_deg);
                    let points = scan(-0.5, 0.3, step_deg);
                    let at = |pose: &Pose| ray_agreement(&map, &points, pose, &AlignmentSettings::default());
                    let truth = at(&Pose::translation(-0.5, 0.3, 0.0));
                    let of = format!("{resolution_m} m, {step_deg} deg, {scans} scans: {truth:?}");
                    assert!(truth.worse() > 0.95 && truth.evidence() > 0.5, "{of}");
                    let aside = at(&Pose::translation(-0.5 + 12.0 * resolution_m, 0.3, 0.0));
                    assert!(aside.worse() < truth.worse() - 0.02, "{of}, aside {aside:?}");
                }
            }
        }
    }

    #[test]
    fn poses_that_are_equal_in_truth_differ_by_the_deviation_that_is_counted_with() {
        // With people they differ by up to two of it, most where one viewpoint is asked: then all that contradicts is a
        // few people.
        for witnesses in [1, 4] {
            let [alone, one, crowd] = [0, 1, 3].map(|people| deviation_of_equals(people, witnesses));
            let is_counted = alone < 0.5 && (0.2..2.0).contains(&one) && (one..2.3).contains(&crowd);
            assert!(is_counted, "{witnesses} witnesses: {alone} {one} {crowd}");
        }
    }

    /// The root mean square of z between two poses in a room that looks the same from both, but for people, who stand
    /// elsewhere in each of the scans. Noise of 2 cm.
    fn deviation_of_equals(people: usize, witnesses: usize) -> f64 {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let mut of_people = |people: usize, x: f32, y: f32| {
            let mut at = |half: f32| random.random_range(-half..half);
            let free = |(at_x, at_y): &(f32, f32)| (at_x - x).hypot(at_y - y) > 1.0;
            let pillars: Vec<_> = (0..people).map(|_| (at(3.5), at(2.5))).filter(free).collect();
            let mut points = scan_of(&pillars, x, y, 1.0);
            points.iter_mut().for_each(|point| {
                let scale = 1.0 + random.random_range(-0.02..0.02) / point.to_f64().coords.norm() as f32;
                *point = Point::from(point.xyz().map(|c| c * scale));
            });
            points
        };
        let mut squares = Vec::new();
        for k in 0..40 {
            let (x, y) = (f32::from(k as u8 % 8) * 0.5 - 1.7, f32::from(k as u8 / 8) * 0.6 - 1.3);
            let places = [(-2.0, -1.0), (-1.0, 1.5), (1.0, 0.0), (2.5, -2.0)];
            let scans = places[..witnesses].iter().map(|&(x, y)| (of_people(people, x, y), x, y));
            let map = map_with(scans.collect(), 0.1);
            let points = of_people(people, x, y);
            let settings = AlignmentSettings::default();
            let scan = SampledScan::new(&points, map.lattice(), &settings, StopSignal::NEVER);
            let (x, y) = (f64::from(x), f64::from(y));
            let turn = nalgebra::Vector3::z() * std::f64::consts::PI;
            let poses = [Pose::translation(x, y, 0.0), Pose::new(nalgebra::Vector3::new(-x, -y, 0.0), turn)];
            let rays = Rays::of(&map, &scan);
            let witnesses = Witnesses::of(&rays, &map, &poses, StopSignal::NEVER);
            let [truth, turned] = poses.map(|pose| Look::of(&rays, &pose, &witnesses, StopSignal::NEVER));
            squares.push(truth.contradicted_more_than(&turned).powi(2));
        }
        (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
    }

    #[test]
    fn a_map_without_viewpoints_tells_what_its_scans_must_have_seen() {
        let mut settings = MapSettings::new(0.1, 5);
        settings.moments = true;
        let map = MultiResolutionMap::new(settings).unwrap();
        let (robot, sightings) = (RobotName::new("r").unwrap(), Sightings::default());
        let viewpoints = ViewpointSettings { bytes_max: 0, ..ViewpointSettings::default() };
        let mapper =
            ScanMapper::new(&map, &sightings, MappingSettings { viewpoints, ..MappingSettings::default() });
        for (x, y) in [(-2.0, -1.0), (0.0, 0.5), (1.5, -1.0)] {
            let (points, pose) = (scan(x, y, 1.0), Pose::translation(x.into(), y.into(), 0.0));
            let scan = Scan { guess: Guess::Pose(pose), at_guess: true, ..Scan::new(&robot, &points) };
            mapper.map_scan(&scan, StopSignal::NEVER).unwrap();
        }
        assert!(map.viewpoints().is_empty());
        let points = scan(-0.5, 0.3, 1.0);
        let at = |x: f64, y: f64, turn: f64| {
            let pose = Pose::new(nalgebra::Vector3::new(x, y, 0.0), nalgebra::Vector3::z() * turn);
            ray_agreement(&map, &points, &pose, &AlignmentSettings::default())
        };
        let truth = at(-0.5, 0.3, 0.0);
        assert!(truth.worse() > 0.95 && truth.evidence() > 0.4, "{truth:?}");
        let (aside, turned) = (at(0.7, 0.3, 0.0), at(0.5, -0.3, std::f64::consts::PI));
        assert!(aside.better() < truth.worse() - 0.02, "{aside:?} {truth:?}");
        assert!(turned.worse() < truth.worse(), "{turned:?} {truth:?}");
    }
}
