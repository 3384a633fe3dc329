//! The units that the header of a LAS or LAZ file names: maps are in meters.

use std::io::{Read, Seek, SeekFrom};

use las::raw;

use super::error::SurveyError;

/// Whose records name the coordinate system.
const PROJECTION_USER: &[u8] = b"LASF_Projection\0";
/// The record of GeoTIFF's keys, and the one of the text (WKT).
const KEYS_RECORD: u16 = 34_735;
const TEXT_RECORD: u16 = 2112;
/// Keys of GeoTIFF: the kind of coordinates, and the units of projected and of vertical ones.
const MODEL_KEY: u16 = 1024;
const LINEAR_UNITS_KEY: u16 = 3076;
const VERTICAL_UNITS_KEY: u16 = 4099;
/// The kind that are degrees, and the unit that is a meter; others are left to whoever named them.
const GEOGRAPHIC: u16 = 2;
const METER: u16 = 9001;
const FEET: [u16; 2] = [9002, 9003];

/// Refuses degrees and feet, where one of the first `records` records behind the header names them.
///
/// # Errors
/// Names the unit.
pub(super) fn check(
    file: &mut (impl Read + Seek),
    header_bytes: u64,
    records: u32,
) -> Result<(), SurveyError> {
    file.seek(SeekFrom::Start(header_bytes))?;
    for _ in 0..records {
        let record = raw::Vlr::read_from(&mut *file, false)?;
        if !record.user_id.starts_with(PROJECTION_USER) {
            continue;
        }
        let unit = match record.record_id {
            KEYS_RECORD => unit_of_keys(&record.data),
            TEXT_RECORD => unit_of_text(&record.data),
            _ => None,
        };
        if let Some(unit) = unit {
            return Err(SurveyError::Content(format!(
                "its coordinates are in {unit} by its own header, and a map is in meters: project it first, as by `pdal \
                 translate IN.las OUT.las reprojection --filters.reprojection.out_srs=EPSG:...` with a system in meters"
            )));
        }
    }
    Ok(())
}

/// The unit other than meters that keys of GeoTIFF name: four numbers each, the key first and its value last.
fn unit_of_keys(data: &[u8]) -> Option<&'static str> {
    let (numbers, _) = data.as_chunks::<2>();
    let numbers: Vec<u16> = numbers.iter().map(|&bytes| u16::from_le_bytes(bytes)).collect();
    let (entries, _) = numbers.get(4..)?.as_chunks::<4>();
    let value =
        |key: u16| entries.iter().find(|entry| entry[0] == key && entry[1] == 0).map(|entry| entry[3]);
    let units = [LINEAR_UNITS_KEY, VERTICAL_UNITS_KEY].map(value);
    match value(MODEL_KEY) == Some(GEOGRAPHIC) {
        true => Some("degrees"),
        false => {
            units.into_iter().flatten().any(|unit| unit != METER && FEET.contains(&unit)).then_some("feet")
        }
    }
}

/// The unit other than meters that a coordinate system in words (WKT 1) has.
fn unit_of_text(data: &[u8]) -> Option<&'static str> {
    let text = String::from_utf8_lossy(data).to_ascii_uppercase();
    let text = text.trim_start();
    let is_degrees = text.starts_with("GEOGCS[")
        || text.starts_with("GEOGCRS[")
        || text.starts_with("COMPD_CS[") && !text.contains("PROJCS[");
    let is_feet = text.split("UNIT[\"").skip(1).any(|unit| unit.split('"').next().is_some_and(is_foot));
    match is_degrees && !text.contains("GEOCCS[") {
        true => Some("degrees"),
        false => is_feet.then_some("feet"),
    }
}

fn is_foot(unit: &str) -> bool {
    unit.contains("FOOT") || unit.contains("FEET") || unit == "FT"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_name_degrees_and_feet() {
        let keys = |entries: &[[u16; 4]]| {
            let head = [1u16, 1, 0, entries.len() as u16];
            let numbers = head.into_iter().chain(entries.iter().flatten().copied());
            unit_of_keys(&numbers.flat_map(u16::to_le_bytes).collect::<Vec<u8>>())
        };
        assert_eq!(keys(&[[1024, 0, 1, 2], [2048, 0, 1, 4326]]), Some("degrees"));
        assert_eq!(keys(&[[1024, 0, 1, 1], [3076, 0, 1, 9003]]), Some("feet"));
        assert_eq!(keys(&[[1024, 0, 1, 1], [4099, 0, 1, 9002]]), Some("feet"));
        for meters in
            [&[[1024, 0, 1, 1], [3072, 0, 1, 32633], [3076, 0, 1, 9001]][..], &[[1024, 0, 1, 1]], &[]]
        {
            assert_eq!(keys(meters), None, "{meters:?}");
        }
        assert_eq!(unit_of_keys(&[1, 2, 3]), None);
    }

    #[test]
    fn words_name_degrees_and_feet() {
        let geographic = r#"GEOGCS["WGS 84",DATUM["WGS_1984"],UNIT["degree",0.0174532925199433]]"#;
        assert_eq!(unit_of_text(geographic.as_bytes()), Some("degrees"));
        let projected =
            |unit: &str| format!(r#"PROJCS["a",{geographic},PROJECTION["b"],UNIT["{unit}",0.3]]"#);
        assert_eq!(unit_of_text(projected("US survey foot").as_bytes()), Some("feet"));
        assert_eq!(unit_of_text(projected("m").as_bytes()), None);
        assert_eq!(unit_of_text(b""), None);
    }
}
