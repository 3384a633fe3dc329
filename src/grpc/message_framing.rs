//! Messages that are handed on when they are there.
//!
//! tonic makes room for a message as soon as its length is declared. A client that declares and does not send would
//! have that memory for nothing, so the length is kept back until what it speaks of has come.

use std::collections::VecDeque;
use std::pin::Pin;
use std::task::{Context, Poll, ready};

use axum::body::{Body, Bytes, HttpBody};
use bytes::{Buf, BytesMut};
use hyper::body::Frame;

/// Bytes before a message: whether it is compressed, and its length, big end first.
const HEAD_BYTES: usize = 5;

/// Pieces of less are copied together: kept by themselves they would take more than what they hold.
const SMALL_BYTES: usize = 4 << 10;

type Piece = Result<Frame<Bytes>, axum::Error>;

/// A call's body whose pieces come when the message that they are a part of is complete, or is too large in any case.
pub(super) struct WholeMessages {
    body: Body,
    message_bytes_max: usize,
    /// Bytes of messages that are not complete, in order.
    kept: VecDeque<Bytes>,
    /// The last of it, where that came in small pieces.
    tail: BytesMut,
    kept_bytes: usize,
    /// To be handed on.
    complete: VecDeque<Piece>,
    ended: bool,
}

impl WholeMessages {
    pub(super) fn new(body: Body, message_bytes_max: usize) -> Self {
        let (kept, tail, complete) = (VecDeque::new(), BytesMut::new(), VecDeque::new());
        Self { body, message_bytes_max, kept, tail, kept_bytes: 0, complete, ended: false }
    }

    fn keep(&mut self, data: Bytes) {
        self.kept_bytes += data.len();
        if data.len() < SMALL_BYTES {
            self.tail.extend_from_slice(&data);
        } else {
            self.close_tail();
            self.kept.push_back(data);
        }
    }

    fn close_tail(&mut self) {
        if !self.tail.is_empty() {
            self.kept.push_back(self.tail.split().freeze());
        }
    }

    fn take(&mut self, piece: Option<Piece>) {
        match piece.map(|piece| piece.map(Frame::into_data)) {
            Some(Ok(Ok(data))) => {
                self.keep(data);
                while let Some(bytes) = self.first_complete() {
                    self.hand_on(bytes);
                }
            }
            // What is left is no message; whoever reads says so.
            None => {
                self.ended = true;
                self.hand_on(self.kept_bytes);
            }
            Some(Ok(Err(trailers))) => self.complete.push_back(Ok(trailers)),
            Some(Err(error)) => self.complete.push_back(Err(error)),
        }
    }

    /// Bytes of the first message that is kept, with its head, where they are all there or are not waited for.
    fn first_complete(&self) -> Option<usize> {
        let kept = self.kept.iter().flatten().chain(&self.tail);
        let head: Vec<u8> = kept.copied().take(HEAD_BYTES).collect();
        let length = head.get(1..HEAD_BYTES).map(|mut length| length.get_u32() as usize)?;
        let message = HEAD_BYTES + length;
        (message <= self.kept_bytes || length > self.message_bytes_max).then(|| message.min(self.kept_bytes))
    }

    fn hand_on(&mut self, mut bytes: usize) {
        self.kept_bytes -= bytes;
        self.close_tail();
        while bytes > 0
            && let Some(mut first) = self.kept.pop_front()
        {
            let part = first.split_to(bytes.min(first.len()));
            bytes -= part.len();
            if !first.is_empty() {
                self.kept.push_front(first);
            }
            self.complete.push_back(Ok(Frame::data(part)));
        }
    }
}

impl HttpBody for WholeMessages {
    type Data = Bytes;
    type Error = axum::Error;

    fn poll_frame(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Option<Piece>> {
        loop {
            if let Some(piece) = self.complete.pop_front() {
                return Poll::Ready(Some(piece));
            }
            if self.ended {
                return Poll::Ready(None);
            }
            let piece = ready!(Pin::new(&mut self.body).poll_frame(context));
            self.take(piece);
        }
    }

    fn is_end_stream(&self) -> bool {
        self.complete.is_empty() && self.kept_bytes == 0 && (self.ended || self.body.is_end_stream())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use http_body_util::BodyExt;
    use tokio_stream::StreamExt;

    fn message(length: u8) -> Vec<u8> {
        [&[0, 0, 0, 0, length][..], &vec![length; length as usize]].concat()
    }

    fn handed_on(pieces: Vec<Vec<u8>>) -> WholeMessages {
        let pieces =
            tokio_stream::iter(pieces.into_iter().map(|piece| Ok::<_, axum::Error>(Bytes::from(piece))));
        WholeMessages::new(Body::from_stream(pieces.chain(tokio_stream::pending())), 100)
    }

    /// What comes while more could.
    async fn read(mut body: WholeMessages) -> Vec<u8> {
        let mut read = Vec::new();
        let pending = std::time::Duration::from_millis(10);
        while let Ok(Some(piece)) = tokio::time::timeout(pending, body.frame()).await {
            read.extend_from_slice(&piece.unwrap().into_data().unwrap());
        }
        read
    }

    #[tokio::test(start_paused = true)]
    async fn messages_come_whole_however_they_were_sent() {
        let sent = [message(3), message(0), message(90)].concat();
        for size in [1, 2, 7, 1000] {
            let pieces = sent.chunks(size).map(<[u8]>::to_vec).collect();
            assert_eq!(read(handed_on(pieces)).await, sent, "in pieces of {size}");
        }
    }

    #[tokio::test(start_paused = true)]
    async fn what_is_not_all_there_is_kept_back_with_its_length() {
        let mut sent = [message(3), message(90)].concat();
        sent.pop();
        assert_eq!(read(handed_on(vec![sent])).await, message(3));
    }

    #[tokio::test(start_paused = true)]
    async fn what_is_too_large_in_any_case_is_told_at_once() {
        let head = message(101)[..HEAD_BYTES].to_vec();
        assert_eq!(read(handed_on(vec![head.clone()])).await, head);
    }

    #[tokio::test]
    async fn a_body_that_ends_in_the_middle_ends_for_its_reader_too() {
        let half = message(90)[..20].to_vec();
        let body = WholeMessages::new(Body::from(half.clone()), 100);
        assert_eq!(body.collect().await.unwrap().to_bytes(), half);
    }
}
