//! Tests of the bytes of map files.

use std::convert::Infallible;
use std::sync::Arc;

use prost::Message;
use uuid::Uuid;

use super::body::Body;
use super::header::{
    FORMAT_VERSION, HEADER_BYTES, VERSION, bytes_with_parts, complete, head_of, parts_in_start, uuid_in,
};
use super::limits::{MapFileError, MapFileLimits, Memory};
use super::snapshot::Snapshot;
use super::writing::body_of;
use crate::codec::moments;
use crate::error::StoreError;
use crate::pb;
use crate::viewpoint_parts::{PartUse, section_of, uses_in};
use mrol_map::geometry::{self, Point};
use mrol_map::map::{
    CallerName, CompletedRequest, ForgottenIds, KeepOut, KeepOutName, KeepOutShape, KeepOuts, MapContents,
    MapOrigin, MapSettings, MappedScan, MultiResolutionMap, Prism, Region, RequestId, RequestKind, RobotName,
    SessionName, Trajectory, WithdrawnChange,
};
use mrol_map::util::StopSignal;
use mrol_map::visibility::{RangeImage, Sweep, Viewpoint, ViewpointSet};
use mrol_map::voxel::{MomentSet, Moments, VoxelKey};

fn snapshot() -> Snapshot {
    let keys = (0..5000).map(|i| VoxelKey::new([i % 70 - 35, i / 70 - 40, i % 3]).unwrap());
    let pose = MappedScan {
        robot: RobotName::new("r1").unwrap(),
        session: SessionName::new("boot-2").unwrap(),
        scan_id: Some(7),
        timestamp_ns: Some(-5),
        map_from_sensor: geometry::pose([1.0, -2.0, 0.5], [0.0, 0.6, 0.0, 0.8]).unwrap(),
        revision: 41,
        level_overlaps: vec![0.5, 0.75],
        iterations: 12,
        points_skipped: 3,
        new_voxels: 5000,
        carved_voxels: 40,
        digest: u64::MAX,
    };
    let mut moments = Moments::of_offset([3, -4, 5]);
    moments += Moments::of_offset([-2048, 2048, 0]);
    let id = RequestId::new("undo-1").unwrap();
    let caller = Some(CallerName::new("r1").unwrap());
    let request = CompletedRequest {
        id,
        digest: 9,
        caller,
        revision: 42,
        removed: 0,
        restored: 3,
        scans: 1,
        deletions: 1,
        kind: RequestKind::Undo,
    };
    Snapshot {
        uuid: Uuid::from_bytes([7; 16]),
        settings: MapSettings::new(0.05, 4),
        contents: MapContents {
            revision: 42,
            moments: MomentSet::from_iter([(VoxelKey::new([1, -2, 0]).unwrap(), moments)]),
            voxels: keys.collect(),
            trajectory: trajectory_of(pose),
            requests: [request].into_iter().collect(),
            keep_outs: Arc::new(keep_outs()),
            viewpoints: Arc::new(viewpoints()),
        },
    }
}

/// Two, of which one was left by a scan whose pose is not kept.
fn viewpoints() -> ViewpointSet {
    let points: Vec<_> = (0..400).map(|i| Point::new(2.0, (i % 20) as f32 / 9.0, 0.3)).collect();
    let image = RangeImage::of_points(&points, Sweep::standing(9.0), 900).unwrap();
    let pose = geometry::pose([1.0, -2.0, 0.5], [0.0, 0.6, 0.0, 0.8]).unwrap();
    let mut viewpoints = ViewpointSet::default();
    for revision in [3, 41] {
        viewpoints.insert(revision, Arc::new(Viewpoint::new(pose, image.clone())));
    }
    viewpoints
}

/// One of each shape.
fn keep_outs() -> KeepOuts {
    let turned = geometry::pose([1.0, -2.0, 0.5], [0.0, 0.6, 0.0, 0.8]).unwrap();
    let of_region = |region| KeepOutShape::of_region(region).unwrap();
    let shapes = [
        of_region(Region::cuboid([0.0; 3], [1.0, 2.0, 1.0 / 3.0]).unwrap()),
        of_region(Region::ball([0.1; 3], 2.0).unwrap()),
        of_region(Region::oriented_box(turned, [1.0, 2.0, 3.0]).unwrap()),
        KeepOutShape::Prism(Prism::new(&[[0.0, 0.1], [2.0, 0.0], [1.0, 3.0]], [-1.0, 1.0]).unwrap()),
    ];
    let keep_out = |(i, shape)| KeepOut {
        name: KeepOutName::new(&format!("k{i}")).unwrap(),
        shape,
        made_by: (i != 1).then(|| CallerName::new("ops").unwrap()),
        made_revision: 42 - i as u64,
        expires_at_ns: (i == 2).then_some(-9),
    };
    shapes.into_iter().enumerate().map(keep_out).collect()
}

/// A trajectory with a scan, one that was undone, and ids of which nothing else is known.
fn trajectory_of(pose: MappedScan) -> Trajectory {
    let r0 = RobotName::new("r0").unwrap();
    let session = SessionName::new("boot-1").unwrap();
    let ids = |session, last_revision| ForgottenIds {
        session,
        ranges: &[(0, 6), (9, 9), (u64::MAX, u64::MAX)],
        last_revision,
    };
    let undone = MappedScan { revision: 39, session: session.clone(), ..pose.clone() };
    Trajectory::default()
        .with_forgotten(&r0, &ids(Some(&SessionName::default()), 0))
        .with_forgotten(&r0, &ids(Some(&session), 17))
        .with_forgotten(&r0, &ids(None, 0))
        .with_poses([undone, pose], vec![WithdrawnChange { change: 39, revision: 42 }])
        .with_thinned(7)
}

/// All of it in one message.
fn message(snapshot: &Snapshot) -> pb::Snapshot {
    let MapContents { revision, voxels, moments, trajectory, requests, keep_outs, viewpoints } =
        &snapshot.contents;
    pb::Snapshot {
        uuid: snapshot.uuid.as_bytes().to_vec().into(),
        resolution_m: snapshot.settings.resolution_m,
        levels: snapshot.settings.levels,
        filter_hashes: snapshot.settings.filter.map_or(0, |filter| filter.hashes),
        filter_bits_per_key: snapshot.settings.filter.map_or(0.0, |filter| filter.bits_per_key),
        revision: *revision,
        block_keys: Vec::new(),
        block_masks: Vec::new().into(),
        trajectory: trajectory.stored().map(Into::into).collect(),
        voxels: Some(voxels.into()),
        withdrawn: trajectory.withdrawn().iter().map(Into::into).collect(),
        requests: requests.iter().map(Into::into).collect(),
        moments: snapshot.settings.moments.then(|| moments::beside(voxels, moments, StopSignal::NEVER)),
        forgotten: trajectory.forgotten().map(Into::into).collect(),
        keep_outs: keep_outs.iter().map(Into::into).collect(),
        no_filter: snapshot.settings.filter.is_none(),
        no_moments: !snapshot.settings.moments,
        viewpoints: viewpoints.iter().map(|(revision, it)| (revision, &**it).into()).collect(),
        origin: snapshot
            .settings
            .origin
            .map(|origin| pb::MapOrigin { position_m: origin.position_m.to_vec() }),
        thinned_scans: trajectory.thinned(),
    }
}

/// The snapshot of a map of a survey.
fn surveyed() -> Snapshot {
    let Snapshot { uuid, settings, contents } = snapshot();
    let origin = Some(MapOrigin::new([388_096.123_456_789, 3_948_996.0, -0.5]).unwrap());
    Snapshot { uuid, settings: MapSettings { origin, ..settings }, contents }
}

#[test]
fn the_origin_of_a_map_is_kept_to_the_last_bit_and_a_broken_one_is_refused() {
    let again = Snapshot::decode(&surveyed().encode().unwrap()).unwrap();
    assert!(again == surveyed());
    assert_eq!(again.restore().unwrap().settings().origin, surveyed().settings.origin);
    for position_m in [vec![], vec![1.0; 4], vec![f64::NAN; 3]] {
        let origin = Some(pb::MapOrigin { position_m });
        let error = read(&pb::Snapshot { origin, ..message(&snapshot()) }).unwrap_err();
        assert!(format!("{error:?}").contains("origin"), "{error:?}");
    }
}

#[test]
fn how_many_scans_have_no_pose_is_kept_and_more_than_there_are_revisions_are_refused() {
    let again = Snapshot::decode(&snapshot().encode().unwrap()).unwrap();
    let (scans, poses) = (again.contents.trajectory.scans(), again.contents.trajectory.len() as u64);
    assert_eq!(scans, poses + 7);
    // As earlier versions wrote it.
    let without = read(&pb::Snapshot { thinned_scans: 0, ..message(&snapshot()) }).unwrap();
    assert_eq!(without.contents.trajectory.scans(), poses);
    for thinned_scans in [snapshot().contents.revision, u64::MAX] {
        let error = read(&pb::Snapshot { thinned_scans, ..message(&snapshot()) }).unwrap_err();
        assert!(format!("{error:?}").contains("without a pose of a map at revision"), "{error:?}");
    }
}

#[test]
fn a_body_is_written_as_the_message_that_it_is() {
    let contents = MapContents::default();
    for snapshot in [snapshot(), surveyed(), Snapshot { contents, ..snapshot() }, query_only(true, true)] {
        let body = body_of(&snapshot, &snapshot.contents.viewpoints, StopSignal::NEVER);
        assert!(body == message(&snapshot).encode_to_vec());
    }
}

/// The snapshot of a map without filters, without moments, or without either.
fn query_only(no_filter: bool, no_moments: bool) -> Snapshot {
    let Snapshot { uuid, settings, contents } = snapshot();
    let filter = settings.filter.filter(|_| !no_filter);
    let moments = if no_moments { MomentSet::default() } else { contents.moments.clone() };
    let settings = MapSettings { filter, moments: !no_moments, ..settings };
    Snapshot { uuid, settings, contents: MapContents { moments, ..contents } }
}

#[test]
fn a_map_without_filters_or_moments_is_restored_without_them() {
    for (no_filter, no_moments) in [(true, false), (false, true), (true, true)] {
        let written = query_only(no_filter, no_moments);
        let read = Snapshot::decode(&written.encode().unwrap()).unwrap();
        assert!(read == written);
        let map = read.restore().unwrap();
        assert_eq!(*map.settings(), written.settings);
        assert!(Snapshot::of(&map, written.uuid) == written);
    }
}

#[test]
fn a_file_is_written_and_read_with_looks_at_the_signal_in_proportion_to_its_size() {
    for side in [20, 200, 800] {
        let square = (0..side).flat_map(|x| (0..side).map(move |y| [x * 8, y * 8, 0]));
        let contents = MapContents::at(1, square.filter_map(VoxelKey::new).collect());
        let entries = contents.voxels.blocks().len() + contents.moments.as_slice().len();
        let snapshot = Snapshot { contents, ..snapshot() };
        let looks = std::cell::Cell::new(0);
        let count = || looks.replace(looks.get() + 1) == usize::MAX;
        let stop = StopSignal::when(&count);
        let bytes = snapshot.encode_until(stop).unwrap().unwrap();
        assert!(entries / looks.replace(0) <= 16 << 10);
        assert!(Snapshot::decode_own(&bytes, stop).unwrap().unwrap().0 == snapshot);
        assert!(entries / looks.replace(0) <= 16 << 10);
        let map =
            MultiResolutionMap::restore_until(snapshot.settings, snapshot.contents, stop).unwrap().unwrap();
        assert!(entries / looks.replace(0) <= 16 << 10);
        assert!(map.contents_until(stop).is_some());
        assert!(entries / looks.get() <= 16 << 10);
    }
}

#[test]
fn work_that_is_stopped_at_any_look_comes_to_nothing_and_soon_to_its_end() {
    let bytes = snapshot().encode().unwrap();
    let map = snapshot().restore().unwrap();
    let looks = std::cell::Cell::new(0);
    for most in 0..200 {
        let stops = || looks.replace(looks.get() + 1) >= most;
        let stop = StopSignal::when(&stops);
        let is_stopped = |what: &str| {
            let taken = looks.replace(0);
            assert!(taken <= most + 300, "{what}: {taken} looks after {most}");
            taken > most
        };
        let encoded = snapshot().encode_until(stop).unwrap();
        assert_eq!(encoded.is_none(), is_stopped("encode"));
        let decoded = Snapshot::decode_own(&bytes, stop);
        assert_eq!(matches!(decoded, Err(StoreError::Cancelled)), is_stopped("decode"));
        let Snapshot { settings, contents, .. } = snapshot();
        let restored = MultiResolutionMap::restore_until(settings, contents, stop).unwrap();
        assert_eq!(restored.is_none(), is_stopped("restore"));
        assert_eq!(map.contents_until(stop).is_none(), is_stopped("contents"));
        assert_eq!(map.describe_until(100, 1, stop).is_none(), is_stopped("describe"));
    }
}

#[test]
fn a_snapshot_survives_its_file() {
    let bytes = snapshot().encode().unwrap();
    assert_eq!(Snapshot::decode(&bytes).unwrap(), snapshot());
}

#[test]
fn a_snapshot_says_whose_it_is_and_where_the_journal_was() {
    let mut bytes = snapshot().encode().unwrap();
    assert_eq!((head_of(&bytes), uuid_in(&bytes)), (Some(42), Some(snapshot().uuid)));
    complete(&mut bytes, 45, &[]);
    assert_eq!(head_of(&bytes), Some(45));
    assert_eq!(Snapshot::decode(&bytes).unwrap(), snapshot());
}

#[test]
fn a_snapshot_that_names_parts_tells_which_from_its_start_and_is_no_map_file() {
    let uses = vec![PartUse { number: 3, checksum: 7, revisions: vec![2, 5, 42] }];
    let mut bytes = snapshot().encode_without_viewpoints().unwrap();
    assert_eq!(bytes_with_parts(&bytes), None);
    complete(&mut bytes, 45, &section_of(&uses));
    let (read, parts) = Snapshot::decode_own(&bytes, StopSignal::NEVER).unwrap().unwrap();
    assert_eq!(parts, uses);
    let contents = MapContents { viewpoints: Arc::default(), ..snapshot().contents };
    assert_eq!(read, Snapshot { contents, ..snapshot() });
    let refused = Snapshot::decode(&bytes).unwrap_err();
    assert!(refused.contains("its viewpoints lie in 1 files beside it"), "{refused}");

    let start = &bytes[..bytes_with_parts(&bytes).unwrap()];
    assert_eq!(uses_in(parts_in_start(start).unwrap()).unwrap(), uses);
    for bit in HEADER_BYTES * 8 - 32..start.len() * 8 {
        let mut damaged = start.to_vec();
        damaged[bit / 8] ^= 1 << (bit % 8);
        assert_eq!(parts_in_start(&damaged), None, "bit {bit}");
    }
    let mut late = snapshot().encode_without_viewpoints().unwrap();
    complete(&mut late, 45, &section_of(&[PartUse { number: 3, checksum: 7, revisions: vec![43] }]));
    let refused = Snapshot::decode_own(&late, StopSignal::NEVER).unwrap().unwrap_err();
    assert!(refused.contains("a viewpoint of revision 43 in a part, the map is at 42"), "{refused}");
}

#[test]
fn a_flipped_bit_anywhere_is_an_error() {
    let bytes = snapshot().encode().unwrap();
    for bit in 0..bytes.len() * 8 {
        let mut damaged = bytes.clone();
        damaged[bit / 8] ^= 1 << (bit % 8);
        assert!(Snapshot::decode(&damaged).is_err(), "bit {bit}");
    }
}

#[test]
fn a_file_cut_anywhere_is_an_error() {
    let bytes = snapshot().encode().unwrap();
    for length in 0..bytes.len() {
        assert!(Snapshot::decode(&bytes[..length]).is_err(), "cut at {length}");
    }
}

fn read(message: &pb::Snapshot) -> Result<Snapshot, MapFileError<Infallible>> {
    let body = message.encode_to_vec();
    let body = Body::of(&body, StopSignal::NEVER).unwrap();
    body.read(&MapFileLimits::OWN, &mut Memory(|_| Ok::<_, Infallible>(())))
}

#[test]
fn a_request_that_is_there_twice_is_an_error() {
    let mut message = message(&snapshot());
    assert!(read(&message).is_ok());
    let older = pb::CompletedRequest { revision: 41, ..message.requests[0].clone() };
    message.requests.insert(0, older);
    let refused = read(&message).unwrap_err().to_string();
    assert!(refused.contains("their ids must differ"), "{refused}");
}

#[test]
fn viewpoints_that_no_map_has_are_refused() {
    let message = message(&snapshot());
    let refused = |change: &dyn Fn(&mut Vec<pb::Viewpoint>)| {
        let mut message = message.clone();
        change(&mut message.viewpoints);
        read(&message).unwrap_err().to_string()
    };
    assert!(refused(&|all| all.swap(0, 1)).contains("must ascend"));
    assert!(refused(&|all| all[0].revision = 0).contains("must ascend from 1"));
    assert!(refused(&|all| all[1].revision = 43).contains("revision 43, the map is at 42"));
    assert!(refused(&|all| all[0].image = all[0].image.slice(1..)).contains("the viewpoint of revision 3"));
    assert!(refused(&|all| all[0].image = vec![1; 9000].into()).contains("a record of"));
    let limits = MapFileLimits { viewpoint_bytes_max: 100, ..MapFileLimits::OWN };
    let bytes = snapshot().encode().unwrap();
    let refused = Snapshot::decode_within(&bytes, &limits, |_| Ok::<_, Infallible>(())).unwrap_err();
    assert!(refused.to_string().ends_with("bytes of viewpoints, viewpoint_bytes_max is 100"), "{refused}");
}

#[test]
fn keep_outs_that_no_map_has_are_refused() {
    let message = message(&snapshot());
    let refused = |change: &dyn Fn(&mut Vec<pb::KeepOut>)| {
        let mut message = message.clone();
        change(&mut message.keep_outs);
        read(&message).unwrap_err().to_string()
    };
    assert!(refused(&|all| all.swap(0, 1)).contains("must ascend"));
    assert!(refused(&|all| all.push(all[3].clone())).contains("must ascend"));
    assert!(refused(&|all| all[0].made_revision = 43).contains("k0 was made at revision 43"));
    assert!(refused(&|all| all[0].name = "K".into()).contains("keep-out must match"));
    assert!(refused(&|all| *all = vec![all[0].clone(); 257]).contains("257 keep-outs"));
    let with_numbers = |i: usize, numbers: Vec<f64>| {
        refused(&move |all| {
            use pb::keep_out_shape::Shape;
            let shape = all[i].put.as_mut().unwrap().shape.as_mut().unwrap().shape.as_mut().unwrap();
            let (Shape::Box(of) | Shape::Sphere(of) | Shape::OrientedBox(of) | Shape::Prism(of)) = shape;
            of.numbers.clone_from(&numbers);
        })
    };
    assert!(with_numbers(0, vec![0.0; 5]).contains("the box of a keep-out has 5 numbers, 6 are one"));
    assert!(with_numbers(1, vec![0.0, 0.0, f64::NAN, 1.0]).contains("sphere.center_m must be finite"));
    assert!(with_numbers(2, vec![0.0; 10]).contains("unit quaternion"));
    assert!(with_numbers(3, vec![0.0, 1.0, 0.0]).contains("half a corner"));
    assert!(with_numbers(3, vec![0.0; 600]).contains("a record of"));
    assert!(with_numbers(3, vec![1.0; 132]).contains("got 65"));
}

#[test]
fn a_newer_version_is_refused_by_name() {
    let mut bytes = snapshot().encode().unwrap();
    let newer = FORMAT_VERSION + 1;
    bytes[VERSION].copy_from_slice(&newer.to_le_bytes());
    assert!(Snapshot::decode(&bytes).unwrap_err().contains(&format!("format version {newer}")));
}

#[test]
fn a_file_without_moments_is_restored_with_those_of_voxel_centers() {
    let mut message = message(&snapshot());
    message.moments = None;
    let body = message.encode_to_vec();
    let memory = &mut Memory(|_| Ok::<_, Infallible>(()));
    let old = Body::of(&body, StopSignal::NEVER).unwrap().read(&MapFileLimits::OWN, memory).unwrap().contents;
    assert_eq!(old.moments, MomentSet::of_centers(&old.voxels));
    let points: i64 = old.moments.as_slice().iter().map(|(_, moments)| moments.count()).sum();
    assert_eq!(points, 5000);
}

#[test]
fn a_restored_map_is_the_map() {
    let map = snapshot().restore().unwrap();
    assert_eq!(Snapshot::of(&map, snapshot().uuid), snapshot());
}
