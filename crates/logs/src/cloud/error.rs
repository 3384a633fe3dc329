//! Why a message has no points that can be read.

use crate::cdr::CdrError;

/// Why a message has no points that can be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CloudError {
    /// The message is cut off, or of another encoding.
    #[error("the message cannot be read: {0}")]
    Message(#[from] CdrError),
    /// The message is of a kind without points.
    #[error("the message has no points")]
    NoCloud,
    /// An image whose camera is not known.
    #[error("where its pixels look is not known: there is no CameraInfo")]
    NoCamera,
    /// An image whose pixels are no depths.
    #[error("its pixels are {0:?}, and depths in 16UC1, mono16 and 32FC1 are read")]
    Encoding(String),
    /// An image of another size than the camera's.
    #[error("it has {} x {} pixels, and its CameraInfo says {} x {}", image[0], image[1], camera[0], camera[1])]
    OtherCamera {
        /// Width and height of the image.
        image: [u32; 2],
        /// Those of the camera.
        camera: [u32; 2],
    },
    /// There are too many points.
    #[error("the cloud has {points} points, and {max} are read")]
    TooMany {
        /// Points of the cloud.
        points: usize,
        /// Points that are read, at most.
        max: usize,
    },
    /// A field is missing.
    #[error("the cloud has no field {missing}, only {fields}")]
    FieldMissing {
        /// Its name.
        missing: String,
        /// Those that there are.
        fields: String,
    },
    /// A field is of a type that ROS does not define.
    #[error("field {0:?} is of an unknown type")]
    FieldType(String),
    /// A field ends behind its point.
    #[error("field {name:?} ends at byte {end} of a point, and a point has {point_step} bytes (point_step)")]
    FieldOutside {
        /// Its name.
        name: String,
        /// The byte behind it.
        end: u64,
        /// Bytes of a point.
        point_step: u32,
    },
    /// There are fewer bytes than the points need.
    #[error("{height} rows of {width} points need {needed} bytes, and data has {len}")]
    DataShort {
        /// Rows.
        height: u32,
        /// Points of a row.
        width: u32,
        /// Bytes that they need.
        needed: u128,
        /// Bytes that are there.
        len: usize,
    },
    /// Rows overlap.
    #[error("a row of {width} points of {point_step} bytes does not fit in row_step, {row_step} bytes")]
    RowStep {
        /// Points of a row.
        width: u32,
        /// Bytes of a point.
        point_step: u32,
        /// Bytes of a row.
        row_step: u32,
    },
}
