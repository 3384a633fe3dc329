//! `POST /v1/maps/{map}/{question}`: what planners ask.

mod answer;
mod body;
pub(super) mod classify;
mod form;
pub(super) mod frontiers;
pub(super) mod grid;
mod handler;
pub(super) mod motions;
pub(super) mod nearest;
pub(super) mod poses;
pub(super) mod rays;
mod scope;
pub(super) mod spheres;
