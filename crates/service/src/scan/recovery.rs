//! The search for lost robots, beside everything else that the server does.
//!
//! A robot that asked for it (see [`RobotSettings::recover`](crate::RobotSettings)) is searched for after a scan of it
//! was refused: on threads of their own that give way to all others, and in turn. The answer to the scan does not wait
//! for it. Whether the robot is where the search saw it, its next scan tells.

use std::sync::Arc;
use std::time::Instant;

use super::localization::SEARCH_SHARE;
use super::mapper::seconds;
use crate::map_service::MapService;
use crate::maps::HostedMap;
use crate::request::ScanRequest;
use crate::resources::{Reservation, ResourceBudget};
use crate::settings::ServiceSettings;
use mrol_map::align::localize::Supervision;
use mrol_map::mapping::{ScanMapper, SearchTask};
use mrol_map::util::StopSignal;

/// Name under which the memory of a search is reserved, for refusals.
const RESERVED_FOR: &str = "a search for a lost robot";

impl MapService {
    /// Begins to search for the robot of a scan that was refused, if it asked for it.
    pub(super) fn search_for_robot_of(&self, map: Arc<HostedMap>, request: &ScanRequest) {
        let inner = Arc::clone(&self.inner);
        if !inner.settings.recovers(request) {
            return;
        }
        let (robot, method) = (request.robot.clone(), request.method);
        let (of_lanes, requester) = (Arc::clone(&self.inner), self.asker.for_robot(&robot));
        tokio::spawn(async move {
            let search = move |stop: StopSignal<'_>| {
                let settings = &inner.settings;
                let mapper = map.mapper(method, true, settings);
                if let Some(task) = mapper.begin_search(&robot) {
                    map.search(&mapper, &task, settings, &inner.budget, stop);
                }
            };
            // Nobody waits for the answer. What came of it is noted with the robot; where many others are searched for,
            // the next scan asks again.
            drop(of_lanes.lanes.recovery.run(requester, search).await);
        });
    }
}

impl HostedMap {
    /// Searches for a lost robot until the time is up or `stop` says so.
    fn search(
        &self,
        mapper: &ScanMapper<'_>,
        task: &SearchTask,
        settings: &ServiceSettings,
        budget: &ResourceBudget,
        stop: StopSignal<'_>,
    ) {
        let (start, limit) = (Instant::now(), seconds(settings.limits.recovery_search_time_max_s));
        let mut reserved: Vec<Reservation> = Vec::new();
        let supervision = &mut Supervision {
            stop: stop.by(start + limit),
            search_stop: stop.by(start + limit.mul_f64(SEARCH_SHARE)),
            progress: &mut |_| (),
            reserve: &mut |bytes| {
                let more = budget.reserve_transient(bytes as u64, RESERVED_FOR);
                more.map(|reservation| reserved.push(reservation)).is_ok()
            },
        };
        let outcome = mapper.search(task, supervision);
        let map = self.name.as_str();
        match outcome {
            Ok(()) => tracing::debug!(map, elapsed = ?start.elapsed(), "searched for a lost robot"),
            Err(error) => tracing::debug!(map, %error, "could not search for a lost robot"),
        }
    }
}
