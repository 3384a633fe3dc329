//! How a connection begins.

use std::time::Duration;

use async_nats::{Client, ConnectErrorKind, ConnectOptions, Event};
use serde::de::IgnoredAny;
use tokio::runtime::Builder;

use super::api::CallError;
use super::connect_error::ConnectError;
use super::connection::Engine;
use super::request::Unanswered;
use super::settings::{Credentials, EngineSettings};

/// How often the server is asked whether it is there. The client gives a connection up at the third question while
/// two are not answered: after three seconds, where its default takes minutes. (A stopped server keeps its
/// connections open.)
const PING_EVERY: Duration = Duration::from_secs(1);

/// How long a server may take to greet. On one network it takes milliseconds; a server that is stopped never does.
const GREETING_MAX: Duration = Duration::from_secs(2);

/// Longest pause between attempts to connect again: short beside the seconds that an election takes.
const RECONNECT_PAUSE_MAX: Duration = Duration::from_millis(500);

/// Bytes that a message may need: 768 KiB of frames with headers.
const MESSAGE_MAX: usize = 800 << 10;

impl Engine {
    /// Connects, and makes sure that JetStream answers. Waits for some seconds at most; not for an async thread.
    ///
    /// # Errors
    /// Says what to do.
    pub fn connect(settings: &EngineSettings) -> Result<Self, ConnectError> {
        let runtime = Builder::new_multi_thread()
            .worker_threads(1)
            .thread_name("nats")
            .enable_all()
            .build()
            .map_err(ConnectError::NoThread)?;
        let client = runtime.block_on(greeted(settings))?;
        let engine = Self::of(client, settings, runtime);
        check_server(&engine)?;
        engine.block_on(check_jetstream(&engine))?;
        Ok(engine)
    }
}

fn check_server(engine: &Engine) -> Result<(), ConnectError> {
    let (servers, info) = (engine.servers().to_owned(), engine.client().server_info());
    if !engine.client().is_server_compatible(2, 11, 0) {
        return Err(ConnectError::TooOld { servers, version: info.version });
    }
    if info.max_payload < MESSAGE_MAX {
        return Err(ConnectError::SmallPayload { servers, max_payload: info.max_payload });
    }
    Ok(())
}

/// Asks for the account's state, which the leader of all of JetStream answers.
async fn check_jetstream(engine: &Engine) -> Result<(), ConnectError> {
    let servers = engine.servers().to_owned();
    match engine.call::<IgnoredAny>("INFO", &(), GREETING_MAX).await {
        Ok(_) => Ok(()),
        Err(CallError::Api(error)) if error.is_no_leader() => {
            Err(ConnectError::NoQuorum { servers, cause: error.to_string() })
        }
        Err(error @ (CallError::Unanswered(Unanswered::NoResponders(_)) | CallError::Api(_))) => {
            Err(ConnectError::NoJetStream { servers, cause: error.to_string() })
        }
        Err(error) => Err(ConnectError::NoQuorum { servers, cause: error.to_string() }),
    }
}

/// A connection that a server greeted.
async fn greeted(settings: &EngineSettings) -> Result<Client, ConnectError> {
    let mut options = with_credentials(ConnectOptions::new(), &settings.credentials)?
        .name(&settings.name)
        .ping_interval(PING_EVERY)
        .connection_timeout(GREETING_MAX)
        .reconnect_delay_callback(reconnect_pause)
        .event_callback(async |event| tell(&event));
    if let Some((user, password)) = settings.user_and_password() {
        options = options.user_and_password(user.to_owned(), password.to_owned());
    }
    if let Some(path) = &settings.root_certificates {
        options = options.add_root_certificates(path.clone());
    }
    options.connect(&settings.urls).await.map_err(|error| {
        let (servers, cause) = (settings.servers(), error.to_string());
        match error.kind() {
            ConnectErrorKind::Authentication | ConnectErrorKind::AuthorizationViolation => {
                ConnectError::Unauthorized { servers, cause }
            }
            ConnectErrorKind::Tls => ConnectError::Tls { servers, cause },
            // The library has no kind for a certificate that is not trusted: "invalid peer certificate".
            ConnectErrorKind::Io if cause.contains("certificate") => ConnectError::Tls { servers, cause },
            _ => ConnectError::NoServer { servers, cause },
        }
    })
}

fn with_credentials(
    options: ConnectOptions,
    credentials: &Credentials,
) -> Result<ConnectOptions, ConnectError> {
    let (Credentials::CredentialsFile(path) | Credentials::NkeySeedFile(path)) = credentials else {
        return Ok(options);
    };
    let bad =
        |cause: std::io::Error| ConnectError::Credentials { path: path.clone(), cause: cause.to_string() };
    let text = std::fs::read_to_string(path).map_err(bad)?;
    match credentials {
        Credentials::NkeySeedFile(_) => Ok(options.nkey(text.trim().to_owned())),
        _ => options.credentials(&text).map_err(bad),
    }
}

/// How long the next attempt to connect waits.
fn reconnect_pause(attempts: usize) -> Duration {
    let doubled = Duration::from_millis(25) * (1 << attempts.min(5));
    doubled.min(RECONNECT_PAUSE_MAX)
}

fn tell(event: &Event) {
    match event {
        Event::Connected => tracing::info!("connected to NATS"),
        Event::Disconnected => tracing::warn!("the connection to NATS was lost"),
        other => tracing::warn!(event = %other, "NATS"),
    }
}
