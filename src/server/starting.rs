//! HTTP while the maps are being opened: the same socket, and answers of its own.

use std::sync::Arc;

use tokio::net::TcpListener;
use tokio::task::JoinHandle;
use tokio::time::timeout;
use tokio_util::sync::CancellationToken;

use super::{CLOSING_MAX, Listener, ServerError};
use crate::http;
use crate::store::OpeningProgress;

/// Answers until the maps are open.
pub(super) struct Starting {
    serving: JoinHandle<()>,
    opened: CancellationToken,
}

impl Starting {
    /// Begins to answer on `listener`, which comes back for the time when the maps are open.
    pub(super) fn serve(
        listener: Listener,
        progress: Arc<OpeningProgress>,
    ) -> Result<(Listener, Self), ServerError> {
        let Listener { tcp, address } = listener;
        let twins = || {
            let tcp = tcp.into_std()?;
            let twin = tcp.try_clone()?;
            Ok((TcpListener::from_std(tcp)?, TcpListener::from_std(twin)?))
        };
        let (tcp, twin) =
            twins().map_err(|error| ServerError::Listen { protocol: "http", address, error })?;
        let opened = CancellationToken::new();
        let serve = axum::serve(twin, http::starting(progress));
        let serve = serve.with_graceful_shutdown(opened.clone().cancelled_owned());
        let serving = tokio::spawn(async move { drop(serve.await) });
        Ok((Listener { tcp, address }, Self { serving, opened }))
    }

    /// Answers what was asked, and leaves the socket to the server.
    pub(super) async fn end(mut self) {
        self.opened.cancel();
        if timeout(CLOSING_MAX, &mut self.serving).await.is_err() {
            self.serving.abort();
        }
    }
}
