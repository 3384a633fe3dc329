//! Arrays of arguments, whose elements can be read where they lie.
//!
//! numpy's arrays begin at any byte and step by any number of bytes: a view into a message behind its header, a field
//! of packed records. References of Rust cannot, and the crate `numpy` divides steps by the size of an element: it
//! would read other bytes.

use std::ops::Deref;

use numpy::ndarray::{Dimension, Ix1, Ix2, IxDyn};
use numpy::{Element, PyArray, PyArrayMethods, PyReadonlyArray, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::IntoPyDict;

use crate::failure::Failure;

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
pub(crate) fn is_aligned<T: Element, D: Dimension>(array: &Bound<'_, PyArray<T, D>>) -> bool {
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
