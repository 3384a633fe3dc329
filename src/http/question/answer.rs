//! Answers to questions: a head and arrays, in the form of the question.

use axum::body::Bytes;
use axum::http::header;
use axum::response::{IntoResponse, Response};
use serde::ser::{Error, SerializeMap};
use serde::{Serialize, Serializer};

use super::form::Form;
use crate::admission::off_runtime;
use crate::http::error::HttpError;
use crate::json::JsonVersion;
use mrol_client::wire::pb;
use mrol_map::voxel::VoxelKey;
use mrol_service::{MapService, MapVersion, Reason, ServiceError};

/// An array of an answer, as bytes.
pub(in crate::http) enum Array {
    /// So many bits.
    Bits(Bytes, usize),
    /// Floats of four bytes, one a value. JSON has null in the place of what is not finite.
    Floats(Bytes),
    /// Unsigned integers of four bytes. JSON has null in the place of the largest, which stands for none.
    Numbers(Bytes),
    /// Three floats a value.
    Vectors(Bytes),
    /// Packed keys, of which only those are voxels whose bits are set. JSON has null in the place of others.
    Voxels(Bytes, Bytes),
    /// Numbers of names, of four bytes each. JSON has the names, and null in the place of the largest number.
    Names(Vec<String>, Bytes),
}

/// The arrays of an answer, each with its name.
pub(in crate::http) type Arrays = Vec<(&'static str, Array)>;

/// An answer that is put together.
pub(super) struct Answer<H> {
    /// What is no array.
    pub(super) head: H,
    pub(super) version: MapVersion,
    pub(super) arrays: Arrays,
}

impl Array {
    fn bytes(&self) -> &Bytes {
        match self {
            Self::Bits(bytes, _) | Self::Floats(bytes) | Self::Numbers(bytes) | Self::Vectors(bytes) => bytes,
            Self::Voxels(bytes, _) | Self::Names(_, bytes) => bytes,
        }
    }

    fn names(&self) -> Option<&[String]> {
        match self {
            Self::Names(names, _) => Some(names),
            _ => None,
        }
    }

    /// The keep-outs that elements met, where one did.
    pub(super) fn keep_outs(
        name: &'static str,
        hits: Option<pb::KeepOutHits>,
    ) -> Option<(&'static str, Self)> {
        hits.map(|hits| (name, Self::Names(hits.names, hits.numbers_u32le)))
    }

    /// Voxels of those elements whose bit is set and that met no keep-out.
    pub(super) fn voxels(bytes: Bytes, bits: &Bytes, keep_outs: Option<&pb::KeepOutHits>) -> Self {
        let Some(keep_outs) = keep_outs else { return Self::Voxels(bytes, bits.clone()) };
        let mut of_voxels = bits.to_vec();
        for (i, number) in keep_outs.numbers_u32le.as_chunks().0.iter().enumerate() {
            if let Some(byte) = of_voxels.get_mut(i / 8).filter(|_| u32::from_le_bytes(*number) != u32::MAX) {
                *byte &= !(1 << (i % 8));
            }
        }
        Self::Voxels(bytes, of_voxels.into())
    }
}

impl<H: Serialize + Send + 'static> Answer<H> {
    /// The answer in a form. A large one is written away from the threads that serve connections.
    pub(super) async fn respond(self, form: Form, service: &MapService) -> Result<Response, HttpError> {
        let content_type = match form {
            Form::Json => "application/json",
            Form::Arrays => "application/octet-stream",
        };
        let body = off_runtime(service, self.array_bytes(), (), move || self.written(form)).await??;
        Ok(([(header::CONTENT_TYPE, content_type)], body).into_response())
    }
}

impl<H: Serialize> Answer<H> {
    fn array_bytes(&self) -> usize {
        self.arrays.iter().map(|(_, array)| array.bytes().len()).sum()
    }

    fn written(&self, form: Form) -> Result<Vec<u8>, ServiceError> {
        let head = serde_json::to_vec(&Head { answer: self, form })
            .map_err(|error| ServiceError::new(Reason::NotWritten, error.to_string()))?;
        Ok(match form {
            Form::Json => head,
            Form::Arrays => self.behind(&head),
        })
    }

    /// The length of the head, the head, and the arrays.
    fn behind(&self, head: &[u8]) -> Vec<u8> {
        let length = u32::try_from(head.len()).unwrap_or(u32::MAX).to_le_bytes();
        let mut body = Vec::with_capacity(length.len() + head.len() + self.array_bytes());
        body.extend_from_slice(&length);
        body.extend_from_slice(head);
        self.arrays.iter().for_each(|(_, array)| body.extend_from_slice(array.bytes()));
        body
    }
}

/// Where an array is, and of numbers of names, the names.
#[derive(Serialize)]
struct NamedSlice<'a> {
    at: usize,
    bytes: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    names: Option<&'a [String]>,
}

/// What of an answer is JSON: all of it, or all but its arrays, of which it says where they are.
struct Head<'a, H> {
    answer: &'a Answer<H>,
    form: Form,
}

impl<H: Serialize> Serialize for Head<'_, H> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Answer { head, version, arrays } = self.answer;
        let mut map = serializer.serialize_map(None)?;
        for value in [serde_json::to_value(head), serde_json::to_value(JsonVersion::from(*version))] {
            let value = value.map_err(S::Error::custom)?;
            for (name, value) in value.as_object().into_iter().flatten() {
                map.serialize_entry(name, value)?;
            }
        }
        let mut at = 0;
        for (name, array) in arrays {
            let bytes = array.bytes().len();
            match self.form {
                Form::Json => map.serialize_entry(name, array)?,
                Form::Arrays => map.serialize_entry(name, &NamedSlice { at, bytes, names: array.names() })?,
            }
            at += bytes;
        }
        map.end()
    }
}

impl Serialize for Array {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Bits(bytes, count) => serializer.collect_seq((0..*count).map(|i| bit(bytes, i))),
            Self::Floats(bytes) => serializer.collect_seq(floats(bytes)),
            Self::Numbers(bytes) => serializer.collect_seq(bytes.as_chunks().0.iter().map(|number| {
                let number = u32::from_le_bytes(*number);
                (number != u32::MAX).then_some(number)
            })),
            Self::Names(names, bytes) => serializer.collect_seq(
                bytes.as_chunks().0.iter().map(|number| names.get(u32::from_le_bytes(*number) as usize)),
            ),
            Self::Vectors(bytes) => serializer.collect_seq(bytes.chunks(VECTOR_BYTES).map(|vector| {
                let mut numbers = floats(vector);
                [(); 3].map(|()| numbers.next())
            })),
            Self::Voxels(bytes, set) => serializer.collect_seq(
                bytes.chunks(size_of::<u64>()).enumerate().map(|(i, key)| bit(set, i).then(|| index(key))),
            ),
        }
    }
}

/// Bytes of a vector of three floats.
const VECTOR_BYTES: usize = 3 * size_of::<f32>();

fn bit(bytes: &[u8], i: usize) -> bool {
    bytes.get(i / 8).is_some_and(|byte| byte >> (i % 8) & 1 == 1)
}

fn floats(bytes: &[u8]) -> impl Iterator<Item = f32> + '_ {
    bytes.as_chunks().0.iter().map(|number| f32::from_le_bytes(*number))
}

/// Index of the voxel of a packed key.
pub(crate) fn index(key: &[u8]) -> Option<[i32; 3]> {
    let bits = u64::from_le_bytes(key.try_into().ok()?);
    Some(VoxelKey::from_bits(bits)?.index())
}

#[cfg(test)]
mod tests {
    use super::*;
    use mrol_client::wire::{bitmap_of, bytes_of};
    use serde_json::{Value, json};

    fn answer() -> Answer<Value> {
        let version = MapVersion { revision: 3, map_uuid: uuid::Uuid::nil(), content_hash: None };
        let key = VoxelKey::new([1, -2, 3]).unwrap().to_bits();
        let hit = bitmap_of(vec![1], 2);
        let arrays = vec![
            ("hit", Array::Bits(hit.clone(), 2)),
            ("distances_m", Array::Floats(bytes_of([0.5f32, f32::INFINITY]))),
            ("away", Array::Vectors(bytes_of([1.0f32, 0.0, 0.0, 0.0, 0.0, 0.0]))),
            ("voxels", Array::Voxels(bytes_of([key, 0]), hit)),
        ];
        Answer { head: json!({"rays": 2}), version, arrays }
    }

    #[test]
    fn people_read_lists_with_null_where_there_is_nothing() {
        let of = answer();
        let said = serde_json::to_value(Head { answer: &of, form: Form::Json }).unwrap();
        assert_eq!((&said["rays"], &said["revision"]), (&json!(2), &json!(3)));
        assert_eq!(said["hit"], json!([true, false]));
        assert_eq!(said["distances_m"], json!([0.5, null]));
        assert_eq!(said["away"], json!([[1.0, 0.0, 0.0], [0.0, 0.0, 0.0]]));
        assert_eq!(said["voxels"], json!([[1, -2, 3], null]));
    }

    #[test]
    fn programs_find_the_arrays_where_the_head_says() {
        let of = answer();
        let head = serde_json::to_vec(&Head { answer: &of, form: Form::Arrays }).unwrap();
        let body = of.behind(&head);
        let length = u32::from_le_bytes(body[..4].try_into().unwrap()) as usize;
        let said: Value = serde_json::from_slice(&body[4..4 + length]).unwrap();
        assert_eq!(
            (&said["hit"], &said["voxels"]),
            (&json!({"at": 0, "bytes": 1}), &json!({"at": 33, "bytes": 16}))
        );
        assert_eq!(body.len(), 4 + length + 49);
        assert_eq!(body[4 + length + 1..][..4], 0.5f32.to_le_bytes());
    }
}
