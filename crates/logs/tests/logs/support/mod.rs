//! Logs as recorders and drivers write them, for tests here and of the program.

mod cdr_writer;
mod drivers;
mod mcap_writer;
mod messages;

pub(super) use cdr_writer::CdrWriter;
pub(super) use drivers::{DRIVERS, Driver};
pub(super) use mcap_writer::McapWriter;
pub(super) use messages::{imu, odometry, transforms};
