//! Between the generated types and the domain: the only place that names both.
//!
//! A request converts into `(MapName, request of the service)` and back, an answer into the domain's answer and
//! back, so that the daemon and the client share one definition. What cannot be converted is an error that
//! names the field; everything else (limits, levels, numbers that are not finite) the service checks.

mod agreement;
mod block;
pub mod codec;
mod deletion;
mod events;
mod failure;
mod forwarded;
mod keep_out;
mod localization;
mod map_file;
mod maps;
mod observers;
mod occupancy;
pub mod pb;
mod question;
mod scan;
mod trajectory;
pub mod transport;
mod undo;
mod values;
mod watch;

pub use codec::{IGNORED_MAX, LINKS_MAX};
pub use failure::{REASON, elsewhere, retry_after, status_code, status_of};
pub use forwarded::{CALLER, NODE};
pub use map_file::{restore_pieces, snapshot_bytes, snapshot_pieces};
pub use maps::{create_map, nanoseconds};
pub use occupancy::{KEYS_PER_CHUNK, listing_bytes, voxel_chunks};
pub use question::{QuestionMessage, check_body, parse_question};
pub use scan::gravity_in_sensor;
pub use values::{InField, bitmap_of, bytes_of, required, uuid_from};
pub use watch::framed;
