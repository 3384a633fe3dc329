//! Who is let in, and the refusal to let in everybody.

use std::net::SocketAddr;

use super::error::ServerError;
use crate::access::Access;
use crate::config::{AccessConfig, Config};

/// The rules that the settings make.
///
/// # Errors
/// When the keys cannot be read, or there are none, other machines could connect and nobody said that this is meant.
pub(super) fn access(config: &Config) -> Result<Access, ServerError> {
    let AccessConfig { keys_file, open, open_metrics, hosts, .. } = &config.access;
    let everybody = || Access::open().at_hosts(hosts.iter().map(String::as_str));
    let others_connect = |address: &SocketAddr| !address.ip().to_canonical().is_loopback();
    let admin = config.admin.listen.map(|address| ("admin", address));
    let listeners = [("http", config.http.listen), ("grpc", config.grpc.listen)].into_iter().chain(admin);
    let reachable = listeners.into_iter().find(|(_, address)| others_connect(address));
    match (keys_file, reachable) {
        (Some(file), _) => {
            let access = Access::by_keys_of(file, *open_metrics)?;
            let keys = access.keys().map_or(0, |keys| keys.current().len());
            tracing::info!(file = %file.display(), keys, "keys are asked for");
            if let Some((protocol, address)) = reachable.filter(|_| config.tls.certificate.is_none()) {
                tracing::warn!(protocol, %address, "keys travel in the clear: TLS needs tls.certificate and tls.key");
            }
            Ok(access)
        }
        (None, Some((protocol, address))) if !open => Err(ServerError::Unguarded { protocol, address }),
        (None, Some((protocol, address))) => {
            tracing::warn!(protocol, %address, "whoever reaches this address may do everything: there are no keys");
            Ok(everybody())
        }
        (None, None) => Ok(everybody()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn listening(http: &str, grpc: &str, open: bool) -> Result<Access, ServerError> {
        let mut config = Config::default();
        config.http.listen = http.parse().unwrap();
        config.grpc.listen = grpc.parse().unwrap();
        config.access.open = open;
        access(&config)
    }

    #[test]
    fn without_keys_other_machines_are_let_in_only_where_somebody_says_so() {
        let here = ["127.0.0.1:0", "[::1]:0", "127.8.9.1:1", "[::ffff:127.0.0.1]:0"];
        let elsewhere = ["0.0.0.0:0", "[::]:0", "192.168.1.2:7333", "[2001:db8::1]:1"];
        for address in here {
            assert!(listening(address, "127.0.0.1:0", false).is_ok(), "{address}");
        }
        for address in elsewhere {
            let refused = listening("127.0.0.1:0", address, false).unwrap_err().to_string();
            assert!(refused.contains(address) && refused.contains("grpc"), "{refused}");
            assert!(refused.contains("access.keys_file") && refused.contains("--insecure-open"), "{refused}");
            assert!(listening(address, address, true).is_ok());
        }
    }

    #[test]
    fn health_is_shown_to_other_machines_under_the_same_rules() {
        let mut config = Config::default();
        config.admin.listen = Some("127.0.0.1:7335".parse().unwrap());
        assert!(access(&config).is_ok());
        config.admin.listen = Some("0.0.0.0:7335".parse().unwrap());
        let refused = access(&config).unwrap_err().to_string();
        assert!(refused.contains("0.0.0.0:7335") && refused.contains("admin"), "{refused}");
    }
}
