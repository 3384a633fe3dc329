//! Streams of requests on one call, answered in order.

use tokio_stream::{Stream, StreamExt};

use super::answers::Answers;
use super::client::Client;
use super::error::ClientError;
use crate::wire::pb;
use mrol_map::map::MapName;
use mrol_service::{PointAnswer, PointQuery, ScanAnswer, ScanRequest, ServiceError};

impl Client {
    /// Inserts scans one after the other, with one answer for each: [`Client::insert_scan`] without a round trip
    /// between two scans. `scans` is polled as fast as the server accepts scans. A scan that the
    /// server refuses is an error among the answers, [`ClientError::Refused`], and the next answer is that of the
    /// next scan.
    ///
    /// # Errors
    /// When the server cannot be reached.
    pub async fn insert_scans(
        &self,
        map: &MapName,
        scans: impl Stream<Item = ScanRequest> + Send + 'static,
    ) -> Result<Answers<ScanAnswer>, ClientError> {
        let name = map.clone();
        let requests = scans.map(move |scan| pb::InsertScanRequest::from((&name, scan)));
        let on = self.calls.connection_of_stream(map).await?;
        let answers: Result<Answers<Inserted>, _> =
            on.answers(on.mapping().insert_scan_stream(requests).await);
        let answers = answers.map(|answers| Answers::new(answers.map(|inserted| inserted?.0)));
        self.calls.answers(map, answers)
    }

    /// Queries batch after batch, with one answer for each: [`Client::query_points`] without a round trip between two
    /// batches. Each batch is answered at one revision of its own.
    ///
    /// # Errors
    /// When the server cannot be reached; a refused request ends the answers.
    pub async fn query_stream(
        &self,
        map: &MapName,
        queries: impl Stream<Item = PointQuery> + Send + 'static,
    ) -> Result<Answers<PointAnswer>, ClientError> {
        let name = map.clone();
        let requests = queries.map(move |query| pb::QueryPointsRequest::from((&name, query)));
        let (on, requests) =
            (self.calls.connection_of_stream(map).await?, self.calls.requests(map, requests));
        let answers = on.answers(on.occupancy().query_points_stream(requests).await);
        self.calls.answers(map, answers)
    }
}

/// An answer of a stream of scans: what became of the scan, or why it failed.
struct Inserted(Result<ScanAnswer, ClientError>);

impl TryFrom<pb::InsertScanResponse> for Inserted {
    type Error = ServiceError;

    fn try_from(mut answer: pb::InsertScanResponse) -> Result<Self, ServiceError> {
        Ok(Self(match answer.error.take() {
            Some(failure) => Err(failure.into()),
            None => Ok(answer.try_into()?),
        }))
    }
}
