//! Questions of planners: each is answered from a view of a whole map, the server's or a replica's.

mod ask;
mod check;
mod classify;
mod frontiers;
mod grid;
mod grid_tiles;
mod known;
mod motions;
mod nearest;
mod pieces;
mod planner_question;
mod poses;
mod question_target;
mod rays;
mod scope;
mod spheres;

pub use check::{CheckAs, Collisions};
pub use classify::ClassifyQuestion;
pub use frontiers::{FRONTIERS_MAX_DEFAULT, FrontierQuestion};
pub use grid::{GridQuestion, GridScope};
pub use grid_tiles::{GridTile, GridTiles, TILED_CELLS_MAX};
pub use known::KnownPart;
pub use motions::MotionCheck;
pub use nearest::NearestQuestion;
pub use planner_question::Question;
pub use poses::PoseCheck;
pub use question_target::QuestionTarget;
pub use rays::{RayQuestion, RaysToward};
pub use scope::{AtVersion, QuestionScope};
pub use spheres::SphereCheck;
