//! Surveys that laspy and pye57 wrote, our own, and damaged ones.

use std::fs;
use std::path::{Path, PathBuf};

use mrol_files::survey::{E57Reader, LasKind, LasReader, SurveyError, write_e57, write_las};
use nalgebra::{Point3, Vector3};

const FIXTURES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/fixtures/surveys");
const LAS_FILES: [&str; 4] = ["plain.las", "plain.laz", "extended.las", "layered.laz"];
const POINTS: usize = 300;
/// Where the fixtures begin.
const FIRST: [f64; 3] = [388_096.0, 5_819_456.0, 34.0];
/// Damaged files of each kind.
const DAMAGED: u64 = 300;

fn fixture(name: &str) -> PathBuf {
    Path::new(FIXTURES).join(name)
}

fn las_points(path: &Path) -> Result<Vec<Point3<f64>>, SurveyError> {
    let mut reader = LasReader::open(path)?;
    let mut points = Vec::new();
    loop {
        let part = reader.next_points()?;
        if part.is_empty() {
            return Ok(points);
        }
        points.extend(part);
    }
}

/// The points of a scan, and how many had no place.
type PointsOfScan = (Vec<Point3<f64>>, u64);

/// The points of each scan.
fn e57_points(path: &Path) -> Result<Vec<PointsOfScan>, SurveyError> {
    let mut reader = E57Reader::open(path)?;
    let scans = reader.scans()?.len();
    let read = |k: usize| -> Result<PointsOfScan, SurveyError> {
        let mut scan = reader.points(k)?;
        let mut points = Vec::new();
        loop {
            let part = scan.next_points(64)?;
            if part.is_empty() {
                return Ok((points, scan.skipped()));
            }
            points.extend(part);
        }
    };
    (0..scans).map(read).collect()
}

/// Largest difference of a coordinate.
fn error_m(points: &[Point3<f64>], truth: &[[f64; 3]]) -> f64 {
    assert_eq!(points.len(), truth.len());
    let error = |(point, truth): (&Point3<f64>, &[f64; 3])| (point.coords - Vector3::from(*truth)).amax();
    points.iter().zip(truth).map(error).fold(0.0, f64::max)
}

#[test]
fn files_of_laspy_keep_a_millimeter_at_northings_of_seven_digits() {
    let truth: Vec<[f64; 3]> = (0..POINTS)
        .map(|k| {
            let height = FIRST[2] + 0.001 * (k % 50) as f64;
            [FIRST[0] + 0.013 * k as f64, FIRST[1] - 0.017 * k as f64, height]
        })
        .collect();
    for name in LAS_FILES {
        let error = error_m(&las_points(&fixture(name)).unwrap(), &truth);
        // Nine digits before and behind the point: what f64 rounds there.
        assert!(error < 1e-8, "{name}: {error}");
    }
}

#[test]
fn scans_of_pye57_have_their_poses_and_leave_out_points_without_a_place() {
    let scans = E57Reader::open(&fixture("scans.e57")).unwrap().scans().unwrap();
    let names: Vec<&str> = scans.iter().map(|scan| scan.name.as_str()).collect();
    assert_eq!((names, scans[0].points), (vec!["first", "second"], 200));
    let [first, second] = [0, 1].map(|k| scans[k].survey_from_scan.unwrap());
    assert_eq!(first.translation.vector, Vector3::new(388_100.0, 5_819_500.0, 36.0));
    assert!((first.rotation * Vector3::x() - Vector3::y()).norm() < 1e-12);
    assert_eq!(second.translation.vector, Vector3::new(388_100.0, 5_819_505.0, 36.0));
    let read = e57_points(&fixture("scans.e57")).unwrap();
    assert_eq!([read[0].0.len(), read[1].0.len()], [200, 180]);
    assert_eq!([read[0].1, read[1].1], [0, 20]);
    let circle = read[0].0.iter().all(|point| (point.x.hypot(point.y) - 4.0).abs() < 1e-6);
    assert!(circle && (read[0].0[199].z - 0.99).abs() < 1e-6);
}

#[test]
fn spherical_coordinates_are_ranges_azimuths_and_elevations() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("spherical.e57");
    let mut writer = e57::E57Writer::from_file(&path, "{s}").unwrap();
    let double = |name| e57::Record { name, data_type: e57::RecordDataType::F64 };
    let state = e57::Record {
        name: e57::RecordName::SphericalInvalidState,
        data_type: e57::RecordDataType::Integer { min: 0, max: 2 },
    };
    let prototype = vec![
        double(e57::RecordName::SphericalRange),
        double(e57::RecordName::SphericalAzimuth),
        double(e57::RecordName::SphericalElevation),
        state,
    ];
    let mut scan = writer.add_pointcloud("{s0}", prototype).unwrap();
    let quarter = std::f64::consts::FRAC_PI_2;
    for (range, azimuth, elevation, state) in
        [(2.0, quarter, 0.0, 0), (3.0, 0.0, quarter, 0), (4.0, 0.0, 0.0, 1), (5.0, 0.0, 0.0, 2)]
    {
        let numbers = [range, azimuth, elevation].map(e57::RecordValue::Double);
        scan.add_point([&numbers[..], &[e57::RecordValue::Integer(state)]].concat()).unwrap();
    }
    scan.finalize().unwrap();
    writer.finalize().unwrap();
    let (points, skipped) = e57_points(&path).unwrap().remove(0);
    assert_eq!((points.len(), skipped), (2, 2));
    assert!((points[0].coords - Vector3::new(0.0, 2.0, 0.0)).norm() < 1e-12);
    assert!((points[1].coords - Vector3::new(0.0, 0.0, 3.0)).norm() < 1e-12);
}

#[test]
fn what_is_written_comes_back_within_a_tenth_of_a_millimeter() {
    let folder = tempfile::tempdir().unwrap();
    let map_points: Vec<[f64; 3]> =
        (0..70_000).map(|k| [(f64::from(k) + 0.5) * 0.05 - 1000.0, 0.0033 * f64::from(k), -0.025]).collect();
    let in_survey = |point: &[f64; 3]| [0, 1, 2].map(|axis| point[axis] + FIRST[axis]);
    let truth: Vec<[f64; 3]> = map_points.iter().map(in_survey).collect();
    for (name, kind) in [("a.las", LasKind::Las), ("a.laz", LasKind::Laz)] {
        let path = folder.path().join(name);
        write_las(&path, kind, FIRST, 3000.0, map_points.iter().copied()).unwrap();
        let error = error_m(&las_points(&path).unwrap(), &truth);
        assert!(error <= 0.5e-4 + 1e-8, "{name}: {error}");
    }
    let [las, laz] = ["a.las", "a.laz"].map(|name| fs::metadata(folder.path().join(name)).unwrap().len());
    assert!(laz * 2 < las, "{laz} {las}");
    let path = folder.path().join("a.e57");
    write_e57(&path, "{a}", truth.iter().copied()).unwrap();
    let scans = e57_points(&path).unwrap();
    assert_eq!((scans.len(), error_m(&scans[0].0, &truth)), (1, 0.0));
    assert_eq!(E57Reader::open(&path).unwrap().scans().unwrap()[0].survey_from_scan, None);
}

#[test]
fn coordinates_wider_than_the_format_have_coarser_steps_or_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("wide.las");
    let far = [[400_000.025, 0.0, 0.0]];
    write_las(&path, LasKind::Las, [0.0; 3], far[0][0], far.into_iter()).unwrap();
    assert!(error_m(&las_points(&path).unwrap(), &far) < 1e-8);
    let error = write_las(&path, LasKind::Las, [0.0; 3], 1e9, [[1e9, 0.0, 0.0]].into_iter()).unwrap_err();
    assert!(error.to_string().contains("1000000000 m from the origin"), "{error}");
}

#[test]
fn claims_that_a_file_cannot_hold_are_refused_before_anything_is_read_by_them() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |name: &str, changes: &[(usize, &[u8])], what: &str| {
        let mut bytes = fs::read(fixture(name)).unwrap();
        for (at, change) in changes {
            bytes[*at..at + change.len()].copy_from_slice(change);
        }
        let path = folder.path().join(name);
        fs::write(&path, bytes).unwrap();
        let error = las_points(&path).unwrap_err().to_string();
        assert!(error.contains(what), "{name}: {error}");
    };
    let many = u32::MAX.to_le_bytes();
    refused("plain.las", &[(107, &many)], "4294967295 points of 28 bytes");
    refused("plain.las", &[(96, &many)], "begin at byte 4294967295");
    refused("plain.laz", &[(107, &many)], "fewer than the 4294967295 points");
    refused("plain.las", &[(107, &[0; 4])], "names no points, and 8400 bytes of points follow");
    for (scale, told) in
        [(0.0, "scales z by 0,"), (-0.01, "scales z by -0.01,"), (f64::NAN, "NaN"), (1e300, "at most 1000")]
    {
        refused("plain.las", &[(147, &f64::to_le_bytes(scale))], told);
    }
    for offset in [f64::NAN, f64::INFINITY, 1e300] {
        refused("plain.laz", &[(155, &offset.to_le_bytes())], "shifts x by");
    }
    // An extended record, for whose claim a reader would make room.
    let record = [&200u64.to_le_bytes()[..], &1u32.to_le_bytes()].concat();
    refused(
        "extended.las",
        &[(235, &record), (220, &u64::MAX.to_le_bytes())],
        "extended record of 1844674407",
    );
    // The table of chunks stands behind the points, and has its number of chunks in its second word.
    for name in ["plain.laz", "layered.laz"] {
        let bytes = fs::read(fixture(name)).unwrap();
        let points = u32::from_le_bytes(*bytes[96..].first_chunk().unwrap()) as usize;
        let table = u64::from_le_bytes(*bytes[points..].first_chunk().unwrap()) as usize;
        refused(name, &[(table + 4, &many)], "names 4294967295 chunks");
        refused(name, &[(points, &[0xff, 0xff, 0xff, 0xff, 0xff, 0, 0, 0])], "said to lie at byte");
    }
    // Behind the first point of a chunk of layers: its number of points, then the size of each layer.
    let bytes = fs::read(fixture("layered.laz")).unwrap();
    let points = u32::from_le_bytes(*bytes[96..].first_chunk().unwrap()) as usize;
    let record = usize::from(u16::from_le_bytes(*bytes[105..].first_chunk().unwrap()));
    refused("layered.laz", &[(points + 8 + record + 4, &many)], "layers of chunk 0");
    refused("layered.laz", &[(points + 8 + record, &many)], "chunk 0 says");
}

#[test]
fn an_xml_that_takes_a_parser_forever_is_refused_and_so_are_scans_that_share_their_points() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.e57");
    let whole = fs::read(fixture("scans.e57")).unwrap();
    let mut content: Vec<u8> = whole.chunks(1024).flat_map(|page| &page[..1020]).copied().collect();
    let number = |at: usize| u64::from_le_bytes(*whole[at..].first_chunk().unwrap()) as usize;
    let (place, length) = (number(24), number(32));
    let begin = place - place / 1024 * 4;
    let xml = String::from_utf8(content[begin..begin + length].to_vec()).unwrap();
    let mut refused = |xml: &str, what: &str| {
        content.truncate(begin);
        content.extend(xml.as_bytes());
        content.resize(content.len().div_ceil(1020) * 1020, 0);
        let mut file: Vec<u8> = content.chunks(1020).flat_map(|page| [page, &[0; 4]].concat()).collect();
        let (bytes, length) = (file.len() as u64, xml.len() as u64);
        file[16..24].copy_from_slice(&bytes.to_le_bytes());
        file[32..40].copy_from_slice(&length.to_le_bytes());
        seal(&mut file);
        fs::write(&path, file).unwrap();
        let error = e57_points(&path).map(|scans| scans.len()).unwrap_err().to_string();
        assert!(error.contains(what), "{error}");
    };
    let nested: String = (0..8000).map(|k| format!("<a xmlns:a{k}=\"u{k}\">")).collect();
    refused(&(nested + &"</a>".repeat(8000)), "more than 64 deep");
    let offset = |xml: &str| {
        let at = xml.find("fileOffset=\"").unwrap() + 12;
        xml[at..].split('"').next().unwrap().to_owned()
    };
    let first = offset(&xml);
    let second = offset(&xml[xml.find(&first).unwrap() + 20..]);
    let same = xml.replace(&format!("fileOffset=\"{second}\""), &format!("fileOffset=\"{first}\""));
    refused(&same, "two scans have the same points");
    let constant: String =
        (0..17).map(|k| format!("<f{k} type=\"Integer\" minimum=\"0\" maximum=\"0\"/>")).collect();
    refused(
        &xml.replacen("</prototype>", &(constant + "</prototype>"), 1),
        "17 fields that are constant, the limit is 16",
    );
}

#[test]
fn cut_and_changed_files_give_errors_or_points_and_never_end_the_program() {
    let folder = tempfile::tempdir().unwrap();
    let mut state = 88_172_645_463_325_252_u64;
    let mut random = |below: usize| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state % below as u64) as usize
    };
    for name in LAS_FILES.into_iter().chain(["scans.e57"]) {
        let whole = fs::read(fixture(name)).unwrap();
        let path = folder.path().join(name);
        let mut errors = 0;
        for trial in 0..DAMAGED {
            let mut bytes = whole.clone();
            match trial % 3 {
                0 => bytes.truncate(random(whole.len())),
                1 => bytes[random(whole.len())] ^= 1 << random(8),
                _ => (0..4).for_each(|_| bytes[random(whole.len().min(700))] = random(256) as u8),
            }
            if name == "scans.e57" {
                seal(&mut bytes);
            }
            fs::write(&path, bytes).unwrap();
            let error = match name {
                "scans.e57" => e57_points(&path).err(),
                _ => las_points(&path).err(),
            };
            if let Some(error) = error {
                errors += 1;
                assert!(error.to_string().len() < 1000, "{error}");
            }
        }
        assert!(errors >= DAMAGED / 3, "{name}: {errors}");
    }
}

/// Writes the checksums of all pages of an E57 file again, so that what is changed is read.
fn seal(bytes: &mut [u8]) {
    for page in bytes.chunks_exact_mut(1024) {
        let (content, checksum) = page.split_at_mut(1020);
        checksum.copy_from_slice(&crc32c(content).to_be_bytes());
    }
}

fn crc32c(bytes: &[u8]) -> u32 {
    let step = |crc: u32, _| if crc & 1 == 1 { (crc >> 1) ^ 0x82f6_3b78 } else { crc >> 1 };
    !bytes.iter().fold(u32::MAX, |crc, byte| (0..8).fold(crc ^ u32::from(*byte), step))
}
