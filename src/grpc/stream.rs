//! Streams of requests, answered in order.

use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll, ready};
use std::time::Instant;

use tokio::sync::mpsc;
use tokio::sync::mpsc::{Receiver, Sender};
use tokio_stream::Stream;
use tonic::{Code, Request, Status, Streaming};
use tracing::Instrument;

use super::adapter::Adapter;
use super::decompression::{Compressed, Inflation};
use super::former::Keeping;
use super::middleware::Grpc;
use super::status;
use crate::access::{Authorized, Operation};
use crate::admission::{Admission, InboundBody, MemoryPermit, RateLimitKey, draining};
use crate::middleware::Protocol;
use crate::telemetry::RequestRecorder;
use mrol_client::wire::{REASON, pb, status_of};
use mrol_map::sync::polled_by_runtime;
use mrol_service::{MapService, ServiceError};

/// Requests read ahead of the one in hand, and answers kept for a client that reads slowly, at most.
const MESSAGES_AHEAD_MAX: usize = 4;

/// The answers to a stream of requests. Each counts by its size from when it is made until it is sent: the next one is
/// asked for when there is room for it on the way to the client.
#[derive(Debug)]
pub(super) struct Answers<T> {
    made: Receiver<Made<T>>,
    /// Held for the one on its way.
    _unsent: Option<MemoryPermit>,
}

/// An answer, with the memory that it takes until it is sent.
type Made<T> = Result<(T, Option<MemoryPermit>), Status>;

impl<T> Answers<T> {
    fn new(made: Receiver<Made<T>>) -> Self {
        Self { made, _unsent: None }
    }
}

impl<T> Stream for Answers<T> {
    type Item = Result<T, Status>;

    fn poll_next(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Option<Self::Item>> {
        self._unsent = None;
        let made = ready!(self.made.poll_recv(context));
        Poll::Ready(made.map(|made| {
            let (answer, unsent) = made?;
            self._unsent = unsent;
            Ok(answer)
        }))
    }
}

/// A request of a stream.
pub(super) trait Message: prost::Message + 'static {
    /// What later requests may leave out.
    type Former: Default + Send + 'static;

    /// Bytes of memory that it takes.
    fn memory_bytes(&self) -> usize {
        self.encoded_len()
    }

    /// Takes what it leaves out from the requests before it, and gives what it says to those that follow.
    ///
    /// # Errors
    /// When what it says is more than is kept.
    fn complete(&mut self, former: &mut Self::Former, keeping: Keeping<'_>) -> Result<(), ServiceError>;
}

impl Adapter {
    /// Answers each request by `handle`, in order, while the next ones are read. A request that fails is told by
    /// `failed`, and the stream goes on; without, it ends with the first failure's status. It ends with `Unavailable`
    /// once the server is going down and the request in hand is answered, and with `Unauthenticated` once the caller's
    /// key counts no longer.
    pub(super) fn answer_in_order<M, A, H, F>(
        &self,
        operation: Operation,
        requests: Request<Streaming<M>>,
        failed: Option<fn(pb::Failure) -> A>,
        handle: H,
    ) -> Result<Answers<A>, Status>
    where
        M: Message,
        A: prost::Message + 'static,
        H: Fn(MapService, M, Counted) -> F + Send + 'static,
        F: Future<Output = Result<A, ServiceError>> + Send,
    {
        let (inbox, read) = mpsc::channel(MESSAGES_AHEAD_MAX);
        let (outbox, answers) = mpsc::channel(MESSAGES_AHEAD_MAX);
        let extensions = requests.extensions();
        let (arrival, asking) =
            (InboundBody::of(extensions).map_err(status_of)?.clone(), RateLimitKey::of(extensions));
        let (admission, recorder) = (self.admission.clone(), self.recorder.clone());
        let authorized = Authorized::of(extensions).map_err(status_of)?.clone();
        let former = M::Former::default();
        let worker = Worker { admission, recorder, asking, authorized, operation, failed, handle, former };
        let compressed = extensions.get().copied().unwrap_or(Compressed(true));
        let reader = Reader {
            requests: requests.into_inner(),
            arrival,
            inflation: self.inflation.clone(),
            compressed,
            message_bytes_max: self.message_bytes_max,
        };
        let caller = outbox.clone();
        let answering = async move {
            tokio::select! {
                // Nobody waits for the request in hand.
                () = caller.closed() => {}
                // The worker's end ends the reader too.
                () = worker.run(read, outbox) => {}
                () = reader.run(inbox) => {}
            }
        };
        tokio::spawn(polled_by_runtime(answering.in_current_span()));
        Ok(Answers::new(answers))
    }
}

/// A request of a stream, with the memory that it takes until it is answered.
type Read<M> = Result<(M, MemoryPermit), Status>;

/// The memory that a request takes: it counts until the request is answered, and nobody works on it still.
pub(super) type Counted = Arc<MemoryPermit>;

struct Reader<M> {
    requests: Streaming<M>,
    arrival: InboundBody,
    inflation: Inflation,
    compressed: Compressed,
    message_bytes_max: usize,
}

impl<M: Message> Reader<M> {
    /// Moves what the client sends to `inbox`; when the client is done, the inbox is closed, and this never ends.
    async fn run(mut self, inbox: Sender<Read<M>>) {
        while let Some(request) = self.next().await {
            let last = request.is_err();
            if inbox.send(request).await.is_err() || last {
                break;
            }
        }
        drop(inbox);
        std::future::pending().await
    }

    async fn next(&mut self) -> Option<Read<M>> {
        let message = self.inflation.within(self.compressed, self.requests.message()).await.transpose()?;
        Some(match message {
            // Compressed, it came as less.
            Ok(message) => match self.arrival.take().at_least(message.memory_bytes()) {
                Ok(charge) => Ok((message, charge)),
                Err(refusal) => Err(status_of(refusal)),
            },
            Err(unreadable) => Err(self
                .arrival
                .refusal()
                .map_or_else(|| status::of_request(unreadable, self.message_bytes_max), status_of)),
        })
    }
}

struct Worker<A, H, P> {
    admission: Admission,
    recorder: RequestRecorder,
    asking: RateLimitKey,
    authorized: Authorized,
    operation: Operation,
    failed: Option<fn(pb::Failure) -> A>,
    handle: H,
    /// What the requests before said.
    former: P,
}

impl<A: prost::Message, H, P> Worker<A, H, P> {
    async fn run<M, F>(mut self, mut inbox: Receiver<Read<M>>, outbox: Sender<Made<A>>)
    where
        M: Message<Former = P>,
        H: Fn(MapService, M, Counted) -> F,
        F: Future<Output = Result<A, ServiceError>>,
    {
        loop {
            let answer = tokio::select! {
                biased;
                () = self.admission.lifecycle().draining() => Err(status_of(draining())),
                withdrawn = self.authorized.caller.withdrawn() => Err(status_of(withdrawn)),
                request = inbox.recv() => match request {
                    Some(request) => self.answer(request).await,
                    None => return,
                },
            };
            let last = answer.is_err();
            if outbox.send(answer).await.is_err() || last {
                return;
            }
        }
    }

    /// Answers one request, timed and counted as a request of its own.
    async fn answer<M, F>(&mut self, request: Read<M>) -> Made<A>
    where
        M: Message<Former = P>,
        H: Fn(MapService, M, Counted) -> F,
        F: Future<Output = Result<A, ServiceError>>,
    {
        let start = Instant::now();
        let mut told = None;
        let answer = match request {
            Ok((request, charge)) => self.kept(request, charge.into()).await.map_err(|error| {
                told = self
                    .failed
                    .filter(|_| !status::ends_stream(&error))
                    .map(|failed| failed(error.clone().into()));
                status_of(error)
            }),
            Err(unreadable) => Err(unreadable),
        };
        let code = answer.as_ref().map_or_else(Status::code, |_| Code::Ok);
        let reason = answer.as_ref().err().and_then(|status| status.metadata().get(REASON));
        let outcome = status::outcome(code, reason.map(|reason| reason.as_bytes()));
        self.recorder.answered(Grpc::NAME, self.operation.name(), outcome, start.elapsed());
        told.map_or(answer, |told| Ok((told, None)))
    }

    /// The answer, with room for it.
    async fn kept<M, F>(
        &mut self,
        request: M,
        counted: Counted,
    ) -> Result<(A, Option<MemoryPermit>), ServiceError>
    where
        M: Message<Former = P>,
        H: Fn(MapService, M, Counted) -> F,
        F: Future<Output = Result<A, ServiceError>>,
    {
        let answer = self.handled(request, Arc::clone(&counted)).await?;
        let unsent = self.admission.keep_answer(answer.encoded_len())?;
        Ok((answer, unsent))
    }

    async fn handled<M, F>(&mut self, mut request: M, counted: Counted) -> Result<A, ServiceError>
    where
        M: Message<Former = P>,
        H: Fn(MapService, M, Counted) -> F,
        F: Future<Output = Result<A, ServiceError>>,
    {
        let keeping = Keeping { admission: &self.admission, limits: self.authorized.service.limits() };
        request.complete(&mut self.former, keeping)?;
        self.admission.check_rate(&self.asking)?;
        let handled = (self.handle)(self.authorized.service.clone(), request, counted);
        self.admission.lifecycle().admit(handled).await?
    }
}

#[cfg(test)]
mod tests {
    use tokio_stream::StreamExt;

    use super::*;
    use crate::admission::Lifecycle;
    use mrol_service::Limits;

    const BYTES: usize = 100_000;

    #[tokio::test]
    async fn an_answer_counts_until_the_next_one_is_asked_for() {
        let limits = Limits { body_bytes_max: 2 * BYTES, ..Limits::default() };
        let admission = Admission::new(&limits, Lifecycle::default());
        let (outbox, made) = mpsc::channel(MESSAGES_AHEAD_MAX);
        let mut answers = Answers::new(made);
        for answer in 1..=2 {
            outbox.send(Ok((answer, admission.keep_answer(BYTES).unwrap()))).await.unwrap();
        }
        let refused = admission.keep_answer(BYTES).unwrap_err();
        assert!(refused.message.contains("body_bytes_max is 200000"), "{refused}");
        // A small one always has room.
        assert!(admission.keep_answer(16 << 10).unwrap().is_none());
        for (answer, bytes) in [(1, 2 * BYTES), (2, BYTES)] {
            assert_eq!(answers.next().await.unwrap().unwrap(), answer);
            assert_eq!(admission.in_use().bytes, bytes);
        }
        drop(outbox);
        assert!(answers.next().await.is_none());
        assert_eq!(admission.in_use().bytes, 0);
    }
}
