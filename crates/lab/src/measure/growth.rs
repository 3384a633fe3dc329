//! Measurement of a map's growth: memory, and the latencies of commits and of a reader.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use super::insert::{bytes, filter_bytes};
use crate::rivals::{Structure, ThroughMap};
use crate::workload::{Order, Queries, Workload, add};
use mrol_map::map::{Lookup, MapSettings, MapSettingsError, MultiResolutionMap};

/// Measurements while a map grew from nothing to a workload's size.
#[derive(Debug, Clone, PartialEq)]
pub struct Growth {
    /// Number of voxels at the end.
    pub voxels: usize,
    /// Bytes for each finest voxel, of all levels, filters and counters: least and most after any commit but the first
    /// ones.
    pub bytes_per_voxel: (f64, f64),
    /// Durations of the commits that did not enlarge a filter, milliseconds, ascending.
    pub commits_ms: Vec<f64>,
    /// Durations of the commits that enlarged a filter, milliseconds, ascending.
    pub growing_commits_ms: Vec<f64>,
    /// Durations of a reader's queries of [`READ_POINTS`] points meanwhile, microseconds, ascending.
    pub reads_us: Vec<f32>,
}

/// Number of points of a reader's query.
pub const READ_POINTS: usize = 640;
/// Pause of a reader between two queries: it is to meet the writer, not to hinder it.
const READ_REST: Duration = Duration::from_micros(50);
/// Number of voxels below which bytes for each voxel say little.
const VOXELS_MIN: usize = 100_000;

/// Streams a workload into a map, piece by piece, while one thread reads.
///
/// # Errors
/// When a setting is out of range.
pub fn watch(workload: Workload, settings: MapSettings, seed: u64) -> Result<Growth, MapSettingsError> {
    let map = MultiResolutionMap::new(settings)?;
    let queries = workload.queries(Order::Random, 100 * READ_POINTS, seed);
    let over = AtomicBool::new(false);
    let mut growth = std::thread::scope(|threads| {
        let reading = threads.spawn(|| read(&map, &queries, &over));
        let mut growth = grow(&map, workload);
        over.store(true, Ordering::Relaxed);
        growth.reads_us = reading.join().unwrap_or_default();
        growth
    });
    growth.commits_ms.sort_unstable_by(f64::total_cmp);
    growth.growing_commits_ms.sort_unstable_by(f64::total_cmp);
    growth.reads_us.sort_unstable_by(f32::total_cmp);
    Ok(growth)
}

fn grow(map: &MultiResolutionMap, workload: Workload) -> Growth {
    let (mut commits_ms, mut growing_commits_ms) = (Vec::new(), Vec::new());
    let (mut filters, mut least, mut most) = (filter_bytes(map), f64::INFINITY, 0.0f64);
    for voxels in workload.pieces() {
        let start = Instant::now();
        add(map, voxels);
        let ms = start.elapsed().as_secs_f64() * 1e3;
        let before = std::mem::replace(&mut filters, filter_bytes(map));
        if filters == before { &mut commits_ms } else { &mut growing_commits_ms }.push(ms);
        let voxels = map.voxels(0);
        let each = bytes(map) as f64 / voxels as f64;
        if voxels >= VOXELS_MIN {
            (least, most) = (least.min(each), most.max(each));
        }
    }
    Growth {
        voxels: map.voxels(0),
        bytes_per_voxel: (least, most),
        commits_ms,
        growing_commits_ms,
        reads_us: Vec::new(),
    }
}

fn read(map: &MultiResolutionMap, queries: &Queries, over: &AtomicBool) -> Vec<f32> {
    let (map, mut reads_us) = (ThroughMap::new(map, 0, Lookup::Bloom), Vec::new());
    let mut occupied = [0; READ_POINTS / 64];
    for points in queries.points.chunks_exact(READ_POINTS).cycle() {
        let start = Instant::now();
        map.occupied(points, &queries.map_from_points, &mut occupied);
        reads_us.push(start.elapsed().as_secs_f32() * 1e6);
        if over.load(Ordering::Relaxed) {
            break;
        }
        std::thread::sleep(READ_REST);
    }
    reads_us
}

/// Peak resident memory of this process, bytes; none where the system does not report it.
pub fn peak_resident_bytes() -> Option<usize> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kib: usize = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kib << 10)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::workload::Site;

    #[test]
    fn every_commit_and_every_read_is_seen() {
        let site = Workload::Site(Site::of(300_000, 1));
        let growth = watch(site, MapSettings::new(site.resolution_m(), 4), 1).unwrap();
        assert!((290_000..310_000).contains(&growth.voxels));
        assert_eq!(growth.commits_ms.len() + growth.growing_commits_ms.len(), site.pieces().count());
        assert!(!growth.growing_commits_ms.is_empty() && !growth.reads_us.is_empty());
        let (least, most) = growth.bytes_per_voxel;
        assert!(least > 1.0 && least <= most && most < 100.0, "{least} to {most}");
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn memory_that_was_held_is_seen() {
        let before = peak_resident_bytes().unwrap();
        let held = vec![1u8; before];
        assert!(peak_resident_bytes().unwrap() > before, "{} bytes", std::hint::black_box(held).len());
    }
}
