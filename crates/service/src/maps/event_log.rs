//! The last events of a map, in memory.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use tokio::sync::watch;

use crate::request::{EventsQuery, ScanEvent};
use mrol_map::map::RobotName;
use mrol_map::sync::{Mutex, Rank};
use mrol_map::util::unix_time_ns;

/// The last events of a map, and the last of each robot: a robot that fell silent is still there to be seen.
///
/// Bounded by the number of events: for a new one, the oldest goes of the robot that has most, so that no robot crowds
/// out the others. Points are kept of a robot's last scan alone.
#[derive(Debug)]
pub(crate) struct EventLog {
    kept: Mutex<Kept>,
    newest: watch::Sender<u64>,
}

#[derive(Debug, Default)]
struct Kept {
    recent: VecDeque<Arc<ScanEvent>>,
    last_of: BTreeMap<RobotName, Arc<ScanEvent>>,
    last_number: u64,
}

impl Default for EventLog {
    fn default() -> Self {
        Self { kept: Mutex::new(Rank::Brief, Kept::default()), newest: watch::Sender::new(0) }
    }
}

impl EventLog {
    /// Keeps an event as the newest one, and tells the watchers. So many are kept at most, and of as many robots the
    /// last.
    pub(crate) fn note(&self, mut event: ScanEvent, most: usize) {
        event.time_ns = unix_time_ns();
        let micros = u64::try_from(event.time_ns / 1000).unwrap_or_default();
        let mut kept = self.kept.lock();
        let number = micros.max(kept.last_number + 1);
        (kept.last_number, event.number) = (number, number);
        kept.push(Arc::new(event), most);
        drop(kept);
        // Of two that are noted at once, the greater number stays.
        self.newest.send_if_modified(|newest| {
            let is_newer = number > *newest;
            *newest = number.max(*newest);
            is_newer
        });
    }

    /// The events that are asked for, ascending by number.
    pub(crate) fn list(&self, query: &EventsQuery) -> Vec<Arc<ScanEvent>> {
        let kept = self.kept.lock();
        let since = if query.since_number > kept.last_number { 0 } else { query.since_number };
        let is_asked = |event: &Arc<ScanEvent>| {
            event.number > since && query.robot.as_ref().is_none_or(|robot| *robot == event.robot)
        };
        let oldest = kept.recent.front().map_or(0, |event| event.number);
        let silent = kept.last_of.values().filter(|event| event.number < oldest);
        let mut silent: Vec<_> = silent.filter(|event| is_asked(event)).cloned().collect();
        silent.sort_unstable_by_key(|event| event.number);
        silent.extend(kept.recent.iter().filter(|event| is_asked(event)).cloned());
        silent
    }

    /// The number of the newest event, as it changes.
    pub(crate) fn newest(&self) -> watch::Receiver<u64> {
        self.newest.subscribe()
    }
}

impl Kept {
    fn push(&mut self, event: Arc<ScanEvent>, most: usize) {
        if most == 0 {
            return;
        }
        self.drop_points_of_last(&event.robot);
        self.last_of.insert(event.robot.clone(), Arc::clone(&event));
        if self.last_of.len() > most {
            let oldest = self.last_of.values().min_by_key(|event| event.number);
            if let Some(robot) = oldest.map(|event| event.robot.clone()) {
                self.last_of.remove(&robot);
            }
        }
        self.recent.push_back(event);
        while self.recent.len() > most {
            self.drop_oldest_of_busiest();
        }
    }

    fn drop_oldest_of_busiest(&mut self) {
        let mut counts = BTreeMap::<&RobotName, usize>::new();
        for event in &self.recent {
            *counts.entry(&event.robot).or_default() += 1;
        }
        let most = counts.values().copied().max().unwrap_or_default();
        // Of several such, that whose event is the oldest.
        let oldest = self.recent.iter().position(|event| counts[&event.robot] == most);
        if let Some(oldest) = oldest {
            self.recent.remove(oldest);
        }
    }

    /// Keeps no more points of what is not the robot's last scan from now on.
    fn drop_points_of_last(&mut self, robot: &RobotName) {
        let Some(last) = self.last_of.get(robot).filter(|last| !last.sample.is_empty()) else { return };
        let Ok(place) = self.recent.binary_search_by_key(&last.number, |event| event.number) else { return };
        self.recent[place] = Arc::new(ScanEvent { sample: Vec::new(), ..ScanEvent::clone(last) });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Reason;
    use crate::request::FailedScan;
    use mrol_map::geometry::Point;
    use mrol_map::map::SessionName;
    use std::time::Duration;

    fn event_of(robot: &str) -> ScanEvent {
        let failed = FailedScan { reason: Reason::NoReturns.as_str().into(), message: "none".into() };
        ScanEvent {
            number: 0,
            time_ns: 0,
            robot: RobotName::new(robot).unwrap(),
            session: SessionName::default(),
            scan_id: None,
            points: 1,
            duration: Duration::ZERO,
            guess: None,
            sample: Vec::new(),
            answer: Err(failed),
        }
    }

    fn numbers(events: &[Arc<ScanEvent>]) -> Vec<u64> {
        events.iter().map(|event| event.number).collect()
    }

    fn all(log: &EventLog) -> Vec<Arc<ScanEvent>> {
        log.list(&EventsQuery::default())
    }

    #[test]
    fn the_last_events_stay_and_the_last_of_a_robot_that_fell_silent() {
        let log = EventLog::default();
        log.note(event_of("silent"), 3);
        for _ in 0..5 {
            log.note(event_of("busy"), 3);
        }
        let kept = all(&log);
        assert_eq!(
            kept.iter().map(|event| event.robot.as_str()).collect::<Vec<_>>(),
            ["silent", "busy", "busy"]
        );
        assert!(numbers(&kept).is_sorted_by(|a, b| a < b));
        let robot = Some(kept[0].robot.clone());
        assert_eq!(log.list(&EventsQuery { robot, since_number: 0 }).len(), 1);
    }

    #[test]
    fn who_names_a_number_is_told_of_those_after_it_and_of_all_for_one_that_is_not_there() {
        let log = EventLog::default();
        (0..4).for_each(|_| log.note(event_of("a"), 10));
        let told = numbers(&all(&log));
        let since = |since_number| numbers(&log.list(&EventsQuery { since_number, robot: None }));
        assert_eq!(since(told[1]), told[2..]);
        assert!(since(told[3]).is_empty());
        assert_eq!(since(told[3] + 1), told);
    }

    #[test]
    fn a_robot_that_sends_much_crowds_out_no_other() {
        let log = EventLog::default();
        (0..3).for_each(|_| log.note(event_of("quiet"), 10));
        (0..100).for_each(|_| log.note(event_of("busy"), 10));
        let kept = all(&log);
        assert_eq!(kept.iter().filter(|event| event.robot.as_str() == "quiet").count(), 3);
        assert_eq!(kept.len(), 10);
        assert!(numbers(&kept).is_sorted_by(|a, b| a < b));
    }

    #[test]
    fn many_robots_take_no_more_than_as_many_events() {
        let log = EventLog::default();
        (0..100).for_each(|n| log.note(event_of(&format!("r{n}")), 4));
        assert_eq!(all(&log).len(), 4);
        assert_eq!(log.kept.lock().last_of.len(), 4);
        log.note(event_of("a"), 0);
        assert_eq!(all(&log).len(), 4);
    }

    #[test]
    fn points_are_kept_of_a_robots_last_scan_alone() {
        let log = EventLog::default();
        let refused = |robot| ScanEvent { sample: vec![Point::new(1.0, 0.0, 0.0)], ..event_of(robot) };
        for event in [refused("a"), refused("b"), refused("a")] {
            log.note(event, 10);
        }
        let samples: Vec<_> = all(&log).iter().map(|event| event.sample.len()).collect();
        assert_eq!(samples, [0, 1, 1]);
        log.note(event_of("a"), 10);
        let samples: Vec<_> = all(&log).iter().map(|event| event.sample.len()).collect();
        assert_eq!(samples, [0, 1, 0, 0]);
    }
}
