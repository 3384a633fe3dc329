//! [`NodeClient`]: how a node of a cluster asks another.

use std::time::Duration;

use super::calls::Calls;
use super::client::Client;
use super::connection::{Address, Connection};
use super::credentials::Credentials;
use super::error::ClientError;
use super::servers::Servers;
use mrol_map::map::CallerName;
use mrol_service::replication::NodeName;

/// A connection by which a node of a cluster forwards what its own callers ask. The other node believes what it says of
/// them for the secret of the cluster, which is the key of its [`Credentials`]: without that it says nothing to
/// anybody.
///
/// A call is sent once, and sent on to nobody. Its error tells what was not sent ([`ClientError::Unreachable`]) from
/// what was ([`ClientError::Lost`]).
#[derive(Debug, Clone)]
pub struct NodeClient {
    connection: Connection,
    node: NodeName,
}

/// What a connection to another node is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ConnectionUse {
    /// Calls that are answered once, and read at once.
    Calls,
    /// Watches, each of which may stand still: none of them takes the room of others.
    Watches,
}

impl NodeClient {
    /// Connects to the gRPC address of another node within `timeout`, as the node `own`.
    ///
    /// # Errors
    /// When the address is not valid, no server answers there, or the two do not trust each other.
    pub async fn connect(
        url: &str,
        credentials: &Credentials,
        own: NodeName,
        usage: ConnectionUse,
        timeout: Duration,
    ) -> Result<Self, ClientError> {
        let address = Address::parse(url, credentials)?.with_keepalive();
        let address = match usage {
            ConnectionUse::Calls => address,
            ConnectionUse::Watches => address.with_windows_of_watches(),
        };
        let connection = address.connect(credentials, timeout).await?.replaceable();
        Ok(Self { connection, node: own })
    }

    /// A client whose calls are those of the holder of the key `caller`, or where no keys are asked for, of anybody.
    pub fn on_behalf_of(&self, caller: Option<&CallerName>) -> Client {
        let connection = self.connection.clone().forwarding(&self.node, caller);
        Client { calls: Calls::new(Servers::One(connection), None) }
    }

    /// True once a call found the other node gone: it is to be connected to again.
    pub fn is_gone(&self) -> bool {
        self.connection.is_gone()
    }
}
