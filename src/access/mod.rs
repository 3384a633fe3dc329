//! Access: the operations, the scope that each takes, and the keys that callers show.
//!
//! A request passes two checks. [`Gate::authorize`] asks, before anything of its body is read, whether the caller's key
//! is for the operation, and whether a page of another site may be behind it; the service that it hands out then
//! refuses every map and every robot that the key is not for.
//!
//! A node of a cluster asks for its own callers: it shows the secret of the cluster, and names the key of each. It gets
//! what the holder of that key would, and no more.

mod allowance;
mod caller;
mod cluster_secret;
mod expiry;
mod forwarding;
mod gate;
mod key;
mod key_file;
mod keys;
mod operation;
mod peer;
mod reload;
mod rules;
mod scope;
mod secret;
mod site;

pub use self::allowance::{Allowance, InWork, KeyLimits};
pub use self::caller::Caller;
pub use self::cluster_secret::{ClusterSecretError, read_cluster_secret};
pub use self::expiry::Expiry;
pub use self::gate::{Authorized, Gate};
pub use self::key::{Key, KeyName};
pub use self::key_file::{
    KeyEntry, KeyFileError, add_to_file, list_file, revoke_in_file, rotate_in_file, to_toml,
};
pub use self::keys::Keys;
pub use self::operation::{Operation, Route};
pub use self::peer::{Peer, asker_of};
pub use self::reload::{Reload, ReloadableFile, is_open_to_others};
pub use self::rules::Access;
pub use self::scope::Scope;
pub use self::secret::{Digest, Secret};
pub use self::site::{ReachedAt, is_host};
