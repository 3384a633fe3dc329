//! What no ray met since none ran there: between rays that lie apart, behind the robot, through holes.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::super::*;
use super::scenes::{RANGE, SURFACE, window};
use crate::geometry::Point;

#[test]
fn what_lies_behind_the_robots_own_parts_is_not_seen() {
    // A strut of 4 cm at 0.5 m.
    let strut = |direction: [f64; 3]| (0.5 * direction[1] / direction[0]).abs() < 0.02;
    let range_m =
        |direction: [f64; 3]| if strut(direction) { 0.5 / direction[0] } else { 8.0 / direction[0] };
    let points = window(40.0, 15.0, 0.4, range_m);
    let image = RangeImage::of_points(&points, RANGE, IMAGE_BYTES_MAX).unwrap();
    for i in 0..100 {
        let (x, aside) = (0.6 + i as f32 * 0.07, (i % 9) as f32 / 8.0 - 0.5);
        let behind = [x, aside * 0.06 * x, 0.02];
        assert!(!image.is_free(behind), "{behind:?}");
    }
    assert!(image.is_free([0.4, 0.0, 0.0]) && image.is_free([4.0, 1.0, 0.0]));
}

#[test]
fn pixels_are_seen_where_points_lie_all_over_them_and_not_where_many_lie_together() {
    // Rings of 6 degrees all around, a point every 0.2 degrees, each sent once and four times.
    let rings: Vec<Point> = (-5..=5)
        .flat_map(|ring| {
            (0..1800).map(move |i| {
                let ((sin, cos), (up, level)) =
                    ((i as f32 * 0.2).to_radians().sin_cos(), (ring as f32 * 6.0).to_radians().sin_cos());
                Point::new(9.0 * level * cos, 9.0 * level * sin, 9.0 * up)
            })
        })
        .collect();
    let four_times: Vec<Point> = (0..4).flat_map(|_| rings.iter().copied()).collect();
    for points in [&rings, &four_times] {
        let Some(image) = RangeImage::of_points(points, RANGE, IMAGE_BYTES_MAX) else { continue };
        // Halfway between two rings, and a third of the way.
        let far_from_rays = (0..720).map(|i| {
            let up_deg = if i < 360 { 3.0f32 } else { 8.0 };
            let ((sin, cos), (up, level)) =
                ((i as f32).to_radians().sin_cos(), up_deg.to_radians().sin_cos());
            [5.0 * level * cos, 5.0 * level * sin, 5.0 * up]
        });
        let seen = far_from_rays.filter(|&offset| image.is_free(offset)).count();
        assert_eq!(seen, 0, "of 720 places, with {} points", points.len());
    }
    // A hole of 7 degrees in what else is dense.
    let dense = window(179.8, 40.0, 0.4, |_| 9.0);
    let is_in_hole = |point: &&Point| {
        let [x, y, z] = point.xyz();
        !(x > 0.0 && y.atan2(x).to_degrees().abs() < 3.5 && (z / x).atan().to_degrees().abs() < 3.5)
    };
    let holed: Vec<Point> = dense.iter().filter(is_in_hole).copied().collect();
    let image = RangeImage::of_points(&holed, RANGE, IMAGE_BYTES_MAX).unwrap();
    let whole = RangeImage::of_points(&dense, RANGE, IMAGE_BYTES_MAX).unwrap();
    for (y, z) in (-10..=10).flat_map(|y| (-10..=10).map(move |z| (y, z))) {
        let offset = [5.0, y as f32 * 0.01, z as f32 * 0.01];
        assert!(!image.is_free(offset) && whole.is_free(offset), "{offset:?}");
    }
}

#[test]
fn nothing_thinner_than_rays_are_apart_is_seen_well_beyond() {
    let least = AbsenceEvidence { margin_m: 0.3, gap_max_m: 0.1 };
    for (step_deg, sees_m) in [(0.4f64, 8.0f32), (1.2, 3.0)] {
        let image =
            RangeImage::of_points(&window(40.0, 20.0, step_deg, |_| 20.0), RANGE, IMAGE_BYTES_MAX).unwrap();
        let apart_m = (step_deg.to_radians() as f32) * sees_m;
        assert!(image.is_free([sees_m * 1.5, 0.1, 0.1]));
        assert!(
            image.proves_absent([sees_m * 0.4, 0.1, 0.1], least),
            "at {sees_m} m rays are {apart_m} m apart"
        );
        assert!(
            !image.proves_absent([sees_m * 2.0, 0.1, 0.1], least),
            "at {sees_m} m rays are {apart_m} m apart"
        );
    }
}

#[test]
fn images_of_before_are_read() {
    let points = window(40.0, 20.0, 0.5, |_| 9.0);
    let image = RangeImage::of_points(&points, RANGE, IMAGE_BYTES_MAX).unwrap();
    let bytes = image.to_bytes();
    let before: Vec<u8> = [&[bytes[0] & 0x7f], &bytes[1..5], &bytes[13..]].concat();
    let read = RangeImage::from_bytes(&before).unwrap();
    assert!(read.seen().eq(image.seen()));
    assert!(RangeImage::from_bytes(&before[..before.len() - 1]).is_err());
    let moved = |number: f32| [&bytes[..5], &number.to_le_bytes()[..], &bytes[9..]].concat();
    assert!(RangeImage::from_bytes(&moved(0.0)).is_ok());
    for number in [-0.1, f32::NAN, f32::INFINITY] {
        assert!(matches!(RangeImage::from_bytes(&moved(number)), Err(RangeImageError::Rays(..))));
    }
}

#[test]
fn what_stands_where_rays_were_missing_is_not_seen_well_beyond() {
    let least = AbsenceEvidence { margin_m: 0.3, gap_max_m: 0.1 };
    // Rays 0.35 degrees apart all around, but for a band of dead rings.
    for gap_deg in [1.4f64, 2.1, 2.8, 3.5] {
        let lies_in_gap = |point: &&Point| {
            let [x, y, z] = point.xyz();
            !(0.2..0.2 + gap_deg).contains(&f64::from((z / x.hypot(y)).atan().to_degrees()))
        };
        for side_deg in [40.0, 179.8] {
            let rays = window(side_deg, 25.0, 0.35, |_| 20.0);
            let image = |points: &[Point]| RangeImage::of_points(points, RANGE, IMAGE_BYTES_MAX).unwrap();
            let whole = image(&rays);
            let gaping = image(&rays.iter().filter(lies_in_gap).copied().collect::<Vec<_>>());
            let (mut kept, mut asked) = (0, 0);
            for azimuth_deg in -20..=20 {
                let up_deg = 0.2 + gap_deg / 2.0;
                let ((sin, cos), up) =
                    (f64::from(azimuth_deg).to_radians().sin_cos(), up_deg.to_radians().tan());
                let place = [7.0 * cos, 7.0 * sin, 7.0 * up].map(|c| c as f32);
                assert!(!gaping.proves_absent(place, least), "{place:?} in a gap of {gap_deg} degrees");
                asked += 1;
                kept += usize::from(whole.proves_absent(place, least));
            }
            assert!(kept * 10 >= asked * 9, "{kept} of {asked} where no ring is dead");
        }
    }
}

#[test]
fn a_ball_between_rings_far_apart_is_not_seen_through_though_others_are_dense() {
    let at = |distance_m: f32, azimuth_deg: f32, elevation_deg: f32| {
        let ((sin, cos), (up, level)) =
            (azimuth_deg.to_radians().sin_cos(), elevation_deg.to_radians().sin_cos());
        [level * cos, level * sin, up].map(|c| c * distance_m)
    };
    let ring =
        |elevation_deg: f32| (-270..=270).map(move |i| Point::from(at(20.0, i as f32 * 0.3, elevation_deg)));
    // One ray in fifty is lost.
    let mut random = ChaCha8Rng::seed_from_u64(5);
    for apart_deg in [1.6, 2.0, 3.0] {
        let below = (1..=40).map(|i| i as f32 * -0.3).flat_map(ring);
        let above = (0..8).map(|i| i as f32 * apart_deg).flat_map(ring);
        let points: Vec<_> = below.chain(above).filter(|_| random.random_range(0..50) > 0).collect();
        let surface = ScanSurface::of(ScanRays::met(&points), SURFACE).unwrap();
        let gap_max_m = 0.15;
        let sees_through = |place| surface.sees_through(place, 0.087, gap_max_m);
        let (mut asked, mut seen) = (0, 0);
        for azimuth_deg in (-60..=60).step_by(4).map(|i| i as f32) {
            for elevation_deg in [-4.0, -6.0, -8.0] {
                asked += 1;
                seen += usize::from(sees_through(at(5.0, azimuth_deg, elevation_deg)));
            }
            for (gap, wide) in (1..6).flat_map(|gap| [1.1, 1.3, 1.6, 2.2].map(|wide| (gap, wide))) {
                let distance_m = wide * gap_max_m / apart_deg.to_radians();
                let place = at(distance_m, azimuth_deg, (gap as f32 + 0.5) * apart_deg);
                assert!(
                    distance_m > 15.0 || !sees_through(place),
                    "{place:?} between rings {apart_deg} degrees apart, {wide} times as far as is seen through"
                );
            }
        }
        // Rings that lie farther apart make all pixels wide, and nothing is seen through so far away.
        assert!(
            apart_deg > 2.0 || seen * 10 >= asked * 9,
            "{seen} of {asked} where rings are dense, {apart_deg} degrees above"
        );
    }
}

/// A sensor with a hole in it, and where it was turned to.
struct Holed {
    /// Degrees between its rays, to the side and up.
    step_deg: [f32; 2],
    /// Degrees from one ray to the next one on the other side of the hole, to the side and up; without end where rings
    /// are dead.
    hole_deg: [f32; 2],
    yaw_deg: f32,
}

impl Holed {
    /// The direction so many degrees to the side and up of the hole, of length 1.
    fn direction(&self, [side_deg, up_deg]: [f32; 2]) -> [f32; 3] {
        let (sin, cos) = (side_deg + self.yaw_deg).to_radians().sin_cos();
        let (up, level) = up_deg.to_radians().sin_cos();
        [level * cos, level * sin, up]
    }

    /// What it sees of a wall 20 m away all around; one ray in `lost` is.
    fn scan(&self, lost: u32, random: &mut ChaCha8Rng) -> Vec<Point> {
        let [columns, rows] = [30.0 / self.step_deg[0], 15.0 / self.step_deg[1]].map(|rays| rays as i32);
        let rays = (-columns..=columns).flat_map(|column| (-rows..=rows).map(move |row| [column, row]));
        let turned = rays.map(|ray| [0, 1].map(|axis| ray[axis] as f32 * self.step_deg[axis]));
        let left = turned.filter(|ray_deg| {
            let is_in_hole =
                [0, 1].iter().all(|&axis| ray_deg[axis].abs() < self.hole_deg[axis] / 2.0 - 1e-3);
            !is_in_hole && random.random_range(0..lost) > 0
        });
        left.map(|ray_deg| Point::from(self.direction(ray_deg).map(|c| c * 20.0))).collect()
    }
}

#[test]
fn what_no_ray_met_for_a_hole_in_the_sensor_is_not_seen_through() {
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let voxel_m = 0.1;
    let well_beyond = AbsenceEvidence { margin_m: 3.0 * voxel_m, gap_max_m: voxel_m };
    let (mut asked, mut seen, mut well_seen) = (0, 0, 0);
    let sensors = [
        ([0.2, 1.0], [f32::INFINITY, 2.0], "a dead ring"),
        ([0.2, 0.5], [f32::INFINITY, 1.5], "two dead rings"),
        ([0.1, 0.1], [0.8, 0.8], "a hole between fine rays"),
        ([0.14, 0.14], [1.2, 1.2], "masked pixels of a camera"),
    ];
    for (step_deg, hole_deg, name) in sensors {
        for (yaw_deg, lost) in [0.0, 20.0, 40.0].into_iter().flat_map(|yaw| [(yaw, u32::MAX), (yaw, 50)]) {
            let sensor = Holed { step_deg, hole_deg, yaw_deg };
            let points = sensor.scan(lost, &mut random);
            let surface = ScanSurface::of(ScanRays::met(&points), SURFACE).unwrap();
            let image = RangeImage::of_points(&points, RANGE, IMAGE_BYTES_MAX).unwrap();
            let sees_through = |place| surface.sees_through(place, 0.87 * voxel_m, 1.5 * voxel_m);
            for voxels_wide in [1.2, 1.65, 2.0, 2.3, 2.8, 3.3] {
                let distance_m = voxels_wide * voxel_m / hole_deg[1].to_radians();
                if distance_m > 15.0 {
                    continue;
                }
                for _ in 0..20 {
                    // Of what fills four fifths of the hole.
                    let [side, up]: [f32; 2] = std::array::from_fn(|_| random.random_range(-0.4..0.4));
                    let side_deg = if hole_deg[0].is_finite() { side * hole_deg[0] } else { side * 8.0 };
                    let at = |up_deg: f32| sensor.direction([side_deg, up_deg]).map(|c| c * distance_m);
                    let place = at(up * hole_deg[1]);
                    let what = format!("{place:?} in {name} {voxels_wide} voxels wide, turned by {yaw_deg}");
                    assert!(voxels_wide < 2.0 || !sees_through(place), "{what}");
                    assert!(!image.proves_absent(place, well_beyond), "{what}");
                    asked += 1;
                    seen += usize::from(sees_through(at(7.0)));
                    well_seen += usize::from(image.proves_absent(at(7.0), well_beyond));
                }
            }
        }
    }
    assert!(seen * 10 >= asked * 9, "{seen} of {asked} beside the holes");
    assert!(well_seen * 8 >= asked, "{well_seen} of {asked} beside the holes");
}

#[test]
fn what_is_gone_is_seen_well_beyond_though_rays_are_lost() {
    let mut random = ChaCha8Rng::seed_from_u64(6);
    let voxel_m = 0.1f32;
    let well_beyond = AbsenceEvidence { margin_m: 0.3, gap_max_m: voxel_m };
    for (step_deg, lost) in [(0.4, u32::MAX), (0.4, 500), (0.4, 100), (0.7, 100)] {
        let sensor = Holed { step_deg: [step_deg; 2], hole_deg: [0.0; 2], yaw_deg: 0.0 };
        let points = sensor.scan(lost, &mut random);
        let image = RangeImage::of_points(&points, RANGE, IMAGE_BYTES_MAX).unwrap();
        // Rays are six tenths of a voxel apart there; the view ends 30 degrees to the side, and 15 up.
        let distance_m = 0.6 * voxel_m / step_deg.to_radians();
        let mut seen = 0;
        for _ in 0..500 {
            let at_deg = [22.0f32, 7.0].map(|most| random.random_range(-most..most));
            let place = sensor.direction(at_deg).map(|c| c * distance_m);
            seen += usize::from(image.proves_absent(place, well_beyond));
        }
        assert!(seen >= 400, "{seen} of 500 places, rays {step_deg} degrees apart, one in {lost} lost");
    }
}

#[test]
fn what_no_ray_met_is_not_seen_through_by_a_sensor_that_moved() {
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let sensor = Holed { step_deg: [0.2, 1.0], hole_deg: [f32::INFINITY, 2.0], yaw_deg: 0.0 };
    let surface = ScanSurface::of(ScanRays::met(&sensor.scan(u32::MAX, &mut random)), SURFACE).unwrap();
    let voxel_m = 0.1f32;
    let distance_m = 2.2 * voxel_m / 2f32.to_radians();
    for moved_m in [0.0, 0.05, 0.2, 0.5] {
        for _ in 0..20 {
            let at_deg = [random.random_range(-5.0..5.0), random.random_range(-0.5..0.5)];
            let place = sensor.direction(at_deg).map(|c| c * distance_m);
            let radius_m = 0.87 * voxel_m + moved_m;
            assert!(!surface.sees_through(place, radius_m, 1.5 * voxel_m), "{place:?}, moved by {moved_m} m");
        }
    }
}

/// A wall across the x axis at 5 m where y < 0; rays to the other side ran on beyond 8 m.
fn half_open() -> Vec<Point> {
    let directions = (-60..=60).flat_map(|side| (-30..=30).map(move |up| [side as f32, up as f32]));
    directions
        .map(|[side, up]| {
            let direction = nalgebra::Vector3::new(1.0, side.to_radians().tan(), up.to_radians().tan());
            let range_m = if side < 0.0 { 5.0 * direction.norm() } else { 8.0 };
            Point::from(<[f32; 3]>::from(direction.normalize() * range_m.min(8.0)))
        })
        .collect()
}

#[test]
fn where_rays_ran_on_is_free_and_says_nothing_of_what_was_met() {
    let sweep = Sweep { open_m: 8.0, ..Sweep::standing(60.0) };
    let image = RangeImage::of_points(&half_open(), sweep, IMAGE_BYTES_MAX).unwrap();
    let back = RangeImage::from_bytes(&image.to_bytes()).unwrap();
    assert!(back == image && image.to_bytes().len() == image.stored_bytes());
    let all_met = RangeImage::of_points(&half_open(), Sweep::standing(60.0), IMAGE_BYTES_MAX).unwrap();
    assert_eq!(
        all_met.to_bytes().len() + 4,
        image.to_bytes().len(),
        "images of which all was met are as they were"
    );
    let place = [6.0, 2.0, 0.3];
    assert!(image.is_free(place) && all_met.is_free(place));
    assert_eq!(all_met.sight(place, 0.1), Sight::Contradicts);
    assert_eq!(image.sight(place, 0.1), Sight::NotSeen);
    assert_eq!(image.sight([4.0, -2.0, 0.3], 0.1), Sight::Contradicts, "the wall was met");
    let open_met =
        |image: &RangeImage| image.met(10_000, 1.0).iter().filter(|met| met.offset[1] > 0.3).count();
    assert!(open_met(&image) == 0 && open_met(&all_met) > 20);
    let mut bytes = image.to_bytes();
    bytes[13..17].copy_from_slice(&f32::NAN.to_le_bytes());
    assert!(matches!(RangeImage::from_bytes(&bytes), Err(RangeImageError::Open(_))));
}
