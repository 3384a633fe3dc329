//! What the leader of a stream knows of a position.

use std::collections::HashMap;
use std::time::Duration;

use async_nats::HeaderMap;
use bytes::Bytes;
use mrol_service::replication::Position;
use serde::de::IgnoredAny;
use serde::{Deserialize, Serialize};
use uuid::Uuid;

use super::names::LogNames;
use crate::engine::{ApiError, CallError, Engine, read_answer};

/// How long the leader may take.
const WITHIN: Duration = Duration::from_millis(400);

/// How long ago a leader may have heard from a replica that still counts as its own. They answer it every second, and
/// elect another after four seconds of silence at the earliest.
const HEARD_WITHIN: Duration = Duration::from_secs(3);

/// A last sequence that no stream has: one of a thousand messages a second reaches it in thirty thousand years.
const NO_LAST_SEQUENCE: &str = "1000000000000000";

/// What the leader of a stream knows of a position.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct LeaderView {
    /// Number of the last message.
    pub(super) last_sequence: u64,
    /// True where the message at the position is there, and for the position before all.
    pub(super) holds: bool,
    /// Who leads; nobody where there is one server.
    leader: Option<String>,
    /// True where most of the replicas follow this leader. One that is cut off from them may not know of messages, and
    /// is asked all the same where nobody else can be reached.
    is_followed: bool,
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
    leader: Option<String>,
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

/// Asks the leader of a stream for a position. What it says it has, is there. What it says it has not, may be there:
/// right after an election it does not know yet of all that was acknowledged.
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
        is_followed: info.cluster.as_ref().is_none_or(Cluster::is_followed_by_most),
        leader: info.cluster.and_then(|cluster| cluster.leader),
    })
}

/// The same, of a leader that knows of all that was acknowledged; `None` where none is known to.
///
/// A leader takes messages only once it knows of all before. So one is published that cannot be taken: the same leader
/// refuses it, and is asked then.
pub(super) async fn certain_view(
    engine: &Engine,
    names: &LogNames,
    position: Position,
) -> Result<Option<LeaderView>, CallError> {
    let before = view(engine, names, position).await?;
    let mut headers = HeaderMap::new();
    headers.insert("Nats-Expected-Last-Sequence", NO_LAST_SEQUENCE);
    headers.insert("Nats-Expected-Last-Subject-Sequence", NO_LAST_SEQUENCE);
    let answer = engine.request(&names.nothing(), headers, Bytes::new(), WITHIN).await?;
    match read_answer::<IgnoredAny>(&answer.payload) {
        Err(CallError::Api(error)) if error.is_wrong_last_sequence() => {}
        Err(error) => return Err(error),
        Ok(_) => return Ok(None),
    }
    let after = view(engine, names, position).await?;
    Ok((after.is_followed && after.leader == before.leader).then_some(after))
}

/// Asks the leader of a stream for the id of the message with this number, if it is there. `Some(None)` is one that is
/// none of the log.
pub(super) async fn id_at(
    engine: &Engine,
    names: &LogNames,
    sequence: u64,
) -> Result<Option<Option<Uuid>>, CallError> {
    #[derive(Serialize)]
    struct Question {
        seq: u64,
        no_hdr: bool,
    }
    #[derive(Deserialize)]
    struct Answer {
        message: Found,
    }
    #[derive(Deserialize)]
    struct Found {
        subject: String,
    }
    let endpoint = format!("STREAM.MSG.GET.{}", names.stream);
    match engine.call::<Answer>(&endpoint, &Question { seq: sequence, no_hdr: true }, WITHIN).await {
        Ok(answer) => Ok(Some(names.id_of(&answer.message.subject))),
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
        Cluster { leader: None, replicas: replicas.collect() }.is_followed_by_most()
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
