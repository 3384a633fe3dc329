//! An answer that ends with its caller's key.

use std::pin::Pin;
use std::task::{Context, Poll};

use axum::body::{Body, Bytes, HttpBody};
use axum::http::HeaderMap;
use axum::response::Response;
use hyper::body::{Frame, SizeHint};

use super::Caller;
use crate::service::ServiceError;

/// What a protocol sends after what has been sent already: trailers, or nothing, so that its client sees the answer cut.
pub type Ending = fn(ServiceError) -> Option<HeaderMap>;

/// A body of which nothing goes out after the key of who asked for it has ended.
struct RevocableBody {
    /// None when it has ended.
    body: Option<Body>,
    revoked: Pin<Box<dyn Future<Output = ServiceError> + Send>>,
    ending: Ending,
}

/// The same answer, which ends by `ending` when the key of `caller` does.
pub fn revocable(response: Response, caller: &Caller, ending: Ending) -> Response {
    if !caller.has_key() {
        return response;
    }
    let revoked = Box::pin(caller.withdrawn());
    response.map(|body| Body::new(RevocableBody { body: Some(body), revoked, ending }))
}

impl HttpBody for RevocableBody {
    type Data = Bytes;
    type Error = axum::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, axum::Error>>> {
        if self.body.is_none() {
            return Poll::Ready(None);
        }
        if let Poll::Ready(revoked) = self.revoked.as_mut().poll(context) {
            self.body = None;
            let cut = axum::Error::new(revoked.clone());
            return Poll::Ready(Some((self.ending)(revoked).map(Frame::trailers).ok_or(cut)));
        }
        self.body.as_mut().map_or(Poll::Ready(None), |body| Pin::new(body).poll_frame(context))
    }

    fn is_end_stream(&self) -> bool {
        self.body.as_ref().is_none_or(HttpBody::is_end_stream)
    }

    fn size_hint(&self) -> SizeHint {
        self.body.as_ref().map(HttpBody::size_hint).unwrap_or_default()
    }
}
