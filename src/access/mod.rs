//! Who may do what: the operations, the scope that each takes, and the keys that callers show.
//!
//! A request passes two checks. [`Gate::authorize`] asks, before anything of its body is read, whether the caller's key
//! is for the operation; the service that it hands out then refuses every map that the key is not for.

mod caller;
mod gate;
mod key;
mod key_file;
mod keys;
mod operation;
mod rules;
mod scope;
mod secret;

pub use caller::Caller;
pub use gate::{Authorized, Gate};
pub use key::{Key, KeyName};
pub use key_file::{KeyFileError, add_to_file, to_toml};
pub use keys::Keys;
pub use operation::{Operation, Route};
pub use rules::{Access, KEY_UNKNOWN};
pub use scope::Scope;
pub use secret::{Digest, Secret};
