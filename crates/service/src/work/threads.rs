//! Threads of the system that take jobs in the order in which they come.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;

use parking_lot::Mutex;

use crate::error::{Reason, ServiceError};

type Job = Box<dyn FnOnce() + Send>;

/// Threads of one name, which end when this is dropped and their jobs are done.
#[derive(Debug)]
pub(super) struct Threads {
    name: &'static str,
    jobs: Sender<Job>,
    /// Whoever holds it takes the next job.
    taken: Arc<Mutex<Receiver<Job>>>,
    started: Mutex<usize>,
}

impl Threads {
    /// `count` threads.
    ///
    /// # Errors
    /// When the system refuses.
    pub(super) fn start(name: &'static str, count: usize) -> Result<Self, ServiceError> {
        let (jobs, taken) = channel();
        let threads = Self { name, jobs, taken: Arc::new(Mutex::new(taken)), started: Mutex::new(0) };
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
            let taken = Arc::clone(&self.taken);
            let thread = thread::Builder::new().name(format!("mrol-{}-{started}", self.name));
            thread.spawn(move || {
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
