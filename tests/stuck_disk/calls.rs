//! Calls of both protocols, timed.

use std::sync::Arc;
use std::time::{Duration, Instant};

use tonic::{Code, Request, Response, Status, Streaming};

use crate::plain::Plain;
use crate::report::{Bound, Report};

/// Of every gRPC call.
pub(crate) const DEADLINE: Duration = Duration::from_secs(2);
/// Whoever is not answered until then is never answered: hangs are shorter.
const PATIENCE: Duration = Duration::from_secs(60);

/// A connection of each protocol.
#[derive(Clone)]
pub(crate) struct Calls {
    pub grpc: Plain,
    http: reqwest::Client,
    url: String,
    report: Arc<Report>,
}

impl Calls {
    pub(crate) async fn connect(http: &str, grpc: &str, report: Arc<Report>) -> Self {
        let client = reqwest::Client::builder().timeout(PATIENCE).no_proxy().build().unwrap();
        Self { grpc: Plain::connect(grpc).await, http: client, url: http.to_owned(), report }
    }

    /// A gRPC call with a deadline; its answer, where it was not refused.
    pub(crate) async fn call<M, A>(
        &self,
        kind: &str,
        message: M,
        call: impl AsyncFnOnce(Request<M>) -> Result<Response<A>, Status>,
    ) -> Option<A> {
        self.call_within(kind, Bound::Deadline(DEADLINE), message, async |request| {
            Ok(call(request).await?.into_inner())
        })
        .await
    }

    /// The same of an answer in many messages.
    pub(crate) async fn stream<M, A>(
        &self,
        kind: &str,
        message: M,
        call: impl AsyncFnOnce(Request<M>) -> Result<Response<Streaming<A>>, Status>,
    ) -> Option<Vec<A>> {
        let all = async |request| {
            let (mut stream, mut all) = (call(request).await?.into_inner(), Vec::new());
            while let Some(message) = stream.message().await? {
                all.push(message);
            }
            Ok(all)
        };
        self.call_within(kind, Bound::Deadline(DEADLINE), message, all).await
    }

    /// A gRPC call that has to be answered within `bound`.
    pub(crate) async fn call_within<M, A>(
        &self,
        kind: &str,
        bound: Bound,
        message: M,
        call: impl AsyncFnOnce(Request<M>) -> Result<A, Status>,
    ) -> Option<A> {
        let mut request = Request::new(message);
        if let Bound::Deadline(deadline) = bound {
            request.set_timeout(deadline);
        }
        let start = Instant::now();
        let answer = tokio::time::timeout(PATIENCE, call(request))
            .await
            .unwrap_or_else(|_| Err(Status::new(Code::Unknown, format!("no answer within {PATIENCE:?}"))));
        let outcome = answer.as_ref().map_or_else(word_of, |_| "ok".to_owned());
        self.report.note(kind, bound, start.elapsed(), &outcome);
        answer.ok()
    }

    /// An HTTP request, with its whole answer.
    pub(crate) async fn request(
        &self,
        kind: &str,
        bound: Bound,
        request: impl FnOnce(&reqwest::Client, &str) -> reqwest::RequestBuilder,
    ) -> Option<Vec<u8>> {
        let start = Instant::now();
        let asked = async {
            let answer = request(&self.http, &self.url).send().await?;
            let status = answer.status();
            Ok::<_, reqwest::Error>((status, answer.bytes().await?.to_vec()))
        };
        let answer = asked.await;
        let outcome = match &answer {
            Ok((status, _)) if status.is_success() => "ok".to_owned(),
            Ok((status, _)) => status.as_str().to_owned(),
            Err(error) => format!("{error:?}"),
        };
        self.report.note(kind, bound, start.elapsed(), &outcome);
        answer.ok().filter(|(status, _)| status.is_success()).map(|(_, body)| body)
    }
}

/// The server's word for a refusal, or what else it was.
fn word_of(status: &Status) -> String {
    let reason = status.metadata().get("mrol-reason").and_then(|reason| reason.to_str().ok());
    reason.map_or_else(|| format!("{:?}", status.code()), str::to_owned)
}
