//! That a log has more.

use std::time::Duration;

use async_nats::Client;
use tokio::sync::watch;
use tokio_stream::StreamExt;

use super::names::LogNames;
use crate::engine::Engine;

/// Wakes whoever waits for more of a log, a moment after it was kept by its leader. It is a hint: news may be lost
/// while NATS is not reached, so whoever waits also looks now and then.
#[derive(Debug, Clone)]
pub struct News {
    engine: Engine,
    newest: watch::Receiver<u64>,
}

impl News {
    pub(super) fn of(engine: &Engine, newest: &watch::Receiver<u64>) -> Self {
        Self { engine: engine.clone(), newest: newest.clone() }
    }

    /// Number of the newest message that was heard of; 0 before the first.
    pub fn newest(&self) -> u64 {
        *self.newest.borrow()
    }

    /// Waits until there is one beyond this number, for so long at most. True where there is. Not for an async thread.
    pub fn wait_beyond(&mut self, sequence: u64, within: Duration) -> bool {
        let newest = &mut self.newest;
        let heard = newest.wait_for(|&newest| newest > sequence);
        self.engine.block_on(async { matches!(tokio::time::timeout(within, heard).await, Ok(Ok(_))) })
    }

    /// Waits until there is one beyond this number.
    pub async fn beyond(&mut self, sequence: u64) {
        // An error is the end of the log's handle: nobody has news any more, and who waits is not woken for that.
        if self.newest.wait_for(|&newest| newest > sequence).await.is_err() {
            std::future::pending().await
        }
    }
}

/// Listens until the connection ends.
pub(super) async fn listen(client: Client, names: LogNames, newest: watch::Sender<u64>) {
    let mut heard = match client.subscribe(names.news.clone()).await {
        Ok(heard) => heard,
        Err(error) => return tracing::warn!(stream = names.stream, %error, "no news of the log"),
    };
    while let Some(message) = heard.next().await {
        let headers = message.headers.unwrap_or_default();
        let sequence = headers.get("Nats-Sequence").and_then(|value| value.as_str().parse().ok());
        if let Some(sequence) = sequence {
            newest.send_if_modified(|newest| {
                let is_news = sequence != *newest;
                *newest = sequence;
                is_news
            });
        }
    }
}
