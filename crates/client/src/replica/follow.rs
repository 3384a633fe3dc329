//! How a replica follows its map.

use std::sync::Arc;
use std::time::{Duration, Instant};

use parking_lot::{Mutex, RwLock};
use rand::RngExt;
use tokio::sync::watch;
use tonic::Code;

use super::copy::{Applied, Builder};
use super::error::ReplicaError;
use super::options::ReplicaOptions;
use super::shared::Shared;
use super::status::ReplicaStatus;
use crate::answers::Answers;
use crate::client::Client;
use crate::error::ClientError;
use mrol_map::map::MapName;
use mrol_service::{WatchForm, WatchMessage, WatchRequest};

/// Shortest and longest pause before the server is asked again, less a random part of up to a half.
const PAUSE: Duration = Duration::from_millis(100);
const PAUSE_MAX: Duration = Duration::from_secs(5);

/// How often in a row a server refuses a key before it is not asked again: it writes a line of its audit each time, and
/// a key that was withdrawn comes back by no asking.
const KEY_REFUSALS_MAX: u32 = 4;

/// True where the server does not know the key, or does not let its holder watch the map.
fn refuses_key(error: &ClientError) -> bool {
    let codes = [Code::Unauthenticated, Code::PermissionDenied];
    matches!(error, ClientError::Refused { code, .. } if codes.contains(code))
}

/// Follows a map.
#[derive(Debug)]
pub(super) struct Follower {
    client: Client,
    map: MapName,
    options: ReplicaOptions,
    /// Away while a thread applies a message.
    builder: Option<Builder>,
    pause: Duration,
}

impl Follower {
    pub(super) fn new(client: Client, map: MapName, options: ReplicaOptions) -> Self {
        let builder = Some(Builder::new(&options));
        Self { client, map, options, builder, pause: PAUSE }
    }

    /// Watches the map from the last revision of the copy on.
    async fn watch(&mut self) -> Result<Answers<WatchMessage>, ClientError> {
        let since = self.builder.as_mut().and_then(|builder| {
            builder.begin();
            builder.since()
        });
        if let Some(since) = &since {
            self.client.wait_to_go_on(&self.map, since).await;
        }
        let request = WatchRequest {
            since,
            region: self.options.region,
            form: WatchForm::Changes,
            viewpoints: self.options.viewpoint_bytes_max > 0,
        };
        self.client.watch(&self.map, request).await
    }

    /// Applies a message, on a thread that may wait for readers of the copy.
    async fn apply(&mut self, message: WatchMessage) -> Result<Applied, ReplicaError> {
        if matches!(message.event, mrol_service::WatchEvent::Heartbeat) {
            return Ok(Applied::Nothing);
        }
        let lost = || ReplicaError::Damaged("the thread that copies has panicked".into());
        let Some(mut builder) = self.builder.take() else { return Err(lost()) };
        let applying = tokio::task::spawn_blocking(move || {
            let applied = builder.apply(message);
            (builder, applied)
        });
        let (builder, applied) = applying.await.map_err(|_| lost())?;
        self.builder = Some(builder);
        applied
    }

    /// Copies the map for the first time; what is shared with readers, and the watch that goes on.
    pub(super) async fn copy_first(&mut self) -> Result<(Arc<Shared>, Answers<WatchMessage>), ReplicaError> {
        let mut watched = self.watch().await?;
        loop {
            let silence_max = self.options.silence_max;
            let message = tokio::time::timeout(silence_max, watched.next()).await;
            let message = message.map_err(|_| ReplicaError::Silent(silence_max))?;
            let Some(message) = message else {
                return Err(ReplicaError::Damaged("the watch ended before the state was complete".into()));
            };
            let message = message?;
            let (head_revision, map_uuid) = (message.head_revision, message.map_uuid);
            if let Applied::Replaced(copied) = self.apply(message).await? {
                let version = copied.map.content_version();
                let status = ReplicaStatus {
                    map_uuid,
                    version,
                    head_revision: head_revision.max(version.revision),
                    is_connected: true,
                    resets: 1,
                    last_error: None,
                    has_ended: false,
                };
                let (copied, status) = (RwLock::new(copied), watch::Sender::new(status));
                let heard = Mutex::new(Instant::now());
                return Ok((Arc::new(Shared { copied, status, heard }), watched));
            }
        }
    }

    /// Follows the map for as long as it is not aborted, and its key not refused again and again.
    pub(super) async fn run(mut self, shared: Arc<Shared>, mut watched: Answers<WatchMessage>) {
        loop {
            let error = self.follow(&shared, &mut watched).await;
            let mut refusals = 0;
            watched = loop {
                shared.tell(|status| status.is_connected = false);
                shared.tell(|status| status.last_error.clone_from(&error));
                self.take_a_break().await;
                match self.watch().await {
                    Ok(watched) => break watched,
                    Err(error) => {
                        refusals = if refuses_key(&error) { refusals + 1 } else { 0 };
                        shared.tell(|status| status.last_error = Some(error.to_string()));
                        if refusals >= KEY_REFUSALS_MAX {
                            shared.tell(|status| status.has_ended = true);
                            return;
                        }
                    }
                }
            };
        }
    }

    /// Applies what a watch tells until it ends; why it ended.
    async fn follow(&mut self, shared: &Shared, watched: &mut Answers<WatchMessage>) -> Option<String> {
        loop {
            let silence_max = self.options.silence_max;
            let message = match tokio::time::timeout(silence_max, watched.next()).await {
                Err(_) => return Some(ReplicaError::Silent(silence_max).to_string()),
                Ok(None) => return None,
                Ok(Some(Err(error))) => return Some(error.to_string()),
                Ok(Some(Ok(message))) => message,
            };
            shared.hear();
            let head_revision = message.head_revision;
            match self.apply(message).await {
                Ok(applied) => {
                    self.pause = PAUSE;
                    shared.take(applied, head_revision);
                }
                Err(error) => {
                    // Whatever went wrong with it, the copy is made anew.
                    match &mut self.builder {
                        Some(builder) => builder.forget(),
                        lost => *lost = Some(Builder::new(&self.options)),
                    }
                    return Some(error.to_string());
                }
            }
        }
    }

    /// Waits before the server is asked again, longer each time.
    async fn take_a_break(&mut self) {
        let share = rand::rng().random_range(0.5..=1.0);
        tokio::time::sleep(self.pause.mul_f64(share)).await;
        self.pause = (2 * self.pause).min(PAUSE_MAX);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_that_is_refused_is_told_from_a_server_that_is_away() {
        let refused = |code| {
            let (reason, message, retry_after, elsewhere) = (None, String::new(), None, Vec::new());
            refuses_key(&ClientError::Refused { code, reason, message, retry_after, elsewhere })
        };
        assert!(refused(Code::Unauthenticated) && refused(Code::PermissionDenied));
        assert!(![Code::Unavailable, Code::NotFound, Code::ResourceExhausted].into_iter().any(refused));
        assert!(!refuses_key(&ClientError::Lost { url: String::new(), cause: String::new() }));
    }
}
