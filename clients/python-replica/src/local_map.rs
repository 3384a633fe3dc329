//! A map without a server: the operations of one, in this process.

use std::time::Duration;

use bytes::Bytes;
use mrol_client::align::localize::{Gravity, LocalizationQuery, SearchBox};
use mrol_client::align::{Method, PoseCovariance, RayAgreement, Rival};
use mrol_client::bloom::FilterSettings;
use mrol_client::geometry::Pose;
use mrol_client::map::{MapName, MapSettings, RobotName};
use mrol_client::mapping::Guess;
use mrol_client::scan::PointFilter;
use mrol_client::service::{
    Deletion, DeletionTarget, ListingRequest, LocalizationRequest, MapService, PointTimes, ScanAnswer,
    ScanRequest, ServiceError, ServiceSettings, TimeReference,
};
use mrol_client::util::Keyword;
use mrol_client::visibility::SensorModelError;
use mrol_store::OpeningProgress;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::answers::{Indices, Version, indices, of_bytes, told};
use crate::arrays::{Rows, Times, points_of};
use crate::failure::{Failure, guarded};
use crate::questions::NativeMap;
use crate::region::{Seven, Shape, pose_of};
use crate::source::{OpenSource, Source};
use crate::waiting::{threads, wait_for};

/// The name of the map in its service, which nobody sees but in messages.
const NAME: &str = "local";

/// A map without a server.
#[pyclass(frozen, extends = NativeMap, module = "mrol_native")]
pub(crate) struct NativeLocalMap;

/// What a scan is sent with, where it is given: the fields of `LocalMap.insert` of the package.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct ScanFields<'py> {
    robot: String,
    guess: Option<Seven>,
    motion: Option<Seven>,
    constant_velocity: bool,
    align: bool,
    timestamp_ns: Option<i64>,
    point_times: Option<Times<'py>>,
    point_times_from_sweep_start: bool,
    gravity_in_sensor: Option<[f64; 3]>,
    guess_covariance: Option<Vec<f64>>,
    recover: Option<bool>,
    carve: Option<bool>,
    force: bool,
    overlap_alone: Option<bool>,
    range_min_m: Option<f64>,
    range_max_m: Option<f64>,
    body_m: Option<([f64; 3], [f64; 3])>,
    sensor: Option<String>,
    strict: bool,
    foreground_level: Option<u32>,
}

impl ScanFields<'_> {
    fn request(self, points: &Rows<'_>) -> Result<ScanRequest, Failure> {
        let robot = RobotName::new(&self.robot).map_err(ServiceError::from)?;
        let reference = match self.point_times_from_sweep_start {
            true => TimeReference::SweepStart,
            false => TimeReference::Timestamp,
        };
        let bad = |message: String| Failure::argument(message);
        Ok(ScanRequest {
            timestamp_ns: self.timestamp_ns,
            point_times: self.point_times.map(|times| PointTimes::new(&times.as_array().to_vec(), reference)),
            gravity: match self.gravity_in_sensor {
                Some(down) => Some(gravity_of(down, None)?),
                None => None,
            },
            guess: match (self.guess, self.motion, self.constant_velocity) {
                (Some(pose), ..) => Guess::Pose(pose_of(pose)?),
                (_, Some(motion), _) => Guess::Motion(pose_of(motion)?),
                (.., true) => Guess::ConstantVelocity,
                _ => Guess::Last,
            },
            guess_covariance: match self.guess_covariance {
                Some(rows) => Some(PoseCovariance::new(&rows).map_err(|error| bad(error.to_string()))?),
                None => None,
            },
            at_guess: !self.align,
            force: self.force,
            recover: self.recover,
            carve: self.carve,
            method: self.overlap_alone.map(|alone| if alone { Method::Overlap } else { Method::Refined }),
            foreground_level: self.foreground_level,
            filter: PointFilter {
                range_min_m: self.range_min_m,
                range_max_m: self.range_max_m,
                no_return_m: None,
                body_m: self.body_m,
                keep_zeros: false,
                beyond_range_is_noise: false,
            },
            sensor: match self.sensor {
                Some(text) => Some(text.parse().map_err(|error: SensorModelError| bad(error.to_string()))?),
                None => None,
            },
            strict: self.strict,
            ..ScanRequest::new(robot, points_of(points))
        })
    }
}

/// The direction in which things fall.
fn gravity_of(in_sensor: [f64; 3], in_map: Option<[f64; 3]>) -> Result<Gravity, Failure> {
    let made = Gravity::new(in_sensor, in_map.unwrap_or([0.0, 0.0, -1.0]));
    made.map_err(|error| Failure::argument(error.to_string()))
}

fn seven_of(pose: &Pose) -> Seven {
    let ([x, y, z], q) = (pose.translation.vector.into(), pose.rotation.coords);
    [x, y, z, q.x, q.y, q.z, q.w]
}

/// What became of a scan, by the names of the fields of `mrol.ScanAnswer`.
fn answer_of<'py>(py: Python<'py>, answer: &ScanAnswer, points: usize) -> PyResult<Bound<'py, PyDict>> {
    let fields = PyDict::new(py);
    fields.set_item("version", told(&answer.version))?;
    fields.set_item("accepted", answer.accepted)?;
    fields.set_item("verdict", answer.verdict.as_str())?;
    fields.set_item("reason", &answer.reason)?;
    fields.set_item("map_from_sensor", seven_of(&answer.map_from_sensor))?;
    fields.set_item("overlap", answer.overlap())?;
    fields.set_item("level_overlaps", &answer.level_overlaps)?;
    fields.set_item("inliers", answer.inliers)?;
    fields.set_item("fitness", answer.fitness)?;
    fields.set_item("information", answer.information)?;
    let undetermined: Vec<_> = answer.undetermined.iter().map(|of| (of.direction, of.std_m)).collect();
    fields.set_item("undetermined", undetermined)?;
    fields.set_item("rays", answer.rays.map(sides_of))?;
    fields.set_item("rivals", answer.rivals.iter().map(rival_of).collect::<Vec<_>>())?;
    fields.set_item("iterations", answer.iterations)?;
    fields.set_item("align_ms", answer.align_time.as_secs_f64() * 1e3)?;
    fields.set_item("new_voxels", answer.new_voxels)?;
    fields.set_item("carved_voxels", answer.carved_voxels)?;
    fields.set_item("points_skipped", answer.points_skipped)?;
    fields.set_item("stationary", answer.stationary)?;
    fields.set_item("recovered", answer.recovered.map(Keyword::as_str))?;
    let foreground = answer.foreground.as_ref().map(|of| of_bytes(py, &of.bitmap, points));
    fields.set_item("foreground", foreground)?;
    Ok(fields)
}

/// Asked, agree and contradicted, of the scan and of the map.
fn sides_of(rays: RayAgreement) -> [[usize; 3]; 2] {
    [rays.of_scan, rays.of_map].map(|side| [side.asked, side.agree, side.contradicted])
}

/// A pose and how rays agree there.
fn rival_of(rival: &Rival) -> (Seven, [[usize; 3]; 2]) {
    (seven_of(&rival.map_from_sensor), sides_of(rival.agreement))
}

fn name() -> Result<MapName, Failure> {
    Ok(MapName::new(NAME).map_err(ServiceError::from)?)
}

/// A service without a folder, a limit of memory and anybody who counts.
fn service() -> Result<MapService, Failure> {
    let _threads = threads()?.enter();
    MapService::open(ServiceSettings::default(), &OpeningProgress::default())
        .map_err(|error| Failure::defect(error.to_string()))
}

fn made(service: MapService) -> PyResult<PyClassInitializer<NativeLocalMap>> {
    let source = OpenSource::new(Source::Local { service, name: name()? });
    Ok(PyClassInitializer::from(NativeMap { source }).add_subclass(NativeLocalMap))
}

#[pymethods]
impl NativeLocalMap {
    /// An empty map.
    #[new]
    fn new(
        py: Python<'_>,
        resolution_m: f64,
        levels: u32,
        has_filter: bool,
        has_moments: bool,
    ) -> PyResult<PyClassInitializer<Self>> {
        guarded(|| {
            let settings = MapSettings {
                filter: has_filter.then(FilterSettings::default),
                moments: has_moments,
                ..MapSettings::new(resolution_m, levels)
            };
            let service = service()?;
            wait_for(py, service.create_map(name()?, settings))?;
            made(service)
        })
    }

    /// The map of a map file's bytes.
    #[staticmethod]
    fn of_file(py: Python<'_>, file: &[u8]) -> PyResult<Py<Self>> {
        guarded(|| {
            let service = service()?;
            wait_for(py, service.restore_map(name()?, Bytes::copy_from_slice(file), false))?;
            Py::new(py, made(service)?)
        })
    }

    /// The map as the bytes of a map file.
    fn to_file<'py>(slf: PyRef<'py, Self>, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        guarded(|| {
            let source = slf.as_super().source.get()?;
            let (service, name) = source.local()?;
            let file = wait_for(py, service.snapshot_map(name))?;
            Ok(PyBytes::new(py, &file.bytes))
        })
    }

    /// Aligns a scan of shape (n, 3) and adds it where it fits; or, not to be `inserted`, says what would become of it.
    fn map_scan<'py>(
        slf: PyRef<'py, Self>,
        py: Python<'py>,
        points: Rows<'py>,
        fields: ScanFields<'py>,
        is_inserted: bool,
    ) -> PyResult<Bound<'py, PyDict>> {
        guarded(|| {
            let source = slf.as_super().source.get()?;
            let (service, name) = source.local()?;
            let scan = fields.request(&points)?;
            let count = scan.points.len();
            let answer = match is_inserted {
                true => wait_for(py, service.insert_scan(name, scan))?,
                false => wait_for(py, service.align_scan(name, scan))?,
            };
            answer_of(py, &answer, count)
        })
    }

    /// Where was a scan taken? By the names of the fields of `mrol.Localization`.
    #[expect(clippy::too_many_arguments, reason = "they are the keywords of a function of Python")]
    fn localize<'py>(
        slf: PyRef<'py, Self>,
        py: Python<'py>,
        points: Rows<'py>,
        gravity_in_sensor: Option<[f64; 3]>,
        gravity_in_map: Option<[f64; 3]>,
        search_box: Option<([f64; 3], [f64; 3])>,
        time_limit_s: Option<f64>,
        candidates: usize,
        seed: u64,
    ) -> PyResult<Bound<'py, PyDict>> {
        guarded(|| {
            let source = slf.as_super().source.get()?;
            let (service, name) = source.local()?;
            let bad = |message: String| PyErr::from(Failure::argument(message));
            let query = LocalizationQuery {
                gravity: match gravity_in_sensor {
                    Some(down) => Some(gravity_of(down, gravity_in_map)?),
                    None => None,
                },
                search_box: match search_box {
                    Some((min_m, max_m)) => {
                        Some(SearchBox::new(min_m, max_m).map_err(|error| bad(error.to_string()))?)
                    }
                    None => None,
                },
                candidates,
                seed,
            };
            let time_limit = time_limit_s.map(Duration::try_from_secs_f64).transpose();
            let time_limit = time_limit.map_err(|error| bad(format!("time_limit_s: {error}")))?;
            let request = LocalizationRequest { points: points_of(&points), query, time_limit };
            let found = wait_for(py, service.localize(name, request))?;
            let version = wait_for(py, service.map_info(name))?.version;
            let fields = PyDict::new(py);
            fields.set_item("version", told(&version))?;
            fields.set_item("verdict", found.verdict.as_str())?;
            fields.set_item("reason", found.reason)?;
            let of = |of: &mrol_client::service::CandidateAnswer| {
                (seven_of(&of.map_from_sensor), of.overlap, of.inliers, of.rays.map(sides_of))
            };
            fields.set_item("candidates", found.candidates.iter().map(of).collect::<Vec<_>>())?;
            fields.set_item("rivals", found.rivals.iter().map(rival_of).collect::<Vec<_>>())?;
            fields.set_item("exhaustive", found.exhaustive)?;
            fields.set_item("cut_short", found.cut_short)?;
            fields.set_item("search_ms", found.search_time.as_secs_f64() * 1e3)?;
            fields.set_item("points_skipped", found.points_skipped)?;
            Ok(fields)
        })
    }

    /// The occupied voxels of a level, all or those in a region: indices, the side of a voxel, the version.
    fn voxels<'py>(
        slf: PyRef<'py, Self>,
        py: Python<'py>,
        level: u32,
        region: Option<Shape>,
    ) -> PyResult<(Indices<'py>, f64, Version)> {
        guarded(|| {
            let source = slf.as_super().source.get()?;
            let (service, name) = source.local()?;
            let region = region.as_ref().map(Shape::region).transpose()?;
            let listing = wait_for(py, service.list_voxels(name, ListingRequest::of(level, region)))?;
            Ok((indices(py, listing.keys.into_iter())?, listing.resolution_m, told(&listing.version)))
        })
    }

    /// Deletes the voxels whose centers lie in a region: how many finest ones went, and the version.
    fn delete(slf: PyRef<'_, Self>, py: Python<'_>, region: Shape, level: u32) -> PyResult<(usize, Version)> {
        guarded(|| {
            let source = slf.as_super().source.get()?;
            let (service, name) = source.local()?;
            let target = DeletionTarget::Region(region.region()?);
            let deletion = Deletion { target, level, request_id: None };
            let deleted = wait_for(py, service.delete_voxels(name, deletion))?;
            Ok((deleted.removed, told(&deleted.version)))
        })
    }
}
