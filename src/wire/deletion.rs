//! Deletions (`mapping.proto`).

use super::occupancy::keys_from;
use super::types::count_from;
use super::{InField, pb, required};
use crate::map::{MapName, Region};
use crate::service::{Deletion, DeletionAnswer, DeletionTarget, ServiceError};

impl TryFrom<pb::DeleteVoxelsRequest> for (MapName, Deletion) {
    type Error = ServiceError;

    fn try_from(request: pb::DeleteVoxelsRequest) -> Result<Self, ServiceError> {
        use pb::delete_voxels_request::Target;
        let target = match required(request.target, "target")? {
            Target::Points(points) => DeletionTarget::Points(points.try_into().in_field("points")?),
            Target::Keys(keys) => DeletionTarget::Keys(keys_from(&keys.keys)?),
            Target::Region(region) => DeletionTarget::Region(Region::try_from(region)?),
        };
        Ok((MapName::new(&request.map)?, Deletion { target, level: request.level }))
    }
}

impl From<(&MapName, Deletion)> for pb::DeleteVoxelsRequest {
    fn from((map, deletion): (&MapName, Deletion)) -> Self {
        use pb::delete_voxels_request::Target;
        let target = match deletion.target {
            DeletionTarget::Points(points) => Target::Points(points.into()),
            DeletionTarget::Keys(keys) => {
                Target::Keys(pb::VoxelKeys { keys: keys.iter().map(|key| key.to_bits()).collect() })
            }
            DeletionTarget::Region(region) => Target::Region(region.into()),
        };
        Self { map: map.to_string(), target: Some(target), level: deletion.level }
    }
}

impl From<DeletionAnswer> for pb::DeleteVoxelsResponse {
    fn from(answer: DeletionAnswer) -> Self {
        Self { removed: answer.removed as u64, state: Some(answer.state.into()) }
    }
}

impl TryFrom<pb::DeleteVoxelsResponse> for DeletionAnswer {
    type Error = ServiceError;

    fn try_from(answer: pb::DeleteVoxelsResponse) -> Result<Self, ServiceError> {
        let state = required(answer.state, "state")?.try_into()?;
        Ok(Self { removed: count_from(answer.removed), state })
    }
}
