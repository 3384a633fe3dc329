//! Measurement of a replica's queries: the same ones through the replica, and through its map as `mrol-lab bench
//! lookup` asks.

use super::stopwatch::Runs;
use crate::rivals::{Structure, ThroughMap};
use mrol_client::{Replica, ReplicaError};
use mrol_map::geometry::Pose;
use mrol_map::map::MultiResolutionMap;
use mrol_service::PointQuery;

/// Times of both, nanoseconds a point, and how many points they called occupied.
#[derive(Debug, Clone, Default)]
pub struct Compared {
    /// Through the replica's map and its locks.
    pub map: Runs,
    /// Through the replica.
    pub replica: Runs,
    /// Number of points that are occupied, as the replica says and as its map does.
    pub occupied: [usize; 2],
}

impl Compared {
    /// Times one pass over all queries each, after one that is not timed.
    ///
    /// # Errors
    /// When the replica refuses a query.
    pub fn pass(&mut self, replica: &Replica, queries: &[PointQuery]) -> Result<(), ReplicaError> {
        let points = queries.iter().map(|query| query.points.len()).sum();
        let (map, longest) = (replica.map(), queries.iter().map(|query| query.points.len()).max());
        let mut words = vec![0; longest.unwrap_or_default().div_ceil(64)];
        let mut through_map = || queries.iter().map(|query| ask_map(&map, query, &mut words)).sum::<usize>();
        through_map();
        let by_map = self.map.time(points, through_map);
        through_replica(replica, queries)?;
        let by_replica = self.replica.time(points, || through_replica(replica, queries))?;
        self.occupied = [by_replica, by_map];
        Ok(())
    }
}

fn through_replica(replica: &Replica, queries: &[PointQuery]) -> Result<usize, ReplicaError> {
    queries.iter().map(|query| Ok(replica.query_points(query)?.points_occupied)).sum()
}

fn ask_map(map: &MultiResolutionMap, query: &PointQuery, words: &mut [u64]) -> usize {
    let words = &mut words[..query.points.len().div_ceil(64)];
    let map_from_points = query.map_from_points.unwrap_or_else(Pose::identity);
    ThroughMap::new(map, query.level, query.lookup).occupied(
        query.points.as_slice(),
        &map_from_points,
        words,
    );
    words.iter().map(|word| word.count_ones() as usize).sum()
}
