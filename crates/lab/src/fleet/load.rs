//! Load of point queries over several connections.

use mrol_map::util::Keyword;
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::{Duration, Instant};

use hdrhistogram::Histogram;
use tokio::sync::mpsc;
use tokio::task::JoinSet;
use tokio_stream::wrappers::ReceiverStream;

use super::address::{GrpcAddress, HttpAddress};
use super::error::FleetError;
use super::http::HttpConnection;
use crate::workload::Queries;
use mrol_map::geometry::{Pose, rotation_xyzw, translation_m};
use mrol_map::map::{Lookup, MapName};
use mrol_service::{PointCloud, PointQuery};

/// Longest latency that is told apart: longer ones count as ten minutes, in nanoseconds.
const LATENCY_NS_MAX: u64 = 600_000_000_000;
/// Significant digits of a latency.
const LATENCY_DIGITS: u8 = 3;

/// The queries of a load, message after message.
#[derive(Debug, Clone)]
pub(crate) struct Question {
    messages: Arc<[PointCloud]>,
    map_from_points: Pose,
    lookup: Lookup,
}

impl Question {
    /// Messages of `points` points each, all of `queries` in turn.
    pub(crate) fn of(queries: &Queries, points: usize, lookup: Lookup) -> Self {
        let mut endless = queries.points.iter().cycle().copied();
        let messages = queries.points.len().div_ceil(points);
        let message = |_| PointCloud::from(endless.by_ref().take(points).collect::<Vec<_>>());
        let messages = (0..messages).map(message).collect();
        Self { messages, map_from_points: queries.map_from_points, lookup }
    }

    pub(crate) fn query(&self, message: usize) -> PointQuery {
        PointQuery {
            points: self.points(message),
            map_from_points: Some(self.map_from_points),
            level: 0,
            lookup: self.lookup,
            min_revision: None,
            map_uuid: None,
            keep_out: false,
        }
    }

    /// Messages of `points` points each, the last one of those that are left: all of `queries` once.
    pub(crate) fn whole(queries: &Queries, points: usize, lookup: Lookup) -> Self {
        let messages =
            queries.points.chunks(points).map(|points| PointCloud::from(points.to_vec())).collect();
        Self { messages, map_from_points: queries.map_from_points, lookup }
    }

    /// All queries in turn, once.
    pub(crate) fn queries(&self) -> Vec<PointQuery> {
        (0..self.messages.len()).map(|message| self.query(message)).collect()
    }

    pub(crate) fn points(&self, message: usize) -> PointCloud {
        self.messages[message % self.messages.len()].clone()
    }

    /// The URL of the query, with all its parameters but the points.
    pub(crate) fn asked_at(&self, server: &HttpAddress, map: &MapName) -> HttpAddress {
        let ([x, y, z], [qx, qy, qz, qw]) =
            (translation_m(&self.map_from_points), rotation_xyzw(&self.map_from_points));
        let lookup = self.lookup.as_str();
        let url = format!(
            "{}/v1/maps/{map}/occupancy?lookup={lookup}&pose={x},{y},{z},{qx},{qy},{qz},{qw}",
            server.url
        );
        HttpAddress { url, ..server.clone() }
    }
}

/// A protocol to query by.
#[derive(Debug, Clone)]
pub(crate) enum Load {
    Unary { server: GrpcAddress, map: MapName, question: Question },
    Stream { server: GrpcAddress, map: MapName, question: Question, in_flight: usize },
    Http { http: HttpAddress, question: Question },
}

/// Answers within some time.
pub(crate) struct Answered {
    /// Latencies, nanoseconds from query to answer.
    pub(crate) latencies: Histogram<u64>,
    pub(crate) points: usize,
    pub(crate) occupied: usize,
    pub(crate) seconds: f64,
}

impl Answered {
    fn none() -> Result<Self, FleetError> {
        let latencies =
            Histogram::new_with_bounds(1, LATENCY_NS_MAX, LATENCY_DIGITS).map_err(FleetError::failed)?;
        Ok(Self { latencies, points: 0, occupied: 0, seconds: 0.0 })
    }

    fn add(&mut self, asked: Instant, points: usize, occupied: usize) {
        self.latencies.saturating_record(asked.elapsed().as_nanos() as u64);
        self.points += points;
        self.occupied += occupied;
    }

    fn merge(&mut self, other: &Self) -> Result<(), FleetError> {
        self.latencies.add(&other.latencies).map_err(FleetError::failed)?;
        self.points += other.points;
        self.occupied += other.occupied;
        Ok(())
    }
}

impl Load {
    /// Sends queries over `connections` connections for `time`.
    pub(crate) async fn run(&self, connections: usize, time: Duration) -> Result<Answered, FleetError> {
        let mut asking = JoinSet::new();
        let start = Instant::now();
        for connection in 0..connections {
            // Each connection begins with another message.
            asking.spawn(self.clone().ask(connection, time));
        }
        let mut all = Answered::none()?;
        while let Some(answered) = asking.join_next().await {
            all.merge(&answered.map_err(FleetError::failed)??)?;
        }
        all.seconds = start.elapsed().as_secs_f64();
        Ok(all)
    }

    async fn ask(self, first: usize, time: Duration) -> Result<Answered, FleetError> {
        match self {
            Self::Unary { server, map, question } => unary(&server, &map, &question, first, time).await,
            Self::Stream { server, map, question, in_flight } => {
                stream(&server, &map, &question, first, in_flight, time).await
            }
            Self::Http { http, question } => over_http(&http, &question, first, time).await,
        }
    }
}

async fn unary(
    server: &GrpcAddress,
    map: &MapName,
    question: &Question,
    first: usize,
    time: Duration,
) -> Result<Answered, FleetError> {
    let client = server.connect().await?;
    let (mut answered, start) = (Answered::none()?, Instant::now());
    for message in first.. {
        let asked = Instant::now();
        if asked - start >= time {
            break;
        }
        let answer = client.query_points(map, question.query(message)).await?;
        answered.add(asked, answer.points, answer.points_occupied);
    }
    Ok(answered)
}

async fn over_http(
    address: &HttpAddress,
    question: &Question,
    first: usize,
    time: Duration,
) -> Result<Answered, FleetError> {
    let connection = HttpConnection::to(address)?;
    let (mut answered, start) = (Answered::none()?, Instant::now());
    for message in first.. {
        let asked = Instant::now();
        if asked - start >= time {
            break;
        }
        let points = question.points(message);
        let count = points.len();
        let occupied = connection.ask(points).await?;
        answered.add(asked, count, occupied);
    }
    Ok(answered)
}

/// Sends queries on one stream, the next one after each answer.
async fn stream(
    server: &GrpcAddress,
    map: &MapName,
    question: &Question,
    first: usize,
    in_flight: usize,
    time: Duration,
) -> Result<Answered, FleetError> {
    let client = server.connect().await?;
    let (mut answered, start) = (Answered::none()?, Instant::now());
    let (sender, questions) = mpsc::channel(in_flight);
    let mut answers = client.query_stream(map, ReceiverStream::new(questions)).await?;
    let (mut under_way, mut messages) = (VecDeque::new(), first..);
    // Once the sender is dropped, the stream ends after the last answer.
    let mut sender = Some(sender);
    loop {
        while let Some(open) = sender.as_ref().filter(|_| under_way.len() < in_flight) {
            under_way.push_back(Instant::now());
            let message = messages.next().unwrap_or(first);
            // A server that stops reading says why in an answer.
            let _ = open.send(question.query(message)).await;
        }
        let Some(answer) = answers.next().await else {
            return Ok(answered);
        };
        let (answer, asked) = (answer?, under_way.pop_front().unwrap_or(start));
        answered.add(asked, answer.points, answer.points_occupied);
        if start.elapsed() >= time {
            sender = None;
        }
    }
}
