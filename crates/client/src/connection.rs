//! The client's connection: address, limits and flow-control windows.

use std::error::Error;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use tokio_stream::StreamExt;
use tonic::service::interceptor::InterceptedService;
use tonic::transport::{Channel, Endpoint};
use tonic::{ConnectError, Response, Status, Streaming};

use super::answers::Answers;
use super::credentials::{Credentials, Shown};
use super::error::{ClientError, root_cause};
use crate::wire::{pb, transport};
use mrol_map::map::CallerName;
use mrol_service::ServiceError;
use mrol_service::replication::NodeName;
use pb::mapping_client::MappingClient;
use pb::maps_client::MapsClient;
use pb::occupancy_client::OccupancyClient;

const CONNECT_TIMEOUT: Duration = Duration::from_secs(10);

/// A channel to a server, with what calls show and the address that error messages name.
#[derive(Debug, Clone)]
pub(super) struct Connection {
    channel: Channel,
    shown: Shown,
    url: Arc<str>,
    /// Of one that is replaced when its server is gone: true once it was found to be, or said that it goes.
    is_gone: Option<Arc<AtomicBool>>,
}

/// A channel that adds to every call what it shows.
type Keyed = InterceptedService<Channel, Shown>;

impl Connection {
    pub(super) async fn open(url: &str, credentials: &Credentials) -> Result<Self, ClientError> {
        Self::open_within(url, credentials, CONNECT_TIMEOUT).await
    }

    async fn open_within(
        url: &str,
        credentials: &Credentials,
        timeout: Duration,
    ) -> Result<Self, ClientError> {
        Address::parse(url, credentials)?.connect(credentials, timeout).await
    }

    /// The same connection, for calls that the node `node` forwards for a caller of its own.
    pub(super) fn forwarding(self, node: &NodeName, caller: Option<&CallerName>) -> Self {
        Self { shown: self.shown.forwarded(node, caller), ..self }
    }

    /// The same connection, for who replaces it once the server is gone, by one to another address or by a new one.
    pub(super) fn replaceable(self) -> Self {
        Self { is_gone: Some(Arc::default()), ..self }
    }

    /// True once a call over this connection found the server gone.
    pub(super) fn is_gone(&self) -> bool {
        self.is_gone.as_ref().is_some_and(|gone| gone.load(Ordering::Relaxed))
    }

    /// Lets later calls use another connection.
    pub(super) fn give_up(&self) {
        if let Some(gone) = &self.is_gone {
            gone.store(true, Ordering::Relaxed);
        }
    }

    pub(super) fn channel(&self) -> Channel {
        self.channel.clone()
    }

    pub(super) fn occupancy(&self) -> OccupancyClient<Keyed> {
        OccupancyClient::with_interceptor(self.channel(), self.shown.clone())
            .max_decoding_message_size(transport::MESSAGE_BYTES_MAX)
    }

    pub(super) fn mapping(&self) -> MappingClient<Keyed> {
        MappingClient::with_interceptor(self.channel(), self.shown.clone())
            .max_decoding_message_size(transport::MESSAGE_BYTES_MAX)
    }

    pub(super) fn maps(&self) -> MapsClient<Keyed> {
        MapsClient::with_interceptor(self.channel(), self.shown.clone())
            .max_decoding_message_size(transport::MESSAGE_BYTES_MAX)
    }

    /// The error that a status is. Where the connection is replaced, a call that was never sent is told from one that
    /// was.
    pub(super) fn failure(&self, status: &Status) -> ClientError {
        let error = ClientError::of(&self.url, status);
        if self.is_gone.is_none() || !matches!(error, ClientError::Lost { .. }) {
            return error;
        }
        self.give_up();
        match status.source().and_then(unsent) {
            Some(cause) => ClientError::Unreachable { url: self.url.to_string(), cause: root_cause(cause) },
            None => error,
        }
    }

    /// Converts an answer to domain types.
    pub(super) fn domain<M, T>(&self, answer: Result<Response<M>, Status>) -> Result<T, ClientError>
    where
        M: TryInto<T, Error = ServiceError>,
    {
        let answer = answer.map_err(|status| self.failure(&status))?;
        answer.into_inner().try_into().map_err(ClientError::Answer)
    }

    /// Converts the messages of a stream to domain types.
    pub(super) fn answers<M, T>(
        &self,
        answers: Result<Response<Streaming<M>>, Status>,
    ) -> Result<Answers<T>, ClientError>
    where
        M: TryInto<T, Error = ServiceError> + Send + 'static,
        T: 'static,
    {
        let answers = answers.map_err(|status| self.failure(&status))?.into_inner();
        let connection = self.clone();
        Ok(Answers::new(answers.map(move |answer| {
            let answer = answer.map_err(|status| connection.failure(&status))?;
            answer.try_into().map_err(ClientError::Answer)
        })))
    }
}

/// How often a server that is asked something is looked for, where another could be asked instead,
const KEEPALIVE_INTERVAL: Duration = Duration::from_secs(2);
/// and how long it may take to answer that, before its connection counts as lost.
const KEEPALIVE_TIMEOUT: Duration = Duration::from_secs(5);

/// Where a server is, and how it is connected to.
#[derive(Debug, Clone)]
pub(super) struct Address {
    /// In full, with its scheme.
    pub(super) url: String,
    endpoint: Endpoint,
}

impl Address {
    /// Parses an address.
    ///
    /// # Errors
    /// When it is not valid, or of no use with these credentials.
    pub(super) fn parse(url: &str, credentials: &Credentials) -> Result<Self, ClientError> {
        let (url, endpoint) = endpoint(url, credentials)?;
        Ok(Self { url, endpoint })
    }

    /// The same, where a server that does not answer any more is found out within seconds.
    pub(super) fn with_keepalive(self) -> Self {
        let endpoint = self.endpoint.http2_keep_alive_interval(KEEPALIVE_INTERVAL);
        Self { endpoint: endpoint.keep_alive_timeout(KEEPALIVE_TIMEOUT), ..self }
    }

    /// The same, for many watches of which each may stand still without keeping room from others.
    pub(super) fn with_windows_of_watches(self) -> Self {
        let endpoint = self.endpoint.initial_stream_window_size(transport::WATCH_WINDOW_BYTES);
        Self { endpoint: endpoint.initial_connection_window_size(transport::WATCHES_WINDOW_BYTES), ..self }
    }

    /// A channel that connects when it is used. It must be called in a runtime.
    pub(super) fn lazy_channel(&self) -> Channel {
        self.endpoint.connect_lazy()
    }

    /// Connects within `timeout`.
    ///
    /// # Errors
    /// When no server answers there, or the two do not trust each other.
    pub(super) async fn connect(
        &self,
        credentials: &Credentials,
        timeout: Duration,
    ) -> Result<Connection, ClientError> {
        let url = self.url.clone();
        let connecting = self.endpoint.clone().connect_timeout(timeout);
        match tokio::time::timeout(timeout, connecting.connect()).await {
            Ok(Ok(channel)) => {
                Ok(Connection { channel, shown: credentials.shown(), url: url.into(), is_gone: None })
            }
            Ok(Err(error)) if !is_timeout(&error) => Err(ClientError::unreachable(url, &error)),
            Ok(Err(_)) | Err(_) => {
                let cause = format!("no answer within {} s", timeout.as_secs_f64());
                Err(ClientError::Unreachable { url, cause })
            }
        }
    }
}

/// The error in a chain of causes that says that nothing was sent: no connection was made, or it had ended before the
/// request's turn came, which hyper calls canceled.
fn unsent<'e>(error: &'e (dyn Error + 'static)) -> Option<&'e (dyn Error + 'static)> {
    let is_canceled = error.downcast_ref::<hyper::Error>().is_some_and(hyper::Error::is_canceled);
    if is_canceled || error.is::<ConnectError>() { Some(error) } else { error.source().and_then(unsent) }
}

/// True of an error that comes of the time which connecting may take.
fn is_timeout(error: &(dyn Error + 'static)) -> bool {
    let is_one = error.is::<tokio::time::error::Elapsed>()
        || error.downcast_ref::<io::Error>().is_some_and(|error| error.kind() == io::ErrorKind::TimedOut);
    is_one || error.source().is_some_and(is_timeout)
}

/// Parses `url`; returns it in full, with the endpoint to connect to.
fn endpoint(url: &str, credentials: &Credentials) -> Result<(String, Endpoint), ClientError> {
    let refused = |problem: &str| ClientError::Url { url: url.to_owned(), problem: problem.to_owned() };
    let full = match url.starts_with("unix:") || url.contains("://") {
        true => url.to_owned(),
        false if credentials.want_tls() => format!("https://{url}"),
        false => format!("http://{url}"),
    };
    let is_secure = full.starts_with("https://");
    if !is_secure && !full.starts_with("http://") && !full.starts_with("unix:") {
        return Err(refused("only http://, https:// and unix: are spoken"));
    }
    if !is_secure && credentials.want_tls() {
        return Err(refused("certificates are of no use but with https://"));
    }
    let endpoint = Endpoint::from_shared(full.clone()).map_err(|error| refused(&error.to_string()))?;
    let endpoint = if is_secure { secured(endpoint, credentials)? } else { endpoint };
    let endpoint = endpoint
        .tcp_nodelay(true)
        .http2_keep_alive_interval(transport::KEEPALIVE_INTERVAL)
        .keep_alive_timeout(transport::KEEPALIVE_TIMEOUT)
        .initial_stream_window_size(transport::STREAM_WINDOW_BYTES)
        .initial_connection_window_size(transport::CONNECTION_WINDOW_BYTES)
        .max_frame_size(transport::FRAME_BYTES_MAX);
    Ok((full, endpoint))
}

fn secured(endpoint: Endpoint, credentials: &Credentials) -> Result<Endpoint, ClientError> {
    let unusable = |error| ClientError::Credentials(format!("TLS cannot be spoken: {}", root_cause(&error)));
    endpoint.tls_config(credentials.tls()).map_err(unusable)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_may_come_without_its_scheme() {
        let none = Credentials::default();
        let full = |url, credentials| endpoint(url, credentials).map(|(full, _)| full).unwrap();
        assert_eq!(full("localhost:7334", &none), "http://localhost:7334");
        assert_eq!(full("http://[::1]:7334", &none), "http://[::1]:7334");
        assert_eq!(full("unix:/run/mrol.sock", &none), "unix:/run/mrol.sock");
        let ca = b"-----BEGIN CERTIFICATE-----\nAA==\n-----END CERTIFICATE-----\n";
        let trusting = Credentials::default().with_server_ca(ca).unwrap();
        assert_eq!(full("localhost:7334", &trusting), "https://localhost:7334");
        let in_the_clear = endpoint("http://localhost:7334", &trusting).unwrap_err().to_string();
        assert!(in_the_clear.contains("certificates are of no use"), "{in_the_clear}");
    }

    #[test]
    fn an_address_that_is_none_is_repeated_in_the_error() {
        for bad in ["", "http://a b", "ftp://x"] {
            let error = endpoint(bad, &Credentials::default()).unwrap_err().to_string();
            assert!(error.starts_with(&format!("{bad:?} is no server address")), "{error}");
        }
    }

    #[tokio::test]
    async fn a_server_that_does_not_take_the_connection_is_named_with_how_long_was_tried() {
        // Once the queue of a listener that accepts nothing is full, nobody answers a connection.
        let socket = tokio::net::TcpSocket::new_v4().unwrap();
        socket.bind("127.0.0.1:0".parse().unwrap()).unwrap();
        let listener = socket.listen(1).unwrap();
        let address = listener.local_addr().unwrap();
        let mut waiting = Vec::new();
        for _ in 0..4 {
            let connecting = tokio::net::TcpStream::connect(address);
            waiting.push(tokio::time::timeout(Duration::from_millis(200), connecting).await);
        }
        assert!(waiting.iter().any(Result::is_err), "the queue is not full");
        let (none, patience) = (Credentials::default(), Duration::from_millis(500));
        let error = Connection::open_within(&address.to_string(), &none, patience).await.unwrap_err();
        let expected = format!(
            "cannot connect to http://{address}: no answer within 0.5 s; is `mrol serve` running there?"
        );
        assert_eq!(error.to_string(), expected);
    }

    #[tokio::test]
    async fn a_server_that_is_not_there_is_named_with_what_to_do() {
        let free = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
        let error =
            Connection::open(&free.to_string(), &Credentials::default()).await.unwrap_err().to_string();
        assert!(error.contains(&format!("http://{free}")) && error.contains("mrol serve"), "{error}");
    }
}
