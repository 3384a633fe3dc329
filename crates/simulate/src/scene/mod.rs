//! A furnished floor of a building, made of analytic shapes, that simulated sensors look at.

mod building;
mod equal_rooms;
mod furnish;
mod furniture;
mod hall;
mod mover;
mod object;
mod places;
mod ray;
mod shape;
mod simulated_scene;

pub use mover::Mover;
pub use simulated_scene::Scene;
