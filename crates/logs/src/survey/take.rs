//! How a survey is taken: message by message.

use super::summary::{LogSurvey, TopicSummary};
use crate::cdr::{CdrError, Cursor};
use crate::cloud::{Cloud, CloudOptions};
use crate::frames::BadTransform;
use crate::log::{LogError, LogMessage, Messages};
use crate::message::{CameraInfo, Header, Image, Imu, MessageKind, Odometry, transforms};
use crate::point_times::{NoTimes, TimesRule};
use mrol_map::util::excerpt;

/// Reasons for which transforms were refused, and contradictions of them, that are kept, at most.
const KEPT_MAX: usize = 10;
/// Clouds of a topic that are looked into for times, at most: the first may have no return.
const CLOUDS_LOOKED_AT: u64 = 10;

impl LogSurvey {
    /// Surveys a log to its end; `step` is told after each message how many bytes of the file were read.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn take(log: &mut impl Messages, mut step: impl FnMut(u64)) -> Result<Self, LogError> {
        let mut survey = Self::default();
        while let Some(message) = log.next_message()? {
            let (topic, log_time_ns) = (message.topic, message.log_time_ns);
            let read = survey
                .topics
                .get(topic)
                .and_then(|summary| Some((summary.kind()?, summary.topic.is_static())));
            match read {
                Some((kind, is_static)) => survey.note(&message, kind, is_static),
                // A topic that was not met yet, whose message has to be given back before it can be asked for.
                None if topic >= survey.topics.len() => {
                    let data = message.data.to_vec();
                    survey
                        .topics
                        .extend(log.topics()[survey.topics.len()..].iter().cloned().map(TopicSummary::new));
                    let message = LogMessage { topic, log_time_ns, data: &data };
                    match survey.topics[topic].kind() {
                        Some(kind) => survey.note(&message, kind, survey.topics[topic].topic.is_static()),
                        None => survey.count(&message),
                    }
                }
                None => survey.count(&message),
            }
            step(log.position());
        }
        survey.topics.extend(log.topics()[survey.topics.len()..].iter().cloned().map(TopicSummary::new));
        survey.damages = log.damages().to_vec();
        Ok(survey)
    }

    fn count(&mut self, message: &LogMessage<'_>) {
        let time_ns = message.log_time_ns;
        let (first, last) = self.span_ns.unwrap_or((time_ns, time_ns));
        self.span_ns = Some((first.min(time_ns), last.max(time_ns)));
        let topic = &mut self.topics[message.topic];
        let (first, last) = if topic.messages == 0 { (time_ns, time_ns) } else { topic.span_ns };
        topic.span_ns = (first.min(time_ns), last.max(time_ns));
        topic.messages += 1;
        topic.bytes += message.data.len() as u64;
    }

    fn note(&mut self, message: &LogMessage<'_>, kind: MessageKind, is_static: bool) {
        self.count(message);
        let noted = match kind {
            MessageKind::Transforms => self.note_transforms(message.data, is_static),
            kind => self.note_stamped(message, kind),
        };
        if let Err(error) = noted {
            let unreadable = &mut self.topics[message.topic].unreadable;
            unreadable.get_or_insert_with(|| error.to_string());
        }
    }

    fn note_stamped(&mut self, message: &LogMessage<'_>, kind: MessageKind) -> Result<(), CdrError> {
        let summary = &mut self.topics[message.topic];
        let header = Header::read(&mut Cursor::new(message.data)?)?;
        if summary.first_stamp_ns.is_none() {
            summary.first_stamp_ns = Some(header.stamp_ns);
            summary.first_checksum = Some(crc32fast::hash(message.data));
            summary.frame = Some(header.frame.to_owned());
        }
        match kind {
            MessageKind::Odometry if summary.child_frame.is_none() => {
                summary.child_frame = Some(Odometry::read(message.data)?.child_frame.to_owned());
            }
            MessageKind::Imu => {
                Imu::read(message.data)?;
            }
            MessageKind::Image => {
                let Image { encoding, .. } = Image::read(message.data)?;
                summary.encoding.get_or_insert_with(|| excerpt(encoding));
            }
            MessageKind::CameraInfo => note_camera(summary, message.data, &mut self.contradictions)?,
            kind if kind.is_cloud()
                && summary.messages <= CLOUDS_LOOKED_AT
                && !matches!(summary.times, Some(Ok(_))) =>
            {
                match Cloud::read(kind, message.data, CloudOptions::default()) {
                    Ok(cloud) => summary.times = Some(times_of(&cloud)),
                    Err(error) => {
                        summary.unreadable.get_or_insert_with(|| error.to_string());
                    }
                }
            }
            _ => {}
        }
        Ok(())
    }

    fn note_transforms(&mut self, data: &[u8], is_static: bool) -> Result<(), CdrError> {
        for transform in transforms(data)? {
            let (parent, child) = (transform.header.frame, transform.child_frame);
            let fixed = transform.parent_from_child.filter(|_| is_static);
            let contradiction = self.frames.contradiction(parent, child, fixed.as_ref());
            let noted = match transform.parent_from_child {
                None => Err(BadTransform::no_pose(parent, child)),
                Some(pose) if is_static => {
                    self.fixed.fix(parent, child, pose).and_then(|()| self.frames.fix(parent, child, pose))
                }
                Some(pose) => self.frames.note(parent, child, transform.header.stamp_ns, pose),
            };
            match (noted, contradiction) {
                (Err(error), _) => note_once(&mut self.refused_transforms, || error.to_string()),
                (Ok(()), Some(told)) => note_once(&mut self.contradictions, || told.to_string()),
                (Ok(()), None) => {}
            }
        }
        Ok(())
    }
}

/// Keeps what is told of a camera first, and notes when something else is told later.
fn note_camera(
    summary: &mut TopicSummary,
    data: &[u8],
    contradictions: &mut Vec<String>,
) -> Result<(), CdrError> {
    let info = CameraInfo::read(data)?;
    match &summary.camera_info {
        None => summary.camera_info = Some(info),
        Some(first) if *first == info => {}
        Some(_) => note_once(contradictions, || {
            let name = excerpt(&summary.topic.name);
            format!(
                "{name} changes within the log, and what it tells first counts: later images are mapped askew"
            )
        }),
    }
    Ok(())
}

/// Notes a text that was not noted before, while there is room.
fn note_once(notes: &mut Vec<String>, text: impl FnOnce() -> String) {
    if notes.len() < KEPT_MAX {
        let text = text();
        if !notes.contains(&text) {
            notes.push(text);
        }
    }
}

/// How the times of a cloud's points are read, or why there are none.
fn times_of(cloud: &Cloud) -> Result<(TimesRule, Vec<String>), String> {
    let raw = cloud.times.as_ref().ok_or_else(|| NoTimes::NoField.to_string())?;
    let (rule, doubts) = TimesRule::find(cloud, raw).map_err(|error| error.to_string())?;
    Ok((rule, doubts.iter().map(ToString::to_string).collect()))
}
