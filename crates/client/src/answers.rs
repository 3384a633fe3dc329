//! Answer streams of the client.

use std::pin::Pin;
use std::task::{Context, Poll};

use tokio_stream::{Stream, StreamExt};

use super::error::ClientError;

/// The answers to a stream of requests, in order. After an error comes no other answer.
pub struct Answers<T>(Pin<Box<dyn Stream<Item = Result<T, ClientError>> + Send>>);

impl<T> Answers<T> {
    pub(super) fn new(answers: impl Stream<Item = Result<T, ClientError>> + Send + 'static) -> Self {
        Self(Box::pin(answers))
    }

    /// Waits for the next answer; none after the last.
    pub async fn next(&mut self) -> Option<Result<T, ClientError>> {
        self.0.next().await
    }
}

impl<T> Stream for Answers<T> {
    type Item = Result<T, ClientError>;

    fn poll_next(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<Option<Self::Item>> {
        self.0.as_mut().poll_next(cx)
    }
}

impl<T> std::fmt::Debug for Answers<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Answers")
    }
}
