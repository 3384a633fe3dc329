//! Places that are shared between askers.

use std::collections::HashMap;
use std::sync::Arc;

use parking_lot::Mutex;

use super::asker::Asker;

/// A number of places. An asker may hold at most as many as are left. So the first can take half of them and the next
/// half of the rest, and a late asker still finds a place.
#[derive(Debug)]
pub(crate) struct Shares {
    most: usize,
    taken: Mutex<HashMap<Asker, usize>>,
}

/// A place, until this is dropped.
#[derive(Debug)]
pub(crate) struct Share {
    shares: Arc<Shares>,
    asker: Asker,
}

impl Shares {
    pub(crate) fn new(most: usize) -> Self {
        Self { most, taken: Mutex::default() }
    }

    /// How many places there are.
    pub(crate) fn most(&self) -> usize {
        self.most
    }

    /// A place; none where the asker has as many as are left.
    pub(crate) fn take(self: &Arc<Self>, asker: &Asker) -> Option<Share> {
        let mut taken = self.taken.lock();
        let left = self.most - taken.values().sum::<usize>();
        let own = taken.get(asker).copied().unwrap_or_default();
        if own >= left {
            return None;
        }
        taken.insert(asker.clone(), own + 1);
        Some(Share { shares: Arc::clone(self), asker: asker.clone() })
    }

    #[cfg(test)]
    pub(crate) fn taken(&self) -> usize {
        self.taken.lock().values().sum()
    }
}

impl Drop for Share {
    fn drop(&mut self) {
        let mut taken = self.shares.taken.lock();
        if let Some(own) = taken.get_mut(&self.asker) {
            *own -= 1;
            if *own == 0 {
                taken.remove(&self.asker);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_takes_many_leaves_room_for_who_comes_late() {
        let (shares, [many, few, one]) = (Arc::new(Shares::new(8)), std::array::from_fn(Asker::at));
        let held = |asker| std::iter::from_fn(|| shares.take(asker)).collect::<Vec<_>>();
        let (of_many, of_few, of_one) = (held(&many), held(&few), held(&one));
        assert_eq!((of_many.len(), of_few.len(), of_one.len()), (4, 2, 1));
        drop(of_many);
        assert_eq!(held(&one).len(), 2);
        drop((of_few, of_one));
        assert!(shares.taken.lock().is_empty());
    }
}
