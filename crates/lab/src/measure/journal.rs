//! Measurement of durability: the same scans at the same poses, sent by several robots at once, with and without a
//! journal.

use std::path::Path;
use std::time::{Duration, Instant};

use tokio::task::JoinSet;

use crate::workload::Queries;
use mrol_map::map::{MapName, MapSettings, RobotName};
use mrol_map::mapping::Guess;
use mrol_service::{MapService, PointCloud, ScanRequest, ServiceError, ServiceSettings};
use mrol_store::{Durability, OpeningProgress, StoreSettings};

/// Where a service keeps its maps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Keeping {
    /// In memory only.
    InMemory,
    /// In a folder, with this durability.
    OnDisk(Durability),
}

/// Scans of several robots.
#[derive(Debug, Clone)]
pub struct Scans {
    /// Scans of each robot.
    of_robots: Vec<Vec<PointCloud>>,
    /// Pose of all scans.
    guess: Guess,
}

impl Scans {
    /// Divides `points` into scans of `scan_points` points, dealt out to `robots` robots.
    pub fn of(points: &Queries, scan_points: usize, robots: usize) -> Self {
        let mut of_robots = vec![Vec::new(); robots];
        for (i, scan) in points.points.chunks(scan_points).enumerate() {
            of_robots[i % robots].push(scan.to_vec().into());
        }
        Self { of_robots, guess: Guess::Pose(points.map_from_points) }
    }

    /// Number of scans.
    pub fn len(&self) -> usize {
        self.of_robots.iter().map(Vec::len).sum()
    }

    /// True when there is no scan.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// Times the insertion of all scans into a new service, and returns the duration and the bytes of journal. Each robot
/// sends its next scan when the last is acknowledged. `folder` must be empty or not exist.
///
/// # Errors
/// When the service refuses.
pub async fn insert(
    settings: MapSettings,
    scans: &Scans,
    keeping: Keeping,
    folder: &Path,
) -> Result<(Duration, u64), ServiceError> {
    let service = open(keeping, folder)?;
    let map = MapName::new("bench")?;
    service.create_map(map.clone(), settings).await?;
    let mut robots = JoinSet::new();
    let start = Instant::now();
    for (number, own) in scans.of_robots.iter().enumerate() {
        let robot = RobotName::new(&format!("robot-{number}"))?;
        robots.spawn(send(service.clone(), map.clone(), robot, own.clone(), scans.guess));
    }
    for sent in robots.join_all().await {
        sent?;
    }
    let elapsed = start.elapsed();
    let storage = service.map_info(&map).await?.storage;
    Ok((elapsed, storage.map_or(0, |storage| storage.journal.bytes)))
}

fn open(keeping: Keeping, folder: &Path) -> Result<MapService, ServiceError> {
    let kept = match keeping {
        Keeping::InMemory => ServiceSettings::default(),
        Keeping::OnDisk(durability) => ServiceSettings {
            data_dir: Some(folder.to_owned()),
            store: StoreSettings { durability, ..StoreSettings::default() },
            ..ServiceSettings::default()
        },
    };
    MapService::open(kept, &OpeningProgress::default())
}

async fn send(
    service: MapService,
    map: MapName,
    robot: RobotName,
    scans: Vec<PointCloud>,
    guess: Guess,
) -> Result<(), ServiceError> {
    for (scan_id, points) in (0..).zip(scans) {
        let scan = ScanRequest {
            scan_id: Some(scan_id),
            guess,
            at_guess: true,
            ..ScanRequest::new(robot.clone(), points)
        };
        service.insert_scan(&map, scan).await?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::workload::{Order, Room, Workload};

    #[tokio::test]
    async fn every_way_of_keeping_takes_all_scans() {
        let points = Workload::Room(Room).queries(Order::Scan, 10_000, 1);
        let scans = Scans::of(&points, 1000, 3);
        assert_eq!(scans.len(), 10);
        let every_second = Keeping::OnDisk(Durability::Interval(Duration::from_secs(1)));
        for keeping in [Keeping::InMemory, Keeping::OnDisk(Durability::Always), every_second] {
            let folder = tempfile::tempdir().unwrap();
            let (_, bytes) = insert(MapSettings::new(0.05, 4), &scans, keeping, folder.path()).await.unwrap();
            assert_eq!(bytes > 0, keeping != Keeping::InMemory);
        }
    }
}
