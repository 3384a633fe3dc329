//! Bounded threads for work that uses the CPU, away from the async runtime.

use tokio::sync::{Semaphore, oneshot};

use super::{ErrorCode, ServiceError};

/// Queries of up to this many points are answered where they arrive: handing them over would take longer than
/// answering them.
pub(super) const INLINE_POINTS: usize = 2000;

/// A fixed number of threads and a bounded queue before them.
#[derive(Debug)]
pub(super) struct Pool {
    threads: rayon::ThreadPool,
    /// One permit for each job that runs or waits.
    places: std::sync::Arc<Semaphore>,
    jobs_waiting_max: usize,
}

impl Pool {
    /// `threads` threads (0 = one a core), with at most `jobs_waiting_max` jobs waiting for them.
    pub(super) fn new(
        name: &'static str,
        threads: usize,
        jobs_waiting_max: usize,
    ) -> Result<Self, ServiceError> {
        let threads = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .thread_name(move |i| format!("{name}-{i}"))
            .build()
            .map_err(|e| ServiceError::new(ErrorCode::Internal, "no_threads", e.to_string()))?;
        let places = threads.current_num_threads() + jobs_waiting_max;
        Ok(Self { threads, places: Semaphore::new(places).into(), jobs_waiting_max })
    }

    /// Runs `job` on a thread of the pool, first come first served; not at all where the caller does not wait for its
    /// turn.
    ///
    /// # Errors
    /// `ResourceExhausted` at once when the queue is full; `Internal` when the job panicked.
    pub(super) async fn run<T: Send + 'static>(
        &self,
        job: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, ServiceError> {
        let Ok(place) = self.places.clone().try_acquire_owned() else {
            let message =
                format!("jobs_waiting_max is {}: all places are taken, try again", self.jobs_waiting_max);
            return Err(ServiceError::overloaded(message));
        };
        let (answer, answered) = oneshot::channel();
        let span = tracing::Span::current();
        self.threads.spawn_fifo(move || {
            let _place = place;
            if answer.is_closed() {
                // Who asked has gone while this waited.
                return;
            }
            let job = std::panic::AssertUnwindSafe(|| span.in_scope(job));
            // A panic drops `answer`, which the caller is told; the pool's thread lives on.
            if let Ok(result) = std::panic::catch_unwind(job) {
                drop(answer.send(result));
            }
        });
        answered.await.map_err(|_| {
            ServiceError::new(ErrorCode::Internal, "job_panicked", "the job failed by a defect of the server")
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn a_full_queue_refuses_at_once_and_recovers() {
        let pool = std::sync::Arc::new(Pool::new("test", 1, 1).unwrap());
        let (release, released) = std::sync::mpsc::channel::<()>();
        let running = tokio::spawn({
            let pool = pool.clone();
            async move { pool.run(move || released.recv()).await }
        });
        while pool.places.available_permits() == 2 {
            tokio::task::yield_now().await;
        }
        let waiting = tokio::spawn({
            let pool = pool.clone();
            async move { pool.run(|| 2).await }
        });
        while pool.places.available_permits() == 1 {
            tokio::task::yield_now().await;
        }
        let refused = pool.run(|| 3).await.unwrap_err();
        assert_eq!(refused.code, ErrorCode::ResourceExhausted);
        assert!(refused.message.contains("jobs_waiting_max is 1"));
        release.send(()).unwrap();
        running.await.unwrap().unwrap().unwrap();
        assert_eq!(waiting.await.unwrap().unwrap(), 2);
        assert_eq!(pool.run(|| 4).await.unwrap(), 4);
    }

    #[tokio::test]
    async fn a_job_that_nobody_waits_for_is_not_run() {
        let pool = std::sync::Arc::new(Pool::new("test", 1, 2).unwrap());
        let (release, released) = std::sync::mpsc::channel::<()>();
        let running = tokio::spawn({
            let pool = pool.clone();
            async move { pool.run(move || released.recv()).await }
        });
        while pool.places.available_permits() == 3 {
            tokio::task::yield_now().await;
        }
        let (ran, was_run) = std::sync::mpsc::channel::<()>();
        let gone = tokio::time::timeout(std::time::Duration::from_millis(10), pool.run(move || ran.send(())));
        assert!(gone.await.is_err());
        release.send(()).unwrap();
        running.await.unwrap().unwrap().unwrap();
        // Its turn has come and gone when the next one's has.
        pool.run(|| ()).await.unwrap();
        assert!(was_run.recv().is_err());
    }

    #[tokio::test]
    async fn a_job_that_panics_is_an_error_of_its_own() {
        let pool = Pool::new("test", 1, 1).unwrap();
        let failed = pool.run(|| panic!("a defect")).await.map(|(): ()| ()).unwrap_err();
        assert_eq!(failed.code, ErrorCode::Internal);
        assert_eq!(pool.run(|| 1).await.unwrap(), 1);
    }
}
