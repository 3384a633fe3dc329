//! Planners: members of a fleet that query.

use tokio::sync::mpsc;
use tokio_stream::wrappers::ReceiverStream;

use super::address::HttpAddress;
use super::error::FleetError;
use super::http::HttpConnection;
use super::load::Question;
use super::member::Member;
use super::target::Target;
use mrol_client::{Answers, Client};
use mrol_map::map::MapName;
use mrol_service::{PointAnswer, PointQuery};

/// A planner that queries points, by each protocol in turn.
pub(crate) struct Planner {
    map: MapName,
    question: Question,
    client: Client,
    stream: QueryStream,
    http: HttpConnection,
}

impl Planner {
    pub(crate) async fn new(target: &Target, question: Question) -> Result<Self, FleetError> {
        let client = target.grpc.connect().await?;
        let http = target.http.clone().unwrap_or_else(|| HttpAddress::open(""));
        Ok(Self {
            map: target.map.clone(),
            http: HttpConnection::to(&question.asked_at(&http, &target.map))?,
            stream: QueryStream::open(&client, &target.map).await?,
            client,
            question,
        })
    }
}

impl Member for Planner {
    async fn carry_out(&mut self, number: u64) -> Result<(), FleetError> {
        let message = number as usize;
        match number % 3 {
            0 => {
                self.client.query_points(&self.map, self.question.query(message)).await?;
            }
            1 => self.stream.ask(self.question.query(message)).await?,
            _ => {
                self.http.ask(self.question.points(message)).await?;
            }
        }
        Ok(())
    }
}

/// A stream of queries, one at a time.
struct QueryStream {
    questions: mpsc::Sender<PointQuery>,
    answers: Answers<PointAnswer>,
}

impl QueryStream {
    async fn open(client: &Client, map: &MapName) -> Result<Self, FleetError> {
        let (questions, asked) = mpsc::channel(1);
        let answers = client.query_stream(map, ReceiverStream::new(asked)).await?;
        Ok(Self { questions, answers })
    }

    async fn ask(&mut self, query: PointQuery) -> Result<(), FleetError> {
        // A server that stops reading says why in an answer.
        let _ = self.questions.send(query).await;
        match self.answers.next().await {
            Some(answer) => answer.map(drop).map_err(FleetError::from),
            None => Err(FleetError::failed("the stream of queries was ended")),
        }
    }
}
