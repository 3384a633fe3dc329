//! Arrays of arguments, whose elements can be read where they lie.
//!
//! numpy's arrays begin at any byte and step by any number of bytes: a view into a message behind its header, a field
//! of packed records. References of Rust cannot, and the crate `numpy` divides steps by the size of an element: it
//! would read other bytes.

use std::ops::Deref;

use mrol_client::geometry::Point;
use mrol_client::service::PointCloud;
use numpy::ndarray::{Dimension, Ix1, Ix2, IxDyn};
use numpy::{
    Element, PyArray, PyArrayDyn, PyArrayMethods, PyReadonlyArray, PyUntypedArray, PyUntypedArrayMethods,
};
use pyo3::prelude::*;
use pyo3::types::IntoPyDict;

use crate::failure::{Failure, argument};

/// An array whose elements are aligned, and whole elements apart: the one that was given, or a copy of it.
pub(crate) struct Readable<'py, T: Element, D: Dimension>(PyReadonlyArray<'py, T, D>);

/// Floats of shape (n, columns).
pub(crate) type Rows<'py> = Readable<'py, f32, Ix2>;
/// Floats of any shape.
pub(crate) type Floats<'py> = Readable<'py, f32, IxDyn>;
/// Floats of shape (n,).
pub(crate) type Times<'py> = Readable<'py, f32, Ix1>;
/// Counts of shape (n,).
pub(crate) type Counts<'py> = Readable<'py, u32, Ix1>;

/// Whether an array begins where its elements may begin.
fn is_aligned<T: Element, D: Dimension>(array: &Bound<'_, PyArray<T, D>>) -> bool {
    array.data().is_aligned()
}

fn is_readable<T: Element, D: Dimension>(array: &Bound<'_, PyArray<T, D>>) -> bool {
    // Steps along an axis of one element, or of none, mean nothing, and a contiguous array may have any there.
    let is_whole = |step: &isize| step.unsigned_abs().is_multiple_of(size_of::<T>());
    is_aligned(array) && (array.is_c_contiguous() || array.strides().iter().all(is_whole))
}

/// A copy in memory of its own, not of a class whose methods are its own.
fn copied<'py, T: Element, D: Dimension>(
    array: &Bound<'py, PyArray<T, D>>,
) -> PyResult<Bound<'py, PyArray<T, D>>> {
    let py = array.py();
    let as_asked = [("order", "C")].into_py_dict(py)?;
    Ok(py.import("numpy")?.call_method("array", (array,), Some(&as_asked))?.cast_into::<PyArray<T, D>>()?)
}

impl<'py, T: Element, D: Dimension + 'py> FromPyObject<'_, 'py> for Readable<'py, T, D> {
    type Error = PyErr;

    fn extract(object: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        let given = object.cast::<PyArray<T, D>>()?;
        let array = if is_readable(&given) { given.to_owned() } else { copied(&given)? };
        if !is_readable(&array) {
            return Err(Failure::defect("numpy.array made a copy that is not aligned").into());
        }
        Ok(Self(array.try_readonly()?))
    }
}

impl<'py, T: Element, D: Dimension> Deref for Readable<'py, T, D> {
    type Target = PyReadonlyArray<'py, T, D>;

    fn deref(&self) -> &Self::Target {
        &self.0
    }
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

/// The numbers of an array, row by row, copied.
pub(crate) fn numbers_of(rows: &Floats<'_>) -> Vec<f32> {
    // A slice there is of an array whose columns lie together, too.
    match rows.as_slice().ok().filter(|_| rows.is_c_contiguous()) {
        Some(numbers) => numbers.to_vec(),
        None => rows.as_array().iter().copied().collect(),
    }
}

/// The array that an argument is which is not copied. One with masked values is none: what its masks hide are numbers
/// here.
pub(crate) fn floats_of<'py>(name: &str, value: &Bound<'py, PyAny>) -> PyResult<Floats<'py>> {
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
