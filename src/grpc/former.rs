//! What requests of a stream leave out, as those before them said it.

use crate::admission::{Admission, MemoryPermit};
use mrol_client::wire::{check_body, pb};
use mrol_service::{Limits, ServiceError};

/// Within which bounds a stream keeps what requests said.
#[derive(Debug, Clone, Copy)]
pub(super) struct Keeping<'a> {
    pub(super) admission: &'a Admission,
    pub(super) limits: &'a Limits,
}

/// The body of the requests before, in memory of its own, which counts as long as it is kept.
#[derive(Debug, Default)]
pub(super) struct FormerBody {
    body: Option<pb::Body>,
    _counted: Option<MemoryPermit>,
}

/// The map that a request names; where the name is empty, that of the request before.
pub(super) fn same_map(map: &mut String, former: &mut String) {
    if map.is_empty() { map.clone_from(former) } else { former.clone_from(map) }
}

impl FormerBody {
    /// The body of a request, or that of the request before.
    ///
    /// # Errors
    /// When the body has more parts than may be, or there is no room to keep it.
    pub(super) fn complete(
        &mut self,
        body: &mut Option<pb::Body>,
        keeping: Keeping<'_>,
    ) -> Result<(), ServiceError> {
        let Some(said) = body else {
            body.clone_from(&self.body);
            return Ok(());
        };
        check_body(said, keeping.limits)?;
        // What was kept makes room first.
        *self = Self::default();
        let counted = keeping.admission.keep(said.copied_bytes())?;
        *self = Self { body: Some(said.copied()), _counted: Some(counted) };
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use axum::body::Bytes;

    use super::*;
    use crate::admission::Lifecycle;

    const SPHERE_BYTES: usize = 16;

    /// A body of so many spheres, whose bytes are a part of a message of a megabyte.
    fn body(spheres: usize) -> (Bytes, Option<pb::Body>) {
        let message = Bytes::from(vec![0; 1 << 20]);
        let spheres_f32le = message.slice(..spheres * SPHERE_BYTES);
        (message, Some(pb::Body { links: vec![pb::Link { spheres_f32le, ..pb::Link::default() }] }))
    }

    #[test]
    fn a_body_is_kept_without_its_message_and_counts_as_long_as_it_is_kept() {
        let limits = Limits { body_parts_max: 10, body_bytes_max: 2048, ..Limits::default() };
        let admission = Admission::new(&limits, Lifecycle::default());
        let keeping = Keeping { admission: &admission, limits: &limits };
        let mut former = FormerBody::default();
        for spheres in [9, 3] {
            let (message, mut said) = body(spheres);
            former.complete(&mut said, keeping).unwrap();
            drop(said);
            assert!(message.is_unique(), "the message is kept");
            let kept = size_of::<pb::Link>() + spheres * SPHERE_BYTES;
            assert_eq!(admission.in_use().bytes, kept);
        }
        let mut left_out = None;
        former.complete(&mut left_out, keeping).unwrap();
        assert_eq!(left_out.unwrap().parts(), 4);
        drop(former);
        assert_eq!(admission.in_use().bytes, 0);
    }

    #[test]
    fn a_body_that_is_too_large_is_not_kept() {
        let limits = Limits { body_parts_max: 10, body_bytes_max: 200, ..Limits::default() };
        let admission = Admission::new(&limits, Lifecycle::default());
        let keeping = Keeping { admission: &admission, limits: &limits };
        let mut former = FormerBody::default();
        let mut refusal = |spheres| former.complete(&mut body(spheres).1, keeping).unwrap_err().message;
        assert!(refusal(10).contains("body has 11 links, spheres and points, body_parts_max is 10"));
        assert!(refusal(9).contains("body_bytes_max is 200"));
        assert_eq!(admission.in_use().bytes, 0);
    }
}
