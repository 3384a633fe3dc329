//! A message of a log, and its topic.

use crate::message::MessageKind;

/// A topic of a log.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Topic {
    /// Its name.
    pub name: String,
    /// The name of its type; empty where the log does not say.
    pub type_name: String,
    /// How its messages are encoded: `cdr` of ROS 2.
    pub encoding: String,
}

impl Topic {
    /// The kind of its messages, where they are read.
    pub fn kind(&self) -> Option<MessageKind> {
        MessageKind::of_type(&self.type_name).filter(|_| self.encoding == "cdr")
    }

    /// True of a topic whose transforms hold for ever.
    pub fn is_static(&self) -> bool {
        self.name.rsplit('/').next() == Some("tf_static")
    }
}

/// A message of a log.
#[derive(Debug, Clone, Copy)]
pub struct LogMessage<'a> {
    /// Number of its topic in [`Messages::topics`](super::Messages::topics).
    pub topic: usize,
    /// When it was recorded, nanoseconds.
    pub log_time_ns: u64,
    /// Its bytes, encoded as the topic says.
    pub data: &'a [u8],
}

/// Bytes of a topic's name, or of its type's, at most.
const NAME_BYTES_MAX: usize = 1024;

/// True of a name that can be told: others, and what they name, are left out.
pub(super) fn is_name(name: &str) -> bool {
    name.len() <= NAME_BYTES_MAX && !name.contains(char::is_control)
}
