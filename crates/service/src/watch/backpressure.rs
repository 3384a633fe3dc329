//! Messages on their way to a client that reads them when it likes.

use std::time::Duration;

use tokio::sync::mpsc;
use tokio_stream::wrappers::ReceiverStream;
use tokio_stream::{Stream, StreamExt};

use crate::error::{Reason, ServiceError};
use mrol_map::sync::polled_by_runtime;

/// A source of messages, one after the other.
pub(crate) trait Teller: Send + 'static {
    /// A message.
    type Message: Send + 'static;

    /// The next message, once there is one. After an error comes no other.
    fn tell(&mut self) -> impl Future<Output = Result<Self::Message, ServiceError>> + Send;

    /// True of a message after which none comes.
    fn is_last(_: &Self::Message) -> bool {
        false
    }
}

/// The messages as a stream, which ends with its first error: that of `end`, once it comes, or `watch_stalled` where
/// the client took no message for `unread_max_s`.
///
/// A message is made when there is room for it on the way: nothing piles up for slow readers.
pub(crate) fn stream_of<T: Teller>(
    mut teller: T,
    unread_max_s: f64,
    end: impl Future<Output = ServiceError> + Send + 'static,
) -> impl Stream<Item = Result<T::Message, ServiceError>> + Send {
    let patience = Duration::from_secs_f64(unread_max_s);
    let (outbox, messages) = mpsc::channel(1);
    let telling = async move {
        let mut end = std::pin::pin!(end);
        loop {
            let message = tokio::select! {
                biased;
                () = outbox.closed() => return,
                reason = &mut end => Err(reason),
                message = teller.tell() => message,
            };
            let is_last = message.as_ref().map_or(true, T::is_last);
            let sent = tokio::time::timeout(patience, outbox.send(message)).await;
            if is_last || !matches!(sent, Ok(Ok(()))) {
                return;
            }
        }
    };
    tokio::spawn(polled_by_runtime(telling));
    let message = format!("watch_unread_max_s is {unread_max_s}: the client took no message for that long");
    let stalled = ServiceError::new(Reason::WatchStalled, message);
    let mut has_ended = false;
    ReceiverStream::new(messages).chain(tokio_stream::once(Err(stalled))).map_while(move |message| {
        let message = (!has_ended).then_some(message)?;
        has_ended = message.as_ref().map_or(true, T::is_last);
        Some(message)
    })
}
