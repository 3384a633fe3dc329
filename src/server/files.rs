//! Files that may change while the server runs.

use std::sync::Arc;
use std::time::{Duration, Instant, SystemTime};

use tokio::time::{MissedTickBehavior, interval};

use super::expiry::Reminders;
use super::protocol::Protocol;
use super::tls::Tls;
use crate::access::Access;
use crate::access::{Reload, ReloadableFile};
use crate::admission::Lifecycle;
use crate::telemetry::Metrics;

/// How often files are looked at.
const INTERVAL: Duration = Duration::from_secs(1);

/// What of a server's settings is read again. A clone is another handle on the same.
#[derive(Debug, Clone)]
pub struct ReloadableFiles {
    access: Access,
    tls: Option<Tls>,
    metrics: Metrics,
    warnings: Warnings,
    reminders: Arc<Reminders>,
}

/// How long before something expires its administrator is told.
#[derive(Debug, Clone, Copy)]
pub(super) struct Warnings {
    pub(super) keys: Duration,
    pub(super) certificates: Duration,
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
    fn at<T, E: ToString>(self, files: &ReloadableFile<T, E>) -> Reload<E> {
        match self {
            Self::IfChanged => files.refresh(),
            Self::Anyway => files.reload(),
        }
    }
}

impl ReloadableFiles {
    pub(super) fn new(access: Access, tls: Option<Tls>, metrics: Metrics, warnings: Warnings) -> Self {
        for (file, is_there) in [(KEYS, access.keys().is_some()), (CERTIFICATES, tls.is_some())] {
            if is_there {
                metrics.file_reload(file, true);
            }
        }
        let files = Self { access, tls, metrics, warnings, reminders: Arc::default() };
        files.tell_of_certificates();
        files
    }

    /// True where there are any.
    pub fn exist(&self) -> bool {
        self.access.keys().is_some() || self.tls.is_some()
    }

    /// Looks at them every second until the server is draining. Keys and certificates are looked at side by side, and
    /// apart from everything else: a disk that keeps others waiting keeps no key in force.
    pub(super) async fn look_after(self, lifecycle: Lifecycle) {
        let often = || {
            let mut looking = interval(INTERVAL);
            looking.set_missed_tick_behavior(MissedTickBehavior::Delay);
            looking
        };
        let (mut expiry, mut keys, mut certificates) = (often(), often(), often());
        let expiring = async {
            loop {
                expiry.tick().await;
                // Needs no file, so that it waits for none.
                self.access.end_expired(SystemTime::now());
                self.tell_of_keys();
                self.tell_of_certificates();
            }
        };
        let keys = async {
            loop {
                keys.tick().await;
                self.look_at_keys(Look::IfChanged).await;
            }
        };
        let certificates = async {
            loop {
                certificates.tick().await;
                self.look_at_certificates(Look::IfChanged).await;
            }
        };
        tokio::select! {
            () = lifecycle.draining() => {}
            () = expiring => {}
            () = keys => {}
            () = certificates => {}
        }
    }

    /// Reads them, changed or not. One that cannot be used is logged and counted, and what it held before goes on.
    pub async fn reload(&self) {
        tokio::join!(self.look_at_keys(Look::Anyway), self.look_at_certificates(Look::Anyway));
    }

    async fn look_at_keys(&self, look: Look) {
        let files = self.clone();
        self.looked(move || files.tell(KEYS, files.access.keys().map(|keys| look.at(keys)))).await;
    }

    async fn look_at_certificates(&self, look: Look) {
        let files = self.clone();
        let looking = move || files.tell(CERTIFICATES, files.tls.as_ref().map(|tls| look.at(tls.files())));
        self.looked(looking).await;
    }

    /// A file system may take its time.
    async fn looked(&self, looking: impl FnOnce() + Send + 'static) {
        if let Err(error) = tokio::task::spawn_blocking(looking).await {
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

    fn tell_of_keys(&self) {
        for (key, expires) in self.access.expiring(SystemTime::now(), self.warnings.keys) {
            if self.reminders.is_due(format!("key {key} {expires}"), Instant::now()) {
                tracing::warn!(%key, %expires, "a secret of a key expires: a later `expires` in its table prolongs it, but for the former one of a key \
                     that was rotated");
            }
        }
    }

    fn tell_of_certificates(&self) {
        let Some(tls) = &self.tls else { return };
        for protocol in [Protocol::Http, Protocol::Grpc] {
            self.metrics.handshakes_failed(protocol.as_str(), tls.failures().count(protocol));
        }
        for expiry in tls.expiries() {
            let (setting, in_s) = (expiry.setting, expiry.in_s(SystemTime::now()));
            self.metrics.certificate_expires(setting, expiry.timestamp_s);
            let is_near = in_s <= self.warnings.certificates.as_secs().try_into().unwrap_or(i64::MAX);
            if !is_near || !self.reminders.is_due(format!("{setting} {}", expiry.timestamp_s), Instant::now())
            {
                continue;
            }
            match in_s {
                1.. => tracing::warn!(setting, days = in_s / (24 * 3600), "a certificate expires"),
                _ => tracing::error!(setting, "a certificate has expired: clients refuse it"),
            }
        }
    }
}
