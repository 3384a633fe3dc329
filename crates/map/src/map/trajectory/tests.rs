//! The trajectory against a list of all that ever happened.

use std::collections::{BTreeMap, BTreeSet, HashSet};

use proptest::prelude::*;

use super::map_trajectory::NAMES_WITHOUT_SCANS_MAX;
use super::*;
use crate::geometry::Pose;
use crate::map::name::{RobotName, SessionName};

#[derive(Debug, Clone)]
enum Step {
    /// Scans of a robot, so many, each a step of that many centimeters further.
    Drive(u8, u16, i32),
    /// Takes every n-th scan out that undo reaches.
    Withdraw(usize),
    /// Moves what undo reaches to so many revisions behind the newest.
    Thin(u64),
}

fn step() -> impl Strategy<Value = Step> {
    prop_oneof![
        5 => (0..3u8, 1..300u16, -30..30i32).prop_map(|(robot, scans, cm)| Step::Drive(robot, scans, cm)),
        2 => (1..20usize).prop_map(Step::Withdraw),
        2 => (0..200u64).prop_map(Step::Thin),
    ]
}

fn session(n: u64) -> SessionName {
    SessionName::new(&if n == 0 { String::new() } else { format!("boot-{n}") }).unwrap()
}

fn robot(n: u8) -> RobotName {
    RobotName::new(&format!("r{n}")).unwrap()
}

/// All that ever happened, with nothing clever about it.
#[derive(Default)]
struct Model {
    all: Vec<MappedScan>,
    gone: BTreeSet<u64>,
    withdrawn: Vec<WithdrawnChange>,
    revision: u64,
    base: u64,
}

impl Model {
    fn accepted(&self) -> impl DoubleEndedIterator<Item = &MappedScan> {
        self.all.iter().filter(|pose| !self.gone.contains(&pose.revision))
    }

    /// What is left when all that happened is thinned at once.
    fn kept(&self, spacing: &TrajectorySpacing) -> Vec<MappedScan> {
        let mut old: BTreeMap<&RobotName, Vec<&MappedScan>> = BTreeMap::new();
        for pose in self.accepted().filter(|pose| pose.revision < self.base) {
            old.entry(&pose.robot).or_default().push(pose);
        }
        let mut thinned = HashSet::new();
        for poses in old.values() {
            let mut seen = thinning::Seen::default();
            let judged = &poses[..poses.len().saturating_sub(2)];
            thinned.extend(judged.iter().filter(|pose| !seen.keeps(pose, spacing)).map(|pose| pose.revision));
        }
        self.accepted().filter(|pose| !thinned.contains(&pose.revision)).cloned().collect()
    }
}

fn check(trajectory: &Trajectory, model: &Model, spacing: &TrajectorySpacing) -> Result<(), TestCaseError> {
    let kept = model.kept(spacing);
    prop_assert_eq!(trajectory.poses().cloned().collect::<Vec<_>>(), kept.clone());
    prop_assert_eq!(trajectory.len(), kept.len());
    prop_assert_eq!(trajectory.scans(), model.accepted().count() as u64);
    let withdrawn: Vec<_> = model.withdrawn.iter().filter(|w| w.revision >= model.base).copied().collect();
    prop_assert_eq!(trajectory.withdrawn(), &withdrawn[..]);
    for revision in 0..=model.revision {
        prop_assert_eq!(trajectory.at(revision), kept.iter().find(|pose| pose.revision == revision));
    }
    for name in (0..3).map(robot) {
        let of_robot = |pose: &&MappedScan| pose.robot == name;
        let mut newest = model.accepted().filter(of_robot).rev();
        let (last, before) = (newest.next(), newest.next());
        prop_assert_eq!(trajectory.last_of(&name), last);
        prop_assert_eq!(trajectory.last_two_of(&name), last.zip(before));
        prop_assert_eq!(trajectory.robots().contains(&name), last.is_some());
        let since = model.revision / 2;
        let after: Vec<_> = trajectory.poses_after(since, Some(&name)).collect();
        let expected: Vec<_> = kept.iter().filter(of_robot).filter(|pose| pose.revision > since).collect();
        prop_assert_eq!(after, expected);
        for pose in model.all.iter().filter(of_robot) {
            let Some(id) = pose.scan_id else { continue };
            let known = trajectory.known(&name, &pose.session, id);
            let expected = match kept.iter().find(|kept| kept.revision == pose.revision) {
                Some(kept) => KnownScan::Kept(kept),
                None if model.gone.contains(&pose.revision) && pose.revision >= model.base => {
                    KnownScan::Undone(pose)
                }
                None => KnownScan::TooOld,
            };
            prop_assert_eq!(known, Some(expected));
            let other_session = session(pose.revision % 2 + 20);
            prop_assert_eq!(trajectory.known(&name, &other_session, id), None);
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]
    #[test]
    fn a_trajectory_is_a_list_however_often_it_is_thinned(steps in prop::collection::vec(step(), 1..12)) {
        let spacing = TrajectorySpacing::default();
        let (mut trajectory, mut model) = (Trajectory::default(), Model::default());
        let mut x = [0; 3];
        for step in steps {
            let (copy, before) = (trajectory.clone(), trajectory.poses().cloned().collect::<Vec<_>>());
            match step {
                Step::Drive(n, scans, cm) => for _ in 0..scans {
                    model.revision += 1;
                    x[usize::from(n)] += cm;
                    let at = Pose::translation(f64::from(x[usize::from(n)] % 900) / 100.0, 0.0, 0.0);
                    let pose = MappedScan {
                        revision: model.revision,
                        session: session(model.revision / 500),
                        scan_id: (model.revision % 5 != 0).then_some(model.revision % 500 * 7),
                        timestamp_ns: Some(model.revision as i64 * 300_000_000),
                        level_overlaps: vec![0.5; 3],
                        ..MappedScan::new(robot(n), at)
                    };
                    trajectory.push(pose.clone());
                    model.all.push(pose);
                },
                Step::Withdraw(every) => {
                    let reached = model.accepted().filter(|pose| pose.revision >= model.base);
                    let scans: Vec<u64> = reached.map(|pose| pose.revision).step_by(every).collect();
                    model.revision += 1;
                    trajectory.withdraw(scans.iter().copied(), model.revision);
                    model.gone.extend(&scans);
                    let revision = model.revision;
                    model.withdrawn.extend(scans.into_iter().map(|change| WithdrawnChange { change, revision }));
                }
                Step::Thin(behind) => {
                    model.base = model.base.max((model.revision + 1).saturating_sub(behind));
                    trajectory.thin(model.base, &spacing);
                }
            }
            check(&trajectory, &model, &spacing)?;
            prop_assert_eq!(copy.poses().cloned().collect::<Vec<_>>(), before);
        }
        // As it is after a restart: nothing is known but what a snapshot holds.
        let mut restored = restored(&trajectory);
        prop_assert_eq!(&restored, &trajectory);
        model.base = model.revision + 1;
        restored.thin(model.base, &spacing);
        check(&restored, &model, &spacing)?;
    }
}

/// The trajectory as a snapshot gives it back.
fn restored(trajectory: &Trajectory) -> Trajectory {
    let forgotten = trajectory.forgotten();
    let empty = forgotten.fold(Trajectory::default(), |all, (robot, ids)| all.with_forgotten(robot, &ids));
    let restored = empty.with_poses(trajectory.stored().cloned(), trajectory.withdrawn().to_vec());
    restored.with_thinned(trajectory.thinned())
}

fn scan(revision: u64, session: &SessionName, id: u64) -> MappedScan {
    let pose = MappedScan::new(robot(0), Pose::identity());
    MappedScan { revision, session: session.clone(), scan_id: Some(id), ..pose }
}

#[test]
fn every_pose_is_kept_where_that_is_wanted_and_what_was_undone_goes_all_the_same() {
    let all = TrajectorySpacing { keep: KeptPoses::All, ..TrajectorySpacing::default() };
    let none = SessionName::default();
    let mut trajectory: Trajectory = (1..=9).map(|revision| scan(revision, &none, revision)).collect();
    trajectory.withdraw([4].into_iter(), 10);
    assert_eq!(trajectory.thin(11, &all), 0);
    assert_eq!((trajectory.len(), trajectory.scans(), trajectory.stored().count()), (8, 8, 8));
    assert!(trajectory.withdrawn().is_empty());
    // As soon as it is wanted no more, they are thinned; that they were there stays known.
    assert_eq!(trajectory.thin(11, &TrajectorySpacing::default()), 5);
    assert_eq!((trajectory.len(), trajectory.scans(), trajectory.thinned()), (3, 8, 5));
}

#[test]
fn the_id_of_an_undone_scan_stays_known_and_may_be_that_of_a_later_one_in_old_journals() {
    let none = SessionName::default();
    let mut trajectory: Trajectory = [scan(1, &none, 7)].into_iter().collect();
    trajectory.withdraw([1].into_iter(), 2);
    let known = |trajectory: &Trajectory| {
        trajectory.known(&robot(0), &none, 7).map(|known| match known {
            KnownScan::Kept(pose) => ("kept", pose.revision),
            KnownScan::Undone(pose) => ("undone", pose.revision),
            KnownScan::TooOld => ("too old", 0),
        })
    };
    assert_eq!(known(&trajectory), Some(("undone", 1)));
    assert_eq!(known(&restored(&trajectory)), Some(("undone", 1)));
    assert!(trajectory.is_empty() && trajectory.last_of(&robot(0)).is_none());
    let mut thinned = trajectory.clone();
    thinned.thin(3, &TrajectorySpacing::default());
    assert_eq!(known(&thinned), Some(("too old", 0)));
    // Servers that did not remember undone ids let them be used again.
    trajectory.push(scan(3, &none, 7));
    assert_eq!(known(&trajectory), Some(("kept", 3)));
    trajectory.thin(3, &TrajectorySpacing::default());
    assert_eq!(known(&trajectory), Some(("kept", 3)));
}

#[test]
fn names_whose_scans_were_all_undone_are_free_again_and_remembered_in_a_bounded_number() {
    let name = |n: u64| RobotName::new(&format!("r{n}")).unwrap();
    let of = |n: u64, revision: u64| {
        let pose = MappedScan::new(name(n), Pose::identity());
        MappedScan { revision, scan_id: Some(7), ..pose }
    };
    let most = NAMES_WITHOUT_SCANS_MAX as u64;
    let count = most + 100;
    let mut trajectory: Trajectory = (1..=count).map(|n| of(n, n)).collect();
    assert_eq!(trajectory.robots_with_scans() as u64, count);
    trajectory.withdraw(1..=count - 1, count + 1);
    assert_eq!((trajectory.robots_with_scans(), trajectory.robots_known() as u64), (1, most + 1));
    assert!(trajectory.has_scans_of(&name(count)) && !trajectory.has_scans_of(&name(count - 1)));
    // Those that were used last are remembered with their ids, and that of the scan that is in force.
    let known = |n| trajectory.known(&name(n), &SessionName::default(), 7).is_some();
    assert_eq!([1, 99, 100, count - 1, count].map(known), [false, false, true, true, true]);
}

#[test]
fn beyond_their_bound_the_session_is_closed_that_was_used_least_recently() {
    let most = SESSIONS_PER_ROBOT_MAX as u64;
    let mut trajectory: Trajectory = (1..=most).map(|n| scan(n, &session(n), 0)).collect();
    trajectory.push(scan(most + 1, &session(1), 1));
    trajectory.push(scan(most + 2, &session(0), 0));
    let is_known = |trajectory: &Trajectory, n, id| trajectory.known(&robot(0), &session(n), id).is_some();
    let is_too_old = |trajectory: &Trajectory, n, id| {
        trajectory.known(&robot(0), &session(n), id) == Some(KnownScan::TooOld)
    };
    assert!((1..=most).all(|n| !is_too_old(&trajectory, n, 0)));
    trajectory.push(scan(most + 3, &session(most + 1), 0));
    for trajectory in [restored(&trajectory), trajectory] {
        // All ids of a closed session are too old, those that were never used too: it is never taken up again.
        assert!(is_too_old(&trajectory, 2, 0) && is_too_old(&trajectory, 2, 5));
        for n in [0, 1, 3, most, most + 1] {
            assert!(is_known(&trajectory, n, 0) && !is_too_old(&trajectory, n, 0), "{n}");
            assert!(!is_known(&trajectory, n, 5), "{n}");
        }
        assert!(!is_known(&trajectory, most + 2, 0));
        // The poses of a closed session are poses as all others.
        assert_eq!(trajectory.len() as u64, most + 3);
    }
}
