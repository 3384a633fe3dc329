//! What robots and operators say.

use mrol::wire::pb;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use crate::support::daemon::{corner, guess_pb, points_pb, pose_pb};

/// Points of a hall about a robot, other ones each time: every scan adds to the map.
fn hall(random: &mut ChaCha8Rng) -> Vec<[f32; 3]> {
    let mut points: Vec<_> = corner().into_iter().step_by(3).collect();
    points.extend((0..500).map(|_| {
        [random.random_range(-8.0..8.0), random.random_range(-8.0..8.0), random.random_range(0.0..3.0)]
    }));
    points
}

fn kind(kind: pb::guess::Kind) -> Option<pb::Guess> {
    Some(pb::Guess { kind: Some(kind), ..Default::default() })
}

/// The robot's scan of that number. Its guesses take turns; some scans are aligned, some go in where they say.
pub(crate) fn scan(random: &mut ChaCha8Rng, map: &str, robot: &str, id: u64) -> pb::InsertScanRequest {
    use pb::guess::Kind;
    let back_and_forth = if id.is_multiple_of(2) { 0.04 } else { -0.04 };
    let guess = match id % 5 {
        0 => guess_pb([0.0; 3]),
        1 => None,
        2 => kind(Kind::LastFromSensor(pose_pb([back_and_forth, 0.0, 0.0]))),
        _ => kind(Kind::ConstantVelocity(true)),
    };
    let scan = pb::Scan {
        robot: robot.into(),
        scan_id: Some(id),
        timestamp_ns: Some(id as i64 * 100_000_000),
        points: points_pb(&hall(random)),
        ..Default::default()
    };
    pb::InsertScanRequest {
        map: map.into(),
        scan: Some(scan),
        guess,
        at_guess: !id.is_multiple_of(3),
        force: true,
        ..Default::default()
    }
}

/// The same, to be aligned and not added.
pub(crate) fn alignment(random: &mut ChaCha8Rng, map: &str, robot: &str, id: u64) -> pb::AlignScanRequest {
    let pb::InsertScanRequest { map, scan, guess, .. } = self::scan(random, map, robot, id);
    pb::AlignScanRequest { map, scan, guess, ..Default::default() }
}

pub(crate) fn localization(map: &str) -> pb::LocalizeRequest {
    pb::LocalizeRequest {
        map: map.into(),
        points: points_pb(&corner()),
        time_limit_s: Some(0.5),
        gravity: Some(pb::Gravity { in_sensor: Some([0.0, 0.0, -1.0].into()), in_map: None }),
        ..Default::default()
    }
}

/// Voxels about a random point go.
pub(crate) fn deletion(random: &mut ChaCha8Rng, map: &str) -> pb::DeleteVoxelsRequest {
    let points: Vec<[f32; 3]> = (0..50)
        .map(|_| {
            [random.random_range(-8.0..8.0), random.random_range(-8.0..8.0), random.random_range(0.0..3.0)]
        })
        .collect();
    let points = points_pb(&points).unwrap();
    pb::DeleteVoxelsRequest {
        map: map.into(),
        target: Some(pb::delete_voxels_request::Target::Points(points)),
        level: 1,
        ..Default::default()
    }
}

pub(crate) fn undo(map: &str, robot: &str, scan_id: u64) -> pb::UndoRequest {
    let scan = pb::RobotScan { robot: robot.into(), scan_id, ..Default::default() };
    pb::UndoRequest {
        map: map.into(),
        target: Some(pb::undo_request::Target::Scan(scan)),
        ..Default::default()
    }
}

pub(crate) fn creation(map: &str) -> pb::CreateMapRequest {
    let settings = pb::MapSettings { resolution_m: 0.1, levels: Some(4), ..Default::default() };
    pb::CreateMapRequest { map: map.into(), settings: Some(settings) }
}
