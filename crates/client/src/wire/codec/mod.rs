//! How messages are written and read: as prost does, of lists no longer than they may be.
//!
//! An element of a list may take no more than two bytes on the wire, and a hundred and more once it is decoded. So the
//! elements of all lists are counted first, in the bytes: of a message that has too many nothing is made. Numbers are not
//! counted, as they take in memory what they take on the wire.

mod elements;
mod most;
#[cfg(test)]
mod tests;

pub use most::{IGNORED_MAX, LINKS_MAX};

use std::marker::PhantomData;

use bytes::Buf;
use prost::{Message, Name};
use tonic::Status;
use tonic::codec::{Codec as TonicCodec, DecodeBuf, Decoder};
use tonic_prost::ProstCodec;

use mrol_service::{Reason, ServiceError};

/// Writes messages `T` and reads messages `U`: the generated clients and servers name it.
#[derive(Debug)]
pub struct Codec<T, U>(PhantomData<(T, U)>);

impl<T, U> Default for Codec<T, U> {
    fn default() -> Self {
        Self(PhantomData)
    }
}

impl<T, U> TonicCodec for Codec<T, U>
where
    T: Message + 'static,
    U: Message + Name + Default + 'static,
{
    type Encode = T;
    type Decode = U;
    type Encoder = <ProstCodec<T, U> as TonicCodec>::Encoder;
    type Decoder = BoundedDecoder<U>;

    fn encoder(&mut self) -> Self::Encoder {
        ProstCodec::<T, U>::default().encoder()
    }

    fn decoder(&mut self) -> Self::Decoder {
        BoundedDecoder(PhantomData)
    }
}

/// Reads messages that have no list of more elements than may be.
#[derive(Debug)]
pub struct BoundedDecoder<U>(PhantomData<U>);

impl<U: Message + Name + Default> Decoder for BoundedDecoder<U> {
    type Item = U;
    type Error = Status;

    fn decode(&mut self, buffer: &mut DecodeBuf<'_>) -> Result<Option<U>, Status> {
        // Shares the memory of the buffer, as the arrays of the message do then.
        let bytes = buffer.copy_to_bytes(buffer.remaining());
        elements::check(&U::full_name(), &bytes, most::elements_max)?;
        U::decode(bytes).map(Some).map_err(|error| Status::internal(error.to_string()))
    }
}

/// A list has more elements than it may.
#[derive(Debug, PartialEq, Eq)]
struct TooMany {
    /// From the message on, with dots.
    field: String,
    most: usize,
}

impl From<TooMany> for Status {
    fn from(TooMany { field, most }: TooMany) -> Self {
        let message = format!("{field} has more than {most} entries in one message");
        crate::wire::status_of(ServiceError::new(Reason::BatchTooLarge, message))
    }
}
