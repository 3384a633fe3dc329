//! The revision that readers see, with the hash of what it holds.

use std::sync::atomic::Ordering;

use crate::map::content_hash::{ContentHash, ContentVersion};
use crate::sync::AtomicU64;

/// The newest revision of a map and its content hash, which are read together without a lock.
///
/// The hashes of even and odd revisions have a place each: whoever publishes a revision writes where that of the one
/// before last was, so that no reader of the present one reads half of it.
#[derive(Debug)]
pub(in crate::map) struct Published {
    revision: AtomicU64,
    hashes: [AtomicU64; 2],
}

impl Default for Published {
    fn default() -> Self {
        Self { revision: AtomicU64::new(0), hashes: [AtomicU64::new(0), AtomicU64::new(0)] }
    }
}

impl Published {
    pub(in crate::map) fn revision(&self) -> u64 {
        self.revision.load(Ordering::Acquire)
    }

    pub(in crate::map) fn read(&self) -> ContentVersion {
        let mut revision = self.revision();
        loop {
            let hash = self.place(revision).load(Ordering::Acquire);
            // A hash of two revisions later was written after the revision in between was published.
            match self.revision() {
                same if same == revision => {
                    return ContentVersion { revision, hash: ContentHash::from_bits(hash) };
                }
                newer => revision = newer,
            }
        }
    }

    /// To be called by one at a time.
    pub(in crate::map) fn publish(&self, ContentVersion { revision, hash }: ContentVersion) {
        self.place(revision).store(hash.to_bits(), Ordering::Release);
        self.revision.store(revision, Ordering::Release);
    }

    fn place(&self, revision: u64) -> &AtomicU64 {
        &self.hashes[usize::from(revision % 2 == 1)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_revision_is_read_with_its_own_hash() {
        let published = Published::default();
        std::thread::scope(|scope| {
            scope.spawn(|| {
                for revision in 1..=100_000 {
                    let hash = ContentHash::from_bits(revision * 3);
                    published.publish(ContentVersion { revision, hash });
                }
            });
            while published.revision() < 100_000 {
                let read = published.read();
                assert_eq!(read.hash.to_bits(), read.revision * 3);
            }
        });
    }
}
