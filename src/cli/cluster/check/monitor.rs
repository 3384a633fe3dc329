//! What a NATS server tells at its monitoring port.

use std::io::{Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::Duration;

use serde::Deserialize;

/// How long the port may take to answer.
const WITHIN: Duration = Duration::from_secs(5);
/// Bytes of an answer that are read: it has some kilobytes.
const ANSWER_MAX: u64 = 4 << 20;

/// What `/varz` tells of a NATS server, as far as it matters here.
#[derive(Debug, PartialEq, Eq, Deserialize)]
pub(super) struct ServerFacts {
    /// Its name.
    pub(super) server_name: String,
    /// Bytes of the largest message that it takes.
    pub(super) max_payload: usize,
    #[serde(default)]
    jetstream: JetStreamFacts,
}

#[derive(Debug, Default, PartialEq, Eq, Deserialize)]
struct JetStreamFacts {
    config: Option<JetStreamConfig>,
}

#[derive(Debug, PartialEq, Eq, Deserialize)]
struct JetStreamConfig {
    /// Nanoseconds; two minutes also where `sync_always` is true.
    sync_interval: Option<u64>,
    /// Left out where it is false.
    #[serde(default)]
    sync_always: bool,
}

/// When a NATS server syncs what it acknowledges.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Syncs {
    /// Before it acknowledges.
    Always,
    /// Every so often.
    Every(Duration),
    /// It has no JetStream.
    Never,
}

impl ServerFacts {
    /// Asks the monitoring port of a server: `http://HOST:PORT`.
    pub(super) fn ask(url: &str) -> Result<Self, String> {
        let body = get(url, "/varz")?;
        serde_json::from_str(&body).map_err(|error| format!("{url}/varz is none of a NATS server: {error}"))
    }

    /// When it syncs.
    pub(super) fn syncs(&self) -> Syncs {
        match &self.jetstream.config {
            None => Syncs::Never,
            Some(JetStreamConfig { sync_always: true, .. }) => Syncs::Always,
            Some(JetStreamConfig { sync_interval, .. }) => {
                Syncs::Every(Duration::from_nanos(sync_interval.unwrap_or_default()))
            }
        }
    }
}

/// Checks the address of a monitoring port.
pub(super) fn monitor_url(text: &str) -> Result<String, String> {
    let host = text.strip_prefix("http://").map(|host| host.trim_end_matches('/'));
    let fits = host.and_then(|host| host.rsplit_once(':')).is_some_and(|(host, port)| {
        !host.is_empty() && !host.contains('/') && port.parse::<u16>().is_ok_and(|port| port > 0)
    });
    match fits {
        true => Ok(text.trim_end_matches('/').to_owned()),
        false => Err(format!("must be http://HOST:PORT, got {text:?}")),
    }
}

fn get(url: &str, path: &str) -> Result<String, String> {
    let failed = |error: std::io::Error| format!("{url} does not answer: {error}");
    let host = url.trim_start_matches("http://");
    let mut addresses = host.to_socket_addrs().map_err(failed)?;
    let address = addresses.next().ok_or_else(|| format!("{url} has no address"))?;
    let mut connection = TcpStream::connect_timeout(&address, WITHIN).map_err(failed)?;
    connection.set_read_timeout(Some(WITHIN)).map_err(failed)?;
    // By version 1.0 the answer comes in one piece and ends with the connection.
    write!(connection, "GET {path} HTTP/1.0\r\nHost: {host}\r\n\r\n").map_err(failed)?;
    let mut answer = String::new();
    connection.take(ANSWER_MAX).read_to_string(&mut answer).map_err(failed)?;
    let (head, body) = answer.split_once("\r\n\r\n").unwrap_or((&answer, ""));
    let status = head.lines().next().unwrap_or_default();
    match status.split(' ').nth(1) {
        Some("200") => Ok(body.to_owned()),
        _ => Err(format!(
            "{url}{path} answers {status:?}: is it the monitoring port (`http:` in nats-server.conf)?"
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn facts(jetstream: &str) -> ServerFacts {
        let text = format!(r#"{{"server_name":"n1","version":"2.15.1","max_payload":1048576,{jetstream}}}"#);
        serde_json::from_str(&text).unwrap()
    }

    /// As nats-server 2.15.1 writes it: the interval is there in both cases.
    #[test]
    fn a_server_tells_when_it_syncs() {
        let of = |config: &str| facts(&format!(r#""jetstream":{{"config":{config},"stats":{{}}}}"#)).syncs();
        let always = r#"{"store_dir":"s","sync_interval":120000000000,"sync_always":true,"strict":true}"#;
        assert_eq!(of(always), Syncs::Always);
        let every = r#"{"store_dir":"s","sync_interval":120000000000,"strict":true}"#;
        assert_eq!(of(every), Syncs::Every(Duration::from_secs(120)));
        assert_eq!(facts(r#""jetstream":{}"#).syncs(), Syncs::Never);
        assert_eq!(facts(r#""port":1"#).syncs(), Syncs::Never);
    }

    #[test]
    fn a_monitoring_port_has_a_scheme_a_host_and_a_port() {
        assert_eq!(monitor_url("http://a:8222/"), Ok("http://a:8222".to_owned()));
        for bad in ["a:8222", "https://a:8222", "http://a", "http://:1", "http://a:1/varz"] {
            assert!(monitor_url(bad).unwrap_err().contains("http://HOST:PORT"), "{bad}");
        }
    }
}
