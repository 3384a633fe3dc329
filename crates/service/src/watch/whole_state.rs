//! How the whole of what a map holds is found out.

use std::sync::Arc;

use crate::error::ServiceError;
use crate::maps::{FullState, HostedMap};
use crate::request::{BlockBytes, WatchForm};
use crate::resources::ResourceBudget;
use crate::work::check_not_stopped;
use mrol_map::util::StopSignal;

/// Name under which the memory is reserved, for refusals.
const WATCH: &str = "a watch";
/// Bytes of memory of a block.
pub(crate) const BLOCK_BYTES: usize = BlockBytes::OF_BLOCK;

impl HostedMap {
    /// What the map holds: as it is, or as it was shortly before where that is at hand and can be followed from. Those
    /// who watch a region share it with those who watch everything.
    pub(crate) fn whole_state(
        &self,
        form: WatchForm,
        budget: &ResourceBudget,
        stop: StopSignal<'_>,
    ) -> Result<Arc<FullState>, ServiceError> {
        let (key, level) = match form {
            WatchForm::Changes => (None, 0),
            WatchForm::Deltas { level } => (Some(level), level),
        };
        if let Some(known) = self
            .followers
            .whole_states
            .get(key)
            .filter(|state| self.followers.recent.can_follow(state.version.revision, form))
        {
            return Ok(known);
        }
        let long_read = self.map.long_read();
        let view = long_read.view().with_keep_outs().with_viewpoints();
        let stored: usize = view.lists(level).map(|list| list.blocks().len()).sum();
        // Lent while it is made; then it lies in memory, and is measured there.
        let _reserved = budget.reserve_transient((stored * BLOCK_BYTES) as u64, WATCH)?;
        let (parts, version) = (view.level_blocks(level, stop), view.version());
        let keep_outs = view.keep_outs().cloned().unwrap_or_default();
        let viewpoints = view.viewpoints().cloned().unwrap_or_default();
        drop(view);
        drop(long_read);
        // All of it is of one revision: the copy alone is made under the locks.
        let voxels = parts.joined(stop);
        check_not_stopped(stop)?;
        let state = Arc::new(FullState { version, level, voxels, keep_outs, viewpoints });
        self.followers.whole_states.put(key, &state);
        Ok(state)
    }
}

#[cfg(test)]
mod tests {
    use crate::map_service::MapService;
    use crate::request::{ScanRequest, WatchEvent, WatchRequest};
    use crate::settings::ServiceSettings;
    use mrol_map::geometry::{Point, Pose};
    use mrol_map::map::{MapName, MapSettings, Region, RobotName};
    use mrol_map::mapping::Guess;
    use mrol_store::OpeningProgress;

    const WATCHERS: u32 = 20;

    /// Each had a copy of its region's voxels once: some dozens that read nothing held gigabytes.
    #[tokio::test(flavor = "multi_thread")]
    async fn all_who_are_told_of_a_state_hold_one_between_them_whatever_regions_they_watch() {
        let service = MapService::open(ServiceSettings::default(), &OpeningProgress::default()).unwrap();
        let map = MapName::new("a").unwrap();
        service.create_map(map.clone(), MapSettings::new(0.1, 4)).await.unwrap();
        let points: Vec<_> = (0..1000).map(|x| Point::new(x as f32 + 0.05, 0.05, 0.05)).collect();
        let scan = ScanRequest {
            guess: Guess::Pose(Pose::identity()),
            at_guess: true,
            ..ScanRequest::new(RobotName::new("r").unwrap(), points.into())
        };
        service.insert_scan(&map, scan).await.unwrap();

        let mut watches = Vec::new();
        for n in 0..WATCHERS {
            let region = Region::cuboid([0.0; 3], [f64::from(1 + n), 1.0, 1.0]).unwrap();
            let region = (n > 0).then_some(region);
            let request = WatchRequest { region, ..WatchRequest::default() };
            let mut watch = service.watch(&map, request).await.unwrap();
            let told = watch.next().await.unwrap().event;
            assert!(matches!(&told, WatchEvent::State(part) if !part.voxels.is_empty()), "{told:?}");
            watches.push(watch);
        }
        let hosted = service.map(&map).await.unwrap();
        let state = hosted.followers.whole_states.get(None).expect("it is being told");
        assert_eq!(std::sync::Arc::strong_count(&state), WATCHERS as usize + 1);
        drop(watches);
        assert_eq!(std::sync::Arc::strong_count(&state), 1);
    }
}
