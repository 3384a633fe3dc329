//! What the log of a map is called at NATS.

use uuid::Uuid;

/// What the log of a map is called at NATS.
#[derive(Debug, Clone)]
pub(super) struct LogNames {
    /// Of the stream.
    pub(super) stream: String,
    /// Where a message was kept is said here, without its payload.
    pub(super) news: String,
    /// Of the messages, but for their ids.
    prefix: String,
}

impl LogNames {
    /// Of the log of the map with this uuid.
    pub(super) fn of(map: Uuid) -> Self {
        Self {
            stream: format!("mrol-{map}"),
            news: format!("mrol.news.{map}"),
            prefix: format!("mrol.log.{map}"),
        }
    }

    /// The subject of the message with this id.
    pub(super) fn subject(&self, id: Uuid) -> String {
        format!("{}.{id}", self.prefix)
    }

    /// The id of the message with this subject.
    pub(super) fn id_of(&self, subject: &str) -> Option<Uuid> {
        subject.strip_prefix(&self.prefix)?.strip_prefix('.')?.parse().ok()
    }

    /// A subject of no message, to which the stream listens all the same.
    pub(super) fn nothing(&self) -> String {
        format!("{}.nothing", self.prefix)
    }

    /// The subjects of all messages.
    pub(super) fn subjects(&self) -> String {
        format!("{}.*", self.prefix)
    }
}
