//! Keep-outs in JSON.

use serde::Serialize;
use utoipa::ToSchema;

use super::pose::JsonPose;
use super::vectors::{Vector2, Vector3};
use mrol_map::map::{KeepOut, KeepOutShape, Region};

/// A keep-out: its name, its shape under the word for it, and who made it.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = KeepOut)]
pub struct JsonKeepOut {
    /// Its name.
    pub name: String,
    /// The space that it takes.
    #[serde(flatten)]
    pub shape: JsonShape,
    /// The name of the key that it was made with.
    #[schema(nullable = false)]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub made_by: Option<String>,
    /// The revision that it made.
    pub made_revision: u64,
    /// When the server ends it, nanoseconds since the Unix epoch.
    #[schema(nullable = false)]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub expires_at_ns: Option<i64>,
}

/// A bounded part of space, meters.
#[derive(Debug, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
#[schema(as = Shape)]
pub enum JsonShape {
    /// A box along the map's axes.
    Box {
        /// Smallest coordinates.
        #[schema(value_type = Vector3)]
        min_m: [f64; 3],
        /// Largest coordinates.
        #[schema(value_type = Vector3)]
        max_m: [f64; 3],
    },
    /// A ball.
    Sphere {
        /// The center.
        #[schema(value_type = Vector3)]
        center_m: [f64; 3],
        /// The radius.
        radius_m: f64,
    },
    /// A box with any orientation.
    OrientedBox {
        /// Where its center is, and how it is turned.
        map_from_box: JsonPose,
        /// Its sides.
        #[schema(value_type = Vector3)]
        size_m: [f64; 3],
    },
    /// A polygon with a height.
    Prism {
        /// x and y of each corner.
        #[schema(value_type = Vec<Vector2>)]
        corners_m: Vec<[f64; 2]>,
        /// The smallest height.
        z_from_m: f64,
        /// The largest height.
        z_to_m: f64,
    },
}

impl From<&KeepOut> for JsonKeepOut {
    fn from(keep_out: &KeepOut) -> Self {
        Self {
            name: keep_out.name.to_string(),
            shape: (&keep_out.shape).into(),
            made_by: keep_out.made_by.as_ref().map(|caller| caller.as_str().to_owned()),
            made_revision: keep_out.made_revision,
            expires_at_ns: keep_out.expires_at_ns,
        }
    }
}

impl From<&KeepOutShape> for JsonShape {
    fn from(shape: &KeepOutShape) -> Self {
        match shape {
            &KeepOutShape::Region(Region::Box { min_m, max_m }) => Self::Box { min_m, max_m },
            &KeepOutShape::Region(Region::Sphere { center_m, radius_m }) => {
                Self::Sphere { center_m, radius_m }
            }
            KeepOutShape::Region(Region::OrientedBox(of)) => {
                Self::OrientedBox { map_from_box: of.map_from_box().into(), size_m: of.size_m() }
            }
            KeepOutShape::Prism(prism) => {
                let [z_from_m, z_to_m] = prism.z_m();
                Self::Prism { corners_m: prism.corners_m().to_vec(), z_from_m, z_to_m }
            }
        }
    }
}
