//! What tells the process to end, or to read its files again.

use std::time::Duration;

use tokio::signal::unix::{Signal, SignalKind, signal};

use super::files::ReloadableFiles;

/// Waits for the process to be told to end: ctrl-c or SIGTERM.
pub async fn shutdown_signal() {
    let interrupted = async {
        if let Err(error) = tokio::signal::ctrl_c().await {
            tracing::error!(%error, "ctrl-c cannot be heard");
            std::future::pending().await
        }
    };
    tokio::select! {
        () = interrupted => {}
        () = terminated() => {}
    }
}

async fn terminated() {
    match signal(SignalKind::terminate()) {
        Ok(mut signal) => {
            signal.recv().await;
        }
        Err(error) => {
            tracing::error!(%error, "sigterm cannot be heard");
            std::future::pending().await
        }
    }
}

/// Exit code of a server that was told to end a second time: as of a program that ctrl-c ended.
const INTERRUPTED: i32 = 130;

/// Exit code of a server that could not go down within its bound.
const STUCK: i32 = 1;

/// Ends the process at once when it is told to end: for a server that is going down, and is told a second time that it
/// takes too long. What was acknowledged as synced is in the journal.
pub async fn exit_when_told() {
    shutdown_signal().await;
    tracing::warn!("told to end a second time: ends at once, requests in flight are lost");
    std::process::exit(INTERRUPTED);
}

/// Ends the process after `bound`, should it still be there: a thread that hangs in a read or a write of a disk cannot
/// be ended, and would keep the process for as long as the disk hangs. It needs nothing of the runtime, whose threads
/// may hang as well.
pub fn exit_after(bound: Duration) {
    let watch = move || {
        std::thread::sleep(bound);
        tracing::error!(
            ?bound,
            "the server did not go down within its bound: ends now; what was acknowledged is kept"
        );
        std::process::exit(STUCK);
    };
    if let Err(error) = std::thread::Builder::new().name("mrol-exit".into()).spawn(watch) {
        tracing::error!(%error, "no thread watches over the bound of going down");
    }
}

/// The hangup signals of the process (SIGHUP), which mean "read your files again" and end nothing from the moment that
/// this is made.
#[derive(Debug)]
pub struct Hangups(Option<Signal>);

impl Hangups {
    /// Begins to hear them.
    pub fn hear() -> Self {
        let heard = signal(SignalKind::hangup());
        Self(heard.inspect_err(|error| tracing::error!(%error, "sighup cannot be heard")).ok())
    }

    /// Reads `files` again at each signal, for ever.
    pub async fn reload(self, files: ReloadableFiles) {
        let Some(mut signals) = self.0 else { return };
        while signals.recv().await.is_some() {
            if files.exist() {
                files.reload().await;
            } else {
                tracing::info!("sighup: there are no files to read again");
            }
        }
    }
}
