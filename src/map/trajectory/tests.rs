//! The trajectory against a list of all that ever happened.

use std::collections::{BTreeMap, BTreeSet, HashSet};

use super::*;
use crate::geometry::Pose;
use proptest::prelude::*;

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

fn robot(n: u8) -> RobotName {
    RobotName::new(&format!("r{n}")).unwrap()
}

/// All that ever happened, with nothing clever about it.
#[derive(Default)]
struct Model {
    all: Vec<MappedScan>,
    gone: BTreeSet<u64>,
    withdrawn: Vec<WithdrawnScan>,
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
            let found = kept.iter().find(|kept| kept.robot == name && kept.scan_id == Some(id));
            prop_assert_eq!(trajectory.find(&name, id), found);
            let accepted = model.accepted().any(|other| other.robot == name && other.scan_id == Some(id));
            prop_assert_eq!(trajectory.has_forgotten(&name, id), accepted && found.is_none());
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
                        scan_id: (model.revision % 5 != 0).then_some(model.revision * 7),
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
                    trajectory.withdraw(&scans, model.revision);
                    model.gone.extend(&scans);
                    let revision = model.revision;
                    model.withdrawn.extend(scans.into_iter().map(|scan| WithdrawnScan { scan, revision }));
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
        let poses: Vec<_> = trajectory.poses().cloned().collect();
        let mut restored = Trajectory::new(poses, trajectory.withdrawn().to_vec());
        for (robot, ranges) in trajectory.forgotten() {
            restored = restored.with_forgotten(robot, ranges.iter().copied());
        }
        prop_assert_eq!(&restored, &trajectory);
        model.base = model.revision + 1;
        restored.thin(model.base, &spacing);
        check(&restored, &model, &spacing)?;
    }
}

#[test]
fn an_undone_id_may_be_used_again_and_is_then_that_of_the_new_scan() {
    let pose =
        |revision| MappedScan { revision, scan_id: Some(7), ..MappedScan::new(robot(0), Pose::identity()) };
    let mut trajectory: Trajectory = [pose(1)].into_iter().collect();
    trajectory.withdraw(&[1], 2);
    assert!(!trajectory.knows(&robot(0)) && trajectory.find(&robot(0), 7).is_none());
    trajectory.push(pose(3));
    assert_eq!(trajectory.find(&robot(0), 7).map(|pose| pose.revision), Some(3));
    trajectory.thin(3, &TrajectorySpacing::default());
    assert_eq!(trajectory.find(&robot(0), 7).map(|pose| pose.revision), Some(3));
}
