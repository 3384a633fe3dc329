//! Databases of SQLite, in which ROS 2 records too: a table of topics, and one of messages.
//!
//! Whatever a database says of itself (views, triggers) is not executed: the two tables are read row by row in the
//! order in which they were written.

mod reader;

pub use reader::{DatabaseReader, MESSAGE_BYTES_MAX};
