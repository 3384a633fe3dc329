//! The message of a body, written by hand: as generated, a message of some bytes a link would take a hundred for each.

use bytes::{Buf, BufMut};
use prost::encoding::{self, DecodeContext, WireType};
use prost::{DecodeError, Message};

use super::Link;

/// Links of a body at most, whatever `body_parts_max` is.
pub const LINKS_MAX: usize = 65_536;

/// A body: rigid links, each of which has a pose of its own.
///
/// Of one that is read, no more than [`LINKS_MAX`] links are kept and one, by which it is known to have too many.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Body {
    /// The links.
    pub links: Vec<Link>,
}

/// The number of the field `links`.
const LINKS: u32 = 1;

impl Message for Body {
    fn encode_raw(&self, buffer: &mut impl BufMut) {
        encoding::message::encode_repeated(LINKS, &self.links, buffer);
    }

    fn merge_field(
        &mut self,
        tag: u32,
        wire_type: WireType,
        buffer: &mut impl Buf,
        context: DecodeContext,
    ) -> Result<(), DecodeError> {
        if tag == LINKS && self.links.len() <= LINKS_MAX {
            encoding::message::merge_repeated(wire_type, &mut self.links, buffer, context)
        } else {
            encoding::skip_field(wire_type, tag, buffer, context)
        }
    }

    fn encoded_len(&self) -> usize {
        encoding::message::encoded_len_repeated(LINKS, &self.links)
    }

    fn clear(&mut self) {
        self.links.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_body_survives_the_wire() {
        let link = Link { spheres_f32le: vec![1; 16].into(), points: None, padding_m: 0.5 };
        let body = Body { links: vec![Link::default(), link, Link::default()] };
        let bytes = body.encode_to_vec();
        assert_eq!((bytes.len(), &bytes[..3]), (body.encoded_len(), &[10, 0, 10][..]));
        assert_eq!(Body::decode(&*bytes).unwrap(), body);
        // A field of a later version.
        assert_eq!(Body::decode(&[&bytes[..], &[16, 1]].concat()[..]).unwrap(), body);
        assert!(Body::decode(&bytes[..bytes.len() - 1]).is_err());
    }

    #[test]
    fn links_that_are_too_many_take_no_memory() {
        let bytes = [10, 0].repeat(4 * LINKS_MAX);
        let links = Body::decode(&*bytes).unwrap().links;
        assert_eq!(links.len(), LINKS_MAX + 1);
        assert!(links.capacity() <= 2 * LINKS_MAX + 2, "{}", links.capacity());
    }
}
