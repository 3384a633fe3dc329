//! How all questions are answered: the body is read, asked of the service, and answered in the form in which it came.

use axum::body::Bytes;
use axum::response::Response;
use serde::Serialize;
use serde::de::DeserializeOwned;

use super::answer::{Answer, Arrays};
use super::form::QuestionBody;
use super::scope::Scoped;
use crate::http::error::HttpError;
use mrol_client::wire::{QuestionMessage, pb};
use mrol_map::map::MapName;
use mrol_service::{AtVersion, MapService, Question, ServiceError};

/// A question of a planner as the body of a request asks it.
pub(in crate::http) trait HttpQuestion: Scoped + DeserializeOwned + Send + 'static {
    /// The message that asks the same over gRPC.
    type Message: QuestionMessage;
    /// The question.
    type Question: Question;
    /// What of the answer is no array.
    type Head: Serialize + Send + 'static;

    /// The message, with what all questions have in common. Arrays of which the body tells the places are in `arrays`.
    ///
    /// # Errors
    /// `InvalidArgument` for an array that does not lie there, and for regions that bound nothing.
    fn into_message(self, scope: pb::Asked, arrays: &Bytes) -> Result<Self::Message, ServiceError>;

    /// The head and the arrays of an answer.
    fn answered(answer: AnswerOf<Self>) -> (Self::Head, Arrays);
}

/// The answer to a question, with the version that it is of.
pub(in crate::http) type AnswerOf<B> = AtVersion<<<B as HttpQuestion>::Question as Question>::Answer>;

impl<B> QuestionBody<B>
where
    B: HttpQuestion,
    (MapName, B::Question): TryFrom<B::Message, Error = ServiceError>,
{
    /// Asks the question of a map, and answers it in its form.
    pub(super) async fn answer(self, service: &MapService, map: MapName) -> Result<Response, HttpError> {
        let form = self.form;
        let (map, question) = self.question(service, map).await?;
        let answered = service.ask(&map, question).await?;
        let version = answered.version;
        let (head, arrays) = B::answered(answered);
        Answer { head, version, arrays }.respond(form, service).await
    }

    /// The question about a map.
    pub(super) async fn question(
        self,
        service: &MapService,
        map: MapName,
    ) -> Result<(MapName, B::Question), HttpError> {
        self.parse(service, move |mut body, arrays| {
            let scope = body.take_scope(&map);
            body.into_message(scope, arrays)
        })
        .await
    }
}

/// Declares the handler of a question that is answered by a head and arrays.
macro_rules! question_handler {
    ($(#[$attribute:meta])* $name:ident, $path:literal, $Body:ident => $Response:ident) => {
        $(#[$attribute])*
        #[utoipa::path(
            post,
            path = $path,
            request_body(content(
                ($Body = "application/json"),
                ($crate::http::forms::QuestionBytes = "application/octet-stream")
            )),
            responses((
                status = 200,
                description = "Answered",
                content(
                    ($Response = "application/json"),
                    ($crate::http::forms::AnswerBytes = "application/octet-stream")
                )
            ))
        )]
        pub(in crate::http) async fn $name(
            $crate::http::middleware::Service(service): $crate::http::middleware::Service,
            $crate::http::forms::Map(map): $crate::http::forms::Map,
            question: $crate::http::question::form::QuestionBody<$Body>,
        ) -> Result<axum::response::Response, $crate::http::error::HttpError> {
            question.answer(&service, map).await
        }
    };
}

pub(super) use question_handler;
