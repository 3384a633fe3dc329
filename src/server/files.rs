//! Files that may change while the server runs.

use super::tls::Tls;
use crate::access::Access;
use crate::reload::{Reload, Reloaded};
use crate::telemetry::Metrics;

/// What of a server's settings is read again. A clone is another handle on the same.
#[derive(Debug, Clone)]
pub struct ReloadedFiles {
    access: Access,
    tls: Option<Tls>,
    metrics: Metrics,
}

/// What the files are called in the log and metrics.
const KEYS: &str = "keys";
const CERTIFICATES: &str = "certificates";

/// How to look at a file.
#[derive(Debug, Clone, Copy)]
enum Look {
    IfChanged,
    Anyway,
}

impl Look {
    fn at<T, E: ToString>(self, files: &Reloaded<T, E>) -> Reload<E> {
        match self {
            Self::IfChanged => files.refresh(),
            Self::Anyway => files.reload(),
        }
    }
}

impl ReloadedFiles {
    pub(super) fn new(access: Access, tls: Option<Tls>, metrics: Metrics) -> Self {
        for (file, is_there) in [(KEYS, access.keys().is_some()), (CERTIFICATES, tls.is_some())] {
            if is_there {
                metrics.file_reload(file, true);
            }
        }
        Self { access, tls, metrics }
    }

    /// True where there are any.
    pub fn exist(&self) -> bool {
        self.access.keys().is_some() || self.tls.is_some()
    }

    /// Reads those that changed. One that cannot be used is logged and counted, and what it held before goes on.
    pub async fn refresh(&self) {
        self.look(Look::IfChanged).await;
    }

    /// Reads them, changed or not.
    pub async fn reload(&self) {
        self.look(Look::Anyway).await;
    }

    async fn look(&self, look: Look) {
        let files = self.clone();
        // A file system may take its time.
        let looked = tokio::task::spawn_blocking(move || {
            files.tell(KEYS, files.access.keys().map(|keys| look.at(keys)));
            files.tell(CERTIFICATES, files.tls.as_ref().map(|tls| look.at(tls.files())));
        });
        if let Err(error) = looked.await {
            tracing::error!(%error, "files cannot be looked at");
        }
    }

    fn tell(&self, file: &'static str, reload: Option<Reload<impl ToString>>) {
        match reload {
            None | Some(Reload::Unchanged) => {}
            Some(Reload::Anew) => {
                tracing::info!(file, "in force");
                self.metrics.file_reload(file, true);
            }
            Some(Reload::Refused(error)) => {
                tracing::error!(
                    file,
                    error = error.to_string(),
                    "cannot be used: what it held before stays in force"
                );
                self.metrics.file_reload(file, false);
            }
        }
    }
}
