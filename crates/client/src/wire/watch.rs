//! Watching a map (`occupancy.proto`).

use prost::bytes::{BufMut, Bytes, BytesMut};

use super::pb;
use super::values::{InField, count_from, required, uuid_from};
use mrol_map::map::{ContentHash, ContentVersion, MapName, RobotName, SessionName, StateHash};
use mrol_service::{
    BlockBytes, Cause, ChangePart, LeftViewpoint, Reason, ServiceError, StatePart, WatchEvent, WatchForm,
    WatchMessage, WatchRequest, WatchedScan, WatchedSince, WatchedViewpoint,
};

impl TryFrom<pb::WatchRequest> for (MapName, WatchRequest) {
    type Error = ServiceError;

    fn try_from(request: pb::WatchRequest) -> Result<Self, ServiceError> {
        let content_hash = request.since_content_hash.map(ContentHash::from_bits);
        let state_hash = request.since_state_hash.map(StateHash::from_bits);
        let since = match (request.since_revision, request.map_uuid.is_empty()) {
            (None, true) if content_hash.is_some() => return Err(half_a_version("since_content_hash")),
            (None, true) if state_hash.is_some() => return Err(half_a_version("since_state_hash")),
            (None, true) => None,
            (Some(revision), false) => {
                let map_uuid = uuid_from(&request.map_uuid)?;
                Some(WatchedSince { revision, map_uuid, content_hash, state_hash })
            }
            (Some(_), true) => return Err(half_a_version("since_revision")),
            (None, false) => return Err(half_a_version("map_uuid")),
        };
        let region = request.region.map(TryInto::try_into).transpose()?;
        let form = request.delta_level.map_or(WatchForm::Changes, |level| WatchForm::Deltas { level });
        Ok((
            MapName::new(&request.map)?,
            WatchRequest { since, region, form, viewpoints: request.viewpoints },
        ))
    }
}

fn half_a_version(got: &str) -> ServiceError {
    let message = format!("since_revision and map_uuid go together, got {got} without both");
    ServiceError::new(Reason::MissingField, message)
}

impl From<(&MapName, WatchRequest)> for pb::WatchRequest {
    fn from((map, request): (&MapName, WatchRequest)) -> Self {
        let WatchRequest { since, region, form, viewpoints } = request;
        Self {
            map: map.to_string(),
            since_revision: since.map(|since| since.revision),
            map_uuid: since.map(|since| since.map_uuid.to_string()).unwrap_or_default(),
            region: region.map(Into::into),
            delta_level: match form {
                WatchForm::Changes => None,
                WatchForm::Deltas { level } => Some(level),
            },
            viewpoints,
            since_content_hash: since.and_then(|since| since.content_hash).map(ContentHash::to_bits),
            since_state_hash: since.and_then(|since| since.state_hash).map(StateHash::to_bits),
        }
    }
}

impl From<WatchMessage> for pb::WatchResponse {
    fn from(WatchMessage { map_uuid, head_revision, state_hash, event }: WatchMessage) -> Self {
        use pb::watch_response::Event;
        let event = match event {
            WatchEvent::Heartbeat => Event::Heartbeat(pb::Heartbeat {}),
            WatchEvent::State(part) => Event::State(part.into()),
            WatchEvent::Change(part) => Event::Change(part.into()),
        };
        let (map_uuid, state_hash) = (map_uuid.to_string(), state_hash.map(StateHash::to_bits));
        Self { map_uuid, head_revision, event: Some(event), state_hash }
    }
}

/// The last message of a watch over HTTP.
impl From<pb::Failure> for pb::WatchResponse {
    fn from(failure: pb::Failure) -> Self {
        let event = Some(pb::watch_response::Event::Failure(failure));
        Self { event, ..Self::default() }
    }
}

impl TryFrom<pb::WatchResponse> for WatchMessage {
    type Error = ServiceError;

    fn try_from(message: pb::WatchResponse) -> Result<Self, ServiceError> {
        use pb::watch_response::Event;
        let event = match required(message.event, "event")? {
            Event::Heartbeat(pb::Heartbeat {}) => WatchEvent::Heartbeat,
            Event::State(part) => WatchEvent::State(part.try_into()?),
            Event::Change(part) => WatchEvent::Change(part.try_into()?),
            Event::Failure(failure) => {
                return Err(ServiceError::new(Reason::UnexpectedField, failure.message));
            }
        };
        let (map_uuid, head_revision) = (uuid_from(&message.map_uuid)?, message.head_revision);
        let state_hash = message.state_hash.map(StateHash::from_bits);
        Ok(Self { map_uuid, head_revision, state_hash, event })
    }
}

impl From<StatePart> for pb::WatchedState {
    fn from(part: StatePart) -> Self {
        Self {
            reset: part.is_first,
            complete: part.is_last,
            revision: part.version.revision,
            content_hash: part.version.hash.to_bits(),
            resolution_m: part.resolution_m,
            levels: part.levels,
            level: part.level,
            blocks: part.voxels.into_bytes(),
            keep_outs: part.keep_outs.into_iter().map(Into::into).collect(),
            viewpoints: part.viewpoints.into_iter().map(Into::into).collect(),
        }
    }
}

impl TryFrom<pb::WatchedState> for StatePart {
    type Error = ServiceError;

    fn try_from(part: pb::WatchedState) -> Result<Self, ServiceError> {
        let hash = ContentHash::from_bits(part.content_hash);
        let keep_outs = part.keep_outs.into_iter().map(TryInto::try_into);
        let viewpoints = part.viewpoints.into_iter().map(TryInto::try_into);
        Ok(Self {
            is_first: part.reset,
            is_last: part.complete,
            version: ContentVersion { revision: part.revision, hash },
            resolution_m: part.resolution_m,
            levels: part.levels,
            level: part.level,
            voxels: BlockBytes::new(part.blocks)?,
            keep_outs: keep_outs.collect::<Result<_, _>>()?,
            viewpoints: viewpoints.collect::<Result<_, _>>()?,
        })
    }
}

impl From<ChangePart> for pb::WatchedChange {
    fn from(part: ChangePart) -> Self {
        use pb::watched_change::Cause as Of;
        let cause = match part.cause {
            Cause::Scan(scan) => Of::Scan((*scan).into()),
            Cause::Deletion => Of::Deletion(pb::WatchedDeletion {}),
            Cause::Undo { scans, deletions } => Of::Undo(pb::WatchedUndo { scans, deletions }),
            Cause::KeepOut(change) => Of::KeepOut((change, part.revision).into()),
        };
        Self {
            revision: part.revision,
            complete: part.is_last,
            content_hash: part.content_hash.map(ContentHash::to_bits),
            removed: part.removed.into_bytes(),
            added: part.added.into_bytes(),
            cause: Some(cause),
            viewpoint: part.viewpoint.map(Into::into),
        }
    }
}

impl TryFrom<pb::WatchedChange> for ChangePart {
    type Error = ServiceError;

    fn try_from(part: pb::WatchedChange) -> Result<Self, ServiceError> {
        use pb::watched_change::Cause as Of;
        let cause = match required(part.cause, "change.cause")? {
            Of::Scan(scan) => Cause::Scan(Box::new(scan.try_into()?)),
            Of::Deletion(pb::WatchedDeletion {}) => Cause::Deletion,
            Of::Undo(pb::WatchedUndo { scans, deletions }) => Cause::Undo { scans, deletions },
            Of::KeepOut(change) => Cause::KeepOut(change.try_into()?),
        };
        Ok(Self {
            revision: part.revision,
            is_last: part.complete,
            content_hash: part.content_hash.map(ContentHash::from_bits),
            cause,
            removed: BlockBytes::new(part.removed)?,
            added: BlockBytes::new(part.added)?,
            viewpoint: part.viewpoint.map(Into::into),
        })
    }
}

impl From<WatchedViewpoint> for pb::Viewpoint {
    fn from(WatchedViewpoint { revision, map_from_sensor, image }: WatchedViewpoint) -> Self {
        Self { revision, map_from_sensor: Some((&map_from_sensor).into()), image }
    }
}

impl TryFrom<pb::Viewpoint> for WatchedViewpoint {
    type Error = ServiceError;

    fn try_from(message: pb::Viewpoint) -> Result<Self, ServiceError> {
        let pose = required(message.map_from_sensor, "viewpoints.map_from_sensor")?;
        let map_from_sensor = pose.try_into().in_field("viewpoints.map_from_sensor")?;
        Ok(Self { revision: message.revision, map_from_sensor, image: message.image })
    }
}

impl From<LeftViewpoint> for pb::LeftViewpoint {
    fn from(LeftViewpoint { image, displaced }: LeftViewpoint) -> Self {
        Self { image, displaced }
    }
}

impl From<pb::LeftViewpoint> for LeftViewpoint {
    fn from(pb::LeftViewpoint { image, displaced }: pb::LeftViewpoint) -> Self {
        Self { image, displaced }
    }
}

impl From<WatchedScan> for pb::WatchedScan {
    fn from(scan: WatchedScan) -> Self {
        Self {
            robot: scan.robot.to_string(),
            session: scan.session.to_string(),
            scan_id: scan.scan_id,
            timestamp_ns: scan.timestamp_ns,
            map_from_sensor: Some((&scan.map_from_sensor).into()),
            carved_voxels: scan.carved_voxels as u64,
        }
    }
}

impl TryFrom<pb::WatchedScan> for WatchedScan {
    type Error = ServiceError;

    fn try_from(scan: pb::WatchedScan) -> Result<Self, ServiceError> {
        Ok(Self {
            robot: RobotName::new(&scan.robot).in_field("scan.robot")?,
            session: SessionName::new(&scan.session).in_field("scan.session")?,
            scan_id: scan.scan_id,
            timestamp_ns: scan.timestamp_ns,
            map_from_sensor: required(scan.map_from_sensor, "scan.map_from_sensor")?
                .try_into()
                .in_field("scan.map_from_sensor")?,
            carved_voxels: count_from(scan.carved_voxels),
        })
    }
}

/// A message of a stream as HTTP sends it: its length in four bytes, little-endian, then the message.
pub fn framed(message: &impl prost::Message) -> Bytes {
    let length = message.encoded_len();
    let mut frame = BytesMut::with_capacity(size_of::<u32>() + length);
    frame.put_u32_le(u32::try_from(length).unwrap_or(u32::MAX));
    // There is room for it.
    let _ = message.encode(&mut frame);
    frame.freeze()
}
