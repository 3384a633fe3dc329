//! The forms of bytes, as the description of the API has them. What reads and writes each is where it is served.

use utoipa::openapi::schema::{KnownFormat, ObjectBuilder, SchemaFormat, Type};
use utoipa::openapi::{RefOr, Schema};
use utoipa::{PartialSchema, ToSchema};

/// Makes a type that stands for bytes in the description, from its name and what the bytes are.
macro_rules! forms_of_bytes {
    ($($name:ident: $description:literal;)+) => {$(
        #[doc = $description]
        pub(in crate::http) enum $name {}

        impl ToSchema for $name {}

        impl PartialSchema for $name {
            fn schema() -> RefOr<Schema> {
                let bytes = ObjectBuilder::new().schema_type(Type::String);
                let bytes = bytes.format(Some(SchemaFormat::KnownFormat(KnownFormat::Binary)));
                bytes.description(Some($description)).into()
            }
        }
    )+};
}

forms_of_bytes! {
    PointBytes: "12 bytes a point: x, y and z as little-endian f32. All other fields are parameters.";
    ScanBytes: "12 bytes a point: x, y and z as little-endian f32; with `point_times=true` the time of each point follows \
                behind all points, 4 bytes each. All other fields are parameters.";
    QuestionBytes: "The form for programs: the length of the head in 4 bytes, little-endian; the head, which is the JSON of \
                    the other form with `{\"at\": a, \"bytes\": n}` in the place of arrays; the arrays, of which this one \
                    has n bytes and begins a bytes behind the head. Numbers are little-endian.";
    AnswerBytes: "The form for programs, as of the question: the length of the head in 4 bytes, the head, the arrays.";
    BitmapBytes: "A bit a point, the lowest of each byte first.";
    BlockBytes: "`sparse`: 72 bytes a block of 8 x 8 x 8 voxels, its packed key and a bit a voxel in Morton order. `dense`: \
                 a byte a cell, x fastest, then y.";
    MapFileBytes: "A map file, as `mrol map` and `mrol snapshot` write it.";
    GridTileBytes: "Tiles, each the protobuf message `mrol.v1.GridTile` behind its length in 4 bytes, little-endian.";
    WatchBytes: "Messages without end, each the protobuf message `mrol.v1.WatchResponse` behind its length in 4 bytes, \
                 little-endian.";
}
