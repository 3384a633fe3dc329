//! The extension module `mrol_replica._native`: what `mrol_replica`, its package, asks of Rust.
//!
//! ```text
//! lib.rs        the module and its classes
//! replica.rs    a copy of a server's map
//! local_map.rs  a map without a server
//! source.rs     whichever of the two is asked
//! questions.rs  the questions, from arrays to arrays
//! arrays.rs     arrays of arguments
//! answers.rs    arrays of answers
//! body.rs       bodies
//! failure.rs    failures, as exceptions of the package `mrol`
//! waiting.rs    the threads, and waits that Ctrl-C ends
//! ```
//!
//! Arrays come checked from `mrol_replica`: of their type, of the right number of columns. They are copied before the
//! interpreter's lock is released, so that no thread of Python changes what is being read. No panic leaves a method.

mod answers;
mod arrays;
mod body;
mod failure;
mod local_map;
mod questions;
mod replica;
mod source;
mod waiting;

/// What `mrol_replica` asks of Rust.
#[pyo3::pymodule]
mod _native {
    #[pymodule_export]
    use crate::body::NativeBody;
    #[pymodule_export]
    use crate::local_map::NativeLocalMap;
    #[pymodule_export]
    use crate::questions::Questions;
    #[pymodule_export]
    use crate::replica::NativeReplica;
}
