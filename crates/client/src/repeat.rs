//! Whether a call that failed may be sent to another server.

use super::error::ClientError;
use mrol_service::Reason;

/// Whether a call may be sent to another server after it failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Repeat {
    /// It changes nothing.
    Always,
    /// It has an id by which the servers know it.
    WithId,
    /// Not once it was sent: it might be done twice.
    UnlessSent,
}

/// What to do after a call failed.
pub(super) enum Next {
    /// Its error is the answer.
    End,
    /// Another server is asked, and later calls go there, too.
    Leave,
    /// Another server is asked about this alone.
    Elsewhere,
}

impl Repeat {
    /// What to do after a call failed by `error`.
    pub(super) fn after(self, error: &ClientError) -> Next {
        let said = |reason: Reason| error.reason() == Some(reason.as_str());
        match error {
            ClientError::Unreachable { .. } => Next::Leave,
            ClientError::Lost { .. } if self != Self::UnlessSent => Next::Leave,
            ClientError::Refused { .. } if said(Reason::Draining) || said(Reason::Starting) => Next::Leave,
            ClientError::Refused { .. } if said(Reason::MapElsewhere) => Next::Elsewhere,
            // Another server may be farther, and later questions need not wait for this one.
            ClientError::Refused { .. } if said(Reason::RevisionNotReached) => Next::Leave,
            _ => Next::End,
        }
    }

    /// The same, of a server that another one named: its answer that it is late is that of the call. One that is not
    /// trusted or has no valid address was sent nothing.
    pub(super) fn after_sent_on(self, error: &ClientError) -> Next {
        match error {
            ClientError::Url { .. } | ClientError::Credentials(_) | ClientError::Untrusted { .. } => {
                Next::Leave
            }
            error if error.reason() == Some(Reason::RevisionNotReached.as_str()) => Next::End,
            error => self.after(error),
        }
    }
}

#[cfg(test)]
mod tests {
    use tonic::Code;

    use super::*;

    fn refused(reason: &str) -> ClientError {
        let (code, reason) = (Code::Unavailable, Some(reason.to_owned()));
        let (retry_after, elsewhere) = (None, Vec::new());
        ClientError::Refused { code, reason, message: String::new(), retry_after, elsewhere }
    }

    #[test]
    fn only_a_refusal_that_another_server_may_not_give_is_taken_elsewhere() {
        let next = |error: &ClientError| match Repeat::UnlessSent.after(error) {
            Next::End => "end",
            Next::Leave => "leave",
            Next::Elsewhere => "elsewhere",
        };
        for reason in ["draining", "starting"] {
            assert_eq!(next(&refused(reason)), "leave", "{reason}");
        }
        assert_eq!(next(&refused("revision_not_reached")), "leave");
        assert_eq!(next(&refused("map_elsewhere")), "elsewhere");
        for reason in ["overloaded", "map_not_found", "guess_required", "outcome_unknown", "key_unknown"] {
            assert_eq!(next(&refused(reason)), "end", "{reason}");
        }
        let late = refused("revision_not_reached");
        assert!(matches!(Repeat::UnlessSent.after_sent_on(&late), Next::End), "it has the map");
        let untrusted = ClientError::Untrusted { url: String::new(), cause: String::new() };
        assert!(matches!(Repeat::UnlessSent.after_sent_on(&untrusted), Next::Leave));
        assert_eq!(next(&ClientError::Foreign { url: String::new(), cause: String::new() }), "end");
    }

    #[test]
    fn what_was_sent_is_sent_again_only_where_it_is_known_by_an_id_or_changes_nothing() {
        let (lost, unreachable) = (
            ClientError::Lost { url: String::new(), cause: String::new() },
            ClientError::Unreachable { url: String::new(), cause: String::new() },
        );
        assert!(matches!(Repeat::UnlessSent.after(&lost), Next::End));
        assert!(matches!(Repeat::Always.after(&lost), Next::Leave));
        assert!(matches!(Repeat::UnlessSent.after(&unreachable), Next::Leave));
    }
}
