//! What a log has, and what of it a mapping uses.

mod choice;
mod odometry_source;
mod plan;
mod summary;
mod take;

pub use choice::{Choice, ChoiceError};
pub use odometry_source::OdometrySource;
pub use plan::{GravitySource, Plan, Use};
pub use summary::{LogSurvey, TopicSummary};
