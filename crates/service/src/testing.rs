//! Changes that tests make, whatever a request would have made of them.

use std::sync::Arc;

use super::commit::{Decided, Submission};
use super::map_service::MapService;
use super::work::{Asker, Requester};
use mrol_map::map::{Change, MapName, MultiResolutionMap};

impl MapService {
    /// Makes a change; its revision, once it is durable and visible.
    ///
    /// # Panics
    /// When there is no such map, or the change fails.
    pub async fn make_change(&self, map: &MapName, change: Change) -> u64 {
        let map = self.map(map).await.expect("a map of that name");
        let decided = Decided { change, record: None, reserved: Vec::new(), pin: None };
        let submission = Submission::Undecided(Box::new(|_, _| Ok(Some(decided))));
        let outcome = map
            .commit_queue
            .submit(&Requester::from(&Asker::default()), submission)
            .expect("room in the queue")
            .await;
        outcome.expect("an outcome").expect("a change").revision
    }

    /// The map itself.
    ///
    /// # Panics
    /// When there is none of that name.
    pub fn map_itself(&self, map: &MapName) -> Arc<MultiResolutionMap> {
        let awake = self.inner.catalog.all().into_iter().find(|awake| awake.name == *map);
        Arc::clone(&awake.expect("a map of that name").map)
    }
}
