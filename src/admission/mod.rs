//! Admission: which requests get in, and how much of the server's memory may lie in requests and answers at once.
//!
//! ```text
//! rate of the caller -> the body arrives -> requests_max -> work -> the answer is sent
//!                       body_bytes_max                              body_bytes_max
//! ```
//!
//! A request counts as one in work when its body has arrived, so that nobody keeps others out by sending slowly. Bodies
//! count by the bytes that have come, not by what was declared; where there is no room for more, the one that has been
//! silent for longest gives way.
//!
//! Probes need no key and are answered whatever else is done, so they have limits of their own: small bodies that come
//! at once (`probes_max`, `probe_body_bytes_max`, `probe_time_max_s`), few scrapes (`scrapes_max`) and few watches
//! (`health_watches_max`).

mod admit;
mod answer_body;
mod bodies;
mod body_state;
mod inbound_body;
mod lifecycle;
mod metered_body;
mod of_connection;
pub(super) mod off_runtime;
mod probes;
mod quota;
mod rate;
mod shares;

pub use admit::{Admission, AnswerBytes};
pub use answer_body::{Ending, Endings};
pub use bodies::MemoryPermit;
pub use body_state::CloseConnection;
pub use inbound_body::InboundBody;
pub use lifecycle::{Lifecycle, draining};
pub use of_connection::OfConnection;
pub use off_runtime::off_runtime;
pub use rate::RateLimitKey;
