//! The threads of this process' replicas and maps, and waits that Ctrl-C ends.

use std::future::Future;
use std::pin::pin;
use std::process;
use std::sync::OnceLock;
use std::time::Duration;

use pyo3::prelude::*;
use tokio::runtime::{Builder, Runtime};

use crate::failure::Failure;

/// Threads that apply changes, at most.
const APPLYING_THREADS: usize = 2;

/// How long Ctrl-C waits, at most.
const LOOK_FOR_SIGNALS: Duration = Duration::from_millis(50);

/// The threads, and the process that they are in.
static THREADS: OnceLock<(u32, Runtime)> = OnceLock::new();

/// The threads: they begin with the first replica or map and stay.
pub(crate) fn threads() -> Result<&'static Runtime, Failure> {
    if let Some((owner, runtime)) = THREADS.get() {
        // Threads do not come along into a child.
        return if *owner == process::id() { Ok(runtime) } else { Err(Failure::forked()) };
    }
    let started = Builder::new_multi_thread()
        .worker_threads(1)
        .max_blocking_threads(APPLYING_THREADS)
        .thread_name("mrol-replica")
        .enable_all()
        .build()
        .map_err(|error| Failure::no_threads(&error))?;
    Ok(&THREADS.get_or_init(|| (process::id(), started)).1)
}

/// What `work` comes to, while other threads of Python go on. Ctrl-C ends the wait, and drops the work.
pub(crate) fn wait_for<T, E>(py: Python<'_>, work: impl Future<Output = Result<T, E>> + Send) -> PyResult<T>
where
    T: Send,
    E: Into<Failure> + Send,
{
    let runtime = threads()?;
    let mut work = pin!(work);
    loop {
        let look = async { tokio::time::timeout(LOOK_FOR_SIGNALS, &mut work).await };
        match py.detach(|| runtime.block_on(look)) {
            Ok(done) => return done.map_err(|error| error.into().into()),
            Err(_) => py.check_signals()?,
        }
    }
}
