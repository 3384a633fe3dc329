//! The trajectory of a map: the accepted scans of all robots.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::chunked::{Chunked, Keyed};
use super::known_scan::{ForgottenIds, KnownScan};
use super::robot_scans::{KnownId, RobotScans};
use super::scan::{MappedScan, WithdrawnChange};
use super::thinning::{KeptPoses, TrajectorySpacing};
use crate::map::name::{RobotName, SessionName};

impl Keyed for MappedScan {
    fn key(&self) -> u64 {
        self.revision
    }
}

/// Robots whose scans were all undone and whose scan ids are remembered all the same, at most: so that one who undoes
/// what it sent under ever new names neither fills the memory nor takes these names from others.
pub(super) const NAMES_WITHOUT_SCANS_MAX: usize = 1024;

/// The accepted scans of all robots, in the order of their revisions. A clone takes no time.
#[derive(Debug, Clone, Default)]
pub struct Trajectory {
    /// With those that are marked.
    poses: Chunked<MappedScan>,
    robots: Arc<BTreeMap<RobotName, Arc<RobotScans>>>,
    /// Revisions of the scans of `poses` that were taken out again.
    marked: Arc<BTreeSet<u64>>,
    withdrawn: Arc<Vec<WithdrawnChange>>,
    /// Scans that were accepted and not undone, and whose poses were thinned.
    thinned: u64,
    /// Bytes that poses point to.
    overlap_bytes: usize,
}

impl Trajectory {
    /// In the order of acceptance.
    pub fn poses(&self) -> impl DoubleEndedIterator<Item = &MappedScan> {
        self.poses.iter().filter(|pose| !self.marked.contains(&pose.revision))
    }

    /// Number of scans that were accepted and not undone, whether their poses are kept or not.
    pub fn scans(&self) -> u64 {
        self.len() as u64 + self.thinned
    }

    /// Number of those scans whose poses are not kept.
    pub fn thinned(&self) -> u64 {
        self.thinned
    }

    /// Number of poses.
    pub fn len(&self) -> usize {
        self.poses.len() - self.marked.len()
    }

    /// True without a pose.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The poses of scans that made a revision after `revision`, of one robot or of all, in the order of acceptance.
    pub fn poses_after<'a>(
        &'a self,
        revision: u64,
        robot: Option<&RobotName>,
    ) -> Box<dyn Iterator<Item = &'a MappedScan> + 'a> {
        let Some(first) = revision.checked_add(1) else {
            return Box::new(std::iter::empty());
        };
        match robot {
            None => Box::new(
                self.poses.from(first).filter(|pose: &&MappedScan| !self.marked.contains(&pose.revision)),
            ),
            Some(robot) => {
                let revisions = self.robots.get(robot).into_iter();
                let revisions = revisions.flat_map(move |robot| robot.revisions.from(first));
                Box::new(revisions.filter_map(|&revision| self.poses.get(revision)))
            }
        }
    }

    /// The scan that made `revision`.
    pub fn at(&self, revision: u64) -> Option<&MappedScan> {
        self.poses.get(revision).filter(|pose| !self.marked.contains(&pose.revision))
    }

    /// True of a revision that a scan made which was taken back and whose pose is still stored.
    pub fn is_undone(&self, revision: u64) -> bool {
        self.marked.contains(&revision)
    }

    /// The scans and deletions that were taken back, in the order in which that was done: all that undo has to know of.
    pub fn withdrawn(&self) -> &[WithdrawnChange] {
        &self.withdrawn
    }

    /// A robot's last accepted scan.
    pub fn last_of(&self, robot: &RobotName) -> Option<&MappedScan> {
        self.poses.get(*self.robots.get(robot)?.revisions.iter().next_back()?)
    }

    /// A robot's last two accepted scans, the last one first.
    pub fn last_two_of(&self, robot: &RobotName) -> Option<(&MappedScan, &MappedScan)> {
        let mut backwards = self.robots.get(robot)?.revisions.iter().rev();
        let (last, before) = (backwards.next()?, backwards.next()?);
        Some((self.poses.get(*last)?, self.poses.get(*before)?))
    }

    /// What is known of a robot's scan by its id.
    pub fn known(&self, robot: &RobotName, session: &SessionName, scan_id: u64) -> Option<KnownScan<'_>> {
        match self.robots.get(robot)?.find(session, scan_id)? {
            KnownId::TooOld => Some(KnownScan::TooOld),
            KnownId::Of(revision) => {
                let scan = self.poses.get(revision)?;
                let is_undone = self.marked.contains(&revision);
                Some(if is_undone { KnownScan::Undone(scan) } else { KnownScan::Kept(scan) })
            }
        }
    }

    /// The sessions in which a robot has a scan of this id that was not undone; the one that was used last comes first.
    pub fn sessions_with(&self, robot: &RobotName, scan_id: u64) -> Vec<&SessionName> {
        let found = self.robots.get(robot).map(|robot| robot.sessions_with(scan_id)).unwrap_or_default();
        let kept = found.into_iter().filter(|(_, revision)| !self.marked.contains(revision));
        kept.map(|(session, _)| session).collect()
    }

    /// All scans whose poses are stored, in the order of acceptance: those that were undone are among them until
    /// thinning takes them, so that their ids tell them.
    pub fn stored(&self) -> impl Iterator<Item = &MappedScan> {
        self.poses.iter()
    }

    /// The ids of scans whose poses are not stored, robot by robot, session by session.
    pub fn forgotten(&self) -> impl Iterator<Item = (&RobotName, ForgottenIds<'_>)> {
        self.robots.iter().flat_map(|(name, robot)| robot.forgotten().map(move |ids| (name, ids)))
    }

    /// True when a scan of the robot was accepted, even if it was undone.
    pub fn knows(&self, robot: &RobotName) -> bool {
        self.robots.contains_key(robot)
    }

    /// True of a robot with an accepted scan that was not undone.
    pub fn has_scans_of(&self, robot: &RobotName) -> bool {
        self.robots.get(robot).is_some_and(|robot| !robot.revisions.is_empty())
    }

    /// How many robots have accepted scans that were not undone.
    pub fn robots_with_scans(&self) -> usize {
        self.robots.values().filter(|robot| !robot.revisions.is_empty()).count()
    }

    /// How many robots have scans here, or have had and are remembered.
    pub fn robots_known(&self) -> usize {
        self.robots.len()
    }

    /// The robots with an accepted scan, by name.
    pub fn robots(&self) -> Vec<RobotName> {
        let with_poses = self.robots.iter().filter(|(_, robot)| !robot.revisions.is_empty());
        with_poses.map(|(name, _)| name.clone()).collect()
    }

    /// Bytes of memory.
    pub fn memory_bytes(&self) -> usize {
        const OF_ENTRY: usize = 64;
        let robots: usize = self.robots.values().map(|robot| robot.bytes() + OF_ENTRY).sum();
        let marked = self.marked.len() * 2 * size_of::<u64>();
        let withdrawn = self.withdrawn.capacity() * size_of::<WithdrawnChange>();
        size_of::<Self>() + self.poses.bytes() + self.overlap_bytes + robots + marked + withdrawn
    }

    pub(in crate::map) fn push(&mut self, pose: MappedScan) {
        self.put(pose, false);
    }

    fn put(&mut self, mut pose: MappedScan, is_undone: bool) {
        if self.poses.get(pose.revision).is_some() {
            return;
        }
        let robots = Arc::make_mut(&mut self.robots);
        // One name for all of a robot's poses, and one for all of a session's.
        if let Some((name, scans)) = robots.get_key_value(&pose.robot) {
            pose.session = scans.session_name(&pose.session).unwrap_or(&pose.session).clone();
            pose.robot = name.clone();
        }
        let robot = Arc::make_mut(robots.entry(pose.robot.clone()).or_default());
        match is_undone {
            false => robot.push(&pose),
            true => {
                robot.push_id(&pose);
                Arc::make_mut(&mut self.marked).insert(pose.revision);
            }
        }
        pose.level_overlaps.shrink_to_fit();
        self.overlap_bytes += overlap_bytes(&pose);
        self.poses.insert(pose);
    }
}

impl Trajectory {
    /// The trajectory of these poses, in ascending order of their revisions, of which those of `withdrawn` were undone.
    pub fn new(poses: impl IntoIterator<Item = MappedScan>, withdrawn: Vec<WithdrawnChange>) -> Self {
        Self::default().with_poses(poses, withdrawn)
    }

    /// This trajectory, without a pose yet, with these poses: see [`Trajectory::new`].
    pub fn with_poses(
        mut self,
        poses: impl IntoIterator<Item = MappedScan>,
        withdrawn: Vec<WithdrawnChange>,
    ) -> Self {
        let undone: BTreeSet<u64> = withdrawn.iter().map(|withdrawn| withdrawn.change).collect();
        for pose in poses {
            let is_undone = undone.contains(&pose.revision);
            self.put(pose, is_undone);
        }
        self.withdrawn = withdrawn.into();
        self
    }

    /// This trajectory, which has no pose yet, with ids of a robot's scans whose poses are not stored. They come before
    /// the poses, since scans of a closed session have no ids.
    pub fn with_forgotten(mut self, robot: &RobotName, ids: &ForgottenIds<'_>) -> Self {
        let robots = Arc::make_mut(&mut self.robots);
        Arc::make_mut(robots.entry(robot.clone()).or_default()).remember(ids);
        self
    }

    /// This trajectory, with so many further scans that were accepted and whose poses are not kept.
    pub fn with_thinned(self, scans: u64) -> Self {
        Self { thinned: self.thinned.saturating_add(scans), ..self }
    }

    /// Takes back the changes that made the revisions `changes`, at `revision`: the scans among them, which ascend, go.
    pub(in crate::map) fn withdraw(&mut self, changes: impl Iterator<Item = u64>, revision: u64) {
        let changes: Vec<_> = changes.map(|change| WithdrawnChange { change, revision }).collect();
        let scans = changes.iter().map(|withdrawn| withdrawn.change);
        let there: Vec<u64> = scans.filter(|&scan| self.at(scan).is_some()).collect();
        self.take_from_robots(&there);
        Arc::make_mut(&mut self.marked).extend(there);
        Arc::make_mut(&mut self.withdrawn).extend(changes);
    }

    /// Thins the poses of scans that made a revision before `before`, which no undo may reach; the number of poses that
    /// went. The ids of their scans stay known, and their number does. `withdrawn` loses what was taken out before
    /// that.
    pub fn thin(&mut self, before: u64, spacing: &TrajectorySpacing) -> usize {
        let mut gone = Vec::new();
        let unjudged = match spacing.keep {
            KeptPoses::Spaced => self.unjudged(before),
            KeptPoses::All => Vec::new(),
        };
        for (name, revisions) in unjudged {
            let robots = Arc::make_mut(&mut self.robots);
            let Some(robot) = robots.get_mut(&name).map(Arc::make_mut) else { continue };
            let poses = revisions.iter().filter_map(|&revision| self.poses.get(revision));
            let thinned: Vec<_> = poses.filter(|pose| !robot.seen.keeps(pose, spacing)).collect();
            gone.extend(thinned.iter().map(|pose| pose.revision));
            robot.forget(thinned.into_iter());
        }
        let thinned = gone.len();
        self.thinned += thinned as u64;
        let marked: Vec<u64> = self.marked.range(..before).copied().collect();
        if !marked.is_empty() {
            self.forget_undone(&marked);
            Arc::make_mut(&mut self.marked).retain(|revision| *revision >= before);
            gone.extend(marked);
        }
        if !gone.is_empty() {
            gone.sort_unstable();
            let poses = gone.iter().filter_map(|&revision| self.poses.get(revision));
            self.overlap_bytes -= poses.map(overlap_bytes).sum::<usize>();
            self.poses.remove_all(&gone);
        }
        if self.withdrawn.iter().any(|withdrawn| withdrawn.revision < before) {
            Arc::make_mut(&mut self.withdrawn).retain(|withdrawn| withdrawn.revision >= before);
        }
        thinned
    }

    /// What thinning has to look at, robot by robot.
    fn unjudged(&self, before: u64) -> Vec<(RobotName, Vec<u64>)> {
        let unjudged = self.robots.iter().map(|(name, robot)| (name.clone(), robot.unjudged(before)));
        unjudged.filter(|(_, revisions)| !revisions.is_empty()).collect()
    }

    /// Takes scans, which ascend, out of what robots have in the map. Their ids stay known.
    fn take_from_robots(&mut self, scans: &[u64]) {
        for (name, revisions) in self.by_robot(scans, |pose| pose.revision) {
            let robots = Arc::make_mut(&mut self.robots);
            let Some(robot) = robots.get_mut(&name).map(Arc::make_mut) else { continue };
            robot.withdraw(&revisions);
            if robot.is_unknown() {
                robots.remove(&name);
            }
        }
        self.forget_names();
    }

    /// Forgets the names of robots whose scans were all undone, and with them the ids of these scans, beyond
    /// [`NAMES_WITHOUT_SCANS_MAX`]: those that were used least recently.
    fn forget_names(&mut self) {
        let without = self.robots.iter().filter(|(_, robot)| robot.revisions.is_empty());
        let mut without: Vec<_> =
            without.map(|(name, robot)| (robot.last_revision(), name.clone())).collect();
        let Some(beyond) = without.len().checked_sub(NAMES_WITHOUT_SCANS_MAX).filter(|beyond| *beyond > 0)
        else {
            return;
        };
        without.sort_unstable();
        let robots = Arc::make_mut(&mut self.robots);
        for (_, name) in &without[..beyond] {
            robots.remove(name);
        }
    }

    /// Forgets scans, which ascend and were undone, but for their ids.
    fn forget_undone(&mut self, scans: &[u64]) {
        for (name, poses) in self.by_robot(scans, MappedScan::clone) {
            if let Some(robot) = Arc::make_mut(&mut self.robots).get_mut(&name) {
                Arc::make_mut(robot).forget(poses.iter());
            }
        }
    }

    /// What `of` says of those of these scans that are stored, by robot, in their order.
    fn by_robot<T>(&self, scans: &[u64], of: impl Fn(&MappedScan) -> T) -> BTreeMap<RobotName, Vec<T>> {
        let mut by_robot: BTreeMap<_, Vec<_>> = BTreeMap::new();
        for pose in scans.iter().filter_map(|&scan| self.poses.get(scan)) {
            by_robot.entry(pose.robot.clone()).or_default().push(of(pose));
        }
        by_robot
    }
}

fn overlap_bytes(pose: &MappedScan) -> usize {
    pose.level_overlaps.capacity() * size_of::<f64>()
}

impl PartialEq for Trajectory {
    /// The indices follow from the poses.
    fn eq(&self, other: &Self) -> bool {
        self.stored().eq(other.stored())
            && self.marked == other.marked
            && self.withdrawn == other.withdrawn
            && self.thinned == other.thinned
            && self.forgotten().eq(other.forgotten())
    }
}

impl FromIterator<MappedScan> for Trajectory {
    fn from_iter<I: IntoIterator<Item = MappedScan>>(poses: I) -> Self {
        Self::new(poses, Vec::new())
    }
}
