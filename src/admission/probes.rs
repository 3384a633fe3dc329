//! Health checks, health watches and scrapes.

use std::time::Duration;

use axum::body::{Body, Bytes, to_bytes};
use axum::extract::Request;
use axum::http::Method;
use axum::response::Response;
use tokio::time::{sleep, timeout};

use super::answer_body::{AnswerBody, Ending, Endings};
use super::bodies::Bodies;
use super::inbound_body::InboundBody;
use super::of_connection::OfConnection;
use super::quota::{Quota, QuotaSlot};
use crate::access::{Authorized, Operation};
use mrol_service::{Limits, Reason, ServiceError};

/// What is asked without a key, or whatever else is done: each kind has places of its own.
#[derive(Debug)]
pub(super) struct Probes {
    limits: Limits,
    checks: Bodies,
    scrapes: Bodies,
    watches: Quota,
}

/// The places of a watch: of the server, and of its connection.
type Watch = (QuotaSlot, Option<QuotaSlot>);

impl Probes {
    pub(super) fn new(limits: &Limits) -> Self {
        Self {
            limits: limits.clone(),
            checks: Bodies::of_probes(limits, "probes_max", limits.probes_max),
            scrapes: Bodies::of_probes(limits, "scrapes_max", limits.scrapes_max),
            watches: Quota::new("health_watches_max", limits.health_watches_max),
        }
    }

    /// Answers a probe by `handle`, once its body has come: that is small, and comes at once.
    ///
    /// # Errors
    /// `InvalidArgument` for a larger body, `DeadlineExceeded` for one that does not come, `ResourceExhausted` with the
    /// name of the limit where there is no place.
    pub(super) async fn answer<F>(
        &self,
        operation: Operation,
        request: Request,
        mut endings: Endings,
        handle: impl FnOnce(Request) -> F,
    ) -> Result<Response, ServiceError>
    where
        F: Future<Output = Result<Response, ServiceError>>,
    {
        let watch = (operation == Operation::HealthWatch).then(|| self.watch(&request)).transpose()?;
        let has_key =
            Authorized::of(request.extensions()).is_ok_and(|authorized| authorized.caller.has_key());
        if watch.is_some() && !has_key {
            endings.when.push(self.watch_over());
        }
        let places = if operation == Operation::Metrics { &self.scrapes } else { &self.checks };
        let arrival = InboundBody::begin(places, false, request.extensions().get().cloned())?;
        let let_in = request.extensions().get().map(OfConnection::let_in);
        let request = self.with_body(request, &arrival).await?;
        let answered = if watch.is_some() {
            // From here on it has a place of its own kind.
            drop(arrival);
            None
        } else {
            arrival.complete()?;
            Some(arrival)
        };
        let response = handle(request).await?;
        Ok(response.map(|body| Body::new(AnswerBody::new(body, answered, (watch, let_in), endings))))
    }

    fn watch(&self, request: &Request) -> Result<Watch, ServiceError> {
        let connection = request.extensions().get::<OfConnection>();
        let of_connection = connection.map(OfConnection::watch).transpose()?;
        Ok((self.watches.take()?, of_connection))
    }

    /// The request with its body, which is there as a whole. Nobody reads that of a method without one.
    async fn with_body(&self, request: Request, arrival: &InboundBody) -> Result<Request, ServiceError> {
        if *request.method() != Method::POST {
            return Ok(request.map(|_| Body::empty()));
        }
        let (parts, body) = request.into_parts();
        arrival.await_more();
        let ended = arrival.ended();
        let body = tokio::select! {
            body = self.whole(body) => body?,
            () = ended.cancelled() => return Err(arrival.refusal().unwrap_or_else(|| self.late())),
        };
        Ok(Request::from_parts(parts, Body::from(body)))
    }

    async fn whole(&self, body: Body) -> Result<Bytes, ServiceError> {
        let most = self.limits.probe_body_bytes_max;
        let whole = timeout(Duration::from_secs_f64(self.limits.probe_time_max_s), to_bytes(body, most));
        whole.await.map_err(|_| self.late())?.map_err(|error| {
            let message = format!(
                "probe_body_bytes_max is {most}: the body of a health check is larger, or broke off ({error})"
            );
            ServiceError::new(Reason::ProbeBody, message)
        })
    }

    /// Resolves when a watch of somebody without a key has lasted for as long as it may: places are few.
    fn watch_over(&self) -> Ending {
        let most = Duration::from_secs_f64(self.limits.health_watch_max_s);
        Box::pin(async move {
            sleep(most).await;
            let message = format!(
                "health_watch_max_s is {}: a watch without a key ends then, watch again",
                most.as_secs_f64()
            );
            ServiceError::new(Reason::HealthWatchOver, message)
        })
    }

    fn late(&self) -> ServiceError {
        let most = Duration::from_secs_f64(self.limits.probe_time_max_s);
        let message =
            format!("probe_time_max_s is {}: the health check did not come in full", most.as_secs_f64());
        ServiceError::new(Reason::ProbeLate, message)
    }

    /// How long the text of a scrape answers those that follow.
    pub(super) fn scrape_kept(&self) -> Duration {
        Duration::from_secs_f64(self.limits.scrape_kept_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn probes(change: impl FnOnce(&mut Limits)) -> Probes {
        let mut limits = Limits::default();
        change(&mut limits);
        Probes::new(&limits)
    }

    fn post(body: Body) -> Request {
        let mut request = Request::new(body);
        *request.method_mut() = Method::POST;
        request
    }

    fn endless() -> Request {
        post(Body::from_stream(tokio_stream::pending::<Result<Bytes, axum::Error>>()))
    }

    async fn ask(probes: &Probes, operation: Operation, request: Request) -> Result<Response, ServiceError> {
        probes
            .answer(operation, request, Endings::none(), async |_| Ok(Response::new(Body::from("ok"))))
            .await
    }

    #[tokio::test]
    async fn the_body_of_a_check_is_small() {
        let probes = probes(|limits| limits.probe_body_bytes_max = 8);
        let of = |bytes| post(Body::from(vec![0; bytes]));
        assert!(ask(&probes, Operation::HealthCheck, of(8)).await.is_ok());
        let refused = ask(&probes, Operation::HealthCheck, of(9)).await.unwrap_err();
        assert!(refused.message.contains("probe_body_bytes_max is 8"), "{refused}");
        assert_eq!(refused.reason, Reason::ProbeBody);
    }

    #[tokio::test(start_paused = true)]
    async fn the_body_of_a_check_comes_in_time() {
        let start = tokio::time::Instant::now();
        let refused = ask(&probes(|_| {}), Operation::HealthCheck, endless()).await.unwrap_err();
        assert_eq!((refused.reason, start.elapsed().as_secs()), (Reason::ProbeLate, 5));
        assert!(refused.message.contains("probe_time_max_s is 5"), "{refused}");
    }

    #[tokio::test]
    async fn where_all_places_are_taken_the_oldest_check_gives_way() {
        let probes = probes(|limits| limits.probes_max = 1);
        let check = || ask(&probes, Operation::HealthCheck, endless());
        let newcomer = async {
            tokio::task::yield_now().await;
            ask(&probes, Operation::Live, Request::new(Body::empty())).await
        };
        let (old, new) = tokio::join!(check(), newcomer);
        assert!(old.unwrap_err().message.contains("probes_max is 1"));
        assert!(new.is_ok());
    }

    #[tokio::test]
    async fn watches_are_few_and_one_a_connection() {
        let probes = probes(|limits| limits.health_watches_max = 2);
        let connections = [OfConnection::new(false), OfConnection::new(false), OfConnection::new(false)];
        let watch = async |connection: &OfConnection| {
            let mut request = post(Body::empty());
            request.extensions_mut().insert(connection.clone());
            ask(&probes, Operation::HealthWatch, request).await
        };
        let first = watch(&connections[0]).await.unwrap();
        let again = watch(&connections[0]).await.unwrap_err();
        assert!(again.message.contains("health watches of one connection is 1"), "{again}");
        let second = watch(&connections[1]).await.unwrap();
        let refused = watch(&connections[2]).await.unwrap_err();
        assert!(refused.message.contains("health_watches_max is 2"), "{refused}");
        drop((first, second));
        assert!(watch(&connections[2]).await.is_ok() && watch(&connections[0]).await.is_ok());
    }

    #[test]
    fn what_was_taken_for_health_answers_nothing_else() {
        let (reserved, usual) = (OfConnection::new(true), OfConnection::new(false));
        assert!(reserved.check(true).is_ok() && usual.check(false).is_ok());
        assert!(reserved.check(false).unwrap_err().message.contains("connections_reserved"));
    }
}
