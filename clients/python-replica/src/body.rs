//! Bodies.

use std::sync::Arc;

use mrol_client::planning::{Body, Link, NUMBERS_PER_POSE, Sphere};
use pyo3::prelude::*;

use crate::arrays::Rows;
use crate::failure::{Failure, guarded};

/// A body that was made of its links: a question about it copies nothing of it.
#[pyclass(frozen, subclass, module = "mrol_replica._native")]
pub(crate) struct NativeBody {
    pub(crate) body: Arc<Body>,
}

impl NativeBody {
    /// Numbers of a configuration: a pose for each link.
    pub(crate) fn numbers(&self) -> usize {
        self.body.links().len() * NUMBERS_PER_POSE
    }
}

/// Spheres of arrays of x y z r.
pub(crate) fn spheres_of(numbers: &Rows<'_>) -> Vec<Sphere> {
    let numbers = numbers.as_array();
    let of_row = |row: numpy::ndarray::ArrayView1<'_, f32>| Sphere {
        center_m: [row[0], row[1], row[2]],
        radius_m: row[3],
    };
    numbers.rows().into_iter().map(of_row).collect()
}

#[pymethods]
impl NativeBody {
    /// A body of links: spheres x y z r of shape (n, 4), points of shape (m, 3), and a padding each.
    #[new]
    fn new(links: Vec<(Rows<'_>, Rows<'_>, f32)>) -> PyResult<Self> {
        guarded(|| {
            let links = links.into_iter().map(|(spheres, points, padding_m)| {
                let points = points.as_array();
                let points = points.rows().into_iter().map(|row| [row[0], row[1], row[2]].into()).collect();
                Link { spheres: spheres_of(&spheres), points, padding_m }
            });
            let body = Body::new(links.collect()).map_err(|error| Failure::argument(error.to_string()))?;
            Ok(Self { body: Arc::new(body) })
        })
    }

    /// How many links it has.
    #[getter]
    fn links(&self) -> usize {
        self.body.links().len()
    }
}
