//! What stands in the address: the map's name, and the parameters of the query.

use std::error::Error;

use axum::extract::{FromRequestParts, Path, Query};
use axum::http::Uri;
use axum::http::request::Parts;
use serde::de::DeserializeOwned;
use utoipa::openapi::schema::{ObjectBuilder, Type};
use utoipa::openapi::{RefOr, Schema};
use utoipa::{PartialSchema, ToSchema};

use super::unreadable;
use crate::access::Authorized;
use crate::http::adapter::Adapter;
use crate::http::error::HttpError;
use mrol_client::wire::InField;
use mrol_map::geometry;
use mrol_map::geometry::Pose;
use mrol_map::map::{KeepOutName, MapName, Region, RequestId};
use mrol_map::util::excerpt;
use mrol_service::{Reason, ServiceError};

/// The `{map}` of a route, which the caller may name: who may not is told so before a body is read.
pub(in crate::http) struct Map(pub(in crate::http) MapName);

impl FromRequestParts<Adapter> for Map {
    type Rejection = HttpError;

    async fn from_request_parts(parts: &mut Parts, adapter: &Adapter) -> Result<Self, HttpError> {
        let text = path::<String>(parts, adapter).await?;
        permitted(&text, parts).map(Self)
    }
}

/// The `{map}` and the `{name}` of a route, the map as in [`Map`].
pub(in crate::http) struct KeepOutOfMap(pub(in crate::http) MapName, pub(in crate::http) KeepOutName);

impl FromRequestParts<Adapter> for KeepOutOfMap {
    type Rejection = HttpError;

    async fn from_request_parts(parts: &mut Parts, adapter: &Adapter) -> Result<Self, HttpError> {
        let (map, name) = path::<(String, String)>(parts, adapter).await?;
        let map = permitted(&map, parts)?;
        Ok(Self(map, KeepOutName::new(&name).map_err(ServiceError::from)?))
    }
}

/// What stands in the path.
async fn path<T: DeserializeOwned + Send>(parts: &mut Parts, adapter: &Adapter) -> Result<T, ServiceError> {
    let path = Path::<T>::from_request_parts(parts, adapter).await;
    let Path(path) = path.map_err(|rejection| ServiceError::new(Reason::BadName, rejection.body_text()))?;
    Ok(path)
}

/// The map of that name, which the caller may name.
fn permitted(text: &str, parts: &Parts) -> Result<MapName, HttpError> {
    let name = MapName::new(text).map_err(ServiceError::from)?;
    Authorized::of(&parts.extensions)?.caller.allowed_maps().permit(&name)?;
    Ok(name)
}

/// The id of a change, where one is given.
pub(in crate::http) fn request_id_of(text: Option<String>) -> Result<Option<RequestId>, ServiceError> {
    Ok(text.map(|text| RequestId::new(&text)).transpose()?)
}

/// The parameters of a request without a body.
pub(in crate::http) struct Params<T>(pub(in crate::http) T);

impl<T: DeserializeOwned> FromRequestParts<Adapter> for Params<T> {
    type Rejection = HttpError;

    async fn from_request_parts(parts: &mut Parts, _: &Adapter) -> Result<Self, HttpError> {
        from_query(&parts.uri).map(Self)
    }
}

/// The parameters of a request that takes none: whoever gives one means something that would not happen.
pub(in crate::http) struct NoParams;

impl<S: Sync> FromRequestParts<S> for NoParams {
    type Rejection = HttpError;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, HttpError> {
        match parts.uri.query().filter(|query| !query.is_empty()) {
            None => Ok(Self),
            Some(query) => {
                let message =
                    format!("{} takes no parameters, got {:?}", excerpt(parts.uri.path()), excerpt(query));
                Err(ServiceError::new(Reason::BadQuery, message).into())
            }
        }
    }
}

/// Parses the query of an address.
pub(in crate::http) fn from_query<T: DeserializeOwned>(uri: &Uri) -> Result<T, HttpError> {
    let parsed = Query::try_from_uri(uri);
    let Query(parameters) = parsed.map_err(|rejection| {
        let said = rejection.source().map_or_else(|| rejection.body_text(), ToString::to_string);
        ServiceError::new(Reason::BadQuery, unreadable::query(&said))
    })?;
    Ok(parameters)
}

/// A region as parameters: `min` and `max` of a box along the map's axes, or `map_from_box` and `size` of one with any
/// orientation.
#[derive(Debug, Default)]
pub(in crate::http) struct RegionParams {
    pub(in crate::http) min: Option<String>,
    pub(in crate::http) max: Option<String>,
    pub(in crate::http) map_from_box: Option<String>,
    pub(in crate::http) size: Option<String>,
}

impl RegionParams {
    /// The region, where one is given.
    ///
    /// # Errors
    /// `InvalidArgument` for half of one, for two, and for numbers that bound nothing.
    pub(in crate::http) fn region(&self) -> Result<Option<Region>, ServiceError> {
        match [&self.min, &self.max, &self.map_from_box, &self.size].map(Option::as_deref) {
            [None, None, None, None] => Ok(None),
            [Some(min), Some(max), None, None] => {
                Ok(Some(Region::cuboid(numbers(min, "min")?, numbers(max, "max")?)?))
            }
            [None, None, Some(placed), Some(size)] => {
                Ok(Some(Region::oriented_box(pose(placed, "map_from_box")?, numbers(size, "size")?)?))
            }
            _ => {
                let message =
                    "a region takes min and max, or map_from_box and size, and not half of them or both";
                Err(ServiceError::new(Reason::HalfABox, message))
            }
        }
    }
}

/// `N` numbers with commas between them.
pub(in crate::http) fn numbers<const N: usize>(text: &str, field: &str) -> Result<[f64; N], ServiceError> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|number| number.trim().parse()).collect();
    numbers.ok().and_then(|numbers| numbers.try_into().ok()).ok_or_else(|| {
        let message =
            format!("{field} must be {N} numbers with commas between them, got {:?}", excerpt(text));
        ServiceError::new(Reason::BadNumbers, message)
    })
}

/// Makes types that stand for so many numbers with commas between them in the description of the API.
macro_rules! texts_of_numbers {
    ($($name:ident: $count:literal;)+) => {$(
        #[doc = concat!(stringify!($count), " numbers with commas between them.")]
        pub(in crate::http) enum $name {}

        impl ToSchema for $name {}

        impl PartialSchema for $name {
            fn schema() -> RefOr<Schema> {
                text_of_numbers($count).into()
            }
        }
    )+};
}

texts_of_numbers! {
    Numbers2: 2;
    Numbers3: 3;
    Numbers6: 6;
    Numbers7: 7;
    Numbers36: 36;
}

/// The schema of what [`numbers`] reads; it reads a little more, such as spaces.
fn text_of_numbers(count: usize) -> ObjectBuilder {
    const NUMBER: &str = "[+-]?([0-9]+[.]?[0-9]*([eE][+-]?[0-9]+)?|inf)";
    let pattern = format!("^{NUMBER}(,{NUMBER}){{{}}}$", count - 1);
    ObjectBuilder::new().schema_type(Type::String).pattern(Some(pattern))
}

/// A pose as `x,y,z,qx,qy,qz,qw`.
pub(in crate::http) fn pose(text: &str, field: &str) -> Result<Pose, ServiceError> {
    let [x, y, z, qx, qy, qz, qw] = numbers(text, field)?;
    geometry::pose([x, y, z], [qx, qy, qz, qw]).in_field(field)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_region_is_one_box_and_whole() {
        let region = |given: [Option<&str>; 4]| {
            let [min, max, map_from_box, size] = given.map(|text| text.map(str::to_owned));
            RegionParams { min, max, map_from_box, size }.region()
        };
        let (corner, placed) = (Some("0,0,0"), Some("1,2,3,0,0,0,1"));
        assert_eq!(region([None; 4]).unwrap(), None);
        assert!(matches!(region([corner, corner, None, None]), Ok(Some(Region::Box { .. }))));
        assert!(matches!(region([None, None, placed, corner]), Ok(Some(Region::OrientedBox(_)))));
        for half in [[corner, None, None, None], [None, None, placed, None], [corner, corner, placed, None]] {
            assert_eq!(region(half).unwrap_err().reason, Reason::HalfABox, "{half:?}");
        }
    }

    #[test]
    fn a_pose_is_seven_numbers() {
        let placed = pose("1,2, 3,0,0,0,1", "guess").unwrap();
        assert_eq!(geometry::translation_m(&placed), [1.0, 2.0, 3.0]);
        for bad in ["", "1,2,3", "1,2,3,0,0,0,x", "1,2,3,0,0,0,1,1"] {
            assert!(pose(bad, "guess").unwrap_err().message.starts_with("guess must be 7 numbers"), "{bad}");
        }
        let zero = pose("0,0,0,0,0,0,0", "guess").unwrap_err();
        assert!(zero.message.starts_with("guess: rotation_xyzw must be a unit quaternion"), "{zero}");
        assert!(pose("inf,0,0,0,0,0,1", "pose").unwrap_err().message.contains("finite"));
    }
}
