//! Every limit of the server, by name, with its default.

use std::time::Duration;

use super::{Marks, Reason, ServiceError};

/// Bounds on what callers may ask. Each is named in the error of a request beyond it.
#[derive(Debug, Clone, PartialEq)]
pub struct Limits {
    /// Points of one query, deletion or scan. 2,000,000.
    pub points_per_request_max: usize,
    /// Keys of one deletion. 2,000,000.
    pub keys_per_request_max: usize,
    /// Maps at once. 64.
    pub maps_max: usize,
    /// Finest voxels of one map. 200,000,000.
    pub voxels_per_map_max: usize,
    /// Voxels that one listing may return. 20,000,000.
    pub listed_voxels_max: usize,
    /// Poses of one page of a trajectory, and of one that is asked for without a limit. 5,000.
    pub trajectory_page_max: usize,
    /// Robots of which one map keeps scans, or ids of scans. 4,096.
    pub robots_per_map_max: usize,
    /// Jobs that may wait for a query thread, and as many for a thread of each other pool. 256.
    pub jobs_waiting_max: usize,
    /// Bytes of a map file that is restored, before and after compression. 1 GiB.
    pub map_file_bytes_max: usize,
    /// Scans of a map file that is restored, and as many that were taken out again. 20,000,000.
    pub map_file_scans_max: usize,
    /// How long a read waits for `min_revision` where the caller sets no deadline. 10 s.
    pub min_revision_wait_max: Duration,
    /// How long aligning a scan may take that is not inserted. 10 s.
    pub alignment_time_max: Duration,
    /// How long aligning and preparing a scan may take that is to be inserted. 30 s.
    pub insertion_time_max: Duration,
    /// How long finding out may take what an undo takes back. 60 s.
    pub undo_time_max: Duration,
    /// How long a search with no guess may take. 60 s.
    pub localization_time_max: Duration,
    /// Candidates of one search, which keeps that many places. 16.
    pub localization_candidates_max: usize,
    /// Memory for the dilated levels of one search; a map that takes more is searched at a coarser resolution, or in
    /// a box. 512 MiB.
    pub localization_grid_bytes_max: usize,
    /// Of disk and memory, where changes are refused.
    pub marks: Marks,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            points_per_request_max: 2_000_000,
            keys_per_request_max: 2_000_000,
            maps_max: 64,
            voxels_per_map_max: 200_000_000,
            listed_voxels_max: 20_000_000,
            trajectory_page_max: 5_000,
            robots_per_map_max: 4_096,
            jobs_waiting_max: 256,
            map_file_bytes_max: 1 << 30,
            map_file_scans_max: 20_000_000,
            min_revision_wait_max: Duration::from_secs(10),
            alignment_time_max: Duration::from_secs(10),
            insertion_time_max: Duration::from_secs(30),
            undo_time_max: Duration::from_secs(60),
            localization_time_max: Duration::from_secs(60),
            localization_candidates_max: 16,
            localization_grid_bytes_max: 512 << 20,
            marks: Marks::default(),
        }
    }
}

impl Limits {
    /// # Errors
    /// When a request has no point, or more than `points_per_request_max`.
    pub(super) fn check_points(&self, points: usize) -> Result<(), ServiceError> {
        within("points", "points_per_request_max", points, self.points_per_request_max)
    }

    /// # Errors
    /// When a request has no key, or more than `keys_per_request_max`.
    pub(super) fn check_keys(&self, keys: usize) -> Result<(), ServiceError> {
        within("keys", "keys_per_request_max", keys, self.keys_per_request_max)
    }

    /// The poses of a page, where `limit` of them are asked for.
    ///
    /// # Errors
    /// When these are none, or more than `trajectory_page_max`.
    pub(super) fn page(&self, limit: Option<usize>) -> Result<usize, ServiceError> {
        let most = self.trajectory_page_max;
        match limit {
            None => Ok(most),
            Some(limit) if (1..=most).contains(&limit) => Ok(limit),
            Some(limit) => {
                let message = format!(
                    "limit must be 1 to trajectory_page_max, which is {most}, got {limit}: ask for the next page by \
                     since_revision"
                );
                Err(ServiceError::new(Reason::PageTooLarge, message))
            }
        }
    }
}

fn within(field: &str, limit: &str, count: usize, most: usize) -> Result<(), ServiceError> {
    match count {
        0 => Err(ServiceError::new(Reason::EmptyBatch, format!("{field} must not be empty"))),
        n if n > most => Err(ServiceError::new(
            Reason::BatchTooLarge,
            format!("{field} has {n} entries, {limit} is {most}"),
        )),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_is_bounded_on_both_sides_and_the_error_names_the_limit() {
        let limits = Limits { trajectory_page_max: 10, ..Limits::default() };
        assert_eq!([None, Some(10), Some(1)].map(|limit| limits.page(limit).unwrap()), [10, 10, 1]);
        for bad in [0, 11] {
            let error = limits.page(Some(bad)).unwrap_err();
            assert!(
                error.message.contains(&format!("trajectory_page_max, which is 10, got {bad}")),
                "{error}"
            );
        }
    }

    #[test]
    fn a_batch_is_bounded_on_both_sides_and_the_error_names_the_limit() {
        let limits = Limits { points_per_request_max: 10, ..Limits::default() };
        assert!(limits.check_points(1).is_ok() && limits.check_points(10).is_ok());
        assert!(limits.check_points(0).unwrap_err().message.contains("points must not be empty"));
        let error = limits.check_points(11).unwrap_err();
        assert!(error.message.contains("11") && error.message.contains("points_per_request_max is 10"));
    }
}
