//! Blocks of a map (`occupancy.proto`).

use std::num::NonZeroU8;

use super::pb;
use super::values::{count_from, required};
use mrol_map::map::{DistanceBlock, MapName, Region};
use mrol_service::{BlockAnswer, BlockBytes, BlockForm, BlockRequest, BlockVoxels, Reason, ServiceError};

impl TryFrom<pb::GetBlockRequest> for (MapName, BlockRequest) {
    type Error = ServiceError;

    fn try_from(request: pb::GetBlockRequest) -> Result<Self, ServiceError> {
        let pb::GetBlockRequest { map, level, region, dense } = request;
        let region = region.map(Region::try_from).transpose()?;
        let form = match dense {
            None => BlockForm::Sparse { region },
            Some(pb::DenseForm { cap_m }) => {
                BlockForm::Dense { region: required(region, "region of a dense block")?, cap_m }
            }
        };
        Ok((MapName::new(&map)?, BlockRequest { level, form }))
    }
}

impl From<(&MapName, BlockRequest)> for pb::GetBlockRequest {
    fn from((map, BlockRequest { level, form }): (&MapName, BlockRequest)) -> Self {
        let (region, dense) = match form {
            BlockForm::Sparse { region } => (region, None),
            BlockForm::Dense { region, cap_m } => (Some(region), Some(pb::DenseForm { cap_m })),
        };
        Self { map: map.to_string(), level, region: region.map(Into::into), dense }
    }
}

impl From<BlockAnswer> for pb::GetBlockResponse {
    fn from(answer: BlockAnswer) -> Self {
        use pb::get_block_response::Voxels;
        let voxels = match answer.voxels {
            BlockVoxels::Sparse(blocks) => Voxels::Blocks(blocks.into_bytes()),
            BlockVoxels::Dense(block) => Voxels::Dense(block.into()),
        };
        Self {
            version: Some(answer.version.into()),
            level: answer.level,
            resolution_m: answer.resolution_m,
            voxels: Some(voxels),
        }
    }
}

impl TryFrom<pb::GetBlockResponse> for BlockAnswer {
    type Error = ServiceError;

    fn try_from(answer: pb::GetBlockResponse) -> Result<Self, ServiceError> {
        use pb::get_block_response::Voxels;
        let voxels = match required(answer.voxels, "voxels")? {
            Voxels::Blocks(bytes) => BlockVoxels::Sparse(BlockBytes::new(bytes)?),
            Voxels::Dense(block) => BlockVoxels::Dense(block.try_into()?),
        };
        Ok(Self {
            level: answer.level,
            resolution_m: answer.resolution_m,
            voxels,
            version: required(answer.version, "version")?.try_into()?,
        })
    }
}

impl From<DistanceBlock> for pb::DistanceBlock {
    fn from(DistanceBlock { origin, size, cap, distances }: DistanceBlock) -> Self {
        // A size is at most that of a level: 2^21.
        let range = |axis: usize| pb::CellRange { first: origin[axis], count: size[axis] as u32 };
        let [x, y, z] = [0, 1, 2].map(|axis| Some(range(axis)));
        Self { x, y, z, cap: cap.get().into(), distances: distances.into() }
    }
}

impl TryFrom<pb::DistanceBlock> for DistanceBlock {
    type Error = ServiceError;

    fn try_from(block: pb::DistanceBlock) -> Result<Self, ServiceError> {
        let pb::DistanceBlock { x, y, z, cap, distances } = block;
        let ranges = [required(x, "dense.x")?, required(y, "dense.y")?, required(z, "dense.z")?];
        let size = ranges.map(|range| count_from(range.count.into()));
        let cells = size.iter().try_fold(1usize, |cells, &size| cells.checked_mul(size));
        let cap = u8::try_from(cap).ok().and_then(NonZeroU8::new);
        let (Some(cap), true) = (cap, cells == Some(distances.len())) else {
            let message = format!("a dense block of {size:?} cells has {} distances", distances.len());
            return Err(ServiceError::new(Reason::BadBlocks, message));
        };
        Ok(Self { origin: ranges.map(|range| range.first), size, cap, distances: distances.into() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mrol_service::MapVersion;
    use prost::Message;
    use uuid::Uuid;

    fn map() -> MapName {
        MapName::new("a").unwrap()
    }

    #[test]
    fn requests_and_answers_survive_the_wire() {
        let region = Region::cuboid([0.0; 3], [1.0; 3]).unwrap();
        for form in [
            BlockForm::Sparse { region: None },
            BlockForm::Sparse { region: Some(region) },
            BlockForm::Dense { region, cap_m: None },
            BlockForm::Dense { region, cap_m: Some(0.5) },
        ] {
            let request = BlockRequest { level: 3, form };
            let message = pb::GetBlockRequest::from((&map(), request)).encode_to_vec();
            let message = pb::GetBlockRequest::decode(&message[..]).unwrap();
            assert_eq!(<(MapName, BlockRequest)>::try_from(message).unwrap(), (map(), request));
        }
        let dense = DistanceBlock {
            origin: [-7, 0, 8],
            size: [3, 1, 2],
            cap: NonZeroU8::MIN,
            distances: vec![0, 1, 1, 0, 1, 0],
        };
        let sparse = BlockBytes::new(vec![0; 144].into()).unwrap();
        let version = MapVersion { revision: 3, map_uuid: Uuid::from_u128(7), content_hash: None };
        for voxels in [BlockVoxels::Dense(dense), BlockVoxels::Sparse(sparse)] {
            let answer = BlockAnswer { level: 1, resolution_m: 0.1, voxels, version };
            let message = pb::GetBlockResponse::from(answer.clone()).encode_to_vec();
            let message = pb::GetBlockResponse::decode(&message[..]).unwrap();
            assert_eq!(BlockAnswer::try_from(message).unwrap(), answer);
        }
    }

    #[test]
    fn a_dense_block_without_a_region_names_it() {
        let request = pb::GetBlockRequest {
            map: "a".into(),
            dense: Some(pb::DenseForm::default()),
            ..Default::default()
        };
        let error = <(MapName, BlockRequest)>::try_from(request).unwrap_err();
        assert_eq!(error.message, "region of a dense block is missing");
    }

    #[test]
    fn a_servers_distances_that_are_none_are_refused() {
        let range = |count| Some(pb::CellRange { first: 0, count });
        let of = |cap, counts: [u32; 3], bytes: usize| {
            let [x, y, z] = counts.map(range);
            DistanceBlock::try_from(pb::DistanceBlock { x, y, z, cap, distances: vec![0; bytes].into() })
        };
        assert!(of(1, [2, 3, 4], 24).is_ok());
        for (cap, counts, bytes) in
            [(0, [1; 3], 1), (256, [1; 3], 1), (1, [2, 3, 4], 23), (1, [u32::MAX; 3], 0), (1, [0; 3], 1)]
        {
            assert_eq!(of(cap, counts, bytes).unwrap_err().reason, Reason::BadBlocks, "{cap} {counts:?}");
        }
    }
}
