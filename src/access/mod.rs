//! Who may do what: the operations, the scope that each takes, and the keys that callers show.
//!
//! A request passes two checks. [`Gate::authorize`] asks, before anything of its body is read, whether the caller's key
//! is for the operation, and whether a page of another site may be behind it; the service that it hands out then refuses
//! every map and every robot that the key is not for.

mod allowance;
mod caller;
mod expiry;
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

pub use allowance::{Allowance, InWork, KeyLimits};
pub use caller::Caller;
pub use expiry::Expiry;
pub use gate::{Authorized, Gate};
pub use key::{Key, KeyName};
pub use key_file::{KeyEntry, KeyFileError, add_to_file, list_file, revoke_in_file, rotate_in_file, to_toml};
pub use keys::Keys;
pub use operation::{Operation, Route};
pub use peer::{Peer, asker_of};
pub use reload::{Reload, ReloadableFile, is_open_to_others};
pub use rules::Access;
pub use scope::Scope;
pub use secret::{Digest, Secret};
pub use site::{ReachedAt, is_host};
