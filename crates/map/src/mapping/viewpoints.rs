//! Which scans leave a viewpoint (paper III-B: free space is generated from recorded poses), and which viewpoints make
//! room.

use std::borrow::Cow;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::geometry::{Point, Pose};
use crate::map::ViewpointRecord;
use crate::util::StopSignal;
use crate::visibility::{
    IMAGE_BYTES_MAX, RangeImage, SensorRays, Sweep, Thresholds, Viewpoint, ViewpointSet,
    newly_seen_by_rays_m3, newly_seen_m3,
};

/// Bytes of memory of a map's viewpoints where nobody says: those of thousands.
pub const VIEWPOINT_BYTES_MAX_DEFAULT: usize = 64 << 20;

/// When a scan sees something new, so that it leaves a viewpoint.
///
/// Viewpoints are no nearer to each other than this but for what they see, whichever robot left them, so that their
/// number grows with the space that robots saw, not with time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ViewpointSettings {
    /// Bytes of memory of all viewpoints of a map; 0 keeps none. 64 MiB: some 5,000.
    pub bytes_max: usize,
    /// A pose is new that lies further than this from every viewpoint, meters. 0.5.
    pub distance_m: f64,
    /// Or that is turned by more than this against those that are nearer, degrees. 15.
    pub rotation_deg: f64,
    /// A scan from a new pose is new if this share of what it sees was unknown. 0.003: who passes between two
    /// viewpoints that saw all of it already leaves none.
    pub unknown_from_new_pose: f64,
    /// A scan of a robot that drives by is new from a known pose if this share of what it sees was unknown. 0.05: it
    /// sees more from the next new one.
    pub unknown_from_known_pose: f64,
    /// A scan of a robot that stands is new from a known pose if it sees through so much of space that nobody saw
    /// through, cubic meters, where space farther than 3 m away counts less, see [`newly_seen_m3`]. 0.15: a door was
    /// opened, somebody left, a pallet was fetched.
    pub newly_seen_standing_m3: f64,
    /// What is further away is seen up to here, meters. 60.
    pub range_max_m: f32,
    /// What was found by trial: no setting of a server.
    pub thresholds: Thresholds,
}

impl Default for ViewpointSettings {
    fn default() -> Self {
        Self {
            bytes_max: VIEWPOINT_BYTES_MAX_DEFAULT,
            distance_m: 0.5,
            rotation_deg: 15.0,
            unknown_from_new_pose: 0.003,
            unknown_from_known_pose: 0.05,
            newly_seen_standing_m3: 0.15,
            range_max_m: 60.0,
            thresholds: Thresholds::DEFAULT,
        }
    }
}

/// Rays that are looked along for what is unknown, where little hangs on it.
const RAYS: usize = 300;
/// Rays of an image that are looked along before it is kept. Of few rays chance lets some of a thousand scans see
/// something new that a robot has seen in each of its rounds.
const RAYS_OF_IMAGE: usize = 3000;
/// What some rays tell to be newly seen may be so much less than what the image tells.
const ROUGHLY: f64 = 0.5;
/// Where along each: before its middle others saw most, and at its end it grazes what it meets.
const ALONG: [f64; 3] = [0.5, 0.75, 0.9];
/// Viewpoints that are compared when one has to go.
const COMPARED: usize = 24;

/// What a scan saw, where it was found.
#[derive(Debug, Clone, Copy)]
pub(super) struct SeenScan<'a> {
    /// Where its rays ended, those at the robot itself and those that met nothing with them (sensor frame, finite).
    pub(super) points: &'a [Point],
    /// Up to where others ran that ended farther away.
    pub(super) beyond: &'a [Point],
    pub(super) map_from_sensor: &'a Pose,
    /// How far the sensor was from there, at most, when a ray was taken, meters.
    pub(super) moved_m: f64,
    /// It was found far from its guess, or is the map's first: the scans after it are judged by what it saw.
    pub(super) is_needed: bool,
    /// Its robot's last one was taken there, too.
    pub(super) is_stationary: bool,
    /// How its rays lie, where the sensor is known.
    pub(super) sensor: Option<SensorRays>,
}

impl ViewpointSettings {
    /// The viewpoint that a scan leaves beside those that are there; none of a scan that sees nothing new, and none
    /// once `stop` says so.
    pub(super) fn viewpoint_of(
        &self,
        scan: SeenScan<'_>,
        viewpoints: &ViewpointSet,
        stop: StopSignal<'_>,
    ) -> Option<ViewpointRecord> {
        if self.bytes_max == 0 {
            return None;
        }
        let SeenScan { points, beyond, map_from_sensor, moved_m, .. } = scan;
        let ends: Cow<'_, [Point]> =
            if beyond.is_empty() { points.into() } else { [points, beyond].concat().into() };
        let range_m = |end: &Point| end.to_f64().coords.norm() as f32;
        let open_m = beyond.iter().map(range_m).fold(f32::INFINITY, f32::min);
        let sweep = Sweep { range_max_m: self.range_max_m, moved_m: moved_m as f32, open_m };
        let is_known_pose = viewpoints.any_near(map_from_sensor, self.distance_m, self.rotation_deg);
        let least = match is_known_pose {
            true if scan.is_stationary => Least::Space(self.newly_seen_standing_m3),
            true => Least::Share(self.unknown_from_known_pose),
            false if scan.is_needed => Least::Share(0.0),
            false => Least::Share(self.unknown_from_new_pose),
        };
        // The image takes a while to make: most scans end here.
        if !least.may_be_seen_by(&ends, sweep, map_from_sensor, viewpoints) {
            return None;
        }
        let image = RangeImage::of_points_by(&ends, sweep, IMAGE_BYTES_MAX, scan.sensor, &self.thresholds)?;
        let viewpoint = Viewpoint::new(*map_from_sensor, image);
        let unknown =
            share_unknown(&samples_of(&viewpoint, RAYS_OF_IMAGE), |point| viewpoints.is_free(point));
        if !least.is_seen_by(&viewpoint, unknown, viewpoints) {
            return None;
        }
        let displaced = self.displaced_by(&viewpoint, unknown, viewpoints, stop)?;
        Some(ViewpointRecord { image: viewpoint.image().clone(), displaced })
    }

    /// The revisions of the viewpoints that go so that `viewpoint` has room, ascending: of some that are compared those
    /// that add least. None where it adds less than they do, `unknown` being the share of what it sees, and once
    /// stopped.
    fn displaced_by(
        &self,
        viewpoint: &Viewpoint,
        unknown: f64,
        viewpoints: &ViewpointSet,
        stop: StopSignal<'_>,
    ) -> Option<Vec<u64>> {
        let needed = (viewpoints.memory_bytes() + viewpoint.memory_bytes()).saturating_sub(self.bytes_max);
        let mut left: Vec<_> = viewpoints.iter().map(|(revision, _)| revision).collect();
        let mut random = ChaCha8Rng::seed_from_u64(left.last().copied().unwrap_or(0));
        let (mut displaced, mut freed) = (Vec::new(), 0);
        while freed < needed {
            let mut compared = Vec::new();
            while compared.len() < COMPARED && !left.is_empty() {
                let revision = left.swap_remove(random.random_range(0..left.len()));
                let kept = viewpoints.get(revision)?;
                let by_others =
                    |point| viewpoint.is_free(point) || viewpoints.is_free_by_others(point, revision);
                compared.push((
                    share_unknown(&samples_of(kept, RAYS), by_others),
                    revision,
                    kept.memory_bytes(),
                ));
                if stop.is_stopped() {
                    return None;
                }
            }
            compared.sort_by(|a, b| a.0.total_cmp(&b.0));
            // Mostly one goes. Where the limit was lowered, half of them at a time.
            let stay = compared.split_off(compared.len().div_ceil(2));
            left.extend(stay.into_iter().map(|(_, revision, _)| revision));
            if compared.is_empty() {
                return None;
            }
            for (adds, revision, bytes) in compared {
                if freed >= needed {
                    left.push(revision);
                } else if adds > unknown {
                    return None;
                } else {
                    displaced.push(revision);
                    freed += bytes;
                }
            }
        }
        displaced.sort_unstable();
        Some(displaced)
    }
}

/// What a scan has to see newly so that it leaves a viewpoint.
#[derive(Debug, Clone, Copy)]
enum Least {
    /// A share of the places along its rays.
    Share(f64),
    /// Space, cubic meters.
    Space(f64),
}

impl Least {
    /// False of most scans that see nothing newly, by some of their rays.
    fn may_be_seen_by(
        self,
        ends: &[Point],
        sweep: Sweep,
        map_from_sensor: &Pose,
        known: &ViewpointSet,
    ) -> bool {
        match self {
            Self::Share(least) => unknown_to(known, map_from_sensor, sweep, spread(ends)) >= least,
            Self::Space(least_m3) => {
                let seen = ends.iter().filter_map(|end| sweep.limited(end.xyz()));
                let mut cache = known.cache();
                newly_seen_by_rays_m3(map_from_sensor, seen, |place| cache.is_free(place))
                    >= ROUGHLY * least_m3
            }
        }
    }

    /// True of a viewpoint that is to be left; `unknown` is the share of what it sees that is not known.
    fn is_seen_by(self, viewpoint: &Viewpoint, unknown: f64, known: &ViewpointSet) -> bool {
        match self {
            Self::Share(least) => unknown >= least,
            Self::Space(least_m3) => {
                let mut cache = known.cache();
                newly_seen_m3(viewpoint, |place| cache.is_free(place)) >= least_m3
            }
        }
    }
}

/// The share of what is before `points` that no viewpoint saw.
fn unknown_to<'p>(
    viewpoints: &ViewpointSet,
    map_from_sensor: &Pose,
    sweep: Sweep,
    points: impl Iterator<Item = &'p Point>,
) -> f64 {
    let seen = points.filter_map(|point| sweep.limited(point.xyz()));
    let samples: Vec<_> = seen.flat_map(|offset| along(map_from_sensor, offset)).collect();
    share_unknown(&samples, |point| viewpoints.is_free(point))
}

/// Some of the points, from all over the scan.
fn spread(points: &[Point]) -> impl Iterator<Item = &Point> {
    points.iter().step_by(points.len().div_ceil(RAYS).max(1))
}

/// Places along the ray to `offset` (sensor frame), in the map.
fn along(map_from_sensor: &Pose, offset: [f32; 3]) -> impl Iterator<Item = [f64; 3]> {
    ALONG.into_iter().map(move |along| {
        let offset = nalgebra::Point3::from(offset.map(|c| f64::from(c) * along));
        (map_from_sensor * offset).into()
    })
}

/// Places that a viewpoint saw through, along so many rays from all over its image.
fn samples_of(viewpoint: &Viewpoint, rays: usize) -> Vec<[f64; 3]> {
    let seen: Vec<_> = viewpoint.image().seen().collect();
    let some = seen.iter().step_by(seen.len().div_ceil(rays).max(1));
    let places = some.flat_map(|&offset| along(viewpoint.map_from_sensor(), offset));
    // Not all that lies before the end of a ray: from a moving sensor it has to be seen from where others were taken,
    // too.
    places.filter(|&place| viewpoint.is_free(place)).collect()
}

/// The share of places that are not known.
fn share_unknown(places: &[[f64; 3]], is_known: impl Fn([f64; 3]) -> bool) -> f64 {
    let unknown = places.iter().filter(|place| !is_known(**place)).count();
    unknown as f64 / places.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    /// A scan of the walls around a square room of 8 m, from `x_m` along its middle.
    fn scan(x_m: f32) -> Vec<Point> {
        let point = |i: usize| {
            let (azimuth, z) = ((i % 720) as f32 * 0.5f32.to_radians(), (i / 720) as f32 * 0.05 - 1.0);
            let (sin, cos) = azimuth.sin_cos();
            let to_wall = |origin: f32, along: f32| {
                if along > 0.0 { (4.0 - origin) / along } else { (-4.0 - origin) / along }
            };
            let r = to_wall(x_m, cos).min(to_wall(0.0, sin));
            Point::new(r * cos, r * sin, z)
        };
        (0..720 * 40).map(point).collect()
    }

    fn standing<'a>(points: &'a [Point], map_from_sensor: &'a Pose) -> SeenScan<'a> {
        SeenScan {
            points,
            beyond: &[],
            map_from_sensor,
            moved_m: 0.0,
            is_needed: false,
            is_stationary: false,
            sensor: None,
        }
    }

    /// Drives through the room and back; the viewpoints, and how many there were after each scan.
    fn drive(settings: &ViewpointSettings, rounds: usize) -> (ViewpointSet, Vec<usize>) {
        let (mut set, mut counts) = (ViewpointSet::default(), Vec::new());
        let there = (0..60).map(|i| -3.0 + i as f32 * 0.1);
        let back = there.clone().rev();
        for (revision, x_m) in (0..rounds).flat_map(|_| there.clone().chain(back.clone())).enumerate() {
            let pose = Pose::translation(f64::from(x_m), 0.0, 0.0);
            if let Some(ViewpointRecord { image, displaced }) =
                settings.viewpoint_of(standing(&scan(x_m), &pose), &set, StopSignal::NEVER)
            {
                displaced.iter().for_each(|&gone| assert!(set.remove(gone).is_some()));
                set.insert(revision as u64, Arc::new(Viewpoint::new(pose, image)));
            }
            counts.push(set.len());
        }
        (set, counts)
    }

    #[test]
    fn a_robot_leaves_viewpoints_where_it_comes_first_and_none_when_it_comes_again() {
        let (_, counts) = drive(&ViewpointSettings::default(), 3);
        assert!((8..=14).contains(&counts[59]), "{counts:?}");
        assert_eq!(counts[59], counts[359], "the way back and two more rounds left some");
    }

    #[test]
    fn no_more_than_has_room_is_kept_and_what_adds_least_goes() {
        let one = drive(&ViewpointSettings::default(), 1).0;
        let bytes_max = one.memory_bytes() / 3;
        let (kept, _) = drive(&ViewpointSettings { bytes_max, ..ViewpointSettings::default() }, 2);
        assert!(
            kept.memory_bytes() <= bytes_max && kept.len() >= 2,
            "{} of {bytes_max}",
            kept.memory_bytes()
        );
        // The room is known as well as by all of them.
        let place = |i: usize| [(i % 20) as f64 * 0.35 - 3.4, (i / 20) as f64 * 0.35 - 3.4, 0.1];
        let seen = |set: &ViewpointSet| (0..400).filter(|&i| set.is_free(place(i))).count();
        assert!(seen(&kept) * 100 >= seen(&one) * 97, "{} of {}", seen(&kept), seen(&one));
        assert_eq!(drive(&ViewpointSettings { bytes_max: 0, ..ViewpointSettings::default() }, 1).0.len(), 0);
    }

    #[test]
    fn what_a_known_pose_sees_anew_leaves_a_viewpoint() {
        let settings = ViewpointSettings::default();
        let near: Vec<_> = scan(0.0).iter().map(|p| Point::from(p.xyz().map(|c| c * 0.4))).collect();
        let (mut set, at) = (ViewpointSet::default(), Pose::identity());
        let first = settings.viewpoint_of(standing(&near, &at), &set, StopSignal::NEVER).unwrap();
        set.insert(1, Arc::new(Viewpoint::new(at, first.image)));
        assert_eq!(settings.viewpoint_of(standing(&near, &at), &set, StopSignal::NEVER), None);
        assert!(
            settings.viewpoint_of(standing(&scan(0.0), &at), &set, StopSignal::NEVER).is_some(),
            "a curtain was drawn aside"
        );
    }
}
