//! A sorted list in pieces that copies share.

use std::sync::Arc;

/// Items of one piece, at most: a change copies this many where somebody holds a copy of the list.
const CHUNK: usize = 256;

/// What an item is found by.
pub(super) trait Keyed: Clone {
    /// Unlike that of any other item of its list.
    fn key(&self) -> u64;
}

impl Keyed for u64 {
    fn key(&self) -> u64 {
        *self
    }
}

/// A value under its key.
impl Keyed for (u64, u64) {
    fn key(&self) -> u64 {
        self.0
    }
}

/// Items in ascending order of their keys. A clone takes no time, shares all pieces, and stays as it is when the
/// original changes, which then copies the pieces that it changes, and no others.
#[derive(Debug, Clone)]
pub(super) struct Chunked<T> {
    /// The chunks, none of them empty.
    chunks: Arc<Vec<Arc<Vec<T>>>>,
    len: usize,
}

impl<T> Default for Chunked<T> {
    fn default() -> Self {
        Self { chunks: Arc::default(), len: 0 }
    }
}

impl<T: Keyed> Chunked<T> {
    pub(super) fn len(&self) -> usize {
        self.len
    }

    pub(super) fn is_empty(&self) -> bool {
        self.len == 0
    }

    pub(super) fn get(&self, key: u64) -> Option<&T> {
        let (chunk, place) = self.place_of(key);
        self.chunks.get(chunk)?.get(place).filter(|item| item.key() == key)
    }

    /// All items, ascending.
    pub(super) fn iter(&self) -> impl DoubleEndedIterator<Item = &T> {
        self.chunks.iter().flat_map(|chunk| chunk.iter())
    }

    /// The items of `key` and above, ascending.
    pub(super) fn from(&self, key: u64) -> impl DoubleEndedIterator<Item = &T> {
        let (chunk, place) = self.place_of(key);
        let begun = self.chunks.get(chunk).map_or(&[][..], |chunk| &chunk[place..]);
        let rest = self.chunks.get(chunk + 1..).unwrap_or_default();
        begun.iter().chain(rest.iter().flat_map(|chunk| chunk.iter()))
    }

    /// Puts an item in its place; the one that had its key before goes.
    pub(super) fn insert(&mut self, item: T) -> Option<T> {
        let (at, place) = self.place_of(item.key());
        let chunks = Arc::make_mut(&mut self.chunks);
        if at == chunks.len() {
            append(chunks, item);
        } else {
            let chunk = Arc::make_mut(&mut chunks[at]);
            if chunk[place].key() == item.key() {
                return Some(std::mem::replace(&mut chunk[place], item));
            }
            chunk.insert(place, item);
            if chunk.len() > CHUNK {
                let upper = chunk.split_off(CHUNK / 2);
                chunk.shrink_to_fit();
                chunks.insert(at + 1, Arc::new(upper));
            }
        }
        self.len += 1;
        None
    }

    /// Takes the items of `keys` out, which ascend, and joins small pieces. Keys of no item are passed over.
    pub(super) fn remove_all(&mut self, keys: &[u64]) {
        debug_assert!(keys.is_sorted(), "keys must ascend");
        let chunks = Arc::make_mut(&mut self.chunks);
        let mut rest = keys;
        let mut joined: Vec<Arc<Vec<T>>> = Vec::with_capacity(chunks.len());
        for mut chunk in chunks.drain(..) {
            let last = chunk.last().map_or(0, Keyed::key);
            let (here, later) = rest.split_at(rest.partition_point(|key| *key <= last));
            rest = later;
            let goes = |item: &T| here.binary_search(&item.key()).is_ok();
            if !here.is_empty() && chunk.iter().any(goes) {
                chunk = Arc::new(chunk.iter().filter(|item| !goes(item)).cloned().collect());
            }
            match joined.last_mut() {
                _ if chunk.is_empty() => {}
                Some(last) if last.len() + chunk.len() <= CHUNK => {
                    let last = Arc::make_mut(last);
                    last.reserve_exact(chunk.len());
                    last.extend(chunk.iter().cloned());
                }
                _ => joined.push(chunk),
            }
        }
        joined.shrink_to_fit();
        self.len = joined.iter().map(|chunk| chunk.len()).sum();
        *chunks = joined;
    }

    /// Bytes of memory, but for what the items themselves point to.
    pub(super) fn bytes(&self) -> usize {
        let of_chunk = size_of::<Arc<Vec<T>>>() + size_of::<Vec<T>>() + 2 * size_of::<usize>();
        let items: usize = self.chunks.iter().map(|chunk| chunk.capacity()).sum();
        self.chunks.capacity() * of_chunk + items * size_of::<T>()
    }

    /// Where the first item of `key` or above is: its piece, and its place in there.
    fn place_of(&self, key: u64) -> (usize, usize) {
        let below = |item: &T| item.key() < key;
        let chunk = self.chunks.partition_point(|chunk| chunk.last().is_some_and(below));
        (chunk, self.chunks.get(chunk).map_or(0, |chunk| chunk.partition_point(below)))
    }
}

/// Behind all others, where the last piece is filled before another is begun.
fn append<T: Clone>(chunks: &mut Vec<Arc<Vec<T>>>, item: T) {
    match chunks.last_mut().filter(|last| last.len() < CHUNK) {
        Some(last) => {
            let last = Arc::make_mut(last);
            if last.len() == last.capacity() {
                last.reserve_exact(last.len().min(CHUNK - last.len()));
            }
            last.push(item);
        }
        None => chunks.push(Arc::new(vec![item])),
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use proptest::prelude::*;

    #[derive(Debug, Clone)]
    enum Step {
        Append(u64),
        Insert(u64),
        Remove(Vec<u64>),
    }

    fn step() -> impl Strategy<Value = Step> {
        prop_oneof![
            6 => (1..600u64).prop_map(Step::Append),
            2 => (0..3000u64).prop_map(Step::Insert),
            1 => prop::collection::vec(0..3000u64, 0..400).prop_map(Step::Remove),
        ]
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 32, ..ProptestConfig::default() })]
        #[test]
        fn a_chunked_list_is_a_sorted_map_and_copies_of_it_stay(steps in prop::collection::vec(step(), 1..16)) {
            let (mut list, mut model) = (Chunked::<(u64, u64)>::default(), BTreeMap::new());
            let mut next = 0;
            for step in steps {
                let (copy, before) = (list.clone(), model.clone());
                match step {
                    Step::Append(count) => for _ in 0..count {
                        prop_assert_eq!(list.insert((next, 1)), model.insert(next, 1).map(|value| (next, value)));
                        next += 2;
                    },
                    Step::Insert(key) => {
                        let replaced = model.insert(key, 2);
                        prop_assert_eq!(list.insert((key, 2)), replaced.map(|value| (key, value)));
                        next = next.max(key + 1);
                    }
                    Step::Remove(mut keys) => {
                        keys.sort_unstable();
                        list.remove_all(&keys);
                        model.retain(|key, _| keys.binary_search(key).is_err());
                    }
                }
                let items = |list: &Chunked<(u64, u64)>| list.iter().copied().collect::<Vec<_>>();
                prop_assert_eq!(items(&list), model.clone().into_iter().collect::<Vec<_>>());
                prop_assert_eq!(items(&copy), before.into_iter().collect::<Vec<_>>());
                prop_assert_eq!(list.len(), model.len());
                prop_assert!(list.chunks.iter().all(|chunk| (1..=CHUNK).contains(&chunk.len())));
                prop_assert!(list.chunks.iter().all(|chunk| chunk.capacity() <= 2 * CHUNK));
                for key in [0, 1, 255, 256, 257, 1000, next] {
                    prop_assert_eq!(list.get(key).map(|item| item.1), model.get(&key).copied());
                    let from: Vec<_> = list.from(key).copied().collect();
                    prop_assert_eq!(from, model.range(key..).map(|(k, v)| (*k, *v)).collect::<Vec<_>>());
                    let last = model.range(key..).next_back().map(|(k, v)| (*k, *v));
                    prop_assert_eq!(list.from(key).next_back().copied(), last);
                }
            }
        }
    }
}
