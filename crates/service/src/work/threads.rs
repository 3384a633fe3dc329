//! Threads of the system that take jobs in the order in which they come.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;

use parking_lot::Mutex;

use crate::error::{Reason, ServiceError};

type Job = Box<dyn FnOnce() + Send>;

/// Threads of one name and one priority, which end when this is dropped and their jobs are done.
#[derive(Debug)]
pub(super) struct Threads {
    name: &'static str,
    niceness: i32,
    jobs: Sender<Job>,
    /// Whoever holds it takes the next job.
    taken: Arc<Mutex<Receiver<Job>>>,
    started: Mutex<usize>,
}

impl Threads {
    /// `count` threads that are `niceness` nicer than the process: 0 for as it is.
    ///
    /// # Errors
    /// When the system refuses.
    pub(super) fn start(name: &'static str, count: usize, niceness: i32) -> Result<Self, ServiceError> {
        let (jobs, taken) = channel();
        let threads =
            Self { name, niceness, jobs, taken: Arc::new(Mutex::new(taken)), started: Mutex::new(0) };
        threads.have(count).map_err(|error| ServiceError::new(Reason::NoThreads, error.to_string()))?;
        Ok(threads)
    }

    /// Starts threads until there are so many.
    ///
    /// # Errors
    /// When the system refuses.
    pub(super) fn have(&self, count: usize) -> std::io::Result<()> {
        let mut started = self.started.lock();
        while *started < count {
            let (taken, niceness) = (Arc::clone(&self.taken), self.niceness);
            let thread = thread::Builder::new().name(format!("mrol-{}-{started}", self.name));
            thread.spawn(move || {
                give_way(niceness);
                loop {
                    let job = taken.lock().recv();
                    let Ok(job) = job else { break };
                    job();
                }
            })?;
            *started += 1;
        }
        Ok(())
    }

    /// Hands a job, which does not panic, to a thread that has none.
    pub(super) fn run(&self, job: impl FnOnce() + Send + 'static) {
        // The receiver lives as long as this.
        let _ = self.jobs.send(Box::new(job));
    }
}

/// The lowest priority that there is.
#[cfg(target_os = "linux")]
const NICEST: i32 = 19;

/// Lowers the priority of this thread. Where the system does not let it, it is as the others are.
#[cfg(target_os = "linux")]
fn give_way(niceness: i32) {
    use rustix::process::{getpriority_process, setpriority_process};

    if niceness == 0 {
        return;
    }
    // On Linux a thread has a priority of its own.
    let lowered =
        getpriority_process(None).and_then(|nice| setpriority_process(None, (nice + niceness).min(NICEST)));
    if let Err(error) = lowered {
        tracing::debug!(%error, "the priority of a thread cannot be lowered");
    }
}

/// Elsewhere it would be the priority of the whole server.
#[cfg(not(target_os = "linux"))]
fn give_way(_: i32) {}
