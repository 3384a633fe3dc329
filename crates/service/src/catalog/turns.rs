//! Whoever makes, replaces or deletes a map waits for its turn, and not for ever.

use super::*;
use crate::map_file::from_file;
use crate::resource_budget::ResourceBudget;
use crate::{Limits, Marks};
use mrol_map::map::MapContents;
use mrol_map::util::StopSignal;
use mrol_map::voxel::VoxelSet;

const MAPS_MAX: usize = 8;

fn named(name: &str) -> Reachable {
    AllowedMaps::Every.check(&MapName::new(name).unwrap()).unwrap()
}

fn built(settings: MapSettings) -> BuiltMap {
    let contents = MapContents::at(0, VoxelSet::default());
    let file = Snapshot { uuid: Uuid::nil(), settings, contents }.encode().unwrap();
    from_file(&file, &Limits::default(), &ResourceBudget::new(None, Marks::default()), StopSignal::NEVER)
        .unwrap()
}

/// What is told within ten times as long as anybody is to wait.
async fn told<T>(waiting: impl Future<Output = Result<T, ServiceError>>) -> Reason {
    let ended = tokio::time::timeout(10 * TURN_MAX, waiting).await.expect("it does not wait for ever");
    ended.map(drop).map_err(|error| error.reason).expect_err("it has no turn")
}

#[tokio::test(start_paused = true)]
async fn who_waits_for_a_turn_that_does_not_come_is_told_so() {
    let progress = OpeningProgress::default();
    let catalog = Catalog::open(None, &StoreSettings::default(), &progress).unwrap();
    let settings = MapSettings::new(0.1, 4);
    catalog.create(named("there"), settings, MAPS_MAX).await.unwrap();
    let turn = catalog.writing.lock().await;
    let busy = Reason::CatalogBusy;
    assert_eq!(told(catalog.create(named("new"), settings, MAPS_MAX)).await, busy);
    assert_eq!(told(catalog.restore(named("new"), built(settings), MAPS_MAX, false)).await, busy);
    assert_eq!(told(catalog.delete(&named("there"))).await, busy);
    // What is there already waits for nobody.
    assert!(!catalog.create(named("there"), settings, MAPS_MAX).await.unwrap().1);
    drop(turn);
    assert!(catalog.create(named("new"), settings, MAPS_MAX).await.unwrap().1);
}
