//! The options that all questions have in common.

use mrol_client::service::QuestionScope;
use mrol_client::wire::uuid_from;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::pybacked::PyBackedStr;
use pyo3::types::{PyBool, PyDict};

use crate::failure::{Failure, argument};

/// The options that were given, by the names that `QuestionScope` of the package `mrol` declares; `None` without any.
pub(crate) struct Scope(QuestionScope);

impl Scope {
    /// The options of a question: those that were given, and the defaults of the others.
    pub(crate) fn asked(scope: Option<Self>) -> QuestionScope {
        scope.map_or_else(QuestionScope::default, |scope| scope.0)
    }

    /// The options that a dictionary has.
    fn of(given: &Bound<'_, PyDict>) -> PyResult<Self> {
        let mut asked = QuestionScope::default();
        for (name, value) in given {
            let name: PyBackedStr = name.extract()?;
            match &*name {
                "level" => asked.level = whole_of(&name, &value, "a whole number of 0 to 4294967295")?,
                "ignore_keep_outs" => asked.ignore_keep_outs = flag_of(&name, &value)?,
                // None is to give nothing.
                "min_revision" | "map_uuid" if value.is_none() => {}
                "min_revision" => {
                    let revision = whole_of(&name, &value, "a whole number of 0 to 18446744073709551615")?;
                    asked.min_revision = Some(revision);
                }
                "map_uuid" => {
                    let text: PyBackedStr = value.extract().map_err(|_| argument(&name, &value, "a name"))?;
                    asked.map_uuid = Some(uuid_from(&text).map_err(Failure::from)?);
                }
                other => {
                    let message = format!("got an unexpected keyword argument '{other}'");
                    return Err(PyTypeError::new_err(message));
                }
            }
        }
        Ok(Self(asked))
    }
}

impl<'py> FromPyObject<'_, 'py> for Scope {
    type Error = PyErr;

    fn extract(object: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        let given = object.cast::<PyDict>().map_err(|_| argument("scope", &object, "a dict of options"))?;
        Self::of(&given)
    }
}

fn whole_of<'py, T: FromPyObjectOwned<'py>>(
    name: &str,
    value: &Bound<'py, PyAny>,
    expected: &str,
) -> PyResult<T> {
    let whole = value.extract::<T>().ok().filter(|_| !value.is_instance_of::<PyBool>());
    whole.ok_or_else(|| argument(name, value, expected))
}

/// True or False.
pub(crate) fn flag_of(name: &str, value: &Bound<'_, PyAny>) -> PyResult<bool> {
    value.extract().map_err(|_| argument(name, value, "True or False"))
}
