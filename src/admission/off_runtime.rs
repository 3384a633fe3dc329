//! What is made of large requests and answers, away from the threads that serve connections.

use mrol_service::{MapService, Reason, ServiceError};

/// Requests and answers of more bytes than this are read and written away from the threads that serve connections.
const INLINE_BYTES_MAX: usize = 64 << 10;

/// What `make` makes of a request, or an answer, of `bytes`: where these are many, in the turn of the caller of
/// `service`. `held` is what counts the request's memory: it is kept to the end of the work, whether or not somebody
/// waits for it still.
///
/// # Errors
/// `Internal` when the work panicked.
pub async fn off_runtime<T, H>(
    service: &MapService,
    bytes: usize,
    held: H,
    make: impl FnOnce() -> T + Send + 'static,
) -> Result<T, ServiceError>
where
    T: Send + 'static,
    H: Send + 'static,
{
    if bytes <= INLINE_BYTES_MAX {
        return Ok(make());
    }
    let make = move || {
        let made = make();
        drop(held);
        made
    };
    service.convert(make).await.map_err(|_| {
        ServiceError::new(Reason::ParserFailed, "the request could not be read, or its answer not written")
    })
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::thread;

    use super::*;
    use mrol_service::ServiceSettings;
    use mrol_store::OpeningProgress;

    #[tokio::test]
    async fn what_is_large_is_made_on_another_thread_and_counts_until_it_is_made() {
        let service = MapService::open(ServiceSettings::default(), &OpeningProgress::default()).unwrap();
        let here = thread::current().id();
        for (bytes, is_here) in [(INLINE_BYTES_MAX, true), (INLINE_BYTES_MAX + 1, false)] {
            let held = Arc::new(());
            let counted = Arc::downgrade(&held);
            let make = move || (thread::current().id(), counted.upgrade().is_some());
            let (made_on, is_counted) = off_runtime(&service, bytes, held, make).await.unwrap();
            assert_eq!((made_on == here, is_counted), (is_here, true));
        }
    }
}
