//! Bodies and what checks of them have in common, in JSON.

use axum::body::Bytes;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::answer::{Array, Arrays};
use super::form::{NumbersField, PointsField};
use crate::http::forms::JsonPoints;
use crate::http::forms::List;
use crate::http::forms::Object;
use crate::http::forms::{BoxBody, OrientedBoxBody, SphereBody};
use crate::json::{JsonVersion, Sphere, VoxelIndex, described_by_words};
use mrol_client::wire::{IGNORED_MAX, InField, LINKS_MAX, pb};
use mrol_map::map::Region;
use mrol_map::util::Keyword;
use mrol_service::{Collisions, ServiceError};

/// A body: its links.
#[derive(Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct BodyField {
    /// Its links; with their spheres and points at most `limits.body_parts_max`.
    #[schema(value_type = Vec<LinkField>)]
    links: List<Object<LinkField>, LINKS_MAX>,
}

/// A link of a body: spheres, points, or both.
#[derive(Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
struct LinkField {
    /// Spheres `[x, y, z, radius]` in the frame of the link, meters.
    #[schema(value_type = Option<Vec<Sphere>>)]
    spheres: Option<NumbersField<4>>,
    /// Points in the frame of the link, meters.
    #[schema(value_type = Option<JsonPoints>)]
    points: Option<PointsField>,
    /// What every radius grows by, meters; 0 without.
    #[serde(default)]
    padding_m: f32,
}

/// The regions in which voxels do not count.
pub(super) type IgnoredList = List<IgnoredField, IGNORED_MAX>;

/// A region in which voxels do not count.
#[derive(Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum IgnoredField {
    Box(Object<BoxBody>),
    Sphere(Object<SphereBody>),
    OrientedBox(Object<OrientedBoxBody>),
}

/// A region in which voxels do not count.
#[derive(ToSchema)]
#[serde(rename_all = "snake_case")]
#[schema(as = IgnoredRegion)]
#[expect(dead_code, reason = "this describes `IgnoredField`, of which the macro cannot see through `Object`")]
pub(super) enum DescribedIgnored {
    /// A box along the map's axes.
    Box(BoxBody),
    /// A ball.
    Sphere(SphereBody),
    /// A box with any orientation.
    OrientedBox(OrientedBoxBody),
}

/// How a check is answered.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum AnswerWord {
    #[default]
    Colliding,
    FirstHit,
    Clearance,
}

impl Keyword for AnswerWord {
    const ALL: &'static [Self] = &[Self::Colliding, Self::FirstHit, Self::Clearance];

    fn as_str(self) -> &'static str {
        match self {
            Self::Colliding => "colliding",
            Self::FirstHit => "first_hit",
            Self::Clearance => "clearance",
        }
    }
}

described_by_words!(AnswerWord);

impl From<AnswerWord> for pb::CheckAnswer {
    fn from(word: AnswerWord) -> Self {
        match word {
            AnswerWord::Colliding => Self::Colliding,
            AnswerWord::FirstHit => Self::FirstHit,
            AnswerWord::Clearance => Self::Clearance,
        }
    }
}

impl BodyField {
    /// The body as a message has it.
    pub(super) fn into_message(self, arrays: &Bytes) -> Result<pb::Body, ServiceError> {
        let link = |(number, Object(link)): (usize, Object<LinkField>)| {
            let name = |field: &str| format!("body.links[{number}].{field}");
            let LinkField { spheres, points, padding_m } = link;
            let spheres = spheres.map(|spheres| spheres.into_bytes(arrays, &name("spheres"))).transpose()?;
            let points = points.map(|points| points.into_message(arrays, &name("points"))).transpose()?;
            Ok(pb::Link { spheres_f32le: spheres.unwrap_or_default(), points, padding_m })
        };
        Ok(pb::Body {
            links: self.links.0.into_iter().enumerate().map(link).collect::<Result<_, ServiceError>>()?,
        })
    }
}

/// The regions in which voxels do not count, as a message has them.
pub(super) fn ignored_of(List(ignored): IgnoredList) -> Result<Vec<pb::Region>, ServiceError> {
    let region = |(number, field): (usize, IgnoredField)| {
        let region: Result<Region, ServiceError> = match field {
            IgnoredField::Box(Object(of)) => of.try_into().map_err(ServiceError::from),
            IgnoredField::Sphere(Object(of)) => of.try_into().map_err(ServiceError::from),
            IgnoredField::OrientedBox(Object(of)) => of.try_into(),
        };
        Ok(region.in_field(&format!("ignored[{number}]"))?.into())
    };
    ignored.into_iter().enumerate().map(region).collect()
}

/// What of an answer to a check is no array.
#[derive(Serialize, ToSchema)]
pub(in crate::http) struct CheckedHead {
    /// How many were checked.
    checked: u64,
    /// How many of them collide.
    colliding_count: u64,
}

/// What is met by what was checked; which arrays there are depends on `answer`.
#[derive(ToSchema)]
#[expect(dead_code, reason = "the answer is put together of its arrays; this describes it")]
pub(super) struct CheckedResponse {
    #[serde(flatten)]
    head: CheckedHead,
    /// Whether each collides.
    colliding: Vec<bool>,
    /// Of the first hit: the link; null where nothing is met.
    #[schema(nullable = false)]
    hit_links: Option<Vec<Option<u32>>>,
    /// Of the first hit: the sphere, or after all spheres the point.
    #[schema(nullable = false)]
    hit_parts: Option<Vec<Option<u32>>>,
    /// Of the first hit: the voxel.
    #[schema(value_type = Option<Vec<Option<VoxelIndex>>>, nullable = false)]
    hit_voxels: Option<Vec<Option<[i32; 3]>>>,
    /// The keep-outs that were met instead of a voxel, null where none was; absent where none was at all.
    #[schema(nullable = false)]
    hit_keep_outs: Option<Vec<Option<String>>>,
    /// The distance to the nearest voxel, at most what was asked for, meters.
    #[schema(nullable = false)]
    clearances_m: Option<Vec<Option<f32>>>,
    /// The link that is nearest; null where nothing is as near as was asked for.
    #[schema(nullable = false)]
    nearest_links: Option<Vec<Option<u32>>>,
    #[serde(flatten)]
    version: JsonVersion,
}

/// The head and the arrays of an answer to a check.
pub(super) fn collisions_answered(collisions: Collisions) -> (CheckedHead, Arrays) {
    let with_hits = matches!(collisions, Collisions::FirstHits(_));
    let with_clearances = matches!(collisions, Collisions::Clearances(_));
    let collisions = pb::Collisions::from(collisions);
    let pb::Collisions { checked, colliding, colliding_count, hit_keep_outs, .. } = collisions;
    let mut arrays = vec![("colliding", Array::Bits(colliding.clone(), checked as usize))];
    if with_hits {
        let voxels = Array::voxels(collisions.hit_voxels_u64le, &colliding, hit_keep_outs.as_ref());
        arrays.extend([
            ("hit_links", Array::Numbers(collisions.hit_links_u32le)),
            ("hit_parts", Array::Numbers(collisions.hit_parts_u32le)),
            ("hit_voxels", voxels),
        ]);
        arrays.extend(Array::keep_outs("hit_keep_outs", hit_keep_outs));
    }
    if with_clearances {
        arrays.extend([
            ("clearances_m", Array::Floats(collisions.clearances_m_f32le)),
            ("nearest_links", Array::Numbers(collisions.nearest_links_u32le)),
        ]);
    }
    (CheckedHead { checked, colliding_count }, arrays)
}

/// Declares the body of a check: the fields that are given, and after them those that all checks have, and all
/// questions (see [`question_body`](super::scope::question_body)).
macro_rules! check_body {
    ($(#[$attribute:meta])* $visibility:vis struct $Body:ident { $($own:tt)* }) => {
        $crate::http::question::scope::question_body! {
            $(#[$attribute])*
            $visibility struct $Body {
                $($own)*
                /// Regions in which voxels do not count; 64 at most.
                #[schema(value_type = Vec<$crate::http::question::body::DescribedIgnored>, required = false)]
                #[serde(default)]
                ignored: $crate::http::question::body::IgnoredList,
                /// What voxels are that no scan saw through: free or occupied; `free` without.
                #[schema(value_type = $crate::json::described::Unknown, required = false)]
                #[serde(default)]
                unknown: $crate::json::ByKeyword<mrol_map::planning::Unknown>,
                /// What is told: whether there is a collision, the first one, or how far away the nearest voxel is;
                /// `colliding` without.
                #[schema(value_type = $crate::http::question::body::AnswerWord, required = false)]
                #[serde(default)]
                answer: $crate::json::ByKeyword<$crate::http::question::body::AnswerWord>,
                /// How far clearances are told, meters.
                clearance_max_m: Option<f32>,
            }
        }
    };
}

pub(super) use check_body;
