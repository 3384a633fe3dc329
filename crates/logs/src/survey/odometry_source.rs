//! From where the motion between scans is known.

use super::choice::{Choice, ChoiceError};
use super::summary::{LogSurvey, TopicSummary};
use crate::message::MessageKind;
use mrol_map::util::excerpt;

/// From where the motion between scans is known.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum OdometrySource {
    /// From nowhere: scans are guessed from the ones before.
    #[default]
    None,
    /// From transforms.
    Frame {
        /// The frame that the robot moves in.
        odometry: String,
        /// The sensor's frame; where extrinsics are given, the frame that they are told in.
        moving: String,
    },
    /// From `nav_msgs/Odometry`.
    Topic {
        /// Number of the topic.
        topic: usize,
        /// The frame that it tells of.
        moving: String,
    },
}

/// A source, and why it is used.
pub(super) type Found = (OdometrySource, String);

/// Topics that an error lists, at most.
const TOPICS_LISTED: usize = 12;
/// Name of the option with which a user says where the sensor is.
const EXTRINSICS: &str = "--extrinsics \"x y z qx qy qz qw\" says where the sensor is on the robot";

impl OdometrySource {
    /// The source for the clouds of a topic, by what the user says or by what is there; none with the reason for it.
    ///
    /// # Errors
    /// When what the user asks for is not there, or cannot be used.
    pub(super) fn find(
        survey: &LogSurvey,
        choice: &Choice,
        sensor: &str,
    ) -> Result<Result<Found, String>, ChoiceError> {
        let Some(asked) = choice.odometry.as_deref() else { return Ok(found_out(survey, choice, sensor)) };
        if asked == "none" {
            return Ok(Err("--odometry none".to_owned()));
        }
        let why = || format!("--odometry {asked}");
        let topic = odometry_topics(survey).find(|(_, summary)| summary.topic.name == asked);
        let found = match topic {
            Some((k, summary)) => of_topic(survey, choice, sensor, k, summary),
            None if survey.frames.has(asked) => of_frame(survey, choice, sensor, asked),
            None => {
                let topics = odometry_topics(survey)
                    .map(|(_, summary)| excerpt(&summary.topic.name))
                    .take(TOPICS_LISTED);
                let topics = topics.collect::<Vec<_>>();
                let topics = if topics.is_empty() { "no topics".to_owned() } else { topics.join(" ") };
                let there = format!("{topics} of odometry, and frames {}", survey.frames.listed());
                return Err(ChoiceError::NoSuchOdometry { asked: asked.to_owned(), there });
            }
        };
        match found {
            Ok(source) => Ok(Ok((source, why()))),
            Err(why) => Err(ChoiceError::Odometry { asked: asked.to_owned(), why }),
        }
    }
}

fn odometry_topics(survey: &LogSurvey) -> impl Iterator<Item = (usize, &TopicSummary)> {
    let topics = survey.topics.iter().enumerate();
    topics.filter(|(_, summary)| summary.kind() == Some(MessageKind::Odometry) && summary.messages > 0)
}

/// The source that is there: a frame `odom`, then a topic, then the frame above all others if the sensor moves in it.
fn found_out(survey: &LogSurvey, choice: &Choice, sensor: &str) -> Result<Found, String> {
    let mut why_not = Vec::new();
    let is_odometry = |frame: &&str| frame.rsplit('/').next() == Some("odom");
    let all = survey.frames.frames();
    let odom = survey.frames.ancestors(sensor).find(|frame| is_odometry(frame));
    if let Some(frame) = odom.or_else(|| all.iter().copied().find(|frame| is_odometry(frame))) {
        match of_frame(survey, choice, sensor, frame) {
            Ok(source) => return Ok((source, "the frame has the usual name".to_owned())),
            Err(why) => why_not.push(why),
        }
    }
    let topic = odometry_topics(survey).max_by_key(|(k, summary)| (summary.messages, std::cmp::Reverse(*k)));
    if let Some((k, summary)) = topic {
        match of_topic(survey, choice, sensor, k, summary) {
            Ok(source) if odometry_topics(survey).count() == 1 => {
                return Ok((source, "it is the only topic of nav_msgs/Odometry".to_owned()));
            }
            Ok(source) => {
                let why =
                    "of the topics of nav_msgs/Odometry it has the most messages; --odometry names another";
                return Ok((source, why.to_owned()));
            }
            Err(why) => why_not.push(why),
        }
    }
    if let Some(root) = survey.frames.ancestors(sensor).last()
        && let Ok(source) = of_frame(survey, choice, sensor, root)
    {
        return Ok((source, "the sensor moves in it, and no frame is above it".to_owned()));
    }
    match why_not.is_empty() {
        true => Err(format!(
            "there is neither a frame in which frame {:?} moves (/tf) nor a topic of nav_msgs/Odometry",
            excerpt(sensor)
        )),
        false => Err(why_not.join("; ")),
    }
}

/// The transforms from the sensor up to a frame.
fn of_frame(
    survey: &LogSurvey,
    choice: &Choice,
    sensor: &str,
    odometry: &str,
) -> Result<OdometrySource, String> {
    let frames = &survey.frames;
    let moving = match choice.extrinsics {
        Some(_) => frames
            .frames()
            .into_iter()
            .find(|frame| frames.moves(frame) && frames.ancestors(frame).nth(1) == Some(odometry))
            .ok_or_else(|| format!("no frame moves in {odometry:?}, which --extrinsics could be told in"))?,
        None => sensor,
    };
    let mut below = frames.ancestors(moving).take_while(|frame| *frame != odometry);
    if !frames.ancestors(moving).any(|frame| frame == odometry) {
        let has = if frames.has(sensor) { "is not below it" } else { "is in no transform" };
        return Err(format!(
            "frame {odometry:?} is there, but the clouds' frame {:?} {has}, there are {}; {EXTRINSICS}",
            excerpt(sensor),
            frames.listed()
        ));
    }
    match below.any(|frame| frames.moves(frame)) {
        true => Ok(OdometrySource::Frame { odometry: odometry.to_owned(), moving: moving.to_owned() }),
        false => Err(format!("frame {:?} does not move in {odometry:?}", excerpt(sensor))),
    }
}

/// A topic, where it is known where the sensor is on the frame that it tells of.
fn of_topic(
    survey: &LogSurvey,
    choice: &Choice,
    sensor: &str,
    topic: usize,
    summary: &TopicSummary,
) -> Result<OdometrySource, String> {
    let moving = summary.child_frame.clone().unwrap_or_default();
    let is_connected = moving == sensor
        || choice.extrinsics.is_some()
        || (survey.frames.has(&moving)
            && survey
                .frames
                .ancestors(sensor)
                .any(|up| survey.frames.ancestors(&moving).any(|other| other == up)));
    match is_connected {
        true => Ok(OdometrySource::Topic { topic, moving }),
        false => Err(format!(
            "{} tells where frame {:?} is, and no transform where the clouds' frame {:?} is on it, there are {}; \
             {EXTRINSICS}",
            excerpt(&summary.topic.name),
            excerpt(&moving),
            excerpt(sensor),
            survey.frames.listed()
        )),
    }
}
