//! Questions of planners and their answers (`planning.proto`).

mod asked;
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

pub use message::{QuestionMessage, check_body, question_of};
