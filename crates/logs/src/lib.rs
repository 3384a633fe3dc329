//! Logs of robots: clouds, frames, odometry and gravity as ROS 2 writes them, made into scans that a map takes.
//!
//! ```text
//! log        a file's messages, one by one, and where a file ends that was cut off
//! survey     what a log has: topics, frames; which of them a mapping uses, and what is missing
//! sequence   messages in the order of the log to scans in the order of time, each with its guess
//!   cloud        points and the raw times of a message     point_times   these times in seconds from the stamp
//!   frames       the tree of transforms, and tracks of poses
//!   message      the messages of ROS by their fields       cdr           a cursor over their bytes
//! ```
//!
//! Below `log`, nothing knows a file or a network: the same code may serve a reader of another kind of log, or messages
//! as they arrive.
//!
//! Everything here reads what others wrote. Counts are compared with the bytes that are there before anything is
//! allocated by them, frames and histories are bounded, and what cannot be used is told once, with its reason.

pub mod cdr;
pub mod cloud;
pub mod frames;
pub mod log;
pub mod message;
pub mod point_times;
pub mod sequence;
pub mod survey;
