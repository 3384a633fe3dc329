//! A map takes the place of another, which is kept under a name of its own.

use std::sync::Arc;

use uuid::Uuid;

use super::catalog::{Catalog, blocking};
use super::hosted_map::HostedMap;
use super::opening::not_stored;
use crate::error::{Reason, ServiceError};
use mrol_map::map::{MapName, MultiResolutionMap, NAME_LENGTH_MAX};
use mrol_store::{DataDir, Snapshot};

impl Catalog {
    /// Puts another map in the place of `old`, which gets a name of its own; the caller holds `writing`.
    pub(super) async fn replace(
        &self,
        old: Arc<HostedMap>,
        uuid: Uuid,
        build: impl FnOnce() -> Result<MultiResolutionMap, ServiceError> + Send + 'static,
    ) -> Result<Arc<HostedMap>, ServiceError> {
        // A newer copy of the same map may take the place of this node's.
        if uuid != old.uuid {
            old.check_not_shared()?;
        }
        let (data_dir, name, settings) = (self.data_dir.clone(), old.name.clone(), self.settings.clone());
        let threads = Arc::clone(&self.commit_threads);
        let taken: Vec<MapName> = self.maps.read().taken().cloned().collect();
        let exchanged = blocking(move || {
            let map = build()?;
            // Its revision, and so its new name, is known from now on.
            old.commit_queue.end_replaced();
            let synced = old.folder.as_ref().map_or(Ok(()), |folder| folder.sync()).map_err(not_stored);
            let kept = name_of_replaced(&old.name, old.map.revision(), &taken);
            let exchange = || {
                let kept = synced.and(kept)?;
                let replace = |data_dir: Arc<DataDir>| match &old.folder {
                    Some(folder) => {
                        let first = Snapshot::of(&map, uuid);
                        data_dir.replace(&old.name, folder, &kept, &first).map(Some).map_err(not_stored)
                    }
                    None => Ok(None),
                };
                data_dir.map_or(Ok(None), replace).map(|folder| (kept, folder))
            };
            match exchange() {
                Ok((kept, folder)) => {
                    let kept = old.again_as(&threads, kept, &settings);
                    let new = HostedMap::new(&threads, old.name.clone(), uuid, map, folder, &settings);
                    Ok((Arc::new(new), Arc::new(kept), None))
                }
                Err(error) => {
                    let old = Arc::new(old.again_as(&threads, old.name.clone(), &settings));
                    Ok((Arc::clone(&old), old, Some(error)))
                }
            }
        });
        let (there, kept, error): (Arc<HostedMap>, Arc<HostedMap>, Option<ServiceError>) = exchanged.await?;
        let mut maps = self.maps.write();
        self.serve(&mut maps, &kept);
        self.serve(&mut maps, &there);
        drop(maps);
        if let Some(error) = error {
            return Err(error);
        }
        tracing::info!(map = %name, kept = %kept.name, "replaced");
        Ok(there)
    }
}

/// The name that a map gets whose name another takes: `NAME-replaced-REVISION`, cut to fit.
fn name_of_replaced(name: &MapName, revision: u64, taken: &[MapName]) -> Result<MapName, ServiceError> {
    let candidate = |again: u32| {
        let again = if again == 1 { String::new() } else { format!("-{again}") };
        let end = format!("-replaced-{revision}{again}");
        let start: String = name.as_str().chars().take(NAME_LENGTH_MAX - end.len()).collect();
        MapName::new(&format!("{start}{end}"))
    };
    let mut names = (1..=taken.len() as u32 + 1).map(candidate);
    let free = names.find(|name| name.as_ref().map_or(true, |name| !taken.contains(name)));
    let none = || ServiceError::new(Reason::MapExists, format!("no name is free for {name}"));
    Ok(free.ok_or_else(none)??)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_name_of_a_replaced_map_fits_and_is_free() {
        let name = |text: &str| MapName::new(text).unwrap();
        let office = name("office");
        let first = name_of_replaced(&office, 41, std::slice::from_ref(&office)).unwrap();
        assert_eq!(first, name("office-replaced-41"));
        let second = name_of_replaced(&office, 41, &[office.clone(), first]).unwrap();
        assert_eq!(second, name("office-replaced-41-2"));
        let long = name(&"a".repeat(NAME_LENGTH_MAX));
        let cut = name_of_replaced(&long, 1 << 53, &[]).unwrap();
        assert_eq!(cut.as_str().len(), NAME_LENGTH_MAX);
        assert!(cut.as_str().ends_with("a-replaced-9007199254740992"), "{cut:?}");
    }
}
