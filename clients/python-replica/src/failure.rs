//! Failures, as exceptions of the package `mrol`, which makes them.

use std::panic::{AssertUnwindSafe, catch_unwind};

use mrol_client::service::ServiceError;
use mrol_client::{ClientError, ReplicaError};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;

/// The functions of the package that make exceptions.
struct Exceptions {
    /// Of a failure: its kind, its code, its reason and its message.
    failure: Py<PyAny>,
    /// Of an argument that is none: its name, what was given, and what belongs there.
    argument: Py<PyAny>,
}

static EXCEPTIONS: PyOnceLock<Exceptions> = PyOnceLock::new();

/// Takes the functions that make exceptions; those that were given first stay.
#[pyfunction]
pub(crate) fn set_exceptions(py: Python<'_>, failure: Py<PyAny>, argument: Py<PyAny>) {
    let _ = EXCEPTIONS.set(py, Exceptions { failure, argument });
}

/// The exception that a function of the package makes.
fn made<'py>(py: Python<'py>, make: impl FnOnce(&'py Exceptions) -> PyResult<Py<PyAny>>) -> PyErr {
    let Some(exceptions) = EXCEPTIONS.get(py) else {
        return PyRuntimeError::new_err("mrol_native is a part of mrol: import mrol.replica");
    };
    make(exceptions).map_or_else(|error| error, |exception| PyErr::from_value(exception.into_bound(py)))
}

/// Why a call fails. `kind` is a word of `failures.py` of the package.
#[derive(Debug)]
pub(crate) struct Failure {
    kind: &'static str,
    code: String,
    reason: String,
    message: String,
}

impl Failure {
    fn new(kind: &'static str, message: impl Into<String>) -> Self {
        Self { kind, code: String::new(), reason: String::new(), message: message.into() }
    }

    /// An argument is wrong: the message names it, its value and its limit.
    pub(crate) fn argument(message: impl Into<String>) -> Self {
        Self::new("argument", message)
    }

    /// The replica or the map was closed.
    pub(crate) fn closed() -> Self {
        Self::new("closed", "it is closed")
    }

    /// It belongs to the process that forked this one.
    pub(crate) fn forked() -> Self {
        Self::new(
            "forked",
            "it belongs to the process that forked this one: open one of its own in each process",
        )
    }

    /// A time was up.
    pub(crate) fn timed_out(message: impl Into<String>) -> Self {
        Self::new("timed_out", message)
    }

    /// What cannot be.
    pub(crate) fn defect(message: impl Into<String>) -> Self {
        Self::new("internal", message)
    }

    /// The system does not give what is needed.
    pub(crate) fn no_threads(error: &std::io::Error) -> Self {
        Self::new("internal", format!("no thread can be started: {error}"))
    }
}

/// What `work` comes to. A panic of it is a failure: PyO3 would raise what `except Exception` does not catch.
pub(crate) fn guarded<T>(work: impl FnOnce() -> PyResult<T>) -> PyResult<T> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|panic| {
        // What it carries may panic in turn when it is dropped.
        std::mem::forget(panic);
        Err(Failure::defect("a defect of mrol-replica: it panicked").into())
    })
}

/// An argument is none: `mrol.ArgumentError`, with its name, what was given, and what belongs there.
pub(crate) fn argument(name: &str, value: &Bound<'_, PyAny>, expected: &str) -> PyErr {
    made(value.py(), |exceptions| exceptions.argument.call1(value.py(), (name, value, expected)))
}

impl From<ServiceError> for Failure {
    fn from(error: ServiceError) -> Self {
        let code = error.code().as_str().to_owned();
        Self { kind: "refused", code, reason: error.reason.as_str().to_owned(), message: error.message }
    }
}

impl From<ClientError> for Failure {
    fn from(error: ClientError) -> Self {
        let message = match &error {
            // The address is not told: where it is none, it may be a key.
            ClientError::Url { problem, .. } => format!("address is no server address: {problem}"),
            error => error.to_string(),
        };
        match error {
            ClientError::Url { .. } | ClientError::Credentials(_) => Self::argument(message),
            ClientError::Unreachable { .. } | ClientError::Untrusted { .. } => {
                Self::new("unreachable", message)
            }
            ClientError::Lost { .. } => Self::new("lost", message),
            ClientError::Foreign { .. } | ClientError::Answer(_) => Self::new("damaged", message),
            ClientError::Refused { code, reason, message, .. } => {
                // gRPC's name of the code in words: "PermissionDenied" is permission_denied.
                let word = format!("{code:?}").chars().fold(String::new(), |mut word, letter| {
                    if letter.is_uppercase() && !word.is_empty() {
                        word.push('_');
                    }
                    word.extend(letter.to_lowercase());
                    word
                });
                Self { kind: "refused", code: word, reason: reason.unwrap_or_default(), message }
            }
        }
    }
}

impl From<ReplicaError> for Failure {
    fn from(error: ReplicaError) -> Self {
        let message = error.to_string();
        match error {
            ReplicaError::Client(error) => error.into(),
            ReplicaError::Question(error) => error.into(),
            ReplicaError::Damaged(_) | ReplicaError::Diverged { .. } => Self::new("damaged", message),
            ReplicaError::Silent(_) => Self::timed_out(message),
            ReplicaError::TooLarge(_) | ReplicaError::TooManyViewpoints(_) => Self::new("too_large", message),
        }
    }
}

impl From<Failure> for PyErr {
    fn from(failure: Failure) -> Self {
        let Failure { kind, code, reason, message } = failure;
        Python::attach(|py| {
            made(py, |exceptions| exceptions.failure.call1(py, (kind, code, reason, message)))
        })
    }
}
