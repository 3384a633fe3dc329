//! A load of questions on a server, and what it took.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use hdrhistogram::Histogram;
use tokio::sync::mpsc;
use tokio_stream::wrappers::ReceiverStream;

use super::batch::Batch;
use crate::fleet::error::FleetError;
use crate::fleet::pace::Pace;
use crate::fleet::process::ServerProcess;
use crate::fleet::target::Target;
use mrol_client::Client;

/// Longest latency that is told apart, nanoseconds.
const LATENCY_NS_MAX: u64 = 600_000_000_000;
/// Significant digits of a latency.
const LATENCY_DIGITS: u8 = 3;

/// How questions follow each other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Pressure {
    /// On one stream, so many under way.
    Stream { in_flight: usize },
    /// One call after the other, so many a second at most; as many as are answered without.
    Calls { per_s: Option<f64> },
}

/// What was answered within some time.
#[derive(Debug)]
pub(crate) struct Told {
    /// From question to answer, nanoseconds.
    pub(crate) latencies: Histogram<u64>,
    /// Things that were asked about.
    pub(crate) items: usize,
    /// How long it took, seconds.
    pub(crate) seconds: f64,
    /// Processor time of the server meanwhile, seconds of one core.
    pub(crate) server_cpu_s: f64,
}

impl Told {
    /// Nothing yet.
    pub(crate) fn nothing() -> Result<Self, FleetError> {
        let latencies =
            Histogram::new_with_bounds(1, LATENCY_NS_MAX, LATENCY_DIGITS).map_err(FleetError::failed)?;
        Ok(Self { latencies, items: 0, seconds: 0.0, server_cpu_s: 0.0 })
    }

    /// Notes an answer about `items` things to what was asked at `asked`.
    pub(crate) fn add(&mut self, asked: Instant, items: usize) {
        self.latencies.saturating_record(asked.elapsed().as_nanos() as u64);
        self.items += items;
    }
}

impl Pressure {
    /// Asks `batches` in turn, for `time`, after a tenth of it that does not count.
    pub(crate) async fn put<B: Batch>(
        self,
        server: &ServerProcess,
        target: &Target,
        batches: &[B],
        time: Duration,
    ) -> Result<Told, FleetError> {
        let client = server.grpc().connect().await?;
        self.ask(&client, target, batches, time / 10).await?;
        let (cpu_s, start) = (server.cpu_seconds()?, Instant::now());
        let mut told = self.ask(&client, target, batches, time).await?;
        told.seconds = start.elapsed().as_secs_f64();
        told.server_cpu_s = server.cpu_seconds()? - cpu_s;
        Ok(told)
    }

    async fn ask<B: Batch>(
        self,
        client: &Client,
        target: &Target,
        batches: &[B],
        time: Duration,
    ) -> Result<Told, FleetError> {
        match self {
            Self::Stream { in_flight } => stream(client, target, batches, in_flight, time).await,
            Self::Calls { per_s } => calls(client, target, batches, per_s, time).await,
        }
    }
}

async fn calls<B: Batch>(
    client: &Client,
    target: &Target,
    batches: &[B],
    per_s: Option<f64>,
    time: Duration,
) -> Result<Told, FleetError> {
    let (mut told, pace) = (Told::nothing()?, Pace::new(per_s, time, 0));
    while let Some(due) = pace.due().await {
        let batch = batches[due.number as usize % batches.len()].clone();
        let items = batch.items();
        batch.ask(client, &target.map).await?;
        told.add(due.since, items);
    }
    Ok(told)
}

/// Asks on one stream, the next question after each answer.
async fn stream<B: Batch>(
    client: &Client,
    target: &Target,
    batches: &[B],
    in_flight: usize,
    time: Duration,
) -> Result<Told, FleetError> {
    let (mut told, start) = (Told::nothing()?, Instant::now());
    let (sender, questions) = mpsc::channel(in_flight);
    let mut answers = B::stream(client, &target.map, ReceiverStream::new(questions)).await?;
    let (mut under_way, mut next) = (VecDeque::new(), batches.iter().cycle());
    // Once the sender is dropped, the stream ends after the last answer.
    let mut sender = Some(sender);
    loop {
        while let Some(open) = sender.as_ref().filter(|_| under_way.len() < in_flight) {
            let Some(batch) = next.next() else { break };
            under_way.push_back((Instant::now(), batch.items()));
            // A server that stops reading says why in an answer.
            let _ = open.send(batch.clone()).await;
        }
        let Some(answer) = answers.next().await else { return Ok(told) };
        answer?;
        if let Some((asked, items)) = under_way.pop_front() {
            told.add(asked, items);
        }
        if start.elapsed() >= time {
            sender = None;
        }
    }
}
