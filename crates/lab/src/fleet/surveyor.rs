//! Surveyors: members of a fleet that change one map all the time, and write down what was acknowledged.

use std::sync::Arc;

use super::address::GrpcAddress;
use super::error::FleetError;
use super::ledger::Ledger;
use super::member::Member;
use super::robot::Seen;
use mrol_client::{Client, new_session};
use mrol_map::map::{MapName, RobotName, SessionName};
use mrol_service::{Deletion, DeletionTarget, ScanRequest};

/// Each so many scans are followed by a deletion, so that scans after it have something to add,
const SCANS_PER_DELETION: u64 = 4;
/// of a ball of this radius, meters.
const DELETED_RADIUS_M: f64 = 1.0;

/// A surveyor that inserts scans at given poses, and now and then deletes what is around a point of them.
pub(crate) struct Surveyor {
    name: RobotName,
    client: Client,
    session: SessionName,
    map: MapName,
    seen: Seen,
    ledger: Arc<Ledger>,
}

impl Surveyor {
    /// A surveyor of `map` that sends what was `seen`.
    pub(crate) async fn new(
        server: &GrpcAddress,
        map: &MapName,
        seen: &Seen,
        ledger: &Arc<Ledger>,
    ) -> Result<Self, FleetError> {
        Ok(Self {
            name: RobotName::new("surveyor").map_err(FleetError::failed)?,
            client: server.connect().await?,
            session: new_session(),
            map: map.clone(),
            seen: seen.clone(),
            ledger: Arc::clone(ledger),
        })
    }
}

impl Member for Surveyor {
    async fn carry_out(&mut self, number: u64) -> Result<(), FleetError> {
        let scan = ScanRequest { at_guess: true, ..self.seen.scan(&self.name, &self.session, number) };
        self.ledger.note(&self.client.insert_scan(&self.map, scan).await?.version);
        if number.is_multiple_of(SCANS_PER_DELETION) {
            let target = DeletionTarget::Region(self.seen.ball(number, DELETED_RADIUS_M)?);
            let deletion = Deletion { target, level: 0, request_id: None };
            self.ledger.note(&self.client.delete_voxels(&self.map, deletion).await?.version);
        }
        Ok(())
    }
}
