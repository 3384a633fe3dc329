//! The topics and frames of a log.

use crate::cloud::is_depth;
use crate::frames::FrameTree;
use crate::log::{Damage, Topic};
use crate::message::{CameraInfo, MessageKind};
use crate::point_times::TimesRule;

/// The topics and frames of a log, collected from its begin to its end.
#[derive(Debug, Clone, Default)]
pub struct LogSurvey {
    /// The topics, in the order in which they were met.
    pub topics: Vec<TopicSummary>,
    /// All frames, as they hang together at the end.
    pub frames: FrameTree,
    /// The frames that are fixed in their parents, of all publishers: those that told it late as well.
    pub fixed: FrameTree,
    /// Time of the first and of the last message, as recorded, nanoseconds; none of a log without messages.
    pub span_ns: Option<(u64, u64)>,
    /// Where and why files end too early.
    pub damages: Vec<Damage>,
    /// What is wrong with transforms, each once.
    pub refused_transforms: Vec<String>,
    /// Where publishers of transforms contradict each other, each once.
    pub contradictions: Vec<String>,
}

/// A topic, and what its messages have.
#[derive(Debug, Clone)]
pub struct TopicSummary {
    /// Its name and type.
    pub topic: Topic,
    /// Number of messages.
    pub messages: u64,
    /// Bytes of all messages.
    pub bytes: u64,
    /// When its first and its last message were recorded, nanoseconds.
    pub span_ns: (u64, u64),
    /// Frame of its first message.
    pub frame: Option<String>,
    /// Of odometry: the frame that moves.
    pub child_frame: Option<String>,
    /// Stamp of its first message, nanoseconds.
    pub first_stamp_ns: Option<i64>,
    /// Checksum of its first message: two logs whose clocks begin at 0 differ in it.
    pub first_checksum: Option<u32>,
    /// Of clouds: how the times of points are read, and what is odd about it, or why there are none.
    pub times: Option<Result<(TimesRule, Vec<String>), String>>,
    /// Of images: what their pixels are.
    pub encoding: Option<String>,
    /// Of a camera: what is told of it first.
    pub camera_info: Option<CameraInfo>,
    /// Why the first message that cannot be read cannot.
    pub unreadable: Option<String>,
}

impl LogSurvey {
    /// What is wrong with transforms, and where their publishers contradict each other.
    pub fn oddities(&self) -> impl Iterator<Item = &String> {
        self.refused_transforms.iter().chain(&self.contradictions)
    }
}

impl TopicSummary {
    /// A topic of which no message was met.
    pub(super) fn new(topic: Topic) -> Self {
        Self {
            topic,
            messages: 0,
            bytes: 0,
            span_ns: (0, 0),
            frame: None,
            child_frame: None,
            first_stamp_ns: None,
            first_checksum: None,
            times: None,
            encoding: None,
            camera_info: None,
            unreadable: None,
        }
    }

    /// The kind of its messages, where they are read.
    pub fn kind(&self) -> Option<MessageKind> {
        self.topic.kind()
    }

    /// True of a topic whose messages have points.
    pub fn has_points(&self) -> bool {
        match self.kind() {
            Some(MessageKind::Image) => self.encoding.as_deref().is_some_and(is_depth),
            kind => kind.is_some_and(MessageKind::is_cloud),
        }
    }

    /// Messages a second, as recorded; none of fewer than two.
    pub fn rate_hz(&self) -> Option<f64> {
        let seconds = self.span_ns.1.saturating_sub(self.span_ns.0) as f64 * 1e-9;
        (self.messages > 1 && seconds > 0.0).then(|| (self.messages - 1) as f64 / seconds)
    }
}
