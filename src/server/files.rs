//! Files that may change while the server runs.

use crate::access::Access;
use crate::reload::Reload;
use crate::telemetry::Metrics;

/// What of a server's settings is read again. A clone is another handle on the same.
#[derive(Debug, Clone)]
pub struct ReloadedFiles {
    access: Access,
    metrics: Metrics,
}

/// What the file of keys is called in the log and metrics.
const KEYS: &str = "keys";

/// How to look at a file.
#[derive(Debug, Clone, Copy)]
enum Look {
    IfChanged,
    Anyway,
}

impl ReloadedFiles {
    pub(super) fn new(access: Access, metrics: Metrics) -> Self {
        if access.keys().is_some() {
            metrics.file_in_force(KEYS, true);
        }
        Self { access, metrics }
    }

    /// True where there are any.
    pub fn exist(&self) -> bool {
        self.access.keys().is_some()
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
            let keys = files.access.keys().map(|keys| match look {
                Look::IfChanged => keys.refresh(),
                Look::Anyway => keys.reload(),
            });
            files.tell(KEYS, keys);
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
                self.metrics.file_in_force(file, true);
            }
            Some(Reload::Refused(error)) => {
                tracing::error!(
                    file,
                    error = error.to_string(),
                    "cannot be used: what it held before stays in force"
                );
                self.metrics.file_in_force(file, false);
            }
        }
    }
}
