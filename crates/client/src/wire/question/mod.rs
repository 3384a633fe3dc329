//! Questions of planners and their answers (`planning.proto`).

mod body;
mod classify;
mod frontiers;
mod grid;
mod keep_outs;
mod message;
mod motions;
mod nearest;
mod poses;
mod rays;
mod scope;

pub use message::{QuestionMessage, check_body, parse_question};
