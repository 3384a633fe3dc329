//! A map as a recording, which viewers of logs show: voxels, grid, and the ways of the robots.

use std::collections::BTreeMap;
use std::fs::File;

use nalgebra::Point3;

use super::exported::Content;
use super::source::Voxels;
use crate::cli::map_source::MapSource;
use mrol::console::{CliError, NewFile, Output};
use mrol_files::{RecordedPose, begin_recording};
use mrol_map::geometry::Point;
use mrol_map::map::{MappedScan, RobotName};
use mrol_map::planning::{BandFrom, Grid, GridArea};
use mrol_service::{GridQuestion, GridScope, QuestionScope};

/// Time from one pose to the next where nobody says when they were taken, nanoseconds.
const STEP_NS: u64 = 1_000_000_000;

/// Writes a map as a recording. A grid that cannot be drawn is left out, with a note.
///
/// # Errors
/// When the file cannot be written, or the server refuses.
pub(super) async fn write(
    out: &NewFile,
    voxels: &Voxels,
    source: MapSource,
    band_m: [f64; 2],
    output: &Output,
) -> Result<Content, CliError> {
    let ways = ways_of(&source.poses().await?);
    let begin_ns = ways.values().flatten().map(|pose| pose.stamp_ns).min().unwrap_or_default();
    let scope = GridScope {
        area: GridArea::Occupied,
        band_m,
        band_from: BandFrom::Floor,
        cell_m: None,
        tells_unknown: true,
    };
    let asked = QuestionScope { level: voxels.level, ..QuestionScope::default() };
    let grid = source.grid(GridQuestion { asked, scope }).await;

    let failed = |error| out.failed(error);
    let file = File::create(out.path()).map_err(|problem| out.failed(problem))?;
    let mut recording = begin_recording(file, begin_ns).map_err(failed)?;
    let centers = voxels.centers_m().map(|center_m| Point::from(Point3::from(center_m)));
    recording.write_voxels(&centers.collect::<Vec<_>>()).map_err(failed)?;
    let grid = grid.inspect_err(|error| output.note(format!("the recording has no grid: {error}"))).ok();
    if let Some(grid) = &grid {
        recording.write_grid(grid).map_err(failed)?;
    }
    for (robot, poses) in &ways {
        recording.write_way(robot, poses).map_err(failed)?;
    }
    recording.finish().map_err(failed)?;
    let grid_cells = grid.as_ref().map(Grid::cells);
    let poses = ways.values().map(Vec::len).sum();
    Ok(Content::Recording { points: voxels.keys.len(), grid_cells, robots: ways.len(), poses })
}

/// The poses of each robot in the order of time. Where one has no time, they are a second apart.
fn ways_of(poses: &[MappedScan]) -> BTreeMap<RobotName, Vec<RecordedPose>> {
    let stamp_ns = |pose: &MappedScan| pose.timestamp_ns.and_then(|stamp_ns| u64::try_from(stamp_ns).ok());
    let are_stamped = poses.iter().all(|pose| stamp_ns(pose).is_some());
    let mut ways: BTreeMap<RobotName, Vec<RecordedPose>> = BTreeMap::new();
    for (step_ns, pose) in (0..).step_by(STEP_NS as usize).zip(poses) {
        let stamp_ns = stamp_ns(pose).filter(|_| are_stamped).unwrap_or(step_ns);
        let recorded = RecordedPose { stamp_ns, map_from_sensor: pose.map_from_sensor };
        ways.entry(pose.robot.clone()).or_default().push(recorded);
    }
    ways.values_mut().for_each(|way| way.sort_by_key(|pose| pose.stamp_ns));
    ways
}

#[cfg(test)]
mod tests {
    use super::*;
    use mrol_map::geometry::Pose;

    #[test]
    fn poses_without_a_time_are_a_second_apart_and_those_with_one_in_its_order() {
        let pose = |robot: &str, timestamp_ns: Option<i64>| {
            let pose = MappedScan::new(RobotName::new(robot).unwrap(), Pose::identity());
            MappedScan { timestamp_ns, ..pose }
        };
        let stamps = |poses: &[MappedScan]| -> Vec<Vec<u64>> {
            let of = |way: &Vec<RecordedPose>| way.iter().map(|pose| pose.stamp_ns).collect();
            ways_of(poses).values().map(of).collect()
        };
        assert_eq!(stamps(&[]), Vec::<Vec<u64>>::new());
        let all = [pose("a", Some(9)), pose("b", Some(5)), pose("a", Some(7))];
        assert_eq!(stamps(&all), [vec![7, 9], vec![5]]);
        for without in [None, Some(-1)] {
            let some = [pose("a", Some(9)), pose("b", without), pose("a", Some(7))];
            assert_eq!(stamps(&some), [vec![0, 2_000_000_000], vec![1_000_000_000]]);
        }
    }
}
