//! How requests are read: bodies, parameters, lists and bytes, with errors that name the field.

pub(super) mod body;
mod filter_choice;
mod json;
mod list;
mod object;
mod octets;
pub(super) mod params;
mod shapes;
mod two_forms;
mod unreadable;

pub(super) use body::points_of;
pub(super) use body::{Points, Sent};
pub(super) use filter_choice::FilterChoice;
pub(super) use json::JsonPoints;
pub(super) use list::List;
pub(super) use object::Object;
pub(super) use octets::AnswerBytes;
pub(super) use octets::{
    BitmapBytes, BlockBytes, GridTileBytes, MapFileBytes, PointBytes, QuestionBytes, ScanBytes, WatchBytes,
};
pub(super) use params::pose;
pub(super) use params::{
    KeepOutOfMap, Map, NoParams, Numbers2, Numbers3, Numbers6, Numbers7, Numbers36, Params, RegionParams,
    numbers, request_id_of,
};
pub(super) use shapes::{BoxBody, OrientedBoxBody, PrismBody, SphereBody};
pub(super) use two_forms::two_forms;
