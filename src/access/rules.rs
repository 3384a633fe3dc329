//! The rules of access.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, SystemTime};

use axum::http::Request;

use super::caller::Caller;
use super::expiry::Expiry;
use super::forwarding::{ForwardedCaller, Forwarding};
use super::key::{Key, KeyName};
use super::key_file::KeyFileError;
use super::keys::Keys;
use super::operation::Operation;
use super::reload::ReloadableFile;
use super::scope::Scope;
use super::secret::{Digest, Secret};
use super::site::{Hosts, check_origin};
use mrol_service::{AllowedMaps, Reason, ServiceError};

/// The rules of a server. A clone is another handle on the same ones.
#[derive(Debug, Clone)]
pub struct Access {
    /// The keys; without them anybody may do anything.
    keys: Option<Arc<ReloadableFile<Keys, KeyFileError>>>,
    /// Whether [`Operation::Metrics`] asks for no key.
    metrics_open: bool,
    /// The names that it answers to where there are no keys.
    hosts: Hosts,
    /// What nodes of the same cluster show that ask for their callers.
    cluster_secret: Option<Digest>,
}

impl Access {
    /// Anybody who can connect may do anything.
    pub fn open() -> Self {
        Self { keys: None, metrics_open: true, hosts: Hosts::default(), cluster_secret: None }
    }

    /// This access, which without keys answers requests to these host names too.
    pub fn at_hosts<'a>(self, names: impl IntoIterator<Item = &'a str>) -> Self {
        Self { hosts: Hosts::new(names), ..self }
    }

    /// The holders of a file's keys may do what the keys are for.
    ///
    /// # Errors
    /// When the file cannot be read or is none of keys.
    pub fn by_keys_of(file: &Path, metrics_open: bool) -> Result<Self, KeyFileError> {
        let path: PathBuf = file.to_owned();
        let keys = ReloadableFile::new(vec![path.clone()], move |former| Keys::read(&path, former))?;
        Ok(Self { keys: Some(Arc::new(keys)), metrics_open, ..Self::open() })
    }

    /// This access, where nodes of the same cluster, which show this secret, ask for callers of their own.
    pub fn with_cluster_secret(self, secret: &Secret) -> Self {
        Self { cluster_secret: Some(secret.digest()), ..self }
    }

    /// The keys, where there are any.
    pub fn keys(&self) -> Option<&ReloadableFile<Keys, KeyFileError>> {
        self.keys.as_deref()
    }

    /// Asks whether a browser may have sent a request for `operation` without its user's knowledge. Where keys are
    /// asked for, no other site can show one, so that names do not matter.
    ///
    /// # Errors
    /// `PermissionDenied` with `host_not_allowed` or `cross_site`.
    pub fn check_site<B>(&self, operation: Operation, request: &Request<B>) -> Result<(), ServiceError> {
        if self.keys.is_none() {
            self.hosts.check(request)?;
        }
        if operation.is_change() { check_origin(request) } else { Ok(()) }
    }

    /// Asks whether a request names this server, as [`Access::check_site`] does.
    ///
    /// # Errors
    /// `PermissionDenied` with `host_not_allowed`.
    pub fn check_host<B>(&self, request: &Request<B>) -> Result<(), ServiceError> {
        if self.keys.is_none() { self.hosts.check(request) } else { Ok(()) }
    }

    /// Ends what was begun with keys whose time is up at `now`.
    pub fn end_expired(&self, now: SystemTime) {
        if let Some(keys) = &self.keys {
            keys.current().end_expired(now);
        }
    }

    /// The keys whose time is up at `now` or within `warning`, with their ends.
    pub fn expiring(&self, now: SystemTime, warning: Duration) -> Vec<(KeyName, Expiry)> {
        self.keys.as_ref().map(|keys| keys.current().expiring(now, warning)).unwrap_or_default()
    }

    /// The holder of `secret`, if it may ask for `operation`.
    ///
    /// # Errors
    /// `Unauthenticated` where a key is needed and there is none that counts; `PermissionDenied` where it is for less.
    pub fn authorize(&self, operation: Operation, secret: Option<&Secret>) -> Result<Caller, ServiceError> {
        let Some(keys) = &self.keys else {
            return Ok(Caller::without_key(AllowedMaps::Every));
        };
        if operation == Operation::Metrics && self.metrics_open {
            return Ok(Caller::without_key(AllowedMaps::Every));
        }
        let key = secret.and_then(|secret| keys.current().find(secret));
        if let Some(key) = &key {
            // The log names whoever is refused, too. Once: a text log appends what is recorded again.
            tracing::Span::current().record("key", key.name.as_str());
        }
        let Some(scope) = operation.scope() else {
            let key = key.filter(|key| !key.is_expired(SystemTime::now()));
            return Ok(key.map_or_else(|| Caller::without_key(AllowedMaps::none()), Caller::with));
        };
        let key = key.ok_or_else(|| no_key(operation, secret.is_some()))?;
        let caller = holder(operation, scope, key)?;
        check_metrics_allowed(operation, &caller)?;
        Ok(caller)
    }

    /// True of the secret of the cluster. How long it takes tells nothing of how near another is to it.
    pub(super) fn is_of_cluster(&self, secret: Option<&Secret>) -> bool {
        let (Some(secret), Some(own)) = (secret, &self.cluster_secret) else { return false };
        own.same_as(&secret.digest()).into()
    }

    /// True where nobody shows anything, neither callers nor nodes.
    pub(super) fn asks_for_nothing(&self) -> bool {
        self.keys.is_none() && self.cluster_secret.is_none()
    }

    /// The caller for whom a node asks for `operation`, if the caller itself may: who shows the secret of the cluster
    /// is believed for whom it asks, and may do nothing else. `over_grpc` is true of a gRPC call: nodes make no others.
    ///
    /// # Errors
    /// `Unauthenticated` without the name of a node, or where the caller's key is needed and not known here, or its
    /// time is up; `PermissionDenied` for what nodes do not ask, and where the key is for less.
    pub(super) fn authorize_forwarded(
        &self,
        operation: Operation,
        over_grpc: bool,
        forwarding: &Forwarding,
    ) -> Result<Caller, ServiceError> {
        let Some(node) = &forwarding.node else { return Err(no_node()) };
        tracing::Span::current().record("node", node.as_str());
        let (true, true, Some(scope)) = (operation.is_asked_by_nodes(), over_grpc, operation.scope()) else {
            return Err(not_asked_by_nodes(operation));
        };
        let keys = self.keys.as_ref().map(|keys| keys.current());
        let key = match (&forwarding.caller, keys) {
            (ForwardedCaller::Anybody, None) => return Ok(Caller::without_key(AllowedMaps::Every)),
            (ForwardedCaller::Anybody, Some(_)) => return Err(no_key(operation, false)),
            (ForwardedCaller::HolderOf(name), Some(keys)) => keys.named(name),
            (ForwardedCaller::HolderOf(_) | ForwardedCaller::Unreadable, _) => None,
        };
        let key = key.ok_or_else(|| unknown_caller(operation, &forwarding.caller))?;
        tracing::Span::current().record("key", key.name.as_str());
        holder(operation, scope, key)
    }
}

/// The holder of a key, where that counts and is for the scope that `operation` takes.
fn holder(operation: Operation, scope: Scope, key: Arc<Key>) -> Result<Caller, ServiceError> {
    if let Some(refusal) = key.expired(SystemTime::now()) {
        return Err(refusal);
    }
    check_scope(operation, scope, &key)?;
    Ok(Caller::with(key))
}

fn no_node() -> ServiceError {
    let message =
        "the secret of the cluster is for its nodes, which say by `mrol-node` which they are: send a key";
    ServiceError::new(Reason::KeyUnknown, message)
}

fn not_asked_by_nodes(operation: Operation) -> ServiceError {
    let message = format!(
        "{} is not what nodes ask each other, by this protocol or at all, and the secret of the cluster is for nothing \
         else: send a key",
        operation.name()
    );
    ServiceError::new(Reason::ScopeTooSmall, message)
}

fn unknown_caller(operation: Operation, caller: &ForwardedCaller) -> ServiceError {
    let key = match caller {
        ForwardedCaller::HolderOf(name) => format!("key {name}"),
        ForwardedCaller::Anybody | ForwardedCaller::Unreadable => "the key".to_owned(),
    };
    let message = format!(
        "{} needs a key: {key} is not known on the node that leads the map; all nodes of a cluster take the same keys",
        operation.name()
    );
    ServiceError::new(Reason::KeyUnknown, message)
}

fn no_key(operation: Operation, given: bool) -> ServiceError {
    let (reason, problem) = match given {
        false => (Reason::KeyMissing, "send one as `authorization: Bearer <secret>`"),
        true => (Reason::KeyUnknown, "the one sent is not known here"),
    };
    let message = format!("{} needs a key: {problem}", operation.name());
    ServiceError::new(reason, message)
}

fn check_scope(operation: Operation, scope: Scope, key: &Key) -> Result<(), ServiceError> {
    if key.scope >= scope {
        return Ok(());
    }
    let message = format!("{} takes scope {scope}, key {} has {}", operation.name(), key.name, key.scope);
    Err(ServiceError::new(Reason::ScopeTooSmall, message))
}

/// Refuses the metrics, which speak of every map, to a key for some maps. Maps that a request names are checked by the
/// service.
fn check_metrics_allowed(operation: Operation, caller: &Caller) -> Result<(), ServiceError> {
    if operation != Operation::Metrics || *caller.allowed_maps() == AllowedMaps::Every {
        return Ok(());
    }
    let message =
        format!("metrics speak of every map, key {} is for some", caller.name().unwrap_or_default());
    Err(ServiceError::new(Reason::MapNotAllowed, message))
}
