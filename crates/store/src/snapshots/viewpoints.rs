//! Reading of the viewpoints of a map file, some at a time.

use prost::Message;

use super::body::{Body, number};
use super::limits::{MapFileError, MapFileLimits, Memory};
use crate::codec::Unreadable;
use crate::pb;
use mrol_map::visibility::{VIEWPOINT_MEMORY_MAX, ViewpointSet};

/// Viewpoints that memory is reserved for at once.
const VIEWPOINTS_PER_RESERVE: usize = 64;
/// Viewpoints between two checks of the stop signal: some milliseconds.
const VIEWPOINTS_PER_STOP_CHECK: usize = 16;
/// Most bytes of a viewpoint: an image, a pose and a revision.
const RECORD_BYTES_MAX: usize = 8192 + 128;

impl Body<'_> {
    /// Decodes the viewpoints, of which each has a revision of its own.
    pub(super) fn viewpoints<E>(
        &self,
        limits: &MapFileLimits,
        memory: &mut Memory<impl FnMut(u64) -> Result<(), E>>,
    ) -> Result<ViewpointSet, MapFileError<E>> {
        let (mut viewpoints, mut last) = (ViewpointSet::default(), 0);
        let records = self.records(number::VIEWPOINTS, RECORD_BYTES_MAX);
        for (i, record) in self.stop.paced(records, VIEWPOINTS_PER_STOP_CHECK).enumerate() {
            if i.is_multiple_of(VIEWPOINTS_PER_RESERVE) {
                memory.reserve(VIEWPOINTS_PER_RESERVE * VIEWPOINT_MEMORY_MAX)?;
            }
            let message = pb::Viewpoint::decode(record?).map_err(|e| format!("a viewpoint: {e}"))?;
            let (revision, viewpoint) = message.try_into().map_err(|e: Unreadable| e)?;
            if revision <= last {
                return Err("the revisions of its viewpoints must ascend from 1".to_owned().into());
            }
            last = revision;
            viewpoints.insert(revision, viewpoint);
            let (count, most) = (viewpoints.memory_bytes(), limits.viewpoint_bytes_max);
            if count > most {
                let (what, limit) = ("bytes of viewpoints", "viewpoint_bytes_max");
                return Err(MapFileError::TooLarge { what, count, limit, most });
            }
        }
        Ok(viewpoints)
    }
}
