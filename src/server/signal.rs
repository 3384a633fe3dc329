//! What tells the process to end, or to read its files again.

use super::ReloadedFiles;

/// Waits for the process to be told to end: ctrl-c, or SIGTERM where there is one.
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

#[cfg(unix)]
async fn terminated() {
    use tokio::signal::unix::{SignalKind, signal};
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

#[cfg(not(unix))]
async fn terminated() {
    std::future::pending().await
}

/// Exit code of a server that was told to end a second time: as of a program that ctrl-c ended.
const INTERRUPTED: i32 = 130;

/// Ends the process at once when it is told to end: for a server that is going down, and is told a second time that it
/// takes too long. What was acknowledged as synced is in the journal.
pub async fn exit_when_told() {
    shutdown_signal().await;
    tracing::warn!("told to end a second time: ends at once, requests in flight are lost");
    std::process::exit(INTERRUPTED);
}

/// Reads `files` again each time that the process gets SIGHUP, for ever. Where there are none, the signal keeps its
/// meaning and ends the process.
pub async fn reload_on_hangup(files: ReloadedFiles) {
    use tokio::signal::unix::{SignalKind, signal};
    if !files.exist() {
        return;
    }
    match signal(SignalKind::hangup()) {
        Ok(mut signal) => {
            while signal.recv().await.is_some() {
                files.reload().await;
            }
        }
        Err(error) => tracing::error!(%error, "sighup cannot be heard"),
    }
}
