//! What a service is opened with.

use std::path::PathBuf;

use super::Limits;
use crate::align::AlignmentSettings;
use crate::bloom::FilterSettings;
use crate::store::StoreSettings;

/// Settings of a [`super::MapService`].
#[derive(Debug, Clone, Default)]
pub struct ServiceSettings {
    /// Where maps are kept across restarts; nowhere without.
    pub data_dir: Option<PathBuf>,
    /// How they are kept there.
    pub store: StoreSettings,
    /// Bounds on what callers may ask.
    pub limits: Limits,
    /// Threads for queries; 0 = one a core.
    pub query_threads: usize,
    /// Threads for alignments and changes; 0 = one a core.
    pub mapping_threads: usize,
    /// Of every alignment.
    pub alignment: AlignmentSettings,
    /// Of maps whose makers do not say.
    pub filter: FilterSettings,
}
