//! What of a log a mapping uses, and why.

use super::choice::{Choice, ChoiceError};
use super::odometry_source::OdometrySource;
use super::summary::{LogSurvey, TopicSummary};
use crate::cloud::Camera;
use crate::log::Topic;
use crate::message::MessageKind;
use mrol_map::geometry::Pose;
use mrol_map::util::excerpt;

/// What of a log a mapping uses.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Number of the topic of clouds.
    pub cloud: usize,
    /// The camera, of depth images.
    pub camera: Option<Camera>,
    /// The frame of the clouds.
    pub sensor_frame: String,
    /// From where the motion between scans is known.
    pub odometry: OdometrySource,
    /// From where the direction of gravity is known.
    pub gravity: Option<GravitySource>,
    /// What is used, and why.
    pub uses: Vec<Use>,
    /// What is missing, and what that means.
    pub missing: Vec<String>,
}

/// An accelerometer.
#[derive(Debug, Clone, PartialEq)]
pub struct GravitySource {
    /// Number of its topic.
    pub topic: usize,
    /// Where it is: sensor_from_imu.
    pub sensor_from_imu: Pose,
}

/// Something of a log that is used.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Use {
    /// For what: `clouds`, `times`, `odometry` or `gravity`.
    pub purpose: &'static str,
    /// What it is.
    pub source: String,
    /// Why.
    pub why: String,
}

/// What is said of planar scans: alignment looks for a pose with six degrees of freedom.
const PLANAR: &str = "no third dimension: scans in one plane are read, and hardly any of them is accepted, since they do \
                      not determine a pose in space";

/// The topic of a camera beside those of its images.
const CAMERA_INFO: &str = "camera_info";

/// Topics that an error lists, at most.
const TOPICS_LISTED: usize = 12;

impl Plan {
    /// What of a log is used, by what the user says and what is there.
    ///
    /// # Errors
    /// When there are no clouds, or what the user asks for is not there.
    pub fn of(survey: &LogSurvey, choice: &Choice) -> Result<Self, ChoiceError> {
        let (cloud, why) = find_cloud(survey, choice)?;
        let summary = &survey.topics[cloud];
        let camera = find_camera(survey, summary)?;
        let sensor_frame = summary.frame.clone().unwrap_or_default();
        let Topic { name, type_name, .. } = &summary.topic;
        let source = format!("{name} ({type_name}, frame {:?})", excerpt(&sensor_frame));
        let mut uses = vec![Use { purpose: "clouds", source, why }];
        let mut missing = Vec::new();
        if summary.kind() == Some(MessageKind::LaserScan) {
            missing.push(PLANAR.to_owned());
        }
        note_times(summary, choice, &mut uses, &mut missing);
        let odometry = match OdometrySource::find(survey, choice, &sensor_frame)? {
            Ok((odometry, why)) => {
                uses.push(Use { purpose: "odometry", source: describe(survey, &odometry), why });
                odometry
            }
            Err(why) => {
                missing.push(format!("no odometry: {why}. Each scan is guessed from the ones before it"));
                OdometrySource::None
            }
        };
        let gravity = match find_gravity(survey, &sensor_frame) {
            Ok(gravity) => {
                let source = survey.topics[gravity.topic].topic.name.clone();
                let why = "it tells what is down in the first scan, while it reads 1 g".to_owned();
                uses.push(Use { purpose: "gravity", source, why });
                Some(gravity)
            }
            Err(why) => {
                let taken = match camera {
                    None => "The first scan is taken to be level",
                    Some(_) => {
                        "The first image is taken as if it was of a level sensor whose z points up: give --axes optical for a \
                         level camera that looks ahead"
                    }
                };
                missing.push(format!("no gravity: {why}. {taken}"));
                None
            }
        };
        Ok(Self { cloud, camera, sensor_frame, odometry, gravity, uses, missing })
    }
}

/// The topic of clouds, and why it is this one.
fn find_cloud(survey: &LogSurvey, choice: &Choice) -> Result<(usize, String), ChoiceError> {
    let clouds: Vec<_> = survey
        .topics
        .iter()
        .enumerate()
        .filter(|(_, summary)| summary.messages > 0 && summary.has_points())
        .collect();
    let names =
        |topics: &mut dyn Iterator<Item = String>| match topics.take(TOPICS_LISTED).collect::<Vec<_>>() {
            none if none.is_empty() => "no topic at all".to_owned(),
            some => some.join(", "),
        };
    if clouds.is_empty() {
        let named = |summary: &TopicSummary| {
            let Topic { name, type_name, encoding } = &summary.topic;
            format!("{} ({}, {})", excerpt(name), excerpt(type_name), excerpt(encoding))
        };
        return Err(ChoiceError::NoClouds(names(&mut survey.topics.iter().map(named))));
    }
    if let Some(asked) = &choice.cloud {
        let found = clouds.iter().find(|(_, summary)| summary.topic.name == *asked);
        let there = || names(&mut clouds.iter().map(|(_, summary)| excerpt(&summary.topic.name)));
        let (k, _) =
            found.ok_or_else(|| ChoiceError::NoSuchCloud { asked: asked.clone(), there: there() })?;
        return Ok((*k, format!("--cloud {asked}")));
    }
    let best = clouds.iter().max_by_key(|(k, summary)| {
        let is_planar = summary.kind() == Some(MessageKind::LaserScan);
        let is_image = summary.kind() == Some(MessageKind::Image);
        (!is_planar, !is_image, summary.bytes, std::cmp::Reverse(*k))
    });
    // There is one, or it would have been refused.
    let k = best.map_or(0, |(k, _)| *k);
    let why = match clouds.len() {
        1 => "it is the only topic of clouds".to_owned(),
        more => format!("of {more} topics of clouds it has the most bytes; --cloud names another"),
    };
    Ok((k, why))
}

/// The camera of a topic of depth images, by the CameraInfo beside it (REP 104); none of other clouds.
fn find_camera(survey: &LogSurvey, images: &TopicSummary) -> Result<Option<Camera>, ChoiceError> {
    if images.kind() != Some(MessageKind::Image) {
        return Ok(None);
    }
    let topic = &images.topic.name;
    let error = |why: String| ChoiceError::Camera { topic: excerpt(topic), why };
    let name = match topic.rsplit_once('/') {
        Some((folder, _)) => format!("{folder}/{CAMERA_INFO}"),
        None => CAMERA_INFO.to_owned(),
    };
    let info = survey.topics.iter().find(|summary| summary.topic.name == name);
    let info = info.and_then(|summary| summary.camera_info.as_ref());
    let info =
        info.ok_or_else(|| error(format!("there is no sensor_msgs/CameraInfo at {}", excerpt(&name))))?;
    Camera::of(info, topic).map(Some).map_err(|why| error(why.to_string()))
}

fn note_times(summary: &TopicSummary, choice: &Choice, uses: &mut Vec<Use>, missing: &mut Vec<String>) {
    if let Some(times) = &choice.times {
        uses.push(Use { purpose: "times", source: times.to_string(), why: "--times".to_owned() });
        return;
    }
    match &summary.times {
        Some(Ok((rule, doubts))) => {
            let source = format!("of points, in {} from {}", rule.unit.as_str(), rule.from.as_str());
            let why = "in this unit a sweep lasts 1 ms to 1 s".to_owned();
            uses.push(Use { purpose: "times", source, why });
            missing.extend(doubts.iter().cloned());
        }
        Some(Err(why)) => {
            missing.push(format!(
                "no times of points: {why}. Clouds are mapped as if each was measured at once"
            ));
        }
        None => {}
    }
}

fn describe(survey: &LogSurvey, odometry: &OdometrySource) -> String {
    match odometry {
        OdometrySource::None => "none".to_owned(),
        OdometrySource::Frame { odometry, moving } => {
            format!("frame {:?} in frame {:?} by /tf", excerpt(moving), excerpt(odometry))
        }
        OdometrySource::Topic { topic, moving } => {
            format!("{} of frame {:?}", survey.topics[*topic].topic.name, excerpt(moving))
        }
    }
}

/// The accelerometer with the most messages of which it is known where it is.
fn find_gravity(survey: &LogSurvey, sensor: &str) -> Result<GravitySource, String> {
    let topics = survey.topics.iter().enumerate();
    let imus = topics.filter(|(_, summary)| summary.kind() == Some(MessageKind::Imu) && summary.messages > 0);
    let Some((topic, summary)) = imus.max_by_key(|(k, summary)| (summary.messages, std::cmp::Reverse(*k)))
    else {
        return Err("there is no topic of sensor_msgs/Imu".to_owned());
    };
    let frame = summary.frame.as_deref().unwrap_or_default();
    match survey.fixed.transform(sensor, frame, 0, 0) {
        Ok(sensor_from_imu) => Ok(GravitySource { topic, sensor_from_imu }),
        Err(why) => Err(format!(
            "where {} (frame {frame:?}) is on the sensor is not known: {why}",
            summary.topic.name
        )),
    }
}
