//! Errors of the client.

use std::error::Error;
use std::time::Duration;

use tonic::{Code, Status};

use crate::wire::{REASON, elsewhere, pb, retry_after};
use mrol_service::ServiceError;

/// Start of the TLS error for a server's certificate.
const BAD_CERTIFICATE: &str = "invalid peer certificate";

/// Part of the TLS error for a peer that answers without TLS.
const NO_TLS: &str = "InvalidContentType";

/// Part of the error for an answer whose first byte is that of a text.
const NO_GRPC: &str = "invalid compression flag";

/// What is said of such an answer.
const PLAIN_HTTP: &str = "it answered as an HTTP server does, and the HTTP port of `mrol serve` is another (7333) than \
                          that of gRPC (7334)";

/// A call that failed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ClientError {
    /// The address is not valid.
    #[error("{url:?} is no server address: {problem}; it looks like http://127.0.0.1:7334")]
    Url {
        /// The address as it was given.
        url: String,
        /// What is wrong with it.
        problem: String,
    },
    /// The credentials cannot be used.
    #[error("{0}")]
    Credentials(String),
    /// No server answers at the address.
    #[error("cannot connect to {url}: {cause}; is `mrol serve` running there?")]
    Unreachable {
        /// The server's address.
        url: String,
        /// What the system said.
        cause: String,
    },
    /// The server's certificate is not signed by a trusted authority.
    #[error("{url} cannot be trusted: {cause}; `--ca` names the authority that signs its certificate")]
    Untrusted {
        /// The server's address.
        url: String,
        /// What is wrong with its certificate.
        cause: String,
    },
    /// The connection broke in the middle of a call.
    #[error("lost the connection to {url}: {cause}; is that the gRPC address of a running `mrol serve`?")]
    Lost {
        /// The server's address.
        url: String,
        /// What the system said.
        cause: String,
    },
    /// The peer is not a gRPC server of this project, or has another version.
    #[error("{url} does not answer as mrol's gRPC does: {cause}; is that the gRPC address of `mrol serve`?")]
    Foreign {
        /// The address.
        url: String,
        /// What the answer was.
        cause: String,
    },
    /// The server refused.
    #[error("{message}{}", in_brackets(reason.as_deref()))]
    Refused {
        /// gRPC status code of the failure.
        code: Code,
        /// Reason of the failure, for programs: `guess_required`, `map_not_found`, ...
        reason: Option<String>,
        /// Message of the failure, for people.
        message: String,
        /// When the same call may be answered otherwise, where the server tells.
        retry_after: Option<Duration>,
        /// gRPC addresses of the servers that hold the map, where this one does not (`map_elsewhere`): the first is the
        /// best.
        elsewhere: Vec<String>,
    },
    /// The server's answer is not valid for this version of the client.
    #[error("the server's answer cannot be understood: {0}")]
    Answer(ServiceError),
}

impl ClientError {
    /// Reason that the server gave for programs, if it gave one.
    pub fn reason(&self) -> Option<&str> {
        match self {
            Self::Refused { reason, .. } => reason.as_deref(),
            _ => None,
        }
    }

    pub(super) fn unreachable(url: String, error: &dyn Error) -> Self {
        match root_cause(error) {
            cause if cause.starts_with(BAD_CERTIFICATE) => Self::Untrusted { url, cause },
            cause if cause.contains(NO_TLS) => {
                let cause = "what answers there speaks no TLS: https:// is for servers with a certificate, \
                             http:// for others";
                Self::Unreachable { url, cause: cause.to_owned() }
            }
            cause => Self::Unreachable { url, cause },
        }
    }

    /// Converts a status to an error. A status from the wire has no source; one that was made in this process has.
    pub(super) fn of(url: &str, status: &Status) -> Self {
        if let Some(cause) = status.source() {
            return Self::Lost { url: url.to_owned(), cause: root_cause(cause) };
        }
        let reason = status.metadata().get(REASON).and_then(|reason| reason.to_str().ok());
        let message = match status.message() {
            "" => status.code().description(),
            message => message,
        };
        match (reason, status.code()) {
            (None, Code::Internal | Code::Unknown | Code::Unimplemented) => {
                let cause = if message.contains(NO_GRPC) { PLAIN_HTTP } else { message };
                Self::Foreign { url: url.to_owned(), cause: cause.to_owned() }
            }
            (reason, code) => {
                let (reason, message) = (reason.map(str::to_owned), message.to_owned());
                let (retry_after, elsewhere) = (retry_after(status), elsewhere(status));
                Self::Refused { code, reason, message, retry_after, elsewhere }
            }
        }
    }
}

impl From<pb::Failure> for ClientError {
    fn from(pb::Failure { code, reason, message, retry_after_s, elsewhere }: pb::Failure) -> Self {
        let reason = Some(reason).filter(|reason| !reason.is_empty());
        let retry_after = retry_after_s.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
        Self::Refused { code: Code::from_i32(code), reason, message, retry_after, elsewhere }
    }
}

fn in_brackets(reason: Option<&str>) -> String {
    reason.map(|reason| format!(" ({reason})")).unwrap_or_default()
}

/// The innermost cause: "connection refused" rather than "transport error".
pub(super) fn root_cause(error: &dyn Error) -> String {
    let mut cause = error;
    while let Some(inner) = cause.source() {
        cause = inner;
    }
    cause.to_string()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::status_of;
    use mrol_map::map::MapName;
    use mrol_service::MapHolder;

    #[test]
    fn a_refusal_keeps_the_servers_message_and_word() {
        let mut status = Status::new(Code::NotFound, "map a does not exist");
        status.metadata_mut().insert(REASON, "map_not_found".parse().unwrap());
        let error = ClientError::of("http://a", &status);
        assert_eq!(error.reason(), Some("map_not_found"));
        assert_eq!(error.to_string(), "map a does not exist (map_not_found)");
    }

    #[test]
    fn a_refusal_keeps_when_to_come_again() {
        let wait = Duration::from_millis(1500);
        let refusal = ServiceError::overloaded("too much").retry_after(wait);
        let told = |error| match error {
            ClientError::Refused { retry_after, .. } => retry_after,
            other => panic!("{other}"),
        };
        assert_eq!(told(ClientError::of("http://a", &status_of(refusal.clone()))), Some(wait));
        assert_eq!(told(pb::Failure::from(refusal).into()), Some(wait));
        assert_eq!(told(ClientError::of("http://a", &Status::not_found("no"))), None);
    }

    #[test]
    fn a_refusal_keeps_where_the_map_is() {
        let holder = |at: &str| MapHolder {
            node: at.to_owned(),
            http: format!("http://{at}:7333"),
            grpc: format!("http://{at}:7334"),
        };
        let map = MapName::new("hall").unwrap();
        let refusal = ServiceError::map_elsewhere(&map, vec![holder("b"), holder("c")]);
        match ClientError::of("http://a", &status_of(refusal)) {
            ClientError::Refused { reason, message, elsewhere, .. } => {
                assert_eq!(reason.as_deref(), Some("map_elsewhere"));
                assert_eq!(elsewhere, ["http://b:7334", "http://c:7334"]);
                assert!(message.contains("node c (http://c:7333, gRPC http://c:7334)"), "{message}");
            }
            other => panic!("{other}"),
        }
    }

    #[test]
    fn an_answer_that_is_none_of_ours_is_told_as_such() {
        let error = ClientError::of("http://a", &Status::unimplemented("")).to_string();
        assert!(error.starts_with("http://a does not answer as mrol's gRPC does"), "{error}");
    }

    #[test]
    fn an_http_port_and_a_port_without_tls_are_told_in_plain_words() {
        let flag =
            "protocol error: received message with invalid compression flag: 123 (valid flags are 0 and 1)";
        let error = ClientError::of("http://a", &Status::internal(flag)).to_string();
        assert!(error.contains("HTTP port of `mrol serve`") && !error.contains("flag"), "{error}");
        let corrupt = std::io::Error::other("received corrupt message of type InvalidContentType");
        let error = ClientError::unreachable("https://a".into(), &corrupt).to_string();
        assert!(error.contains("speaks no TLS") && !error.contains("corrupt"), "{error}");
    }

    #[test]
    fn a_broken_connection_is_told_from_a_refusal() {
        let broken = Status::from_error(Box::new(std::io::Error::other("reset by peer")));
        let error = ClientError::of("http://a", &broken).to_string();
        assert!(error.starts_with("lost the connection to http://a: reset by peer"), "{error}");
    }
}
