//! What can go wrong with a request, once for every protocol.

use std::time::Duration;

use super::code::ErrorCode;
use super::map_holder::MapHolder;
use super::reason::Reason;
use mrol_map::bloom::FilterSettingsError;
use mrol_map::geometry::PoseError;
use mrol_map::map::{
    FrustumError, KeepOutShapeError, MapName, MapSettingsError, NameError, PrismError, RegionError,
};
use mrol_map::voxel::SettingError;

/// A failed request: nothing was changed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct ServiceError {
    /// Why, for programs.
    pub reason: Reason,
    /// A sentence for people: the field, its value and the limit, in lower case.
    pub message: String,
    /// When the same request may be answered otherwise, where the server can tell.
    pub retry_after: Option<Duration>,
    /// The nodes that are to be asked instead, for [`Reason::MapElsewhere`]: the first is the best.
    pub holders: Vec<MapHolder>,
}

impl ServiceError {
    /// A failure for `reason`.
    pub fn new(reason: Reason, message: impl Into<String>) -> Self {
        Self { reason, message: message.into(), retry_after: None, holders: Vec::new() }
    }

    /// The server has too much to do: a limit, named in the message, would be exceeded.
    pub fn overloaded(message: impl Into<String>) -> Self {
        Self::new(Reason::Overloaded, message).retry_after(Duration::from_secs(1))
    }

    /// Other nodes hold the map, and this one does not.
    pub fn map_elsewhere(name: &MapName, holders: Vec<MapHolder>) -> Self {
        let at = |MapHolder { node, http, grpc }: &MapHolder| format!("node {node} ({http}, gRPC {grpc})");
        let nodes: Vec<String> = holders.iter().map(at).collect();
        let message = format!("map {name} is not held by this node: ask {}", nodes.join(", or "));
        Self { holders, ..Self::new(Reason::MapElsewhere, message) }
    }

    /// What kind of failure it is.
    pub fn code(&self) -> ErrorCode {
        self.reason.code()
    }

    /// This failure, with when to come again.
    pub fn retry_after(self, wait: Duration) -> Self {
        Self { retry_after: Some(wait), ..self }
    }
}

impl From<NameError> for ServiceError {
    fn from(error: NameError) -> Self {
        Self::new(Reason::BadName, error.to_string())
    }
}

impl From<PoseError> for ServiceError {
    fn from(error: PoseError) -> Self {
        Self::new(Reason::BadPose, error.to_string())
    }
}

impl From<SettingError> for ServiceError {
    fn from(error: SettingError) -> Self {
        Self::new(Reason::BadSettings, error.to_string())
    }
}

impl From<FilterSettingsError> for ServiceError {
    fn from(error: FilterSettingsError) -> Self {
        Self::new(Reason::BadSettings, error.to_string())
    }
}

impl From<MapSettingsError> for ServiceError {
    fn from(error: MapSettingsError) -> Self {
        Self::new(Reason::BadSettings, error.to_string())
    }
}

impl From<PrismError> for ServiceError {
    fn from(error: PrismError) -> Self {
        Self::new(Reason::BadKeepOut, error.to_string())
    }
}

impl From<KeepOutShapeError> for ServiceError {
    fn from(error: KeepOutShapeError) -> Self {
        match error {
            KeepOutShapeError::Region(error) => error.into(),
            KeepOutShapeError::Prism(error) => error.into(),
            KeepOutShapeError::TooFar(..) => Self::new(Reason::BadKeepOut, error.to_string()),
        }
    }
}

impl From<RegionError> for ServiceError {
    fn from(error: RegionError) -> Self {
        Self::new(Reason::BadRegion, error.to_string())
    }
}

impl From<FrustumError> for ServiceError {
    fn from(error: FrustumError) -> Self {
        Self::new(Reason::BadView, error.to_string())
    }
}
