//! Section `cluster` of the settings.

#[cfg(any(feature = "cluster", test))]
use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

use mrol_service::replication::NodeName;
use mrol_service::section;

use super::error::ConfigError;

section! {
    /// Settings of a node of a cluster: a server that shares its maps with others, by way of NATS. Without `nats` the
    /// server is by itself.
    pub struct ClusterConfig in "cluster" {
        /// Addresses of the NATS servers that the nodes share, `nats://HOST:PORT`, or `tls://` for TLS; with
        /// `USER:PASSWORD@` before the host where they ask for a password. One that answers is enough.
        nats: Vec<String> = Vec::new(); none;
        /// Name of this node, which no other node has: `[a-z0-9][a-z0-9_-]{0,63}`. The data folder belongs to it.
        node: Option<String> = None; none;
        /// Address of HTTP as clients reach it, `http://HOST:PORT` or `https://`; what it listens at, where others can
        /// reach that.
        http: Option<String> = None; none;
        /// Address of gRPC as the other nodes and clients reach it, likewise.
        grpc: Option<String> = None; none;
        /// Path of the secret by which the nodes know each other, the same on all: one line of 32 characters or more.
        /// Needed where there is a file of keys.
        secret_file: Option<PathBuf> = None; none;
        /// Path of certificates, PEM, that sign those of the NATS servers and of the other nodes; those of the system
        /// where there is none.
        ca: Option<PathBuf> = None; none;
        /// Path of a `.creds` file that the NATS servers ask for.
        credentials_file: Option<PathBuf> = None; none;
        /// Path of a file with the seed of an nkey that the NATS servers ask for.
        nkey_file: Option<PathBuf> = None; none;
        /// On how many NATS servers each log is kept: 3 outlives the loss of one, 1 none. Counts when a map is made.
        replicas: u32 = 3; none, from 1, to 5.0;
        /// How many nodes hold a map that is made at this one: itself, and those with the most room; 0 where all do.
        /// Others send callers on to them. `mrol cluster copies` changes it for a map.
        copies: u32 = 0; none, to 1000.0;
        /// How far behind the others a node may be with a map before `/readyz` says that it is not ready.
        lag_max_s: f64 = 5.0; s, from 0.1, to 3600.0;
    }
}

impl ClusterConfig {
    /// True of a node of a cluster.
    pub fn is_used(&self) -> bool {
        !self.nats.is_empty()
    }

    /// How far behind a node may be.
    pub fn lag_max(&self) -> Duration {
        Duration::from_secs_f64(self.lag_max_s)
    }

    /// The name of this node.
    pub fn node_name(&self) -> Option<NodeName> {
        self.node.as_deref().and_then(|name| NodeName::new(name).ok())
    }

    pub(super) fn check(&self, has_keys: bool, data_dir_is_empty: bool) -> Result<(), ConfigError> {
        if !self.is_used() {
            return Ok(());
        }
        let Some(node) = &self.node else {
            return Err(ConfigError::Missing { needed: "cluster.node", by: "cluster.nats" });
        };
        if let Err(error) = NodeName::new(node) {
            let (range, value) = ("[a-z0-9][a-z0-9_-]{0,63}".to_owned(), error.to_string());
            return Err(ConfigError::Range { key: "cluster.node", range, value });
        }
        if data_dir_is_empty {
            return Err(ConfigError::Missing { needed: "data_dir", by: "cluster.nats" });
        }
        if has_keys && self.secret_file.is_none() {
            return Err(ConfigError::Missing { needed: "cluster.secret_file", by: "cluster.nats" });
        }
        if self.credentials_file.is_some() && self.nkey_file.is_some() {
            let (one, other) = ("cluster.credentials_file", "cluster.nkey_file");
            return Err(ConfigError::Contradiction { one, other });
        }
        for (key, address) in [("cluster.http", &self.http), ("cluster.grpc", &self.grpc)] {
            if let Some(value) = address.as_ref().filter(|address| !is_address(address)) {
                let range = "http://HOST:PORT or https://HOST:PORT".to_owned();
                return Err(ConfigError::Range { key, range, value: value.clone() });
            }
        }
        Ok(())
    }
}

/// An address at which others reach a listener: the one that is set, or where it listens.
///
/// # Errors
/// Where it listens at all addresses of the machine, of which none is known to be the right one.
#[cfg(any(feature = "cluster", test))]
pub(crate) fn advertised(
    key: &'static str,
    set: Option<&String>,
    listens: SocketAddr,
    is_secured: bool,
) -> Result<String, ConfigError> {
    match set {
        Some(address) => Ok(address.trim_end_matches('/').to_owned()),
        None if listens.ip().is_unspecified() => {
            Err(ConfigError::Missing { needed: key, by: "cluster.nats" })
        }
        None => Ok(format!("{}://{listens}", if is_secured { "https" } else { "http" })),
    }
}

fn is_address(text: &str) -> bool {
    let host = text.strip_prefix("http://").or_else(|| text.strip_prefix("https://"));
    host.map(|host| host.trim_end_matches('/')).and_then(|host| host.rsplit_once(':')).is_some_and(
        |(host, port)| {
            !host.is_empty() && !host.contains(['/', '@']) && port.parse::<u16>().is_ok_and(|port| port > 0)
        },
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn clustered() -> ClusterConfig {
        ClusterConfig {
            nats: vec!["nats://a:4222".to_owned()],
            node: Some("n1".to_owned()),
            ..ClusterConfig::default()
        }
    }

    #[test]
    fn a_node_has_a_name_a_data_folder_and_where_there_are_keys_a_secret() {
        assert!(ClusterConfig::default().check(true, true).is_ok(), "a server by itself needs none of it");
        assert!(clustered().check(false, false).is_ok());
        let refused = |config: ClusterConfig, has_keys, is_empty| {
            config.check(has_keys, is_empty).unwrap_err().to_string()
        };
        assert!(refused(ClusterConfig { node: None, ..clustered() }, false, false).contains("cluster.node"));
        assert!(
            refused(ClusterConfig { node: Some("N 1".into()), ..clustered() }, false, false).contains("N 1")
        );
        assert!(refused(clustered(), true, false).contains("cluster.secret_file"));
        assert!(refused(clustered(), false, true).contains("data_dir"));
    }

    #[test]
    fn an_address_has_a_scheme_a_host_and_a_port() {
        for good in ["http://a:1", "https://10.0.0.1:7334", "http://[::1]:7334", "http://a:1/"] {
            assert!(is_address(good), "{good}");
        }
        for bad in ["a:1", "http://a", "http://:1", "http://a:0", "http://u@a:1", "http://a:1/x", "tcp://a:1"]
        {
            assert!(!is_address(bad), "{bad}");
        }
        let at = |listens: &str, set: Option<&str>| {
            advertised("cluster.http", set.map(str::to_owned).as_ref(), listens.parse().unwrap(), true)
        };
        assert_eq!(at("10.0.0.1:7333", None).unwrap(), "https://10.0.0.1:7333");
        assert_eq!(at("0.0.0.0:7333", Some("http://a:1/")).unwrap(), "http://a:1");
        assert!(at("[::]:7333", None).unwrap_err().to_string().contains("cluster.http"));
    }
}
