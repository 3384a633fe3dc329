//! A data folder is taken out of its cluster.

use uuid::Uuid;

use super::contents::DataDirContents;
use super::data_dir::DataDir;
use crate::error::StoreError;
use crate::folder;
use crate::progress::OpeningProgress;
use crate::snapshots::Snapshot;
use mrol_map::map::MapName;

/// A map of a folder that is taken out of its cluster: what it was there, and what it is now.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LeftMap {
    /// Its name, which stays.
    pub name: MapName,
    /// Its revision, which stays.
    pub revision: u64,
    /// Its uuid in the cluster.
    pub before: Uuid,
    /// Its uuid from now on.
    pub now: Uuid,
}

impl DataDir {
    /// Takes the folder out of its cluster for good, and says which node's it was; none where it belongs to no node,
    /// and nothing is done. Every map gets a uuid of its own: from now on its history is another than that of the
    /// cluster. Voxels, revisions, trajectories and keep-outs stay; undo does not reach behind.
    ///
    /// After a crash at any moment each map is there once, under one of the two uuids, and the folder still belongs to
    /// the node: it is to be called again, and gives all maps new uuids. `left` is called with each map.
    ///
    /// # Errors
    /// When a map cannot be opened, or the system refuses. The folder still belongs to the node then.
    pub fn leave_cluster(&self, mut left: impl FnMut(&LeftMap)) -> Result<Option<String>, StoreError> {
        let Some(node) = self.node()? else { return Ok(None) };
        folder::sweep(&*self.files, &self.maps)?;
        let mut interrupted = DataDirContents::default();
        self.end_replacements(&mut interrupted)?;
        if let Some((_, error)) = interrupted.refused.pop() {
            return Err(error);
        }
        for name in self.names()? {
            left(&self.with_new_uuid(name)?);
        }
        // The last step: before it, a server by itself does not open the folder.
        self.forget_node()?;
        Ok(Some(node))
    }

    /// Makes the map of that name another incarnation, in one exchange of folders.
    fn with_new_uuid(&self, name: MapName) -> Result<LeftMap, StoreError> {
        let opened = self.map(&name, &OpeningProgress::default())?;
        let (old, before, now) = (opened.folder.path(), opened.uuid, Uuid::new_v4());
        drop(opened.folder);
        let first = Snapshot::of(&opened.map, now);
        drop(opened.map);
        let kept = folder::unfinished(&old);
        let kept = kept.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let gone = self.replace_folder(&name, &old, kept, &first)?;
        // What is left is swept away at the next start.
        drop(self.files.remove_folder(&gone));
        Ok(LeftMap { name, revision: first.contents.revision, before, now })
    }
}
