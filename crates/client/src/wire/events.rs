//! What became of scans (`mapping.proto`).

use std::sync::Arc;
use std::time::Duration;

use super::failure::status_code;
use super::pb;
use super::values::{InField, count_from, required};
use mrol_map::map::{MapName, RobotName, SessionName};
use mrol_service::{
    EventMessage, EventsQuery, FailedScan, PointCloud, Reason, ScanAnswer, ScanEvent, ServiceError,
};

impl TryFrom<pb::ListEventsRequest> for (MapName, EventsQuery) {
    type Error = ServiceError;

    fn try_from(request: pb::ListEventsRequest) -> Result<Self, ServiceError> {
        let pb::ListEventsRequest { map, since_number, robot } = request;
        let robot = (!robot.is_empty()).then(|| RobotName::new(&robot)).transpose()?;
        Ok((MapName::new(&map)?, EventsQuery { since_number, robot }))
    }
}

impl TryFrom<pb::WatchEventsRequest> for (MapName, EventsQuery) {
    type Error = ServiceError;

    fn try_from(request: pb::WatchEventsRequest) -> Result<Self, ServiceError> {
        let pb::WatchEventsRequest { map, since_number, robot } = request;
        pb::ListEventsRequest { map, since_number, robot }.try_into()
    }
}

impl From<(&MapName, EventsQuery)> for pb::ListEventsRequest {
    fn from((map, EventsQuery { since_number, robot }): (&MapName, EventsQuery)) -> Self {
        let robot = robot.map(|robot| robot.to_string()).unwrap_or_default();
        Self { map: map.to_string(), since_number, robot }
    }
}

impl From<(&MapName, EventsQuery)> for pb::WatchEventsRequest {
    fn from(request: (&MapName, EventsQuery)) -> Self {
        let pb::ListEventsRequest { map, since_number, robot } = request.into();
        Self { map, since_number, robot }
    }
}

impl From<&ScanEvent> for pb::ScanEvent {
    fn from(event: &ScanEvent) -> Self {
        let sample = PointCloud::from(event.sample.clone());
        Self {
            number: event.number,
            time_ns: event.time_ns,
            robot: event.robot.to_string(),
            session: event.session.to_string(),
            scan_id: event.scan_id,
            points: event.points as u64,
            duration_ms: event.duration.as_secs_f64() * 1e3,
            guess: event.guess.as_ref().map(Into::into),
            sample: (!event.sample.is_empty()).then(|| sample.into()),
            answer: Some(match &event.answer {
                Ok(answer) => ScanAnswer::clone(answer).into(),
                Err(failed) => pb::Failure::from(failed).into(),
            }),
        }
    }
}

impl From<&FailedScan> for pb::Failure {
    fn from(FailedScan { reason, message }: &FailedScan) -> Self {
        let code = Reason::of_word(reason).map_or(tonic::Code::Unknown, |reason| status_code(reason.code()));
        Self { code: code.into(), reason: reason.to_string(), message: message.clone(), ..Default::default() }
    }
}

impl TryFrom<pb::ScanEvent> for ScanEvent {
    type Error = ServiceError;

    fn try_from(event: pb::ScanEvent) -> Result<Self, ServiceError> {
        let mut answer = required(event.answer, "event.answer")?;
        let failed =
            |pb::Failure { reason, message, .. }| FailedScan { reason: String::into(reason), message };
        let answer = match answer.error.take() {
            Some(failure) => Err(failed(failure)),
            None => Ok(Box::new(answer.try_into()?)),
        };
        let sample: Option<PointCloud> =
            event.sample.map(TryInto::try_into).transpose().in_field("event.sample")?;
        Ok(Self {
            number: event.number,
            time_ns: event.time_ns,
            robot: RobotName::new(&event.robot)?,
            session: SessionName::new(&event.session)?,
            scan_id: event.scan_id,
            points: count_from(event.points),
            duration: Duration::try_from_secs_f64(event.duration_ms / 1e3).unwrap_or_default(),
            guess: event.guess.map(TryInto::try_into).transpose().in_field("event.guess")?,
            sample: sample.map(|points| points.as_slice().to_vec()).unwrap_or_default(),
            answer,
        })
    }
}

impl TryFrom<pb::ListEventsResponse> for Vec<ScanEvent> {
    type Error = ServiceError;

    fn try_from(answer: pb::ListEventsResponse) -> Result<Self, ServiceError> {
        answer.events.into_iter().map(TryInto::try_into).collect()
    }
}

impl From<EventMessage> for pb::WatchEventsResponse {
    fn from(message: EventMessage) -> Self {
        Self {
            event: match message {
                EventMessage::Event(event) => Some((&*event).into()),
                EventMessage::Heartbeat => None,
            },
        }
    }
}

impl TryFrom<pb::WatchEventsResponse> for EventMessage {
    type Error = ServiceError;

    fn try_from(message: pb::WatchEventsResponse) -> Result<Self, ServiceError> {
        message.event.map_or(Ok(Self::Heartbeat), |event| Ok(Self::Event(Arc::new(event.try_into()?))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failure_with_a_reason_of_a_newer_server_comes_through() {
        let failure = pb::Failure { reason: "brand_new".into(), message: "no".into(), ..Default::default() };
        let event = pb::ScanEvent { robot: "r".into(), answer: Some(failure.into()), ..Default::default() };
        let event = ScanEvent::try_from(event).unwrap();
        assert_eq!(
            event.answer.unwrap_err(),
            FailedScan { reason: "brand_new".into(), message: "no".into() }
        );
    }
}
