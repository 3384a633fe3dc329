//! What the leader of a stream knows of a position.

use std::collections::HashMap;
use std::time::Duration;

use mrol_service::replication::Position;
use serde::{Deserialize, Serialize};
use uuid::Uuid;

use super::names::LogNames;
use crate::engine::{ApiError, CallError, Engine};

/// How long the leader may take.
const WITHIN: Duration = Duration::from_millis(400);

/// How long ago a leader may have heard from a replica that still counts as its own. They answer it every second, and
/// elect another after four seconds of silence at the earliest.
const HEARD_WITHIN: Duration = Duration::from_secs(3);

/// What the leader of a stream knows of a position.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct LeaderView {
    /// Number of the last message.
    pub(super) last_sequence: u64,
    /// True where the message at the position is there, and for the position before all.
    pub(super) holds: bool,
    /// True where most of the replicas follow this leader. One that is cut off from them may not know of messages, and
    /// is asked all the same where nobody else can be reached.
    pub(super) is_certain: bool,
}

#[derive(Deserialize)]
struct Info {
    state: State,
    cluster: Option<Cluster>,
}

#[derive(Deserialize)]
struct State {
    last_seq: u64,
    #[serde(default)]
    subjects: HashMap<String, u64>,
}

#[derive(Deserialize)]
struct Cluster {
    #[serde(default)]
    replicas: Vec<Replica>,
}

/// One of those that follow.
#[derive(Deserialize)]
struct Replica {
    #[serde(default)]
    offline: bool,
    /// Nanoseconds since it was heard.
    #[serde(default)]
    active: u128,
}

impl Cluster {
    fn is_followed_by_most(&self) -> bool {
        let heard = |replica: &&Replica| !replica.offline && replica.active < HEARD_WITHIN.as_nanos();
        let following = self.replicas.iter().filter(heard).count();
        // Itself counts on both sides.
        2 * (following + 1) > self.replicas.len() + 1
    }
}

/// Asks the leader of a stream for a position.
pub(super) async fn view(
    engine: &Engine,
    names: &LogNames,
    position: Position,
) -> Result<LeaderView, CallError> {
    #[derive(Serialize)]
    struct Question {
        subjects_filter: Option<String>,
    }
    let subject = position.id.map(|id| names.subject(id));
    let endpoint = format!("STREAM.INFO.{}", names.stream);
    let question = Question { subjects_filter: subject.clone() };
    let info = engine.call::<Info>(&endpoint, &question, WITHIN).await?;
    Ok(LeaderView {
        last_sequence: info.state.last_seq,
        holds: subject.is_none_or(|subject| info.state.subjects.contains_key(&subject)),
        is_certain: info.cluster.is_none_or(|cluster| cluster.is_followed_by_most()),
    })
}

/// Asks the leader of a stream for the number of a message, if it is there.
pub(super) async fn sequence_of(
    engine: &Engine,
    names: &LogNames,
    id: Uuid,
) -> Result<Option<u64>, CallError> {
    #[derive(Serialize)]
    struct Question {
        last_by_subj: String,
        no_hdr: bool,
    }
    #[derive(Deserialize)]
    struct Answer {
        message: Found,
    }
    #[derive(Deserialize)]
    struct Found {
        seq: u64,
    }
    let endpoint = format!("STREAM.MSG.GET.{}", names.stream);
    let question = Question { last_by_subj: names.subject(id), no_hdr: true };
    match engine.call::<Answer>(&endpoint, &question, WITHIN).await {
        Ok(answer) => Ok(Some(answer.message.seq)),
        Err(CallError::Api(ApiError { err_code: ApiError::NO_MESSAGE, .. })) => Ok(None),
        Err(error) => Err(error),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn is_followed(active: &[(bool, u64)]) -> bool {
        let replicas = active
            .iter()
            .map(|&(offline, seconds)| Replica { offline, active: Duration::from_secs(seconds).as_nanos() });
        Cluster { replicas: replicas.collect() }.is_followed_by_most()
    }

    #[test]
    fn a_leader_is_certain_that_most_follow_once_it_heard_from_them() {
        assert!(is_followed(&[]));
        assert!(is_followed(&[(false, 0), (false, 0)]));
        assert!(is_followed(&[(true, 0), (false, 1)]));
        assert!(is_followed(&[(false, 60), (false, 1)]));
        assert!(!is_followed(&[(false, 60), (false, 3)]));
        assert!(!is_followed(&[(true, 0), (true, 0)]));
        assert!(!is_followed(&[(false, 60)]));
    }
}
