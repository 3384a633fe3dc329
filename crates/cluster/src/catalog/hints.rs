//! That the list of maps was changed.

use tokio::sync::watch;
use tokio::task::JoinHandle;
use tokio_stream::StreamExt;

use crate::engine::Engine;

/// Wakes whoever follows the list, a moment after it was changed. A hint: some may be lost while NATS is not reached,
/// so whoever follows also looks now and then.
#[derive(Debug)]
pub struct Hints {
    heard: watch::Receiver<u64>,
    listener: JoinHandle<()>,
}

impl Hints {
    /// Of what is published under a subject.
    pub(super) fn of(engine: &Engine, subject: String) -> Self {
        let (tell, heard) = watch::channel(0_u64);
        let client = engine.client().clone();
        let listener = engine.spawn(async move {
            let Ok(mut changes) = client.subscribe(subject).await else { return };
            while changes.next().await.is_some() {
                tell.send_modify(|count| *count += 1);
            }
        });
        Self { heard, listener }
    }

    /// Waits for the next.
    pub async fn next(&mut self) {
        if self.heard.changed().await.is_err() {
            std::future::pending().await
        }
    }
}

impl Drop for Hints {
    fn drop(&mut self) {
        self.listener.abort();
    }
}
