//! `POST /v1/maps/{map}/{question}`: what planners ask.

mod answer;
mod asked;
mod body;
pub(super) mod classify;
mod form;
pub(super) mod frontiers;
pub(super) mod grid;
pub(super) mod motions;
pub(super) mod nearest;
pub(super) mod poses;
pub(super) mod rays;
pub(super) mod spheres;
