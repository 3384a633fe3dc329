//! Bodies.

use std::sync::Arc;

use mrol_client::geometry::Point;
use mrol_client::planning::{Body, Link, NUMBERS_PER_POSE, Sphere};
use pyo3::prelude::*;

use crate::arrays::Rows;
use crate::failure::{Failure, guarded};

/// A body that was made of its links: a question about it copies nothing of it.
#[pyclass(frozen, subclass, module = "mrol_native")]
pub(crate) struct NativeBody {
    pub(crate) body: Arc<Body>,
}

impl NativeBody {
    /// Numbers of a configuration: a pose for each link.
    pub(crate) fn numbers(&self) -> usize {
        self.body.links().len() * NUMBERS_PER_POSE
    }
}

/// Points of an array of x y z.
fn points_of(numbers: &Rows<'_>) -> Vec<Point> {
    numbers.as_array().rows().into_iter().map(|row| [row[0], row[1], row[2]].into()).collect()
}

/// Spheres of an array of x y z r.
pub(crate) fn spheres_of(numbers: &Rows<'_>) -> Vec<Sphere> {
    let numbers = numbers.as_array();
    let of_row = |row: numpy::ndarray::ArrayView1<'_, f32>| Sphere {
        center_m: [row[0], row[1], row[2]],
        radius_m: row[3],
    };
    numbers.rows().into_iter().map(of_row).collect()
}

/// A link: spheres x y z r of shape (n, 4), points of shape (m, 3), and what is added to their radii.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct LinkFields<'py> {
    spheres: Option<Rows<'py>>,
    points: Option<Rows<'py>>,
    padding_m: f32,
}

#[pymethods]
impl NativeBody {
    /// A body of links.
    #[new]
    fn new(links: Vec<LinkFields<'_>>) -> PyResult<Self> {
        guarded(|| {
            let links = links.into_iter().map(|LinkFields { spheres, points, padding_m }| Link {
                spheres: spheres.as_ref().map(spheres_of).unwrap_or_default(),
                points: points.as_ref().map(points_of).unwrap_or_default(),
                padding_m,
            });
            let body = Body::new(links.collect()).map_err(|error| Failure::argument(error.to_string()))?;
            Ok(Self { body: Arc::new(body) })
        })
    }
}
