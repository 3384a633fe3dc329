//! Arrays of a fixed length, as the description of the API has them: Rust's arrays tell the derived schemas no length.

use utoipa::openapi::schema::{ArrayBuilder, Object, ObjectBuilder, Type};
use utoipa::openapi::{RefOr, Schema};
use utoipa::{PartialSchema, ToSchema};

/// Makes a type that stands for an array in a schema, from its name, its length, what it is an array of and its
/// description.
macro_rules! vectors {
    ($($name:ident: $length:literal of $item:expr, $description:literal;)+) => {$(
        #[doc = concat!($description, ".")]
        #[derive(Debug)]
        pub struct $name;

        impl ToSchema for $name {}

        impl PartialSchema for $name {
            fn schema() -> RefOr<Schema> {
                let array = ArrayBuilder::new().items($item).min_items(Some($length)).max_items(Some($length));
                array.description(Some(concat!($description, "."))).into()
            }
        }
    )+};
}

vectors! {
    Vector2: 2 of number(), "x and y, meters";
    Vector3: 3 of number(), "x, y and z";
    Quaternion: 4 of number(), "A unit quaternion x, y, z, w";
    Sphere: 4 of number(), "Center x, y, z and radius, meters";
    PoseNumbers: 7 of number(), "A pose x, y, z, qx, qy, qz, qw";
    PoseVector: 6 of number(), "A number for each of x, y, z and the turns about them";
    PoseMatrix: 6 of PoseVector::schema(), "Six rows of six numbers";
    Corners3: 2 of Vector3::schema(), "The smallest and the largest coordinates of a box";
    VoxelIndex: 3 of ObjectBuilder::new().schema_type(Type::Integer), "Indices i, j and k of a voxel";
    Sizes2: 2 of ObjectBuilder::new().schema_type(Type::Integer), "Numbers of cells along x and y";
}

fn number() -> Object {
    ObjectBuilder::new().schema_type(Type::Number).build()
}
