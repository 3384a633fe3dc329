//! Images and their bytes, surfaces of scans, and the set against every viewpoint, asked one by one.

use std::sync::Arc;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::super::*;
use super::scenes::{RANGE, SURFACE, any_pose, room};
use crate::geometry::Point;

#[test]
fn an_image_tells_up_to_the_wall_and_never_beyond() {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let points = room(&mut random, 40_000, 0.5);
    let image = RangeImage::of_points(&points, RANGE, IMAGE_BYTES_MAX).unwrap();
    assert!(image.stored_bytes() <= IMAGE_BYTES_MAX);
    let mut before = 0;
    for point in &points {
        let beyond = point.xyz().map(|c| c * 1.001);
        assert!(!image.is_free(beyond), "{point:?} was seen through");
        before += usize::from(image.is_free(point.xyz().map(|c| c * 0.95)));
    }
    assert!(before * 100 > points.len() * 97, "{before} of {}", points.len());
    // Nothing was seen behind the sensor.
    assert!(!image.is_free([-0.5, 0.0, 0.0]));
}

#[test]
fn an_image_comes_back_from_its_bytes_and_garbage_does_not() {
    let mut random = ChaCha8Rng::seed_from_u64(2);
    let image = RangeImage::of_points(&room(&mut random, 9000, 3.0), RANGE, IMAGE_BYTES_MAX).unwrap();
    let bytes = image.to_bytes();
    assert_eq!(bytes.len(), image.stored_bytes());
    assert_eq!(RangeImage::from_bytes(&bytes).unwrap(), image);
    for end in [0, 3, 5, bytes.len() / 2, bytes.len() - 1] {
        assert!(matches!(RangeImage::from_bytes(&bytes[..end]), Err(RangeImageError::Length { .. })));
    }
    let garbled = |at: usize, with: &[u8]| {
        let mut bytes = bytes.clone();
        bytes[at..at + with.len()].copy_from_slice(with);
        RangeImage::from_bytes(&bytes)
    };
    assert_eq!(garbled(0, &[0]), Err(RangeImageError::Tiles(0)));
    assert!(matches!(garbled(1, &f32::NAN.to_le_bytes()), Err(RangeImageError::Unit(_))));
    assert!(matches!(garbled(1, &f32::MAX.to_le_bytes()), Err(RangeImageError::Unit(_))));
}

#[test]
fn an_image_of_any_scan_keeps_to_its_bytes() {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    for count in [1, 2, 30, 3000, 60_000] {
        let mut any = || random.random_range(-30.0f32..30.0);
        let points: Vec<_> = (0..count).map(|_| Point::new(any(), any(), any())).collect();
        for bytes_max in [2000, IMAGE_BYTES_MAX] {
            let image = RangeImage::of_points(&points, RANGE, bytes_max);
            // Points all around have to be many.
            assert!(image.is_some() || count < 60_000, "{count} points left no image");
            let bytes = image.map_or(0, |image| image.stored_bytes());
            assert!(bytes <= bytes_max, "{count} points took {bytes}");
        }
    }
    assert_eq!(RangeImage::of_points(&[Point::new(0.0, 0.0, 0.0)], RANGE, IMAGE_BYTES_MAX), None);
}

/// A scan of a room, half of which a plate hides.
fn half_hidden(random: &mut ChaCha8Rng) -> Vec<Point> {
    let mut points = room(random, 60_000, 0.6);
    for point in &mut points {
        let [x, y, z] = point.xyz();
        if y / x > 0.0 {
            *point = Point::new(1.5, 1.5 * y / x, 1.5 * z / x);
        }
    }
    points
}

#[test]
fn a_ball_is_seen_through_only_where_all_of_it_is() {
    let mut random = ChaCha8Rng::seed_from_u64(4);
    let surface = ScanSurface::of(ScanRays::met(&half_hidden(&mut random)), SURFACE).unwrap();
    let sees_through = |offset| surface.sees_through(offset, 0.05, 0.1);
    assert!(sees_through([2.0, -0.5, 0.1]) && surface.depth_exceeds([2.0, -0.5, 0.1], 0.05));
    assert!(
        !sees_through([2.0, 0.5, 0.1]) && !surface.depth_exceeds([2.0, 0.5, 0.1], 0.05),
        "behind the plate"
    );
    assert!(!sees_through([2.0, -0.02, 0.1]), "at the plate's rim");
    assert!(!sees_through([2.97, -0.5, 0.1]), "at the wall");
    assert!(!sees_through([2.0, -1.25, 0.1]), "at the edge of what was seen");
    assert!(!sees_through([-2.0, -0.5, 0.1]), "behind the sensor");
    assert!(!sees_through([0.0; 3]) && !sees_through([0.15, -0.05, 0.0]), "at the sensor");
}

#[test]
fn samples_leave_no_gap_wider_than_their_spacing_and_join_no_rims() {
    let mut random = ChaCha8Rng::seed_from_u64(5);
    // Points farther apart than samples, which only a surface at a sharper angle than half a radian would join to the
    // plate.
    let points: Vec<_> = half_hidden(&mut random).into_iter().step_by(40).collect();
    let surface =
        ScanSurface::of(ScanRays::met(&points), SurfaceSettings { grazing_rad: 0.5, ..SURFACE }).unwrap();
    let mut samples: Vec<[f32; 3]> = points.iter().map(|point| point.xyz()).collect();
    surface.for_samples(10.0, |sample| samples.push(sample));
    for &[x, _, _] in &samples {
        // Floor and ceiling begin at 2.5 m.
        assert!(!(1.51..2.3).contains(&x), "a sample at {x} m, between plate and wall");
    }
    // Where the wall is seen, and not at its edges.
    let mut bare = 0;
    for i in 0..1000 {
        let (y, z) = ((i % 40) as f32 * -0.035 - 0.2, (i / 40) as f32 * 0.08 - 1.0);
        let is_near = |&[a, b, c]: &[f32; 3]| (a - 3.0).abs() < 0.01 && (b - y).hypot(c - z) < 0.1;
        bare += usize::from(!samples.iter().any(is_near));
    }
    assert!(bare < 10, "{bare} of 1000 places of the wall are bare");
    surface.for_samples(1.0, |sample| panic!("{sample:?} is beyond the range"));
}

#[test]
fn a_scan_without_points_has_no_surface() {
    assert!(ScanSurface::of(ScanRays::met(&[]), SURFACE).is_none());
    assert!(ScanSurface::of(ScanRays::met(&[Point::new(0.0, 0.0, 0.0)]), SURFACE).is_none());
}

#[test]
fn a_set_says_of_every_point_what_its_viewpoints_say() {
    for seed in 0..6 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut set = ViewpointSet::default();
        let mut all: Vec<(u64, Arc<Viewpoint>)> = Vec::new();
        for revision in 1..40 {
            let pose = any_pose(&mut random, 6.0);
            let around = random.random_range(0.2..4.0);
            let far = random.random_range(0.05..6.0f32);
            let points: Vec<_> = room(&mut random, 15_000, around)
                .iter()
                .map(|p| Point::from(p.xyz().map(|c| c * far)))
                .collect();
            let Some(image) = RangeImage::of_points(&points, RANGE, 4096) else { continue };
            let viewpoint = Arc::new(Viewpoint::new(pose, image));
            set.insert(revision, viewpoint.clone());
            all.push((revision, viewpoint));
            if revision % 3 == 0 {
                let (gone, _) = all.swap_remove(random.random_range(0..all.len()));
                assert!(set.remove(gone).is_some() && set.remove(gone).is_none());
            }
        }
        assert_eq!(set.len(), all.len());
        let (mut cache, mut seen) = (set.cache(), 0);
        for _ in 0..4000 {
            let mut any = || random.random_range(-15.0..15.0);
            let point = [any(), any(), any()];
            let expected = all.iter().any(|(_, viewpoint)| viewpoint.is_free(point));
            assert_eq!(set.is_free(point), expected, "{point:?}");
            assert_eq!(cache.is_free(point), expected, "{point:?}");
            seen += usize::from(expected);
        }
        assert!((100..3900).contains(&seen), "{seen} seen: the test says nothing");
        for (revision, _) in all {
            set.remove(revision);
        }
        assert_eq!((set.len(), set.memory_bytes(), set.stored_bytes(), set.hash()), (0, 0, 0, 0));
    }
}

#[test]
fn equal_sets_have_equal_hashes_and_whatever_differs_counts() {
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let mut viewpoint = |bytes_max| {
        let points = room(&mut random, 15_000, 1.0);
        let image = RangeImage::of_points(&points, RANGE, bytes_max).unwrap();
        Arc::new(Viewpoint::new(any_pose(&mut random, 6.0), image))
    };
    let (first, second, third) = (viewpoint(4096), viewpoint(4096), viewpoint(2048));
    let of = |viewpoints: &[(u64, &Arc<Viewpoint>)]| {
        let mut set = ViewpointSet::default();
        set.extend(viewpoints.iter().map(|&(revision, viewpoint)| (revision, Arc::clone(viewpoint))));
        set
    };
    let set = of(&[(1, &first), (2, &second)]);
    let read = RangeImage::from_bytes(&first.image().to_bytes()).unwrap();
    let read = Arc::new(Viewpoint::new(*first.map_from_sensor(), read));
    assert_eq!(of(&[(2, &third), (2, &second), (1, &read)]).hash(), set.hash());
    let elsewhere = Arc::new(Viewpoint::new(*second.map_from_sensor(), first.image().clone()));
    for other in [
        of(&[(1, &first)]),
        of(&[(1, &second), (2, &first)]),
        of(&[(1, &first), (3, &second)]),
        of(&[(1, &elsewhere), (2, &second)]),
        of(&[(1, &third), (2, &second)]),
    ] {
        assert_ne!(other.hash(), set.hash());
    }
}

#[test]
fn a_scan_of_points_far_from_each_other_says_little_and_nothing_far_from_its_rays() {
    // A lidar of one ring sees a disc: what lies above or below is not seen, however coarse the pixels.
    let ring: Vec<_> = (0..360)
        .map(|i| {
            let (sin, cos) = (i as f32).to_radians().sin_cos();
            Point::new(10.0 * cos, 10.0 * sin, 0.0)
        })
        .collect();
    let one = [Point::new(50.0, 0.0, 0.0)];
    for points in [&ring[..], &one[..]] {
        let Some(image) = RangeImage::of_points(points, RANGE, IMAGE_BYTES_MAX) else { continue };
        for distance in [2.0f32, 5.0, 9.0] {
            let aside = distance * 0.03;
            for offset in [[distance, 0.0, aside], [distance, 0.0, -aside]] {
                assert!(!image.is_free(offset), "{offset:?} of {} points", points.len());
            }
        }
    }
    // Points all around, some 5 degrees from each other: too few for the pixels that fit.
    let mut random = ChaCha8Rng::seed_from_u64(9);
    let mut any = || random.random_range(-1.0f32..1.0);
    let sparse: Vec<_> = (0..1500).map(|_| Point::from([any(), any(), any()].map(|c| c * 10.0))).collect();
    let Some(image) = RangeImage::of_points(&sparse, RANGE, IMAGE_BYTES_MAX) else { return };
    let angle_deg =
        |a: [f32; 3], b: [f32; 3]| nalgebra::Vector3::from(a).angle(&nalgebra::Vector3::from(b)).to_degrees();
    let far_from_rays = (0..2000).filter(|_| {
        let place = [any(), any(), any()].map(|c| c * 0.2);
        image.is_free(place) && sparse.iter().all(|point| angle_deg(point.xyz(), place) > 3.0)
    });
    let count = far_from_rays.count();
    assert!(count < 20, "{count} of 2000 places are more than 3 degrees from all rays and seen");
}

#[test]
fn nothing_is_seen_behind_points_that_are_too_few_to_tell_more() {
    // Six points for each pixel of a scan all around at 8 m: coarse pixels, of which each needs some points to count as
    // seen.
    let pixels = 40;
    let at = |i: usize, aside: f32| (i as f32 + 0.5 + aside) / pixels as f32 * 2.0 - 1.0;
    let aside = [-0.4f32, 0.0, 0.4].map(|u| [[u, -0.3], [u, 0.3]]);
    let mut points = Vec::new();
    for (face, sign) in (0..3).flat_map(|face| [(face, 1.0f32), (face, -1.0)]) {
        for (i, j) in (0..pixels * pixels).map(|n| (n / pixels, n % pixels)) {
            for [u, v] in aside.iter().flatten() {
                let mut offset = [0.0; 3];
                offset[face] = sign;
                offset[(face + 1) % 3] = at(i, *u);
                offset[(face + 2) % 3] = at(j, *v);
                let scale = 8.0 / offset.iter().map(|c| c * c).sum::<f32>().sqrt();
                points.push(Point::from(offset.map(|c| c * scale)));
            }
        }
    }
    // The pixel beside the middle of the face +x.
    let is_there = |point: &Point| {
        let [x, y, z] = point.xyz();
        x > 0.0 && (0.0..0.05).contains(&(y / x)) && (0.0..0.05).contains(&(z / x))
    };
    let (there, elsewhere): (Vec<Point>, Vec<Point>) = points.into_iter().partition(is_there);
    assert_eq!(there.len(), 6);
    for few in 1..=6 {
        // They met a pole at 2 m; the others of the pixel met nothing.
        let near = there.iter().take(few).map(|point| Point::from(point.xyz().map(|c| c / 4.0)));
        let scan: Vec<Point> = elsewhere.iter().copied().chain(near).collect();
        let image = RangeImage::of_points(&scan, RANGE, IMAGE_BYTES_MAX).unwrap();
        assert!(!image.is_free([4.0, 0.1, 0.1]), "{few} points");
        assert!(image.is_free([1.5, 0.0375, 0.0375]) && image.is_free([4.0, 0.3, 0.1]), "{few} points");
    }
}
