//! Who may do what.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::{Caller, Key, KeyFileError, Keys, Operation, Scope, Secret};
use crate::reload::Reloaded;
use crate::service::{ErrorCode, MapReach, ServiceError};

/// The rules of a server. A clone is another handle on the same ones.
#[derive(Debug, Clone)]
pub struct Access {
    /// Without them anybody may do anything.
    keys: Option<Arc<Reloaded<Keys, KeyFileError>>>,
    /// Whether [`Operation::Metrics`] asks for no key.
    metrics_open: bool,
}

impl Access {
    /// Anybody who can connect may do anything.
    pub fn open() -> Self {
        Self { keys: None, metrics_open: true }
    }

    /// The holders of a file's keys may do what the keys are for.
    ///
    /// # Errors
    /// When the file cannot be read or is none of keys.
    pub fn by_keys_of(file: &Path, metrics_open: bool) -> Result<Self, KeyFileError> {
        let path: PathBuf = file.to_owned();
        let keys = Reloaded::new(vec![path.clone()], move |former| Keys::read(&path, former))?;
        Ok(Self { keys: Some(Arc::new(keys)), metrics_open })
    }

    /// The keys, where there are any.
    pub fn keys(&self) -> Option<&Reloaded<Keys, KeyFileError>> {
        self.keys.as_deref()
    }

    /// Says who the holder of `secret` is, if that is somebody who may ask for `operation`.
    ///
    /// # Errors
    /// `Unauthenticated` where a key is needed and there is none that counts; `PermissionDenied` where it is for less.
    pub fn authorize(&self, operation: Operation, secret: Option<&Secret>) -> Result<Caller, ServiceError> {
        let Some(keys) = &self.keys else {
            return Ok(Caller::without_key(MapReach::Every));
        };
        if operation == Operation::Metrics && self.metrics_open {
            return Ok(Caller::without_key(MapReach::Every));
        }
        let key = secret.and_then(|secret| keys.current().find(secret));
        let Some(scope) = operation.scope() else {
            return Ok(key.map_or_else(|| Caller::without_key(MapReach::none()), Caller::with));
        };
        let key = key.ok_or_else(|| no_key(operation, secret.is_some()))?;
        check_scope(operation, scope, &key)?;
        check_reach(operation, &key)?;
        Ok(Caller::with(key))
    }
}

/// The reason of a refusal where a key came that is none of ours.
pub const KEY_UNKNOWN: &str = "key_unknown";

fn no_key(operation: Operation, given: bool) -> ServiceError {
    let (reason, problem) = match given {
        false => ("key_missing", "send one as `authorization: Bearer <secret>`"),
        true => (KEY_UNKNOWN, "the one sent is not known here"),
    };
    let message = format!("{} needs a key: {problem}", operation.name());
    ServiceError::new(ErrorCode::Unauthenticated, reason, message)
}

fn check_scope(operation: Operation, scope: Scope, key: &Key) -> Result<(), ServiceError> {
    if key.scope >= scope {
        return Ok(());
    }
    let message = format!("{} takes scope {scope}, key {} has {}", operation.name(), key.name, key.scope);
    Err(ServiceError::new(ErrorCode::PermissionDenied, "scope_too_small", message))
}

/// Of what speaks of every map, a key for some may see nothing. Maps that a request names are checked by the service.
fn check_reach(operation: Operation, key: &Key) -> Result<(), ServiceError> {
    if operation != Operation::Metrics || key.reach == MapReach::Every {
        return Ok(());
    }
    let message = format!("metrics speak of every map, key {} is for some", key.name);
    Err(ServiceError::new(ErrorCode::PermissionDenied, "map_not_allowed", message))
}
