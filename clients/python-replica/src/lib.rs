//! The extension module `mrol_native`: what `mrol.replica`, of the package `mrol`, asks of Rust.
//!
//! ```text
//! lib.rs        the module and its classes
//! replica.rs    a copy of a server's map
//! local_map.rs  a map without a server
//! source.rs     whichever of the two is asked
//! questions.rs  the questions, from arrays to arrays
//! scope.rs      the options that all questions have
//! region.rs     regions and poses
//! arrays.rs     arrays of arguments
//! answers.rs    arrays of answers
//! body.rs       bodies
//! failure.rs    failures, as exceptions of the package `mrol`
//! waiting.rs    the threads, and waits that Ctrl-C ends
//! ```
//!
//! Arrays come checked from the package: of their type, of the right number of columns. They are copied before the
//! interpreter's lock is released, so that no thread of Python changes what is being read. No panic leaves a method.

mod answers;
mod arrays;
mod body;
mod failure;
mod local_map;
mod questions;
mod region;
mod replica;
mod scope;
mod source;
mod waiting;

/// What `mrol.replica` asks of Rust.
#[pyo3::pymodule]
mod mrol_native {
    use pyo3::prelude::*;

    #[pymodule_export]
    use crate::body::NativeBody;
    #[pymodule_export]
    use crate::failure::set_exceptions;
    #[pymodule_export]
    use crate::local_map::NativeLocalMap;
    #[pymodule_export]
    use crate::questions::NativeMap;
    #[pymodule_export]
    use crate::replica::NativeReplica;

    /// The version, which has to be that of the package.
    #[pymodule_init]
    fn add_version(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
