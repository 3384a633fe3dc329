//! The service with its work counted, once for every protocol.

use super::Metrics;
use crate::map::{CallerName, MapName};
use crate::service::{
    AllowedMaps, AllowedScans, Deletion, DeletionAnswer, MapInfo, MapService, PointAnswer, PointQuery,
    ScanAnswer, ScanRequest, ServiceError, Undo, UndoAnswer,
};

/// A [`MapService`] whose queries, insertions and deletions are counted by map; what is not counted is asked of
/// [`MeteredService::maps`].
#[derive(Debug, Clone)]
pub struct MeteredService {
    service: MapService,
    metrics: Metrics,
}

impl MeteredService {
    /// `service`, counted in `metrics`.
    pub fn new(service: MapService, metrics: Metrics) -> Self {
        Self { service, metrics }
    }

    /// The same for a caller of a name, who may name no others than the allowed maps, nor send others than the scans of `scans`.
    pub fn limited_to(
        &self,
        caller: Option<CallerName>,
        allowed_maps: AllowedMaps,
        scans: AllowedScans,
    ) -> Self {
        Self { service: self.service.limited_to(caller, allowed_maps, scans), metrics: self.metrics.clone() }
    }

    /// The service itself.
    pub fn maps(&self) -> &MapService {
        &self.service
    }

    /// Where its work is counted.
    pub fn metrics(&self) -> &Metrics {
        &self.metrics
    }

    /// Everything that is measured in Prometheus' text form, with what is known of `maps`.
    pub fn render(&self, maps: &[MapInfo]) -> String {
        let (pools, names) = (self.service.pools(), self.service.map_names());
        self.metrics.render(&pools, &names, maps, &self.service.unavailable_maps())
    }

    /// Folds what was measured, and forgets what was measured of maps that are gone; to be called now and then with a
    /// service that reaches every map.
    pub fn upkeep(&self) {
        self.metrics.upkeep();
        self.metrics.keep_maps(&self.service.map_names());
    }

    /// [`MapService::measure`], shown. May block as well.
    pub fn measure(&self) {
        let readings = self.service.measure();
        self.metrics.room(&readings, &self.service.shortages());
    }

    /// [`MapService::query_points`], counted.
    ///
    /// # Errors
    /// Those of the service.
    pub async fn query_points(&self, map: &MapName, query: PointQuery) -> Result<PointAnswer, ServiceError> {
        let lookup = query.lookup;
        let answer = self.service.query_points(map, query).await?;
        self.metrics.points_queried(map, lookup, answer.points);
        Ok(answer)
    }

    /// [`MapService::insert_scan`], counted unless it is a replay.
    ///
    /// # Errors
    /// Those of the service.
    pub async fn insert_scan(&self, map: &MapName, scan: ScanRequest) -> Result<ScanAnswer, ServiceError> {
        let robot = scan.robot.clone();
        let answer = self.service.insert_scan(map, scan).await?;
        if !answer.replayed {
            self.metrics.scan(map, &robot, answer.verdict);
        }
        Ok(answer)
    }

    /// [`MapService::undo`], counted.
    ///
    /// # Errors
    /// Those of the service.
    pub async fn undo(&self, map: &MapName, undo: Undo) -> Result<UndoAnswer, ServiceError> {
        let answer = self.service.undo(map, undo).await?;
        if !answer.replayed {
            self.metrics.scans_undone(map, answer.scans);
            self.metrics.voxels_removed(map, answer.removed);
        }
        Ok(answer)
    }

    /// [`MapService::delete_voxels`], counted unless it is a replay.
    ///
    /// # Errors
    /// Those of the service.
    pub async fn delete_voxels(
        &self,
        map: &MapName,
        deletion: Deletion,
    ) -> Result<DeletionAnswer, ServiceError> {
        let answer = self.service.delete_voxels(map, deletion).await?;
        if !answer.replayed {
            self.metrics.voxels_removed(map, answer.removed);
        }
        Ok(answer)
    }
}
