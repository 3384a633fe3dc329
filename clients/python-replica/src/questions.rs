//! The questions, from arrays to arrays.

use std::sync::Arc;

use mrol_client::geometry::{Point, Pose, pose};
use mrol_client::map::{Lookup, Region};
use mrol_client::planning::{MeasuredTo, Surroundings, Unknown};
use mrol_client::service::{
    Asked, CheckAs, ClassifyQuestion, MotionCheck, NearestQuestion, PointCloud, PointQuery, PoseCheck,
    RayQuestion, RaysToward, Reason, ServiceError, SphereCheck,
};
use numpy::{PyArray1, PyArray2, PyArrayDyn, PyArrayMethods, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyBool;

use crate::answers::{
    Bools, Checked, Indices, Version, checked, indices, names, of_bytes, of_words, ones, told,
};
use crate::arrays::{Counts, Floats, Rows, is_aligned};
use crate::body::{NativeBody, spheres_of};
use crate::failure::{Failure, argument, guarded};
use crate::source::OpenSource;

/// A pose, x y z and qx qy qz qw.
pub(crate) type Seven = [f64; 7];

/// Regions, each a word for its kind and its numbers.
type Regions = Vec<(String, Vec<f64>)>;

/// Names of keep-outs, of an answer with any.
type Names = Option<Vec<Option<String>>>;

/// What a map of this process is asked.
#[pyclass(frozen, subclass, module = "mrol_replica._native")]
pub(crate) struct Questions {
    pub(crate) source: OpenSource,
}

/// The points of an array of shape (n, 3), copied: changes of the array meanwhile do not change the question.
pub(crate) fn points_of(rows: &Rows<'_>) -> PointCloud {
    // A slice there is of an array whose columns lie together, too.
    let points: Vec<Point> = match rows.as_slice().ok().filter(|_| rows.is_c_contiguous()) {
        Some(numbers) => bytemuck::cast_slice(numbers).to_vec(),
        None => rows.as_array().rows().into_iter().map(|row| [row[0], row[1], row[2]].into()).collect(),
    };
    points.into()
}

/// A pose of seven numbers.
pub(crate) fn pose_of([x, y, z, i, j, k, w]: Seven) -> Result<Pose, Failure> {
    Ok(pose([x, y, z], [i, j, k, w]).map_err(ServiceError::from)?)
}

/// The region that a word for its kind and its numbers mean.
pub(crate) fn region_of((kind, numbers): &(String, Vec<f64>)) -> Result<Region, Failure> {
    let three = |from: usize| -> [f64; 3] {
        std::array::from_fn(|i| numbers.get(from + i).copied().unwrap_or(f64::NAN))
    };
    let region = match kind.as_str() {
        "box" => Region::cuboid(three(0), three(3)),
        "sphere" => Region::ball(three(0), three(3)[0]),
        _ => {
            let seven = std::array::from_fn(|i| numbers.get(i).copied().unwrap_or(f64::NAN));
            Region::oriented_box(pose_of(seven)?, three(7))
        }
    };
    Ok(region.map_err(ServiceError::from)?)
}

fn surroundings(ignored: &Regions, unknown_is_occupied: bool) -> Result<Surroundings, Failure> {
    let ignored = ignored.iter().map(region_of).collect::<Result<_, _>>()?;
    Ok(Surroundings { ignored, unknown: unknown(unknown_is_occupied) })
}

fn unknown(is_occupied: bool) -> Unknown {
    if is_occupied { Unknown::Occupied } else { Unknown::Free }
}

fn asked(level: u32, ignore_keep_outs: bool) -> Asked {
    Asked { level, ignore_keep_outs, ..Asked::default() }
}

fn check_as(answer: &str, most_m: Option<f32>) -> Result<CheckAs, Failure> {
    match answer {
        "clearance" => Ok(CheckAs::Clearance { most_m }),
        _ if most_m.is_some() => {
            // As of a server, which would otherwise refuse what this answers.
            let message = "clearance_max_m goes with the answer clearance";
            Err(ServiceError::new(Reason::BadCheck, message).into())
        }
        "first_hit" => Ok(CheckAs::FirstHit),
        _ => Ok(CheckAs::Colliding),
    }
}

/// The numbers of an array, row by row, copied.
fn numbers_of(rows: &Floats<'_>) -> Vec<f32> {
    // A slice there is of an array whose columns lie together, too.
    match rows.as_slice().ok().filter(|_| rows.is_c_contiguous()) {
        Some(numbers) => numbers.to_vec(),
        None => rows.as_array().iter().copied().collect(),
    }
}

/// The array that an argument is which is not copied. One with masked values is none: what its masks hide are numbers
/// here.
fn floats_of<'py>(name: &str, value: &Bound<'py, PyAny>) -> PyResult<Floats<'py>> {
    let expected = "an array of float32: numpy.asarray(..., numpy.float32) makes it so";
    let array = value.cast::<PyArrayDyn<f32>>().map_err(|_| argument(name, value, expected))?;
    if !(array.is_c_contiguous() && is_aligned(array)) {
        let message = format!(
            "{name} must be contiguous and aligned: numpy.require(..., numpy.float32, ['C', 'ALIGNED']) makes it so"
        );
        return Err(Failure::argument(message).into());
    }
    if !value.is_exact_instance_of::<PyUntypedArray>() {
        let masked = value.py().import("numpy.ma")?.call_method1("is_masked", (value,))?;
        if masked.extract()? {
            return Err(argument(
                name,
                value,
                "an array without masked values: fill it first, .filled(numpy.nan)",
            ));
        }
    }
    value.extract()
}

fn level_of(value: &Bound<'_, PyAny>) -> PyResult<u32> {
    let level = value.extract::<u32>().ok().filter(|_| !value.is_instance_of::<PyBool>());
    level.ok_or_else(|| argument("level", value, "a whole number of 0 to 4294967295"))
}

fn flag_of(name: &str, value: Option<&Bound<'_, PyAny>>) -> PyResult<bool> {
    let Some(value) = value else { return Ok(false) };
    value.extract().map_err(|_| argument(name, value, "True or False"))
}

#[pymethods]
impl Questions {
    /// Frees its memory, once the last call that uses it returns.
    fn close(&self, py: Python<'_>) -> PyResult<()> {
        guarded(|| {
            py.detach(|| self.source.close());
            Ok(())
        })
    }

    /// Are points of shape (n, 3) in occupied voxels?
    fn query<'py>(
        &self,
        py: Python<'py>,
        points: Rows<'py>,
        map_from_points: Option<Seven>,
        level: u32,
        bloom: bool,
        keep_out: bool,
    ) -> PyResult<(Bools<'py>, usize, Version)> {
        guarded(|| {
            let query = PointQuery {
                points: points_of(&points),
                map_from_points: map_from_points.map(pose_of).transpose()?,
                level,
                lookup: if bloom { Lookup::Bloom } else { Lookup::Exact },
                min_revision: None,
                map_uuid: None,
                keep_out,
            };
            let answer = self.source.get()?.query_points(py, query)?;
            Ok((of_bytes(py, &answer.occupied, answer.points), answer.points_occupied, told(&answer.version)))
        })
    }

    /// Does a body fit at configurations, an array of shape (n, 7 * links)?
    #[expect(clippy::too_many_arguments, reason = "they are the keywords of a function of Python")]
    fn check_poses<'py>(
        &self,
        py: Python<'py>,
        body: &NativeBody,
        configurations: Floats<'py>,
        answer: &str,
        clearance_max_m: Option<f32>,
        ignored: Regions,
        unknown_is_occupied: bool,
        level: u32,
        ignore_keep_outs: bool,
    ) -> PyResult<Checked<'py>> {
        guarded(|| {
            let check = PoseCheck {
                asked: asked(level, ignore_keep_outs),
                body: Arc::clone(&body.body),
                configurations: numbers_of(&configurations),
                surroundings: surroundings(&ignored, unknown_is_occupied)?,
                answer: check_as(answer, clearance_max_m)?,
            };
            let answered = self.source.get()?.ask(py, check)?;
            checked(py, &answered.answer, &answered.version)
        })
    }

    /// Do spheres of shape (n, 4) meet anything, in groups of so many?
    #[expect(clippy::too_many_arguments, reason = "they are the keywords of a function of Python")]
    fn check_spheres<'py>(
        &self,
        py: Python<'py>,
        spheres: Rows<'py>,
        sizes: Counts<'py>,
        padding_m: f32,
        answer: &str,
        clearance_max_m: Option<f32>,
        ignored: Regions,
        unknown_is_occupied: bool,
        level: u32,
        ignore_keep_outs: bool,
    ) -> PyResult<Checked<'py>> {
        guarded(|| {
            let check = SphereCheck {
                asked: asked(level, ignore_keep_outs),
                spheres: spheres_of(&spheres),
                sizes: sizes.as_array().to_vec(),
                padding_m,
                surroundings: surroundings(&ignored, unknown_is_occupied)?,
                answer: check_as(answer, clearance_max_m)?,
            };
            let answered = self.source.get()?.ask(py, check)?;
            checked(py, &answered.answer, &answered.version)
        })
    }

    /// Can a body move along configurations, so many of them a motion? The bits, the shares of first hits, and
    /// clearances.
    #[expect(
        clippy::too_many_arguments,
        clippy::type_complexity,
        reason = "they are those of a function of Python"
    )]
    fn check_motions<'py>(
        &self,
        py: Python<'py>,
        body: &NativeBody,
        configurations: Floats<'py>,
        lengths: Counts<'py>,
        step_m: Option<f32>,
        clearance_max_m: Option<f32>,
        ignored: Regions,
        unknown_is_occupied: bool,
        level: u32,
        ignore_keep_outs: bool,
    ) -> PyResult<(Bools<'py>, usize, Bound<'py, PyArray1<f32>>, Option<Bound<'py, PyArray1<f32>>>, Version)>
    {
        guarded(|| {
            let check = MotionCheck {
                asked: asked(level, ignore_keep_outs),
                body: Arc::clone(&body.body),
                configurations: numbers_of(&configurations),
                lengths: lengths.as_array().to_vec(),
                step_m,
                clearance_max_m,
                surroundings: surroundings(&ignored, unknown_is_occupied)?,
            };
            let answered = self.source.get()?.ask(py, check)?;
            let motions = &answered.answer;
            let free: Vec<bool> = motions.iter().map(|motion| motion.is_free()).collect();
            let count = free.iter().filter(|free| **free).count();
            let hits = motions.iter().map(|motion| motion.first_hit.unwrap_or(f32::NAN)).collect();
            let clearance = |_| {
                PyArray1::from_vec(
                    py,
                    motions.iter().map(|motion| motion.clearance_m.unwrap_or(f32::NAN)).collect(),
                )
            };
            let clearances_m = clearance_max_m.map(clearance);
            Ok((
                PyArray1::from_vec(py, free),
                count,
                PyArray1::from_vec(py, hits),
                clearances_m,
                told(&answered.version),
            ))
        })
    }

    /// Is one motion free? For the innermost loop of a planner: no array is made, and nothing is checked that the
    /// question does not check itself.
    #[pyo3(
        signature = (body, configurations, *, level = None, unknown_is_occupied = None, ignore_keep_outs = None),
        text_signature = "(body, configurations, *, level=0, unknown_is_occupied=False, ignore_keep_outs=False)"
    )]
    fn motion_is_free(
        &self,
        py: Python<'_>,
        body: &Bound<'_, PyAny>,
        configurations: &Bound<'_, PyAny>,
        level: Option<&Bound<'_, PyAny>>,
        unknown_is_occupied: Option<&Bound<'_, PyAny>>,
        ignore_keep_outs: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<bool> {
        guarded(|| {
            let body = body.cast::<NativeBody>().map_err(|_| argument("body", body, "a PreparedBody"))?.get();
            let level = level.map_or(Ok(0), level_of)?;
            let unknown_is_occupied = flag_of("unknown_is_occupied", unknown_is_occupied)?;
            let ignore_keep_outs = flag_of("ignore_keep_outs", ignore_keep_outs)?;
            let numbers = numbers_of(&floats_of("configurations", configurations)?);
            let each = body.numbers();
            if !numbers.len().is_multiple_of(each) || numbers.len() < 2 * each {
                let message = format!(
                    "configurations must be two or more of {each} numbers each, x y z qx qy qz qw of every link, got {} numbers",
                    numbers.len()
                );
                return Err(Failure::argument(message).into());
            }
            let check = MotionCheck {
                asked: asked(level, ignore_keep_outs),
                body: Arc::clone(&body.body),
                lengths: vec![(numbers.len() / each) as u32],
                configurations: numbers,
                step_m: None,
                clearance_max_m: None,
                surroundings: surroundings(&Regions::new(), unknown_is_occupied)?,
            };
            let answered = self.source.get()?.ask(py, check)?;
            Ok(answered.answer.iter().all(|motion| motion.is_free()))
        })
    }

    /// What do rays meet first? From origins (one, or one each) along directions up to a range, or to ends.
    #[expect(
        clippy::too_many_arguments,
        clippy::type_complexity,
        reason = "they are those of a function of Python"
    )]
    fn cast_rays<'py>(
        &self,
        py: Python<'py>,
        origins: Rows<'py>,
        toward: Rows<'py>,
        are_ends: bool,
        range_m: Option<f64>,
        unknown_is_occupied: bool,
        level: u32,
        ignore_keep_outs: bool,
    ) -> PyResult<(Bools<'py>, usize, Bound<'py, PyArray1<f32>>, Indices<'py>, Names, Version)> {
        guarded(|| {
            let points = points_of(&toward);
            let question = RayQuestion {
                asked: asked(level, ignore_keep_outs),
                origins: points_of(&origins),
                toward: match are_ends {
                    true => RaysToward::Ends(points),
                    false => RaysToward::Directions {
                        directions: points,
                        range_m: range_m.unwrap_or(f64::INFINITY),
                    },
                },
                unknown: unknown(unknown_is_occupied),
            };
            let answered = self.source.get()?.ask(py, question)?;
            let hits = answered.answer;
            let count = hits.distances_m.len();
            let hit = (of_words(py, &hits.hit, count), ones(&hits.hit));
            let voxels = indices(py, hits.voxels.iter().copied())?;
            let distances_m = PyArray1::from_vec(py, hits.distances_m);
            Ok((hit.0, hit.1, distances_m, voxels, names(&hits.keep_outs), told(&answered.version)))
        })
    }

    /// What is nearest to points, within a radius?
    #[expect(clippy::type_complexity, reason = "it is that of a function of Python")]
    fn nearest<'py>(
        &self,
        py: Python<'py>,
        points: Rows<'py>,
        radius_m: f64,
        to_centers: bool,
        level: u32,
        ignore_keep_outs: bool,
    ) -> PyResult<(
        Bools<'py>,
        Bound<'py, PyArray1<f32>>,
        Indices<'py>,
        Bound<'py, PyArray2<f32>>,
        Names,
        Version,
    )> {
        guarded(|| {
            let question = NearestQuestion {
                asked: asked(level, ignore_keep_outs),
                points: points_of(&points),
                radius_m,
                to: if to_centers { MeasuredTo::Centers } else { MeasuredTo::Cubes },
            };
            let answered = self.source.get()?.ask(py, question)?;
            let nearest = answered.answer;
            let count = nearest.distances_m.len();
            let voxels = indices(py, nearest.voxels.iter().copied())?;
            let away =
                PyArray1::from_vec(py, nearest.away.into_iter().flatten().collect()).reshape([count, 3])?;
            let distances_m = PyArray1::from_vec(py, nearest.distances_m);
            let found = of_words(py, &nearest.found, count);
            Ok((found, distances_m, voxels, away, names(&nearest.keep_outs), told(&answered.version)))
        })
    }

    /// Are points occupied, free, or unknown? The bits of the first two.
    fn classify<'py>(
        &self,
        py: Python<'py>,
        points: Rows<'py>,
        level: u32,
        ignore_keep_outs: bool,
    ) -> PyResult<(Bools<'py>, Bools<'py>, Version)> {
        guarded(|| {
            let question =
                ClassifyQuestion { asked: asked(level, ignore_keep_outs), points: points_of(&points) };
            let answered = self.source.get()?.ask(py, question)?;
            let states = answered.answer;
            let bits = |words: &[u64]| of_words(py, words, states.points);
            Ok((bits(&states.occupied), bits(&states.free), told(&answered.version)))
        })
    }
}
