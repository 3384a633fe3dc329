//! Counts the elements of lists in the bytes of a message.

use prost::encoding::{DecodeContext, WireType, decode_key, decode_varint, skip_field};

use super::too_many::TooMany;

/// A message that has lists of which the elements are counted, or messages with such lists.
#[derive(Debug)]
struct Elements {
    /// With its package.
    message: &'static str,
    fields: &'static [Field],
}

/// A list of which the elements are counted, or a message that has one; or both.
#[derive(Debug)]
struct Field {
    number: u32,
    name: &'static str,
    is_counted: bool,
    /// The message of this table that it is, or that its elements are; empty where there is none.
    of: &'static str,
}

/// All of them, as `build.rs` finds them in the contract; by name.
static TABLE: &[Elements] = include!(concat!(env!("OUT_DIR"), "/elements.rs"));

/// Refuses a message, whose type is `name`, that has a list of more elements than `elements_max` says of the field; all
/// lists of a field count together, since a message may have them in parts. What cannot be read is left to the decoder:
/// it comes as far as this and no further.
pub(super) fn check(name: &str, bytes: &[u8], elements_max: impl Fn(&str) -> usize) -> Result<(), TooMany> {
    match Elements::of(name) {
        Some(elements) => Counts { of: Vec::new(), elements_max }.add(elements, bytes),
        None => Ok(()),
    }
}

impl Elements {
    fn of(message: &str) -> Option<&'static Self> {
        TABLE.binary_search_by(|elements| elements.message.cmp(message)).ok().map(|at| &TABLE[at])
    }
}

/// How many elements there were so far.
struct Counts<F> {
    /// Of each field that had some.
    of: Vec<(&'static Field, usize)>,
    elements_max: F,
}

impl<F: Fn(&str) -> usize> Counts<F> {
    /// Adds those of a message.
    fn add(&mut self, elements: &Elements, mut bytes: &[u8]) -> Result<(), TooMany> {
        while let Ok((number, wire_type)) = decode_key(&mut bytes) {
            let field = elements.fields.iter().find(|field| field.number == number);
            let Some(field) = field.filter(|_| wire_type == WireType::LengthDelimited) else {
                match skip_field(wire_type, number, &mut bytes, DecodeContext::default()) {
                    Ok(()) => continue,
                    Err(_) => break,
                }
            };
            let length = decode_varint(&mut bytes).ok().and_then(|length| usize::try_from(length).ok());
            let Some((value, rest)) = length.and_then(|length| bytes.split_at_checked(length)) else { break };
            bytes = rest;
            if field.is_counted {
                self.count(field)?;
            }
            if let Some(inner) = Some(field.of).filter(|of| !of.is_empty()).and_then(Elements::of) {
                self.add(inner, value).map_err(|TooMany { field: path, most }| TooMany {
                    field: format!("{}.{path}", field.name),
                    most,
                })?;
            }
        }
        Ok(())
    }

    fn count(&mut self, field: &'static Field) -> Result<(), TooMany> {
        let known = self.of.iter().position(|(known, _)| std::ptr::eq(*known, field));
        let at = known.unwrap_or_else(|| {
            self.of.push((field, 0));
            self.of.len() - 1
        });
        let most = (self.elements_max)(field.name);
        self.of[at].1 += 1;
        if self.of[at].1 <= most { Ok(()) } else { Err(TooMany { field: field.name.into(), most }) }
    }
}
