//! Points written as E57.

use std::path::Path;

use e57::{E57Writer, Record, RecordValue};

use super::error::SurveyError;

/// Writes points as the one scan of a file, Cartesian coordinates in double precision, meters. `guid` is an identity
/// that no other file has.
///
/// # Errors
/// When the file cannot be written.
pub fn write_e57(path: &Path, guid: &str, points: impl Iterator<Item = [f64; 3]>) -> Result<(), SurveyError> {
    let failed = |error: e57::Error| SurveyError::Writing(error.to_string());
    let mut writer = E57Writer::from_file(path, guid).map_err(failed)?;
    let prototype = vec![Record::CARTESIAN_X_F64, Record::CARTESIAN_Y_F64, Record::CARTESIAN_Z_F64];
    let mut scan = writer.add_pointcloud(guid, prototype).map_err(failed)?;
    for point in points {
        scan.add_point(point.map(RecordValue::Double).to_vec()).map_err(failed)?;
    }
    scan.finalize().map_err(failed)?;
    writer.finalize().map_err(failed)
}
