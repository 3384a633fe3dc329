//! The questions, from arrays to arrays: each has the name, the fields and the answer that it has over HTTP.

use std::sync::Arc;

use mrol_client::map::Lookup;
use mrol_client::planning::{BandFrom, GridArea, MeasuredTo, Surroundings, Unknown};
use mrol_client::service::{
    CheckAs, ClassifyQuestion, FrontierQuestion, GridQuestion, GridScope, MotionCheck, NearestQuestion,
    PointQuery, PoseCheck, RayQuestion, RaysToward, Reason, ServiceError, SphereCheck,
};
use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::answers::{
    Bools, FrontierFields, Version, answer, checked, indices, names, of_bytes, of_words, ones, told,
};
use crate::arrays::{Counts, Floats, Rows, floats_of, numbers_of, points_of};
use crate::body::{NativeBody, spheres_of};
use crate::failure::{Failure, argument, guarded};
use crate::region::{Corners, Seven, Shape, pose_of, surroundings, unknown_of};
use crate::scope::{Scope, flag_of};
use crate::source::OpenSource;

/// A map of this process, which is asked.
#[pyclass(frozen, subclass, module = "mrol_native")]
pub(crate) struct NativeMap {
    pub(crate) source: OpenSource,
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

#[pymethods]
impl NativeMap {
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
        lookup: &str,
        keep_out: bool,
        scope: Option<Scope>,
    ) -> PyResult<(Version, Bools<'py>, usize)> {
        guarded(|| {
            let asked = Scope::asked(scope);
            let query = PointQuery {
                points: points_of(&points),
                map_from_points: map_from_points.map(pose_of).transpose()?,
                level: asked.level,
                lookup: if lookup == "bloom" { Lookup::Bloom } else { Lookup::Exact },
                min_revision: asked.min_revision,
                map_uuid: asked.map_uuid,
                keep_out,
            };
            let answer = self.source.get()?.query_points(py, query)?;
            Ok((told(&answer.version), of_bytes(py, &answer.occupied, answer.points), answer.points_occupied))
        })
    }

    /// Does a body fit at configurations, an array of shape (n, 7 * links)?
    #[pyo3(signature = (scope, *, body, configurations, answer, clearance_max_m, ignored, unknown))]
    #[expect(clippy::too_many_arguments, reason = "they are the fields of the question")]
    fn poses<'py>(
        &self,
        py: Python<'py>,
        scope: Option<Scope>,
        body: &NativeBody,
        configurations: Floats<'py>,
        answer: &str,
        clearance_max_m: Option<f32>,
        ignored: Option<Vec<Shape>>,
        unknown: &str,
    ) -> PyResult<Bound<'py, PyDict>> {
        guarded(|| {
            let check = PoseCheck {
                asked: Scope::asked(scope),
                body: Arc::clone(&body.body),
                configurations: numbers_of(&configurations),
                surroundings: surroundings(ignored.as_deref(), unknown)?,
                answer: check_as(answer, clearance_max_m)?,
            };
            let answered = self.source.get()?.ask(py, check)?;
            checked(py, &answered.answer, &answered.version)
        })
    }

    /// Do spheres of shape (n, 4) meet anything, in groups of so many, or each by itself?
    #[pyo3(signature = (scope, *, spheres, sizes, padding_m, answer, clearance_max_m, ignored, unknown))]
    #[expect(clippy::too_many_arguments, reason = "they are the fields of the question")]
    fn spheres<'py>(
        &self,
        py: Python<'py>,
        scope: Option<Scope>,
        spheres: Rows<'py>,
        sizes: Option<Counts<'py>>,
        padding_m: f32,
        answer: &str,
        clearance_max_m: Option<f32>,
        ignored: Option<Vec<Shape>>,
        unknown: &str,
    ) -> PyResult<Bound<'py, PyDict>> {
        guarded(|| {
            let spheres = spheres_of(&spheres);
            let check = SphereCheck {
                asked: Scope::asked(scope),
                sizes: sizes.map_or_else(|| vec![1; spheres.len()], |sizes| sizes.as_array().to_vec()),
                spheres,
                padding_m,
                surroundings: surroundings(ignored.as_deref(), unknown)?,
                answer: check_as(answer, clearance_max_m)?,
            };
            let answered = self.source.get()?.ask(py, check)?;
            checked(py, &answered.answer, &answered.version)
        })
    }

    /// Can a body move along configurations, so many of them a motion?
    #[pyo3(signature = (scope, *, body, configurations, lengths, step_m, clearance_max_m, ignored, unknown))]
    #[expect(clippy::too_many_arguments, reason = "they are the fields of the question")]
    fn motions<'py>(
        &self,
        py: Python<'py>,
        scope: Option<Scope>,
        body: &NativeBody,
        configurations: Floats<'py>,
        lengths: Counts<'py>,
        step_m: Option<f32>,
        clearance_max_m: Option<f32>,
        ignored: Option<Vec<Shape>>,
        unknown: &str,
    ) -> PyResult<Bound<'py, PyDict>> {
        guarded(|| {
            let check = MotionCheck {
                asked: Scope::asked(scope),
                body: Arc::clone(&body.body),
                configurations: numbers_of(&configurations),
                lengths: lengths.as_array().to_vec(),
                step_m,
                clearance_max_m,
                surroundings: surroundings(ignored.as_deref(), unknown)?,
            };
            let answered = self.source.get()?.ask(py, check)?;
            let motions = &answered.answer;
            let free: Vec<bool> = motions.iter().map(|motion| motion.is_free()).collect();
            let floats = |of: Vec<Option<f32>>| {
                PyArray1::from_vec(py, of.into_iter().map(|float| float.unwrap_or(f32::NAN)).collect())
            };
            let clearances_m =
                clearance_max_m.map(|_| floats(motions.iter().map(|motion| motion.clearance_m).collect()));
            answer!(
                py,
                &answered.version,
                motions = motions.len(),
                free_count = free.iter().filter(|free| **free).count(),
                free = PyArray1::from_vec(py, free),
                first_hits = floats(motions.iter().map(|motion| motion.first_hit).collect()),
                clearances_m = clearances_m,
            )
        })
    }

    /// Is one motion free? For the innermost loop of a planner: no array is made, and nothing is checked that the
    /// question does not check itself. Options are a dictionary, since a call that takes any keywords is slower.
    #[pyo3(
        signature = (body, configurations, *, unknown_is_occupied = None, scope = None),
        text_signature = "($self, body, configurations, *, unknown_is_occupied=False, scope=None)"
    )]
    fn motion_is_free(
        &self,
        py: Python<'_>,
        body: &Bound<'_, PyAny>,
        configurations: &Bound<'_, PyAny>,
        unknown_is_occupied: Option<&Bound<'_, PyAny>>,
        scope: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<bool> {
        guarded(|| {
            let body = body.cast::<NativeBody>().map_err(|_| argument("body", body, "a PreparedBody"))?.get();
            let asked = Scope::asked(scope.map(|scope| scope.extract()).transpose()?);
            let is_occupied = unknown_is_occupied.map(|value| flag_of("unknown_is_occupied", value));
            let unknown = match is_occupied.transpose()? {
                Some(true) => Unknown::Occupied,
                _ => Unknown::Free,
            };
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
                asked,
                body: Arc::clone(&body.body),
                lengths: vec![(numbers.len() / each) as u32],
                configurations: numbers,
                step_m: None,
                clearance_max_m: None,
                surroundings: Surroundings { ignored: Vec::new(), unknown },
            };
            let answered = self.source.get()?.ask(py, check)?;
            Ok(answered.answer.iter().all(|motion| motion.is_free()))
        })
    }

    /// What do rays meet first? From origins (one, or one each) along directions up to a range, or to ends.
    #[pyo3(signature = (scope, *, origins, directions = None, ends = None, range_m, unknown))]
    #[expect(clippy::too_many_arguments, reason = "they are the fields of the question")]
    fn rays<'py>(
        &self,
        py: Python<'py>,
        scope: Option<Scope>,
        origins: Rows<'py>,
        directions: Option<Rows<'py>>,
        ends: Option<Rows<'py>>,
        range_m: Option<f64>,
        unknown: &str,
    ) -> PyResult<Bound<'py, PyDict>> {
        guarded(|| {
            let toward = match (&directions, &ends) {
                (Some(directions), None) => RaysToward::Directions {
                    directions: points_of(directions),
                    range_m: range_m.unwrap_or(f64::INFINITY),
                },
                (None, Some(ends)) => RaysToward::Ends(points_of(ends)),
                _ => return Err(Failure::argument("one of directions and ends, not both").into()),
            };
            let question = RayQuestion {
                asked: Scope::asked(scope),
                origins: points_of(&origins),
                toward,
                unknown: unknown_of(unknown),
            };
            let answered = self.source.get()?.ask(py, question)?;
            let hits = answered.answer;
            let count = hits.distances_m.len();
            answer!(
                py,
                &answered.version,
                rays = count,
                hits = ones(&hits.hit),
                hit = of_words(py, &hits.hit, count),
                voxels = indices(py, hits.voxels.iter().copied())?,
                distances_m = PyArray1::from_vec(py, hits.distances_m),
                keep_outs = names(&hits.keep_outs),
            )
        })
    }

    /// What is nearest to points, within a radius?
    #[pyo3(signature = (scope, *, points, radius_m, to))]
    fn nearest<'py>(
        &self,
        py: Python<'py>,
        scope: Option<Scope>,
        points: Rows<'py>,
        radius_m: f64,
        to: &str,
    ) -> PyResult<Bound<'py, PyDict>> {
        guarded(|| {
            let question = NearestQuestion {
                asked: Scope::asked(scope),
                points: points_of(&points),
                radius_m,
                to: if to == "centers" { MeasuredTo::Centers } else { MeasuredTo::Cubes },
            };
            let answered = self.source.get()?.ask(py, question)?;
            let nearest = answered.answer;
            let count = nearest.distances_m.len();
            let away = PyArray1::from_vec(py, nearest.away.into_iter().flatten().collect());
            answer!(
                py,
                &answered.version,
                points = count,
                found = of_words(py, &nearest.found, count),
                voxels = indices(py, nearest.voxels.iter().copied())?,
                away = away.reshape([count, 3])?,
                distances_m = PyArray1::from_vec(py, nearest.distances_m),
                keep_outs = names(&nearest.keep_outs),
            )
        })
    }

    /// Are points occupied, free, or unknown?
    #[pyo3(signature = (scope, *, points))]
    fn classification<'py>(
        &self,
        py: Python<'py>,
        scope: Option<Scope>,
        points: Rows<'py>,
    ) -> PyResult<Bound<'py, PyDict>> {
        guarded(|| {
            let question = ClassifyQuestion { asked: Scope::asked(scope), points: points_of(&points) };
            let answered = self.source.get()?.ask(py, question)?;
            let states = answered.answer;
            answer!(
                py,
                &answered.version,
                points = states.points,
                occupied = of_words(py, &states.occupied, states.points),
                free = of_words(py, &states.free, states.points),
            )
        })
    }

    /// Which frontiers has a box?
    #[pyo3(signature = (scope, *, r#box, size_min, frontiers_max, standoff_m))]
    fn frontiers<'py>(
        &self,
        py: Python<'py>,
        scope: Option<Scope>,
        r#box: Corners<3>,
        size_min: Option<u64>,
        frontiers_max: Option<usize>,
        standoff_m: Option<f64>,
    ) -> PyResult<Bound<'py, PyDict>> {
        guarded(|| {
            let question = FrontierQuestion {
                asked: Scope::asked(scope),
                min_m: r#box.min_m,
                max_m: r#box.max_m,
                size_min,
                frontiers_max,
                standoff_m,
            };
            let answered = self.source.get()?.ask(py, question)?;
            let found = answered.answer;
            answer!(
                py,
                &answered.version,
                frontiers = found.frontiers.iter().map(FrontierFields::of).collect::<Vec<_>>(),
                frontiers_total = found.frontiers_total,
                voxels_total = found.voxels_total,
            )
        })
    }

    /// What does the map look like from above?
    #[pyo3(signature = (scope, *, area, min_z_m, max_z_m, band_from, cell_m, tell_unknown))]
    #[expect(clippy::too_many_arguments, reason = "they are the fields of the question")]
    fn grid<'py>(
        &self,
        py: Python<'py>,
        scope: Option<Scope>,
        area: Option<Corners<2>>,
        min_z_m: Option<f64>,
        max_z_m: Option<f64>,
        band_from: &str,
        cell_m: Option<f64>,
        tell_unknown: bool,
    ) -> PyResult<Bound<'py, PyDict>> {
        guarded(|| {
            let area = area
                .map_or(GridArea::Occupied, |Corners { min_m, max_m }| GridArea::Rectangle { min_m, max_m });
            let band_m = [min_z_m.unwrap_or(f64::NEG_INFINITY), max_z_m.unwrap_or(f64::INFINITY)];
            let band_from = if band_from == "map" { BandFrom::Map } else { BandFrom::Floor };
            let question = GridQuestion {
                asked: Scope::asked(scope),
                scope: GridScope { area, band_m, band_from, cell_m, tells_unknown: tell_unknown },
            };
            let answered = self.source.get()?.ask(py, question)?;
            let grid = answered.answer;
            let cells = grid.tops_m.len();
            answer!(
                py,
                &answered.version,
                cell_m = grid.cell_m,
                origin_m = grid.origin_m,
                size = grid.size,
                occupied = of_words(py, &grid.occupied, cells),
                free = grid.free.map(|free| of_words(py, &free, cells)),
                tops_m = PyArray1::from_vec(py, grid.tops_m),
                floor_m = grid.floor_m,
            )
        })
    }
}
