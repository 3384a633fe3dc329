//! From messages in the order of the log to scans in the order of time.

use std::collections::VecDeque;

use super::gravity_window::GravityWindow;
use super::logged_scan::LoggedScan;
use super::notes::Notes;
use super::options::SequenceOptions;
use crate::cdr::{CdrError, Cursor};
use crate::cloud::{Cloud, CloudOptions};
use crate::frames::{EXTRAPOLATION_MAX_NS, FrameTree, NoTransform, Seconds, Track};
use crate::log::{LogMessage, Topic};
use crate::message::{Header, Imu, MessageKind, Odometry, transforms};
use crate::point_times::{NoTimes, TimesRule};
use crate::survey::{LogSurvey, OdometrySource, Plan};
use mrol_map::geometry::Pose;
use mrol_map::util::excerpt;

/// How much of the log a cloud waits for its transforms, nanoseconds: publishers are late, and recorders write what
/// they get.
const WAIT_NS: u64 = 1_000_000_000;
/// Points that wait, at most: clouds beyond are taken without waiting.
const WAITING_POINTS_MAX: usize = 4_000_000;
/// Clouds that wait, at most.
const WAITING_MAX: usize = 256;
/// A stamp that is farther than this before the one of the cloud before is that of a clock that was set back,
/// nanoseconds; a nearer one is that of a cloud that comes too late.
const SET_BACK_NS: i64 = 1_000_000_000;

/// Scans of a log in the order of time.
///
/// [`Sequence::take`] is given all messages of the log, and [`Sequence::next_scan`] asked after each.
#[derive(Debug)]
pub struct Sequence {
    plan: Plan,
    options: SequenceOptions,
    /// What each topic of the log has.
    kinds: Vec<(Option<MessageKind>, bool)>,
    frames: FrameTree,
    /// Where the moving frame is by a topic of odometry.
    track: Track,
    accelerations: GravityWindow,
    waiting: VecDeque<Waiting>,
    waiting_points: usize,
    /// Time of the newest message, as recorded.
    log_time_ns: u64,
    rule: Option<TimesRule>,
    first_stamp_ns: Option<i64>,
    last_stamp_ns: Option<i64>,
    /// No scan was given out yet.
    is_first: bool,
    /// Clouds within the wanted time so far.
    clouds: u64,
    notes: Notes,
}

/// A cloud that waits for its transforms.
#[derive(Debug)]
struct Waiting {
    cloud: Cloud,
    since_ns: u64,
}

impl Sequence {
    /// The scans of a surveyed log that the plan names.
    pub fn new(survey: &LogSurvey, plan: Plan, options: SequenceOptions) -> Self {
        let kind = |topic: &Topic| (topic.kind(), topic.is_static());
        Self {
            kinds: survey.topics.iter().map(|summary| kind(&summary.topic)).collect(),
            // Programs that started before the recorder told their transforms once, maybe at the end of the log.
            frames: survey.fixed.clone(),
            rule: options.times.as_ref().map(|times| times.rule),
            plan,
            options,
            track: Track::default(),
            accelerations: GravityWindow::default(),
            waiting: VecDeque::new(),
            waiting_points: 0,
            log_time_ns: 0,
            first_stamp_ns: None,
            last_stamp_ns: None,
            is_first: true,
            clouds: 0,
            notes: Notes::default(),
        }
    }

    /// Takes the next message of the log.
    pub fn take(&mut self, message: &LogMessage<'_>) {
        self.log_time_ns = self.log_time_ns.max(message.log_time_ns);
        let Some(&(Some(kind), is_static)) = self.kinds.get(message.topic) else { return };
        let taken = match kind {
            MessageKind::Transforms => self.take_transforms(message.data, is_static),
            MessageKind::Odometry => self.take_odometry(message),
            MessageKind::Imu => self.take_imu(message),
            kind if message.topic == self.plan.cloud => self.take_cloud(kind, message),
            _ => Ok(()),
        };
        if let Err(error) = taken {
            self.notes.note("message", || format!("a message is left out that cannot be read: {error}"));
        }
    }

    /// The next scan whose transforms are there, or that waited long enough; `is_over` after the last message.
    pub fn next_scan(&mut self, is_over: bool) -> Option<LoggedScan> {
        let front = self.waiting.front()?;
        let is_late = is_over
            || self.log_time_ns.saturating_sub(front.since_ns) >= WAIT_NS
            || self.waiting_points > WAITING_POINTS_MAX
            || self.waiting.len() > WAITING_MAX;
        let stamp_ns = front.cloud.stamp_ns.saturating_add(self.options.time_offset_ns);
        let mut odometry_from_sensor = self.odometry_from_sensor(stamp_ns, 0);
        let is_gravity_there = self.plan.gravity.is_none() || self.accelerations.reaches(stamp_ns);
        if !is_late && (odometry_from_sensor.is_err() || !is_gravity_there) {
            return None;
        }
        if odometry_from_sensor.is_err() {
            odometry_from_sensor = self.odometry_from_sensor(stamp_ns, EXTRAPOLATION_MAX_NS);
        }
        let Waiting { cloud, .. } = self.waiting.pop_front()?;
        self.waiting_points -= cloud.points.len();
        let odometry_from_sensor = odometry_from_sensor.unwrap_or_else(|why| {
            self.notes.note("odometry", || {
                format!("the cloud of {} s has no guess by odometry: {why}", Seconds(cloud.stamp_ns))
            });
            None
        });
        let gravity = self.plan.gravity.as_ref();
        let gravity = gravity.and_then(|source| self.accelerations.at(stamp_ns, &source.sensor_from_imu));
        if std::mem::take(&mut self.is_first) && gravity.is_none() && self.plan.gravity.is_some() {
            self.notes.note("gravity", || {
                "the first cloud has no gravity: in the 0.2 s before it there is no acceleration, or one that is not 1 g; \
                 the map leans as the sensor did"
                    .to_owned()
            });
        }
        let times_s = self.times_s(&cloud).map_or_else(
            |why| {
                self.notes.note("times", || {
                    format!("clouds are mapped as if all points of each were measured at once: {why}")
                });
                None
            },
            Some,
        );
        Some(LoggedScan {
            stamp_ns: cloud.stamp_ns,
            points: cloud.points,
            times_s,
            odometry_from_sensor,
            gravity,
        })
    }

    /// What is to be said of the log and was not said yet.
    pub fn notes(&mut self) -> Vec<String> {
        self.notes.take()
    }

    /// How often what was said was met, for the end of the log.
    pub fn totals(&self) -> Vec<String> {
        self.notes.totals()
    }

    fn take_transforms(&mut self, data: &[u8], is_static: bool) -> Result<(), CdrError> {
        for transform in transforms(data)? {
            let (parent, child) = (transform.header.frame, transform.child_frame);
            let noted = match transform.parent_from_child {
                Some(pose) if is_static => self.frames.fix(parent, child, pose),
                Some(pose) => self.frames.note(parent, child, transform.header.stamp_ns, pose),
                None => Ok(()),
            };
            if let Err(why) = noted {
                self.notes.note("transform", || format!("a transform is left out: {why}"));
            }
        }
        Ok(())
    }

    fn take_odometry(&mut self, message: &LogMessage<'_>) -> Result<(), CdrError> {
        if matches!(self.plan.odometry, OdometrySource::Topic { topic, .. } if topic == message.topic) {
            let odometry = Odometry::read(message.data)?;
            if let Some(pose) = odometry.pose {
                self.track.insert(odometry.header.stamp_ns, pose);
            }
        }
        Ok(())
    }

    fn take_imu(&mut self, message: &LogMessage<'_>) -> Result<(), CdrError> {
        if self.plan.gravity.as_ref().is_some_and(|source| source.topic == message.topic)
            && let Some(imu) = Imu::read(message.data)?
        {
            self.accelerations.note(imu.header.stamp_ns, imu.acceleration);
        }
        Ok(())
    }

    fn take_cloud(&mut self, kind: MessageKind, message: &LogMessage<'_>) -> Result<(), CdrError> {
        let header = Header::read(&mut Cursor::new(message.data)?)?;
        if !self.is_wanted(header) {
            return Ok(());
        }
        let options = CloudOptions {
            time_field: self.options.times.as_ref().map(|times| times.field.as_str()),
            camera: self.plan.camera.as_ref(),
        };
        match Cloud::read(kind, message.data, options) {
            Ok(cloud) => {
                self.waiting_points += cloud.points.len();
                self.waiting.push_back(Waiting { cloud, since_ns: message.log_time_ns });
            }
            Err(why) => self.notes.note("cloud", || format!("a cloud is left out: {why}")),
        }
        Ok(())
    }

    /// True of a cloud that is later than the one before, within the wanted time, and one of those wanted of so many.
    fn is_wanted(&mut self, header: Header<'_>) -> bool {
        let Header { stamp_ns, frame } = header;
        if frame != self.plan.sensor_frame {
            self.notes.note("frame", || {
                format!("clouds of other frames than {:?} are left out", excerpt(&self.plan.sensor_frame))
            });
            return false;
        }
        let first_ns = *self.first_stamp_ns.get_or_insert(stamp_ns);
        if let Some(last_ns) = self.last_stamp_ns.filter(|last_ns| stamp_ns <= *last_ns) {
            let back_ns = last_ns.saturating_sub(stamp_ns);
            if back_ns < SET_BACK_NS {
                self.notes.note("order", || {
                    format!("a cloud of {} s is left out: the one before it is not older", Seconds(stamp_ns))
                });
                return false;
            }
            self.notes.note("clock", || {
                format!("the stamps of clouds go back by {} s, as of a clock that was set", Seconds(back_ns))
            });
            self.track = Track::default();
        }
        self.last_stamp_ns = Some(stamp_ns);
        let since_ns = stamp_ns.saturating_sub(first_ns);
        if !(self.options.from_ns..=self.options.to_ns).contains(&since_ns) {
            return false;
        }
        self.clouds += 1;
        (self.clouds - 1).is_multiple_of(self.options.every.max(1))
    }

    /// Where the sensor was by its odometry; none where there is no odometry.
    fn odometry_from_sensor(&self, stamp_ns: i64, beyond_ns: i64) -> Result<Option<Pose>, NoTransform> {
        let sensor = &self.plan.sensor_frame;
        match (&self.plan.odometry, self.options.extrinsics) {
            (OdometrySource::None, _) => Ok(None),
            (OdometrySource::Frame { odometry, moving }, extrinsics) => {
                let pose = self.frames.transform(odometry, moving, stamp_ns, beyond_ns)?;
                Ok(Some(pose * extrinsics.unwrap_or_default()))
            }
            (OdometrySource::Topic { moving, .. }, extrinsics) => {
                let pose = self.track.at(stamp_ns, beyond_ns).map_err(|outside| {
                    NoTransform::other_time("the odometry", &excerpt(moving), outside, beyond_ns)
                })?;
                let moving_from_sensor = match extrinsics {
                    Some(extrinsics) => extrinsics,
                    None => self.frames.transform(moving, sensor, stamp_ns, beyond_ns)?,
                };
                Ok(Some(pose * moving_from_sensor))
            }
        }
    }

    /// The times of a cloud's points, by the rule of the first cloud that shows one.
    fn times_s(&mut self, cloud: &Cloud) -> Result<Vec<f32>, NoTimes> {
        let raw = cloud.times.as_ref().ok_or(NoTimes::NoField)?;
        let rule = match self.rule {
            Some(rule) => rule,
            None => {
                let (rule, doubts) = TimesRule::find(cloud, raw)?;
                for doubt in doubts {
                    self.notes.note("doubt", || doubt.to_string());
                }
                *self.rule.insert(rule)
            }
        };
        rule.times_s(cloud, raw)
    }
}
