//! Which elements of an answer met keep-outs.

use std::collections::{BTreeMap, BTreeSet};

use crate::wire::pb;
use crate::wire::values::{InField, bytes_of, numbers_of};
use mrol_map::map::KeepOutName;
use mrol_service::{Reason, ServiceError};

/// Stands for no keep-out.
const NONE: u32 = u32::MAX;

/// The keep-outs of elements; none where no element has one.
pub(super) fn keep_outs_of<'a>(
    elements: impl Iterator<Item = Option<&'a KeepOutName>> + Clone,
) -> Option<pb::KeepOutHits> {
    let met: BTreeSet<&KeepOutName> = elements.clone().flatten().collect();
    if met.is_empty() {
        return None;
    }
    let numbers: BTreeMap<_, u32> = met.iter().copied().zip(0..).collect();
    let number =
        |name: Option<&KeepOutName>| name.and_then(|name| numbers.get(name)).copied().unwrap_or(NONE);
    Some(pb::KeepOutHits {
        names: met.iter().map(ToString::to_string).collect(),
        numbers_u32le: bytes_of(elements.map(number).collect::<Vec<_>>()),
    })
}

/// The inverse of [`keep_outs_of`]: empty where no element has one.
pub(super) fn keep_outs_from(
    hits: Option<pb::KeepOutHits>,
    elements: usize,
    field: &str,
) -> Result<Vec<Option<KeepOutName>>, ServiceError> {
    let pb::KeepOutHits { names, numbers_u32le } = hits.unwrap_or_default();
    if numbers_u32le.is_empty() {
        return Ok(Vec::new());
    }
    let names = names.iter().map(|name| KeepOutName::new(name)).collect::<Result<Vec<_>, _>>();
    let names = names.in_field(field)?;
    let numbers: Vec<u32> = numbers_of(&numbers_u32le, elements, &format!("{field}.numbers_u32le"))?;
    let named = |number: u32| match names.get(number as usize) {
        _ if number == NONE => Ok(None),
        Some(name) => Ok(Some(name.clone())),
        None => {
            let message = format!("{field}.numbers_u32le must be below {}, got {number}", names.len());
            Err(ServiceError::new(Reason::BadArray, message))
        }
    };
    numbers.into_iter().map(named).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keep_outs_of_elements_survive_the_wire() {
        let name = |text: &str| Some(KeepOutName::new(text).unwrap());
        let met = vec![name("b"), None, name("a"), name("b")];
        let hits = keep_outs_of(met.iter().map(Option::as_ref)).unwrap();
        assert_eq!((hits.names.clone(), hits.numbers_u32le.len()), (vec!["a".into(), "b".into()], 16));
        assert_eq!(keep_outs_from(Some(hits.clone()), 4, "keep_outs").unwrap(), met);
        assert_eq!(keep_outs_of([None, None].into_iter()), None);
        assert_eq!(keep_outs_from(None, 2, "keep_outs").unwrap(), Vec::new());
        let said = |hits, count| keep_outs_from(Some(hits), count, "keep_outs").unwrap_err().to_string();
        assert!(said(hits.clone(), 3).contains("keep_outs.numbers_u32le"));
        let fewer = pb::KeepOutHits { names: vec!["a".into()], ..hits.clone() };
        assert!(said(fewer, 4).contains("keep_outs.numbers_u32le must be below 1, got 1"));
        assert!(said(pb::KeepOutHits { names: vec!["A b".into(); 2], ..hits }, 4).contains("keep_out"));
    }
}
