//! Which node of a cluster a data folder belongs to.

use std::path::PathBuf;

use super::data_dir::DataDir;
use crate::error::StoreError;
use crate::folder;

/// Name of the file, in the data folder.
const FILE: &str = "node";

impl DataDir {
    /// The node of a cluster that the folder belongs to; none of a server by itself. Its maps go on by the logs of the
    /// cluster: a server that changed them by itself would give them another history. Empty where a cluster has adopted
    /// maps of the folder, and no node has opened it since.
    ///
    /// # Errors
    /// When the folder or the file cannot be read.
    pub fn node(&self) -> Result<Option<String>, StoreError> {
        let path = self.node_mark();
        let names = self.files.list(folder::folder_of(&path)).map_err(StoreError::io(&path))?;
        if !names.iter().any(|name| name == FILE) {
            return Ok(None);
        }
        let bytes = self.files.read(&path).map_err(StoreError::io(&path))?;
        Ok(Some(String::from_utf8_lossy(&bytes).trim().to_owned()))
    }

    /// From now on the folder belongs to a node.
    ///
    /// # Errors
    /// When the system refuses.
    pub fn set_node(&self, node: &str) -> Result<(), StoreError> {
        folder::replace(&*self.files, &self.node_mark(), format!("{node}\n").as_bytes())
    }

    /// From now on the folder belongs to whichever node opens it first: a cluster adopts maps of it.
    ///
    /// # Errors
    /// When the system refuses.
    pub fn set_adopted(&self) -> Result<(), StoreError> {
        self.set_node("")
    }

    /// From now on the folder belongs to a server by itself; it belonged to a node.
    ///
    /// # Errors
    /// When the system refuses.
    pub(super) fn forget_node(&self) -> Result<(), StoreError> {
        let path = self.node_mark();
        let removed = self.files.remove(&path).and_then(|()| self.files.sync(folder::folder_of(&path)));
        removed.map_err(StoreError::io(path))
    }

    fn node_mark(&self) -> PathBuf {
        folder::folder_of(&self.maps).join(FILE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::StoreSettings;

    #[test]
    fn a_folder_belongs_to_a_node_until_that_leaves() {
        let folder = tempfile::tempdir().unwrap();
        let open = || DataDir::open(folder.path(), StoreSettings::default()).unwrap();
        assert_eq!(open().node().unwrap(), None);
        open().set_adopted().unwrap();
        assert_eq!(open().node().unwrap().as_deref(), Some(""));
        open().set_node("n1").unwrap();
        assert_eq!(open().node().unwrap().as_deref(), Some("n1"));
        open().forget_node().unwrap();
        assert_eq!(open().node().unwrap(), None);
    }
}
