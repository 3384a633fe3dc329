//! What uploads that were cut short leave behind.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use serde::de::IgnoredAny;
use serde::{Deserialize, Serialize};

use super::error::BaseError;
use super::store::{BaseStore, NAME};

/// How long each question may take.
const WITHIN: Duration = Duration::from_secs(5);

/// Files that are described at once: NATS gives no more. A map has two bases at most.
const FILES_MAX: usize = 1_024;

/// Pieces that belong to no file: subject, and how many.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Orphans(BTreeMap<String, u64>);

impl Orphans {
    /// How many pieces there are.
    pub fn pieces(&self) -> u64 {
        self.0.values().sum()
    }
}

impl BaseStore {
    /// Deletes pieces that belong to no file now, did not `before`, and have not become more since: of uploads that
    /// were cut short. Says what belongs to no file still. To be called minutes apart, with what the last call said.
    ///
    /// # Errors
    /// Nobody answered, or a file that was just put is not described on all servers yet.
    pub fn sweep(&self, before: &Orphans) -> Result<Orphans, BaseError> {
        let engine = &self.engine;
        engine.block_on(async {
            let described = self.described().await?;
            let (descriptions, pieces) = self.subjects().await?;
            if descriptions != described.len() {
                return Err(BaseError::Unavailable(format!("object store {NAME}: a server lags")));
            }
            let piece_of = |nuid: &String| format!("$O.{NAME}.C.{nuid}");
            let whole: BTreeSet<_> = described.iter().flatten().map(piece_of).collect();
            let mut orphans: BTreeMap<_, _> =
                pieces.into_iter().filter(|(subject, _)| !whole.contains(subject)).collect();
            let is_left = |(subject, count): &(&String, &u64)| before.0.get(*subject) == Some(*count);
            let left: Vec<_> = orphans.iter().filter(is_left).map(|(subject, _)| subject.clone()).collect();
            for subject in left {
                self.purge(&subject).await?;
                orphans.remove(&subject);
            }
            Ok(Orphans(orphans))
        })
    }

    /// The files as one server describes them: what their pieces are called, or nothing of one that was deleted.
    async fn described(&self) -> Result<Vec<Option<String>>, BaseError> {
        #[derive(Serialize)]
        struct Question {
            multi_last: [String; 1],
            batch: usize,
        }
        #[derive(Deserialize)]
        struct Description {
            nuid: String,
            #[serde(default)]
            deleted: bool,
        }
        let question = Question { multi_last: [format!("$O.{NAME}.M.>")], batch: FILES_MAX };
        let found = self.engine.batch(&stream(), &question, WITHIN).await.map_err(unavailable)?;
        let read = |payload: &[u8]| {
            let description: Description = serde_json::from_slice(payload).map_err(unavailable)?;
            Ok((!description.deleted).then_some(description.nuid))
        };
        found.iter().map(|message| read(&message.payload)).collect()
    }

    /// By the leader: how many files are described, and how many pieces of each name there are.
    async fn subjects(&self) -> Result<(usize, BTreeMap<String, u64>), BaseError> {
        #[derive(Serialize)]
        struct Question {
            subjects_filter: String,
        }
        #[derive(Deserialize)]
        struct Info {
            state: State,
        }
        #[derive(Deserialize)]
        struct State {
            #[serde(default)]
            subjects: BTreeMap<String, u64>,
        }
        let question = Question { subjects_filter: format!("$O.{NAME}.>") };
        let endpoint = format!("STREAM.INFO.{}", stream());
        let info: Info = self.engine.call(&endpoint, &question, WITHIN).await.map_err(unavailable)?;
        let is_piece = |subject: &String| subject.starts_with(&format!("$O.{NAME}.C."));
        let (pieces, descriptions): (BTreeMap<_, _>, BTreeMap<_, _>) =
            info.state.subjects.into_iter().partition(|(subject, _)| is_piece(subject));
        Ok((descriptions.len(), pieces))
    }

    async fn purge(&self, subject: &str) -> Result<(), BaseError> {
        #[derive(Serialize)]
        struct Question<'a> {
            filter: &'a str,
        }
        let endpoint = format!("STREAM.PURGE.{}", stream());
        let purged = self.engine.call::<IgnoredAny>(&endpoint, &Question { filter: subject }, WITHIN).await;
        purged.map(|_| ()).map_err(unavailable)
    }
}

fn stream() -> String {
    format!("OBJ_{NAME}")
}

fn unavailable(error: impl std::error::Error) -> BaseError {
    BaseError::Unavailable(format!("object store {NAME}: {error}"))
}
