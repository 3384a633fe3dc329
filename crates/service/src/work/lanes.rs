//! The lanes, one for each kind of work: what keeps one kind waiting keeps no other.

use super::background::Background;
use super::lane::{Lane, LaneSettings, LaneUse};
use super::precedence::Precedence;
use crate::error::ServiceError;
use crate::settings::ServiceSettings;

/// Of the jobs that may wait for a thread, one in so many may wait for one of [`Lanes::long_mapping`].
const LONG_SHARE: usize = 4;
/// Threads of the lanes where each job takes memory as a part of a map or of a journal does: one at a time.
const ONE_AT_A_TIME: usize = 1;

/// Jobs of a lane that gave way at once.
const PAUSED_MAX: usize = 16;
/// The same where each takes memory as a part of a map or of a journal does.
const LARGE_PAUSED_MAX: usize = 2;
/// Points of a query that takes some milliseconds at most; an eighth where they are compared with keep-outs.
const SHORT_QUERY_POINTS: usize = 64 << 10;

/// Messages and parts of answers that wait, of which `limits.requests_max` has bounded how many there are: an answer
/// that is begun is not refused halfway.
const MESSAGES_WAITING_MAX: usize = u32::MAX as usize;

/// The lanes.
#[derive(Debug)]
pub(crate) struct Lanes {
    /// For what is read in a few milliseconds: descriptions, keep-outs, queries of a scan's points. Nothing else, so
    /// that none of it waits for what takes long.
    pub(crate) reads: Lane,
    /// For long queries, listings and trajectories, so that no alignment starves them.
    pub(crate) queries: Lane,
    /// For reading large requests and writing large answers.
    pub(crate) messages: Lane,
    /// For insertions, with their alignments, and deletions. Nothing else: whatever others ask for, robots map.
    pub(crate) mapping: Lane,
    /// For the scans of robots and keys whose scans keep failing, which take a second and more each: robots whose scans
    /// fit do not wait for them. A scan that takes long now and then stays in `mapping`, and gives way there.
    pub(crate) long_mapping: Lane,
    /// For alignments of scans that are not inserted: a key for reading may ask for any number of them.
    pub(crate) alignment: Lane,
    /// For searches with no guess, which take seconds: no alignment waits for them.
    pub(crate) localization: Lane,
    /// For searches for lost robots, which nobody waits for.
    pub(crate) recovery: Lane,
    /// For finding out what an undo takes back, which reads a snapshot and the journal behind it.
    pub(crate) undo: Lane,
    /// For map files, out of the server and in, which take seconds and much memory each: no query or scan waits for
    /// them.
    pub(crate) map_files: Lane,
    /// For what watches are told of besides the last changes: whole states, and changes that the journal has.
    pub(crate) watch: Lane,
    /// For finding the scans that touched a voxel, which may read much of the journal.
    pub(crate) observers: Lane,
    /// For blocks, which take up to seconds: no query of points waits for them.
    pub(crate) blocks: Lane,
    /// For what planners ask besides points: no query of points waits for a long one.
    pub(crate) planning: Lane,
}

impl Lanes {
    /// Starts the threads.
    ///
    /// # Errors
    /// When the system refuses.
    pub(crate) fn start(settings: &ServiceSettings) -> Result<Self, ServiceError> {
        let waiting = settings.limits.jobs_waiting_max;
        // All of one priority: a nice thread that holds a lock of a map hardly runs, and keeps all others waiting for
        // it.
        let of = |name, threads: usize, waiting_max, paused_max| {
            let threads = if threads == 0 { cores() } else { threads };
            Lane::start(LaneSettings { name, threads, waiting_max, paused_max })
        };
        let half = |threads: usize| (if threads == 0 { cores() } else { threads } / 2).max(1);
        let ServiceSettings { query_threads, mapping_threads, localization_threads, .. } = *settings;
        let (of_queries, of_mapping, of_searches) =
            (half(query_threads), half(mapping_threads), half(localization_threads));
        let beside_robots = match settings.planning_threads_beside_robots {
            0 => of_queries,
            threads => threads,
        };
        let robots = Precedence::default();
        let background = Background::behind(&robots, cores());
        let long_waiting = waiting.div_ceil(LONG_SHARE);
        let watches = waiting.max(settings.limits.watches_max);
        Ok(Self {
            reads: of("read", query_threads, waiting, PAUSED_MAX)?,
            queries: of("query", query_threads, waiting, PAUSED_MAX)?.behind(&robots, beside_robots),
            messages: of("message", query_threads, MESSAGES_WAITING_MAX, 0)?,
            mapping: of("mapping", mapping_threads, waiting, PAUSED_MAX)?.taking(&robots),
            long_mapping: of("long_mapping", of_mapping, long_waiting, PAUSED_MAX)?
                .in_background(&background),
            alignment: of("alignment", settings.alignment_threads, waiting, PAUSED_MAX)?,
            localization: of("localization", localization_threads, waiting, LARGE_PAUSED_MAX)?,
            recovery: of("recovery", of_searches, long_waiting, LARGE_PAUSED_MAX)?.in_background(&background),
            undo: of("undo", ONE_AT_A_TIME, waiting, LARGE_PAUSED_MAX)?,
            map_files: of("map_file", ONE_AT_A_TIME, waiting, LARGE_PAUSED_MAX)?,
            watch: of("watch", ONE_AT_A_TIME, watches, LARGE_PAUSED_MAX)?,
            observers: of("observers", ONE_AT_A_TIME, waiting, LARGE_PAUSED_MAX)?,
            blocks: of("blocks", of_queries, waiting, LARGE_PAUSED_MAX)?,
            planning: of("planning", query_threads, waiting, PAUSED_MAX)?.behind(&robots, beside_robots),
        })
    }

    /// The lane for a query of so many points, with or without keep-outs.
    pub(crate) fn for_points(&self, points: usize, keep_out: bool) -> &Lane {
        let short = if keep_out { SHORT_QUERY_POINTS / 8 } else { SHORT_QUERY_POINTS };
        if points <= short { &self.reads } else { &self.queries }
    }

    /// What the threads are doing.
    pub(crate) fn in_use(&self) -> [LaneUse; 14] {
        let all = [
            &self.reads,
            &self.queries,
            &self.messages,
            &self.mapping,
            &self.long_mapping,
            &self.alignment,
            &self.localization,
            &self.recovery,
            &self.undo,
            &self.map_files,
            &self.watch,
            &self.observers,
            &self.blocks,
            &self.planning,
        ];
        all.map(Lane::in_use)
    }
}

/// Cores that the process may use; one where the system does not say.
fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::work::{Asker, Requester};
    use mrol_map::map::RobotName;
    use parking_lot::Mutex;
    use std::sync::Arc;
    use std::sync::mpsc::channel;
    use tokio::task::JoinSet;

    /// Jobs of one key under as many names of robots, and the turns of them that another key waits for.
    async fn turns_before_another(lanes: &Arc<Lanes>, of: fn(&Lanes) -> &Lane) -> usize {
        const MANY: usize = 30;
        let (hold, held) = channel::<()>();
        let (order, mut all) = (Arc::new(Mutex::new(Vec::new())), JoinSet::new());
        let mut spawn =
            |requester: Requester, name: &'static str, wait: Option<std::sync::mpsc::Receiver<()>>| {
                let (lanes, order) = (Arc::clone(lanes), Arc::clone(&order));
                all.spawn(async move {
                    let job = move |_: mrol_map::util::StopSignal<'_>| {
                        wait.map(|held| held.recv());
                        order.lock().push(name);
                    };
                    of(&lanes).run(&requester, job).await.unwrap();
                });
            };
        let many = Asker::with_key("many");
        let robot = |n: usize| many.for_robot(&RobotName::new(&format!("r{n}")).unwrap());
        spawn(robot(0), "first", Some(held));
        while of(lanes).in_use().running == 0 {
            tokio::task::yield_now().await;
        }
        (0..MANY).for_each(|n| spawn(robot(n), "many", None));
        while of(lanes).in_use().waiting < MANY {
            tokio::task::yield_now().await;
        }
        spawn(Requester::from(&Asker::with_key("one")), "one", None);
        while of(lanes).in_use().waiting <= MANY {
            tokio::task::yield_now().await;
        }
        drop(hold);
        while all.join_next().await.is_some() {}
        let order = order.lock();
        order.iter().skip(1).take_while(|name| **name != "one").count()
    }

    #[tokio::test]
    async fn in_every_lane_nobody_waits_for_more_than_two_turns_of_another_key() {
        let settings = ServiceSettings {
            query_threads: 1,
            mapping_threads: 1,
            alignment_threads: 1,
            localization_threads: 1,
            ..ServiceSettings::default()
        };
        let lanes = Arc::new(Lanes::start(&settings).unwrap());
        let every: [fn(&Lanes) -> &Lane; 14] = [
            |lanes| &lanes.reads,
            |lanes| &lanes.queries,
            |lanes| &lanes.messages,
            |lanes| &lanes.mapping,
            |lanes| &lanes.long_mapping,
            |lanes| &lanes.alignment,
            |lanes| &lanes.localization,
            |lanes| &lanes.recovery,
            |lanes| &lanes.undo,
            |lanes| &lanes.map_files,
            |lanes| &lanes.watch,
            |lanes| &lanes.observers,
            |lanes| &lanes.blocks,
            |lanes| &lanes.planning,
        ];
        let names = every.map(|of| of(&lanes).in_use().name);
        assert_eq!(names, lanes.in_use().map(|lane| lane.name));
        for (of, name) in every.into_iter().zip(names) {
            let turns = turns_before_another(&lanes, of).await;
            assert!(turns <= 2, "lane {name}: {turns} turns");
        }
    }
}
