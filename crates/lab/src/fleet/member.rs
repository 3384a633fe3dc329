//! Members of a fleet, and their work.

use std::sync::Arc;
use std::time::Duration;

use parking_lot::Mutex;
use tokio::task::JoinSet;

use super::error::FleetError;
use super::pace::Pace;
use super::tally::Tally;

/// A member of a fleet, which carries out operations.
pub(crate) trait Member: Send + 'static {
    /// Carries out the operation `number`; every operation has a number of its own.
    fn carry_out(&mut self, number: u64) -> impl Future<Output = Result<(), FleetError>> + Send;
}

/// Members of one kind, between two periods of work.
pub(crate) struct Fleet<M> {
    members: Vec<M>,
    /// Number of the next operation.
    number: u64,
}

/// A member at work.
pub(crate) struct Working<M> {
    members: JoinSet<M>,
    pace: Arc<Pace>,
    tally: Arc<Mutex<Tally>>,
}

impl<M: Member> Fleet<M> {
    pub(crate) fn new(members: Vec<M>) -> Self {
        Self { members, number: 0 }
    }

    /// Starts the members for `time`, at `rate` operations a second in total, of which those are left out that are late
    /// by a whole period.
    pub(crate) fn work_skipping(self, rate: f64, time: Duration) -> Result<Working<M>, FleetError> {
        let pace = Pace::new(Some(rate), time, self.number).skipping();
        self.work_at(pace)
    }

    /// Starts the members for `time`, without a pause or at `rate` operations a second in total.
    pub(crate) fn work(self, rate: Option<f64>, time: Duration) -> Result<Working<M>, FleetError> {
        let pace = Pace::new(rate, time, self.number);
        self.work_at(pace)
    }

    fn work_at(self, pace: Pace) -> Result<Working<M>, FleetError> {
        let pace = Arc::new(pace);
        let tally = Arc::new(Mutex::new(Tally::new()?));
        let mut members = JoinSet::new();
        for member in self.members {
            members.spawn(work(member, Arc::clone(&pace), Arc::clone(&tally)));
        }
        Ok(Working { members, pace, tally })
    }
}

impl<M: Member> Working<M> {
    /// Returns the tally since the last call.
    pub(crate) fn tally(&self) -> Result<Tally, FleetError> {
        Ok(std::mem::replace(&mut *self.tally.lock(), Tally::new()?))
    }

    /// Waits for the end of the period and of all operations; returns the members and the rest of the tally.
    pub(crate) async fn end(mut self) -> Result<(Fleet<M>, Tally), FleetError> {
        let mut members = Vec::new();
        while let Some(member) = self.members.join_next().await {
            members.push(member.map_err(FleetError::failed)?);
        }
        Ok((Fleet { members, number: self.pace.next() }, self.tally()?))
    }
}

async fn work<M: Member>(mut member: M, pace: Arc<Pace>, tally: Arc<Mutex<Tally>>) -> M {
    while let Some(due) = pace.due().await {
        let failed = member.carry_out(due.number).await.err();
        tally.lock().count(due.since.elapsed(), failed.map(|error| error.to_string()));
    }
    member
}
