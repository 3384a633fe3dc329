//! Compressed messages, and where they are inflated.
//!
//! A kilobyte may become tens of megabytes, in one go while a call's future is polled. On the threads that serve
//! connections that would keep everybody else waiting, so such calls are polled a few at a time, each on a thread that
//! is given up to it.

use std::pin::{Pin, pin};
use std::sync::Arc;
use std::task::{Context, Poll, ready};

use axum::http::HeaderMap;
use tokio::runtime::{Handle, RuntimeFlavor};
use tokio::sync::Semaphore;
use tokio::task::block_in_place;
use tokio_util::sync::PollSemaphore;

/// Calls that are inflating at once: each holds a message as it came and as it is.
const INFLATING_MAX: usize = 2;

const ENCODING: &str = "grpc-encoding";

/// The places of calls that are inflating. A clone has the same ones.
#[derive(Debug, Clone)]
pub(super) struct Inflation(Arc<Semaphore>);

impl Default for Inflation {
    fn default() -> Self {
        Self(Arc::new(Semaphore::new(INFLATING_MAX)))
    }
}

/// Whether messages of a call are compressed; to be found among its extensions.
#[derive(Debug, Clone, Copy)]
pub(super) struct Compressed(pub(super) bool);

impl Compressed {
    /// As the headers of a call say.
    pub(super) fn of(headers: &HeaderMap) -> Self {
        Self(headers.get(ENCODING).is_some_and(|encoding| encoding != "identity"))
    }
}

impl Inflation {
    /// What becomes of `call`, in which messages are read.
    pub(super) async fn within<T>(&self, compressed: Compressed, call: impl Future<Output = T>) -> T {
        if compressed.0 {
            let places = PollSemaphore::new(Arc::clone(&self.0));
            InTurn { call: pin!(call), places }.await
        } else {
            call.await
        }
    }
}

/// A call that holds a place while it is polled, and not while it waits.
struct InTurn<'a, F> {
    call: Pin<&'a mut F>,
    places: PollSemaphore,
}

impl<F: Future> Future for InTurn<'_, F> {
    type Output = F::Output;

    fn poll(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<F::Output> {
        let _place = ready!(self.places.poll_acquire(context));
        in_place(|| self.call.as_mut().poll(context))
    }
}

/// Runs what takes long on this thread, while another one takes over what else this one would serve, if there can be
/// one.
fn in_place<T>(long: impl FnOnce() -> T) -> T {
    match Handle::current().runtime_flavor() {
        RuntimeFlavor::MultiThread => block_in_place(long),
        _ => long(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::future::poll_fn;
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::time::Duration;

    #[tokio::test(flavor = "multi_thread", worker_threads = 8)]
    async fn no_more_calls_are_polled_at_once_than_have_a_place() {
        let (inflation, polled, most) =
            (Inflation::default(), Arc::<AtomicUsize>::default(), Arc::<AtomicUsize>::default());
        let calls: Vec<_> = (0..16)
            .map(|_| {
                let (inflation, polled, most) = (inflation.clone(), Arc::clone(&polled), Arc::clone(&most));
                let call = poll_fn(move |_| {
                    most.fetch_max(polled.fetch_add(1, Ordering::SeqCst) + 1, Ordering::SeqCst);
                    std::thread::sleep(Duration::from_millis(5));
                    polled.fetch_sub(1, Ordering::SeqCst);
                    Poll::Ready(())
                });
                tokio::spawn(async move { inflation.within(Compressed(true), call).await })
            })
            .collect();
        for call in calls {
            call.await.unwrap();
        }
        assert!((1..=INFLATING_MAX).contains(&most.load(Ordering::SeqCst)));
    }

    #[tokio::test]
    async fn a_call_that_waits_holds_no_place() {
        let inflation = Inflation::default();
        let waiting = || inflation.within(Compressed(true), std::future::pending::<()>());
        let all = async { tokio::join!(waiting(), waiting(), waiting()) };
        assert!(tokio::time::timeout(Duration::from_millis(20), all).await.is_err());
        assert_eq!(inflation.within(Compressed(true), async { 1 }).await, 1);
    }
}
