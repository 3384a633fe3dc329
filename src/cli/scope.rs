//! What planners' questions have in common.

use mrol_service::QuestionScope;

/// Options of every question.
#[derive(Debug, clap::Args)]
pub(super) struct ScopeOptions {
    /// Level to ask: 0 is the finest
    #[arg(long, default_value_t = 0)]
    level: u32,
    /// Wait until the map has this revision
    #[arg(long, value_name = "REVISION")]
    min_revision: Option<u64>,
    /// Regard no keep-outs, which count as voxels do otherwise
    #[arg(long)]
    ignore_keep_outs: bool,
}

impl ScopeOptions {
    pub(super) fn scope(&self) -> QuestionScope {
        let Self { level, min_revision, ignore_keep_outs } = *self;
        QuestionScope { level, min_revision, map_uuid: None, ignore_keep_outs }
    }
}
