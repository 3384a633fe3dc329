//! What the caller is told of a call to another node that failed.

use std::time::Duration;

use mrol_client::ClientError;
use mrol_service::replication::NodeName;
use mrol_service::{Reason, ServiceError};

/// When to ask again where a node does not answer: another takes over after some seconds.
const NODE_SOON: Duration = Duration::from_secs(2);

/// What was asked of another node.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Asked {
    /// Something that changes the map: once it was sent, it may be made.
    Change,
    /// Something that changes nothing.
    Question,
}

/// What the caller is told of a call to `node` that failed: what that node said, in its words, where it said something.
pub(super) fn error_of(node: &NodeName, asked: Asked, error: ClientError) -> ServiceError {
    match error {
        ClientError::Refused { reason, message, retry_after, .. } => {
            let reason = reason.as_deref().and_then(Reason::of_word);
            match (reason, asked) {
                // It went on without whoever waits for it.
                (Some(Reason::Deadline | Reason::CallerGone) | None, Asked::Change) => {
                    unknown(node, &message)
                }
                (Some(reason), _) => ServiceError { retry_after, ..ServiceError::new(reason, message) },
                (None, Asked::Question) => unanswered(node, &message),
            }
        }
        // It was never sent.
        ClientError::Url { .. }
        | ClientError::Credentials(_)
        | ClientError::Unreachable { .. }
        | ClientError::Untrusted { .. } => unanswered(node, &cause_of(&error)),
        ClientError::Lost { .. } | ClientError::Foreign { .. } | ClientError::Answer(_) => match asked {
            Asked::Change => unknown(node, &cause_of(&error)),
            Asked::Question => unanswered(node, &cause_of(&error)),
        },
    }
}

/// What the caller is told where nobody knows yet where `node` is.
pub(super) fn no_address(node: &NodeName) -> ServiceError {
    unanswered(node, "its address is not known here")
}

/// What the caller is told where too many calls are on their way to `node`.
pub(super) fn no_place(node: &NodeName) -> ServiceError {
    unanswered(node, "too many calls to it are not answered yet")
}

/// What the caller is told where `node` does not begin to answer.
pub(super) fn not_opened(node: &NodeName) -> ServiceError {
    unanswered(node, "it began no answer in time")
}

fn unanswered(node: &NodeName, cause: &str) -> ServiceError {
    let message = format!("node {node} does not answer ({cause}): nothing was changed, try again");
    ServiceError::new(Reason::NoQuorum, message).retry_after(NODE_SOON)
}

fn unknown(node: &NodeName, cause: &str) -> ServiceError {
    let message = format!(
        "this change was sent to node {node}, which did not answer ({cause}): it may be there, now or later; the same scan_id or \
         request_id, sent again, tells"
    );
    ServiceError::new(Reason::OutcomeUnknown, message).retry_after(NODE_SOON)
}

/// The cause, without what is said to people at a terminal.
fn cause_of(error: &ClientError) -> String {
    match error {
        ClientError::Unreachable { cause, .. }
        | ClientError::Untrusted { cause, .. }
        | ClientError::Lost { cause, .. }
        | ClientError::Foreign { cause, .. }
        | ClientError::Url { problem: cause, .. } => cause.clone(),
        error => error.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mrol_client::wire::status_code;

    fn told(asked: Asked, error: ClientError) -> ServiceError {
        error_of(&NodeName::new("b").unwrap(), asked, error)
    }

    fn refused(reason: Option<&str>, code: tonic::Code) -> ClientError {
        let (reason, message) = (reason.map(str::to_owned), "no".to_owned());
        let (retry_after, elsewhere) = (None, Vec::new());
        ClientError::Refused { code, reason, message, retry_after, elsewhere }
    }

    #[test]
    fn what_the_other_node_says_is_told_as_it_is() {
        for &reason in Reason::ALL {
            let said = ServiceError::new(reason, "no").retry_after(Duration::from_millis(1500));
            let error = ClientError::Refused {
                code: status_code(reason.code()),
                reason: Some(reason.as_str().to_owned()),
                message: said.message.clone(),
                retry_after: said.retry_after,
                elsewhere: Vec::new(),
            };
            assert_eq!(told(Asked::Question, error.clone()), said);
            let of_change = told(Asked::Change, error);
            match reason {
                // That node does not know what became of it.
                Reason::Deadline | Reason::CallerGone => {
                    assert_eq!(of_change.reason, Reason::OutcomeUnknown);
                }
                _ => assert_eq!(of_change, said),
            }
        }
    }

    #[test]
    fn what_was_sent_and_not_answered_is_unknown_of_a_change_alone() {
        let (url, cause) = ("http://b:7334".to_owned(), "reset by peer".to_owned());
        let bad = ServiceError::new(Reason::BadVerdict, "a verdict of a newer version");
        let after_sending = [
            ClientError::Lost { url: url.clone(), cause: cause.clone() },
            ClientError::Foreign { url: url.clone(), cause: cause.clone() },
            ClientError::Answer(bad),
            refused(Some("brand_new"), tonic::Code::Unavailable),
            refused(None, tonic::Code::Cancelled),
        ];
        for error in after_sending {
            assert_eq!(told(Asked::Change, error.clone()).reason, Reason::OutcomeUnknown, "{error:?}");
            assert_eq!(told(Asked::Question, error.clone()).reason, Reason::NoQuorum, "{error:?}");
        }
        let before_sending = [
            ClientError::Unreachable { url: url.clone(), cause: cause.clone() },
            ClientError::Untrusted { url: url.clone(), cause: cause.clone() },
            ClientError::Url { url, problem: cause },
        ];
        for error in before_sending {
            let told = told(Asked::Change, error);
            assert_eq!(told.reason, Reason::NoQuorum);
            let expected = "node b does not answer (reset by peer): nothing was changed, try again";
            assert_eq!((&*told.message, told.retry_after), (expected, Some(NODE_SOON)));
        }
    }
}
