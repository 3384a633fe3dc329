//! Questions of planners: each is answered from a view of a whole map, the server's or a replica's.

mod ask;
mod asked;
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
mod questioned_map;
mod rays;
mod spheres;

pub use asked::{Answered, Asked};
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
pub use questioned_map::QuestionedMap;
pub use rays::{RayQuestion, RaysToward};
pub use spheres::SphereCheck;
