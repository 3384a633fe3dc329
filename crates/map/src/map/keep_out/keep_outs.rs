//! A keep-out, and all those of a map by name.

use std::collections::BTreeMap;

use super::change::{KeepOutAct, KeepOutChange};
use super::shape::KeepOutShape;
use crate::map::name::{CallerName, KeepOutName};
use crate::util::Digest;

/// Keep-outs that a map may have.
pub const KEEP_OUTS_MAX: usize = 256;

/// A named part of space where no robot may go.
#[derive(Debug, Clone, PartialEq)]
pub struct KeepOut {
    /// Unique in its map.
    pub name: KeepOutName,
    /// The space that it takes.
    pub shape: KeepOutShape,
    /// The name of the key that it was made with; none without a key.
    pub made_by: Option<CallerName>,
    /// The revision that it made.
    pub made_revision: u64,
    /// When the server ends it, nanoseconds since the Unix epoch; never where none.
    pub expires_at_ns: Option<i64>,
}

/// Why there is no place for another keep-out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the map has {0} keep-outs, keep_outs_max is {1}: delete one")]
pub struct KeepOutsFull(usize, usize);

/// The keep-outs of a map, by name.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct KeepOuts {
    all: BTreeMap<KeepOutName, KeepOut>,
    /// The sum of their hashes, modulo 2^64.
    hash: u64,
}

impl KeepOut {
    /// Hash of all that it is: equal for equal ones.
    fn hash(&self) -> u64 {
        let Self { name, shape, made_by, made_revision, expires_at_ns } = self;
        // No caller has an empty name.
        let made_by = made_by.as_ref().map_or("", CallerName::as_str);
        let expiry = expires_at_ns.map_or([0, 0], |at| [1, at.cast_unsigned()]);
        let digest = Digest::default().bytes(name.as_str().as_bytes()).bytes(made_by.as_bytes());
        let digest = digest.word(*made_revision).word(expiry[0]).word(expiry[1]);
        shape.add_to(digest).finish()
    }
}

impl KeepOuts {
    fn of(all: BTreeMap<KeepOutName, KeepOut>) -> Self {
        let hash = all.values().fold(0_u64, |sum, keep_out| sum.wrapping_add(keep_out.hash()));
        Self { all, hash }
    }

    /// Number of keep-outs.
    pub fn len(&self) -> usize {
        self.all.len()
    }

    /// True without a keep-out.
    pub fn is_empty(&self) -> bool {
        self.all.is_empty()
    }

    /// All of them, by name.
    pub fn iter(&self) -> impl Iterator<Item = &KeepOut> {
        self.all.values()
    }

    /// The one of that name.
    pub fn get(&self, name: &KeepOutName) -> Option<&KeepOut> {
        self.all.get(name)
    }

    /// Hash of all of them: equal for equal ones. 0 for none.
    pub fn hash(&self) -> u64 {
        self.hash
    }

    /// Those whose time is up at `now_ns`, nanoseconds since the Unix epoch.
    pub fn expired(&self, now_ns: i64) -> impl Iterator<Item = &KeepOut> {
        self.iter().filter(move |keep_out| keep_out.expires_at_ns.is_some_and(|at| at <= now_ns))
    }

    /// # Errors
    /// When there are `most` keep-outs already, and none of them is called `name`.
    pub fn check_room_for(&self, name: &KeepOutName, most: usize) -> Result<(), KeepOutsFull> {
        match self.len() < most || self.all.contains_key(name) {
            true => Ok(()),
            false => Err(KeepOutsFull(self.len(), most)),
        }
    }

    /// True when the point, meters in the map frame, lies in one of them.
    pub fn contains(&self, point_m: [f64; 3]) -> bool {
        self.iter().any(|keep_out| keep_out.shape.contains(point_m))
    }

    /// These after the change that made `revision`.
    #[must_use]
    pub(in crate::map) fn after(&self, change: &KeepOutChange, revision: u64) -> Self {
        let (name, mut all) = (change.name.clone(), self.all.clone());
        match change.act.clone() {
            KeepOutAct::Put { shape, made_by, expires_at_ns } => {
                let made =
                    KeepOut { name: name.clone(), shape, made_by, made_revision: revision, expires_at_ns };
                all.insert(name, made);
            }
            KeepOutAct::Removed { .. } | KeepOutAct::Expired => drop(all.remove(&name)),
        }
        Self::of(all)
    }
}

impl FromIterator<KeepOut> for KeepOuts {
    /// Of several of one name, the last.
    fn from_iter<I: IntoIterator<Item = KeepOut>>(all: I) -> Self {
        Self::of(all.into_iter().map(|keep_out| (keep_out.name.clone(), keep_out)).collect())
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::map::keep_out::prism::Prism;
    use crate::map::regions::Region;

    fn name(text: &str) -> KeepOutName {
        KeepOutName::new(text).unwrap()
    }

    fn put(text: &str, radius_m: f64, expires_at_ns: Option<i64>) -> KeepOutChange {
        let shape = KeepOutShape::of_region(Region::ball([0.0; 3], radius_m).unwrap()).unwrap();
        KeepOutChange { name: name(text), act: KeepOutAct::Put { shape, made_by: None, expires_at_ns } }
    }

    #[test]
    fn a_keep_out_that_is_put_again_is_replaced_and_one_that_ended_is_gone() {
        let all = KeepOuts::default().after(&put("a", 1.0, None), 1).after(&put("b", 3.0, None), 2);
        assert!(all.contains([2.0, 0.0, 0.0]) && !all.contains([4.0, 0.0, 0.0]));
        let all = all.after(&put("b", 1.5, None), 3);
        assert_eq!((all.len(), all.get(&name("b")).unwrap().made_revision), (2, 3));
        assert!(!all.contains([2.0, 0.0, 0.0]));
        let gone = |act| all.after(&KeepOutChange { name: name("b"), act }, 4);
        assert_eq!(gone(KeepOutAct::Expired), gone(KeepOutAct::Removed { by: None }));
        assert_eq!(gone(KeepOutAct::Expired).iter().map(|it| it.name.as_str()).collect::<Vec<_>>(), ["a"]);
    }

    #[test]
    fn equal_keep_outs_have_equal_hashes_and_whatever_differs_counts() {
        let all = KeepOuts::default().after(&put("a", 1.0, None), 1).after(&put("b", 2.0, Some(5)), 2);
        let again: KeepOuts = all.iter().cloned().collect();
        assert_eq!((again.hash(), KeepOuts::default().hash()), (all.hash(), 0));
        let gone = all.after(&KeepOutChange { name: name("b"), act: KeepOutAct::Expired }, 3);
        assert_eq!(gone.hash(), KeepOuts::default().after(&put("a", 1.0, None), 1).hash());
        let prism = |z_to_m| {
            let prism = Prism::new(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], [0.0, z_to_m]).unwrap();
            let shape = KeepOutShape::Prism(prism);
            KeepOutChange {
                name: name("b"),
                act: KeepOutAct::Put { shape, made_by: None, expires_at_ns: None },
            }
        };
        let by = CallerName::new("k").unwrap();
        let ball = KeepOutShape::of_region(Region::ball([0.0; 3], 2.0).unwrap()).unwrap();
        let act = KeepOutAct::Put { shape: ball, made_by: Some(by), expires_at_ns: Some(5) };
        let first = KeepOuts::default().after(&put("a", 1.0, None), 1);
        let hashes: BTreeSet<u64> = [
            all.hash(),
            first.hash(),
            first.after(&put("b", 2.0, Some(5)), 3).hash(),
            first.after(&put("b", 2.0, Some(6)), 2).hash(),
            first.after(&put("b", 2.0, None), 2).hash(),
            first.after(&put("b", 2.5, Some(5)), 2).hash(),
            first.after(&put("c", 2.0, Some(5)), 2).hash(),
            first.after(&prism(1.0), 2).hash(),
            first.after(&prism(1.5), 2).hash(),
            first.after(&KeepOutChange { name: name("b"), act }, 2).hash(),
        ]
        .into();
        assert_eq!(hashes.len(), 10);
    }

    #[test]
    fn its_time_is_up_from_the_moment_itself_on() {
        let all = KeepOuts::default().after(&put("a", 1.0, Some(5)), 1).after(&put("b", 1.0, None), 2);
        assert_eq!([4, 5, 6].map(|now| all.expired(now).count()), [0, 1, 1]);
    }

    #[test]
    fn one_more_than_there_may_be_is_refused_and_one_that_is_there_may_be_replaced() {
        let all = KeepOuts::default().after(&put("a", 1.0, None), 1).after(&put("b", 1.0, None), 2);
        assert!(all.check_room_for(&name("c"), 3).is_ok() && all.check_room_for(&name("b"), 2).is_ok());
        let full = all.check_room_for(&name("c"), 2).unwrap_err().to_string();
        assert_eq!(full, "the map has 2 keep-outs, keep_outs_max is 2: delete one");
    }
}
