//! What is refused for its size, with the limit that says so.

use super::service_limits::Limits;
use crate::error::{Reason, ServiceError};

/// Bytes of a message besides those of a block, at most.
const BESIDE_BLOCK_BYTES: usize = 1 << 10;

impl Limits {
    /// # Errors
    /// When a request has no point, or more than `points_per_request_max`.
    pub(crate) fn check_points(&self, points: usize) -> Result<(), ServiceError> {
        within("points", "points_per_request_max", points, self.points_per_request_max)
    }

    /// # Errors
    /// When a request has no element of `field`, such as rays, or more than `points_per_request_max`.
    pub(crate) fn check_elements(&self, field: &str, elements: usize) -> Result<(), ServiceError> {
        within(field, "points_per_request_max", elements, self.points_per_request_max)
    }

    /// # Errors
    /// When a request has no key, or more than `keys_per_request_max`.
    pub(crate) fn check_keys(&self, keys: usize) -> Result<(), ServiceError> {
        within("keys", "keys_per_request_max", keys, self.keys_per_request_max)
    }

    /// # Errors
    /// When the body of a question has more links, spheres and points in all than `body_parts_max`.
    pub fn check_body_parts(&self, parts: usize) -> Result<(), ServiceError> {
        let most = self.body_parts_max;
        if parts <= most {
            return Ok(());
        }
        let message = format!("body has {parts} links, spheres and points, body_parts_max is {most}");
        Err(ServiceError::new(Reason::BatchTooLarge, message))
    }

    /// # Errors
    /// When one of the groups, of so many spheres each, has more than `body_parts_max`.
    pub(crate) fn check_group_sizes(&self, sizes: &[u32]) -> Result<(), ServiceError> {
        let most = self.body_parts_max;
        let Some((i, size)) = sizes.iter().enumerate().find(|(_, size)| **size as usize > most) else {
            return Ok(());
        };
        let message = format!("sizes[{i}] has {size} spheres, body_parts_max is {most}");
        Err(ServiceError::new(Reason::BatchTooLarge, message))
    }

    /// # Errors
    /// When a query of so many points would be compared with more sides of keep-outs than `keep_out_tests_max` in all.
    pub(crate) fn check_keep_out_tests(&self, points: usize, sides: usize) -> Result<(), ServiceError> {
        let most = self.keep_out_tests_max;
        if points.saturating_mul(sides) <= most {
            return Ok(());
        }
        let message = format!(
            "points: {points} of them compared with {sides} sides of keep-outs are more than keep_out_tests_max, {most}: ask for \
             at most {}",
            most / sides.max(1)
        );
        Err(ServiceError::new(Reason::BatchTooLarge, message))
    }

    /// # Errors
    /// When the prism of a keep-out has more corners than `keep_out_corners_max`.
    pub(crate) fn check_corners(&self, corners: usize) -> Result<(), ServiceError> {
        let most = self.keep_out_corners_max;
        if corners <= most {
            return Ok(());
        }
        let message = format!("prism.corners_m has {corners} corners, keep_out_corners_max is {most}");
        Err(ServiceError::new(Reason::BadKeepOut, message))
    }

    /// The bytes that a block may have, and the limit that says so: one message has to hold it.
    pub(crate) fn block_bytes(&self) -> (usize, &'static str) {
        let message = self.message_bytes_max.saturating_sub(BESIDE_BLOCK_BYTES);
        match self.block_bytes_max <= message {
            true => (self.block_bytes_max, "block_bytes_max"),
            false => (message, "message_bytes_max, less 1 KiB,"),
        }
    }

    /// # Errors
    /// When a block is larger than it may be.
    pub(crate) fn check_block_bytes(&self, bytes: usize) -> Result<(), ServiceError> {
        let (most, limit) = self.block_bytes();
        if bytes <= most {
            return Ok(());
        }
        let message = format!(
            "the block has {bytes} bytes or more, {limit} is {most}: ask for a smaller part or a coarser level"
        );
        Err(ServiceError::new(Reason::BlockTooLarge, message))
    }

    /// The poses of a page, where `limit` of them are asked for.
    ///
    /// # Errors
    /// When these are none, or more than `trajectory_page_max`.
    pub(crate) fn page(&self, limit: Option<usize>) -> Result<usize, ServiceError> {
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

    #[test]
    fn points_are_compared_with_as_many_sides_as_the_limit_says_and_no_more() {
        let limits = Limits { keep_out_tests_max: 1000, ..Limits::default() };
        assert!(limits.check_keep_out_tests(10, 100).is_ok() && limits.check_keep_out_tests(5000, 0).is_ok());
        for (points, sides) in [(11, 100), (usize::MAX, 2)] {
            let error = limits.check_keep_out_tests(points, sides).unwrap_err();
            assert!(error.message.contains("keep_out_tests_max, 1000"), "{error}");
        }
    }

    #[test]
    fn a_body_or_a_group_has_as_many_parts_as_the_limit_says_and_no_more() {
        let limits = Limits { body_parts_max: 5, ..Limits::default() };
        assert!(limits.check_body_parts(5).is_ok() && limits.check_group_sizes(&[5, 1, 5]).is_ok());
        let refused = limits.check_body_parts(6).unwrap_err().message;
        assert_eq!(refused, "body has 6 links, spheres and points, body_parts_max is 5");
        let refused = limits.check_group_sizes(&[5, 6]).unwrap_err().message;
        assert_eq!(refused, "sizes[1] has 6 spheres, body_parts_max is 5");
    }

    #[test]
    fn a_prism_has_as_many_corners_as_the_limit_says_and_no_more() {
        let limits = Limits { keep_out_corners_max: 5, ..Limits::default() };
        assert!(limits.check_corners(0).is_ok() && limits.check_corners(5).is_ok());
        let refused = limits.check_corners(6).unwrap_err().message;
        assert_eq!(refused, "prism.corners_m has 6 corners, keep_out_corners_max is 5");
    }

    #[test]
    fn a_block_has_room_in_one_message() {
        let of = |block_bytes_max, message_bytes_max| Limits {
            block_bytes_max,
            message_bytes_max,
            ..Limits::default()
        };
        assert_eq!(of(1000, 2024).block_bytes(), (1000, "block_bytes_max"));
        for (limits, most) in [(of(1001, 2024), 1000), (of(1000, 5), 0)] {
            assert!(limits.check_block_bytes(most).is_ok());
            let error = limits.check_block_bytes(most + 1).unwrap_err();
            assert!(error.message.contains(&format!("message_bytes_max, less 1 KiB, is {most}")), "{error}");
        }
    }
}
