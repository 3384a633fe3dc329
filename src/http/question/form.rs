//! The two forms of a question and its answer: JSON for people, and a head in JSON with arrays of bytes for programs.
//!
//! The form for programs is one for all questions (`application/octet-stream`):
//!
//! ```text
//! bytes      what
//! 4          length h of the head, little-endian
//! h          the head: the JSON of the other form, in which {"at": a, "bytes": n} stands for an array
//! the rest   the arrays: this one is n bytes long and begins a bytes after the head
//! ```
//!
//! Numbers of arrays are little-endian, as in `planning.proto`. The answer has the form of the question.

use std::marker::PhantomData;

use axum::body::Bytes;
use axum::extract::{FromRequest, Request};
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{DeserializeOwned, Error, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

use crate::access::Authorized;
use crate::admission::{InboundBody, off_runtime};
use crate::http::adapter::Adapter;
use crate::http::error::HttpError;
use crate::http::forms::JsonPoints;
use crate::http::forms::{Sent, body};
use mrol_client::wire::{QuestionMessage, bytes_of, parse_question, pb};
use mrol_map::map::MapName;
use mrol_service::{MapService, PointCloud, Question, Reason, ServiceError};

/// In which form something is said.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::http) enum Form {
    Json,
    Arrays,
}

/// A question: its head, and the arrays that the head speaks of.
pub(in crate::http) struct QuestionBody<T> {
    pub(super) head: T,
    arrays: Bytes,
    pub(super) form: Form,
    /// Bytes of all of it.
    bytes: usize,
    /// Counts them, and what is made of them.
    arrival: InboundBody,
}

/// Bytes that say how long the head is.
const LENGTH_BYTES: usize = size_of::<u32>();

impl<T: DeserializeOwned + Send + 'static> FromRequest<Adapter> for QuestionBody<T> {
    type Rejection = HttpError;

    async fn from_request(request: Request, adapter: &Adapter) -> Result<Self, HttpError> {
        let arrival = InboundBody::of(request.extensions())?.clone();
        let service = Authorized::of(request.extensions())?.service.clone();
        let sent = body::json_or_octets(request, adapter).await?;
        match sent {
            Sent::Json { parsed: head, bytes } => {
                Ok(Self { head, arrays: Bytes::new(), form: Form::Json, bytes, arrival })
            }
            Sent::Octets(mut body) => {
                let bytes = body.len();
                let length = body.get(..LENGTH_BYTES).map(|bytes| {
                    let length = u32::from_le_bytes(std::array::from_fn(|i| bytes[i]));
                    usize::try_from(length).unwrap_or(usize::MAX)
                });
                let length = length.filter(|length| *length <= body.len() - LENGTH_BYTES);
                let length = length.ok_or_else(|| no_head(body.len()))?;
                let mut rest = body.split_off(LENGTH_BYTES);
                let arrays = rest.split_off(length);
                let others = LENGTH_BYTES + arrays.len();
                let head = body::parse_beside(&service, rest, others, arrival.clone()).await?;
                Ok(Self { head, arrays, form: Form::Arrays, bytes, arrival })
            }
        }
    }
}

impl<T: Send + 'static> QuestionBody<T> {
    /// The question that `message` asks, made of the head and the arrays.
    pub(super) async fn parse<M, Q>(
        self,
        service: &MapService,
        message: impl FnOnce(T, &Bytes) -> Result<M, ServiceError> + Send + 'static,
    ) -> Result<(MapName, Q), HttpError>
    where
        M: QuestionMessage,
        Q: Question,
        (MapName, Q): TryFrom<M, Error = ServiceError>,
    {
        let Self { head, arrays, bytes, arrival, .. } = self;
        let of_limits = service.clone();
        let make = move || parse_question(message(head, &arrays)?, of_limits.limits());
        Ok(off_runtime(service, bytes, arrival, make).await??)
    }
}

fn no_head(bytes: usize) -> ServiceError {
    let message = format!(
        "the body must begin with the length of its head in {LENGTH_BYTES} bytes, little-endian, and the head, got {bytes} \
         bytes"
    );
    ServiceError::new(Reason::BadArray, message)
}

/// Where an array is, from the end of the head on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Slice {
    pub(super) at: usize,
    pub(super) bytes: usize,
}

impl Slice {
    /// The array.
    pub(super) fn of(self, arrays: &Bytes, field: &str) -> Result<Bytes, ServiceError> {
        let end = self.at.checked_add(self.bytes).filter(|end| *end <= arrays.len());
        let Some(end) = end else {
            let message = format!(
                "{field} must lie in the {} bytes after the head, got {} bytes at {}",
                arrays.len(),
                self.bytes,
                self.at
            );
            return Err(ServiceError::new(Reason::BadArray, message));
        };
        Ok(arrays.slice(self.at..end))
    }
}

/// What an array lists, or where the bytes of it are.
#[derive(Debug)]
enum ListOrSlice<L> {
    Listed(L),
    Sliced(Slice),
}

impl<'de, L: Deserialize<'de>> Deserialize<'de> for ListOrSlice<L> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(ListVisitor(PhantomData))
    }
}

struct ListVisitor<L>(PhantomData<L>);

impl<'de, L: Deserialize<'de>> Visitor<'de> for ListVisitor<L> {
    type Value = ListOrSlice<L>;

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("an array, or {\"at\", \"bytes\"}")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<Self::Value, A::Error> {
        L::deserialize(SeqAccessDeserializer::new(seq)).map(ListOrSlice::Listed)
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
        Slice::deserialize(MapAccessDeserializer::new(map)).map(ListOrSlice::Sliced)
    }
}

/// Points: a list of them, or where they are.
#[derive(Debug, Deserialize)]
#[serde(transparent)]
pub(super) struct PointsField(ListOrSlice<JsonPoints>);

impl PointsField {
    /// The points as a message has them.
    pub(super) fn into_message(self, arrays: &Bytes, field: &str) -> Result<pb::Points, ServiceError> {
        match self.0 {
            ListOrSlice::Listed(points) => Ok(PointCloud::from(points).into()),
            ListOrSlice::Sliced(slice) => {
                Ok(pb::Points { xyz_f32le: slice.of(arrays, field)?, ..pb::Points::default() })
            }
        }
    }
}

/// Tuples of `N` floats: a list of them, or where they are.
#[derive(Debug, Deserialize)]
#[serde(transparent)]
pub(super) struct NumbersField<const N: usize>(ListOrSlice<Vec<Tuple<N>>>);

/// `N` floats.
#[derive(Debug)]
struct Tuple<const N: usize>([f32; N]);

impl<'de, const N: usize> Deserialize<'de> for Tuple<N> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let numbers = Vec::<f32>::deserialize(deserializer)?;
        let wrong =
            |numbers: Vec<f32>| D::Error::custom(format!("{N} numbers are needed, got {}", numbers.len()));
        numbers.try_into().map(Self).map_err(wrong)
    }
}

impl<const N: usize> NumbersField<N> {
    /// The bytes of all numbers.
    pub(super) fn into_bytes(self, arrays: &Bytes, field: &str) -> Result<Bytes, ServiceError> {
        match self.0 {
            ListOrSlice::Listed(tuples) => {
                Ok(bytes_of(tuples.into_iter().flat_map(|Tuple(numbers)| numbers)))
            }
            ListOrSlice::Sliced(slice) => slice.of(arrays, field),
        }
    }
}

/// Counts: a list of them, or where they are.
#[derive(Debug, Deserialize)]
#[serde(transparent)]
pub(super) struct CountsField(ListOrSlice<Vec<u32>>);

impl CountsField {
    /// The bytes of all counts.
    pub(super) fn into_bytes(self, arrays: &Bytes, field: &str) -> Result<Bytes, ServiceError> {
        match self.0 {
            ListOrSlice::Listed(counts) => Ok(bytes_of(counts)),
            ListOrSlice::Sliced(slice) => slice.of(arrays, field),
        }
    }

    /// The bytes of so many ones.
    pub(super) fn ones(count: usize) -> Bytes {
        bytes_of(std::iter::repeat_n(1u32, count))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_listed_or_lie_where_the_head_says() {
        let arrays = Bytes::from(vec![7u8; 30]);
        let field = |text: &str| serde_json::from_str::<PointsField>(text).unwrap();
        let listed = field("[[1, 2, 3]]").into_message(&arrays, "points").unwrap();
        assert_eq!(listed.xyz_f32le.len(), 12);
        let sliced = field(r#"{"at": 6, "bytes": 24}"#).into_message(&arrays, "points").unwrap();
        assert_eq!(sliced.xyz_f32le, vec![7u8; 24]);
        for (at, bytes) in [(7, 24), (usize::MAX, 1), (31, 0)] {
            let error = Slice { at, bytes }.of(&arrays, "points").unwrap_err();
            assert!(error.message.starts_with("points must lie in the 30 bytes"), "{error}");
        }
        assert!(serde_json::from_str::<PointsField>(r#"{"at": 6}"#).is_err());
        assert!(serde_json::from_str::<PointsField>("[[1, 2]]").is_err());
    }
}
