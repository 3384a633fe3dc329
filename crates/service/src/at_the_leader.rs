//! Operations that the node makes that leads a map: this one, or another for it.
//!
//! ```text
//! this node leads, or shares the map with nobody    it is made here
//! another leads                                     it goes on to that one, and no further
//! nobody leads yet                                  it waits for somebody to take over
//! ```
//!
//! A node that refuses because it does not lead has changed nothing, and neither has one that cannot be reached. So
//! where the lead moves meanwhile the operation is tried again, where it is to be made by then: to callers a hand-over
//! is a delay. What was sent and has an unknown outcome is not sent again.

use std::sync::Arc;
use std::time::Duration;

use tokio::time::{Instant, timeout};

use super::cluster::{Forward, ForwardedCall};
use super::commit::{Lead, not_leader};
use super::error::{Reason, ServiceError};
use super::map_service::MapService;
use super::maps::HostedMap;
use super::replication::NodeName;

/// How long after its beginning an operation is tried again.
const TRIED_FOR: Duration = Duration::from_secs(5);
/// The first pause between two attempts; each is twice as long as the one before, up to [`PAUSE_MAX`]. A lead that
/// moves ends it.
const PAUSE_MIN: Duration = Duration::from_millis(50);
const PAUSE_MAX: Duration = Duration::from_millis(200);

/// How long after it has lost the lead a node that was asked is waited for: one that handed it over answers, and one
/// that was stopped does not.
const ANSWERED_WITHIN: Duration = Duration::from_millis(500);

/// Where an operation of which the leader makes the changes is made.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Maker {
    /// Here.
    Here,
    /// At another node.
    There(NodeName),
    /// Nowhere yet: nobody has claimed the lead, or this node has and did not take over.
    Nobody,
}

impl Maker {
    /// Who that is as `lead` says, to the node `own`.
    fn of(lead: &Lead, own: &NodeName) -> Self {
        match lead {
            // What has not joined its log is refused here, with what helps.
            Lead::Alone | Lead::NotJoined | Lead::Shared { is_here: true, .. } => Self::Here,
            Lead::Shared { leader: Some(leader), .. } if leader != own => Self::There(leader.clone()),
            Lead::Shared { .. } => Self::Nobody,
        }
    }
}

impl MapService {
    /// Where an operation of which the leader of `map` makes the changes is made now.
    pub(crate) fn maker(&self, map: &HostedMap) -> Maker {
        let cluster = self.inner.settings.cluster.as_ref();
        cluster.map_or(Maker::Here, |cluster| Maker::of(&map.lead(), &cluster.node))
    }

    /// Waits until that is another than `maker`: for ever where this server is no node.
    pub(crate) async fn maker_changed(&self, map: &HostedMap, maker: &Maker) {
        let Some(cluster) = &self.inner.settings.cluster else { return std::future::pending().await };
        let mut lead = map.commit_queue.lead();
        // The sender is there as long as the map is.
        drop(lead.wait_for(|lead| Maker::of(lead, &cluster.node) != *maker).await);
    }

    /// Waits until the node that was asked has lost the lead, and has not answered for a while after.
    async fn answered_no_more(&self, map: &HostedMap, asked: &Maker) {
        self.maker_changed(map, asked).await;
        tokio::time::sleep(ANSWERED_WITHIN).await;
    }

    /// How the node that leads is asked, where that is another: not for a call that was forwarded itself.
    pub(crate) fn leader_elsewhere(&self, map: &HostedMap) -> Option<(Arc<dyn Forward>, ForwardedCall)> {
        let cluster = self.inner.settings.cluster.as_ref().filter(|_| !self.is_forwarded)?;
        match Maker::of(&map.lead(), &cluster.node) {
            Maker::There(leader) => Some((Arc::clone(&cluster.forward), self.call_to(leader, map))),
            Maker::Here | Maker::Nobody => None,
        }
    }

    fn call_to(&self, to: NodeName, map: &HostedMap) -> ForwardedCall {
        ForwardedCall { to, caller: self.caller.clone(), map: map.name.clone() }
    }

    /// Makes an operation by `here` where this node leads the map, and otherwise by `there`, at the node that does.
    /// Both may be called several times, since the lead may move; whatever the caller may not do is to be refused
    /// before.
    ///
    /// An operation that another node forwarded is made here or refused, at once: that node tries again.
    ///
    /// # Errors
    /// Those of the last attempt; `NotLeader` for a forwarded operation where another node leads.
    pub(crate) async fn at_the_leader<A, H, T>(
        &self,
        map: &HostedMap,
        here: impl Fn() -> H,
        there: impl Fn(Arc<dyn Forward>, ForwardedCall) -> T,
    ) -> Result<A, ServiceError>
    where
        H: Future<Output = Result<A, ServiceError>>,
        T: Future<Output = Result<A, ServiceError>>,
    {
        let Some(cluster) = &self.inner.settings.cluster else { return here().await };
        let until = Instant::now() + TRIED_FOR;
        let mut pause = PAUSE_MIN;
        loop {
            let is_last = self.is_forwarded || Instant::now() >= until;
            let maker = Maker::of(&map.lead(), &cluster.node);
            let refusal = match &maker {
                Maker::Nobody if !is_last => None,
                // The map's worker says why.
                Maker::Here | Maker::Nobody => match here().await {
                    Err(error) if error.reason == Reason::NotLeader => Some(error),
                    outcome => return outcome,
                },
                Maker::There(leader) if self.is_forwarded => Some(not_leader(&map.name, Some(leader))),
                Maker::There(leader) => {
                    let asked = there(Arc::clone(&cluster.forward), self.call_to(leader.clone(), map));
                    let answer = tokio::select! {
                        biased;
                        answer = asked => answer,
                        () = self.answered_no_more(map, &maker) => Err(not_answered(map, leader)),
                    };
                    match answer {
                        // One that goes down may have begun with it.
                        Err(error) if leads_no_more(&error) && error.reason != Reason::Draining => {
                            Some(error)
                        }
                        outcome => return outcome,
                    }
                }
            };
            if let Some(refusal) = refusal.filter(|_| is_last) {
                return Err(refusal);
            }
            // Either the lead has moved then, or it is asked again all the same.
            let _ = timeout(pause, self.maker_changed(map, &maker)).await;
            pause = PAUSE_MAX.min(2 * pause);
        }
    }
}

/// That a node lost the lead before it answered.
fn not_answered(map: &HostedMap, leader: &NodeName) -> ServiceError {
    let message = format!(
        "this change of map {} was sent to node {leader}, which did not answer, and another leads now: it may be there; the same \
         scan_id or request_id, sent again, tells",
        map.name
    );
    ServiceError::new(Reason::OutcomeUnknown, message).retry_after(PAUSE_MIN)
}

/// True of a refusal after which another node may lead, or this one: nothing was changed.
pub(crate) fn leads_no_more(error: &ServiceError) -> bool {
    let reasons = [Reason::NotLeader, Reason::NoQuorum, Reason::Draining, Reason::MapElsewhere];
    reasons.contains(&error.reason)
}
