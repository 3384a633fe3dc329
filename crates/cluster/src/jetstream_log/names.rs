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

    /// The subjects of all messages.
    pub(super) fn subjects(&self) -> String {
        format!("{}.*", self.prefix)
    }
}
