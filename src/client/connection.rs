//! The connection: where to, with which limits and windows.

use std::sync::Arc;
use std::time::Duration;

use tokio_stream::StreamExt;
use tonic::transport::{Channel, Endpoint};
use tonic::{Response, Status, Streaming};

use super::{Answers, ClientError};
use crate::service::ServiceError;
use crate::wire::{pb, transport};
use pb::mapping_client::MappingClient;
use pb::maps_client::MapsClient;
use pb::occupancy_client::OccupancyClient;

const CONNECT_TIMEOUT: Duration = Duration::from_secs(10);

/// A channel to a server, and its address for error messages.
#[derive(Debug, Clone)]
pub(super) struct Connection {
    channel: Channel,
    url: Arc<str>,
}

impl Connection {
    pub(super) async fn open(url: &str) -> Result<Self, ClientError> {
        let (url, endpoint) = endpoint(url)?;
        match endpoint.connect().await {
            Ok(channel) => Ok(Self { channel, url: url.into() }),
            Err(error) => Err(ClientError::unreachable(url, &error)),
        }
    }

    pub(super) fn occupancy(&self) -> OccupancyClient<Channel> {
        OccupancyClient::new(self.channel.clone())
            .max_decoding_message_size(transport::MESSAGE_BYTES_MAX)
            .max_encoding_message_size(transport::MESSAGE_BYTES_MAX)
    }

    pub(super) fn mapping(&self) -> MappingClient<Channel> {
        MappingClient::new(self.channel.clone())
            .max_decoding_message_size(transport::MESSAGE_BYTES_MAX)
            .max_encoding_message_size(transport::MESSAGE_BYTES_MAX)
    }

    pub(super) fn maps(&self) -> MapsClient<Channel> {
        MapsClient::new(self.channel.clone())
            .max_decoding_message_size(transport::MESSAGE_BYTES_MAX)
            .max_encoding_message_size(transport::MESSAGE_BYTES_MAX)
    }

    pub(super) fn failure(&self, status: &Status) -> ClientError {
        ClientError::of(&self.url, status)
    }

    /// The messages of a stream, in domain types.
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

/// Where `url` leads, in full, and how to go there.
fn endpoint(url: &str) -> Result<(String, Endpoint), ClientError> {
    let refused = |problem: &str| ClientError::Url { url: url.to_owned(), problem: problem.to_owned() };
    let is_socket = url.starts_with("unix:");
    let full = if is_socket || url.contains("://") { url.to_owned() } else { format!("http://{url}") };
    if !is_socket && !full.starts_with("http://") {
        return Err(refused("only http:// and unix: are spoken"));
    }
    let endpoint = Endpoint::from_shared(full.clone()).map_err(|error| refused(&error.to_string()))?;
    let endpoint = endpoint
        .connect_timeout(CONNECT_TIMEOUT)
        .tcp_nodelay(true)
        .http2_keep_alive_interval(transport::KEEPALIVE_INTERVAL)
        .keep_alive_timeout(transport::KEEPALIVE_TIMEOUT)
        .initial_stream_window_size(transport::STREAM_WINDOW_BYTES)
        .initial_connection_window_size(transport::CONNECTION_WINDOW_BYTES)
        .max_frame_size(transport::FRAME_BYTES_MAX);
    Ok((full, endpoint))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_may_come_without_its_scheme() {
        assert_eq!(endpoint("localhost:7334").unwrap().0, "http://localhost:7334");
        assert_eq!(endpoint("http://[::1]:7334").unwrap().0, "http://[::1]:7334");
        assert_eq!(endpoint("unix:/run/mrol.sock").unwrap().0, "unix:/run/mrol.sock");
    }

    #[test]
    fn an_address_that_is_none_is_repeated_in_the_error() {
        for bad in ["https://127.0.0.1:7334", "", "http://a b", "ftp://x"] {
            let error = endpoint(bad).unwrap_err().to_string();
            assert!(error.starts_with(&format!("{bad:?} is no server address")), "{error}");
        }
    }

    #[tokio::test]
    async fn a_server_that_is_not_there_is_named_with_what_to_do() {
        let free = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
        let error = Connection::open(&free.to_string()).await.unwrap_err().to_string();
        assert!(error.contains(&format!("http://{free}")) && error.contains("mrol serve"), "{error}");
    }
}
