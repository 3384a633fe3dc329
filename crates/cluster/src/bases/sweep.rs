//! What nothing points to any more.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use serde::de::IgnoredAny;
use serde::{Deserialize, Serialize};
use uuid::Uuid;

use super::base::object_of;
use super::error::BaseError;
use super::pointers::BasePointers;
use super::store::{BaseStore, NAME};

/// How long each question may take.
const WITHIN: Duration = Duration::from_secs(5);

/// Files that are described at once.
const FILES_AT_ONCE: usize = 1_000;

/// What nothing points to: a file that is no map's base, or was deleted, by the number of its description, and pieces
/// that belong to no file, by how many there are. Each by its subject.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Orphans(BTreeMap<String, u64>);

impl Orphans {
    /// True where there is none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

/// What NATS says of a file.
struct Described {
    subject: String,
    /// Number of what it says.
    sequence: u64,
    name: String,
    /// What the file's pieces are called; none of one that was deleted.
    nuid: Option<String>,
}

impl BaseStore {
    /// Deletes what nothing points to now, nor did `before`, and is the same since: of nodes that went down while they
    /// put a base. Says what nothing points to still; pieces of a file that is deleted now are among it. To be called
    /// minutes apart, with what the last call said.
    ///
    /// # Errors
    /// Nobody answered, or a file that was just put is not described on all servers yet.
    pub fn sweep(&self, pointers: &BasePointers, before: &Orphans) -> Result<Orphans, BaseError> {
        let engine = &self.engine;
        let described = engine.block_on(self.described())?;
        // A file is put before it is pointed to.
        let bases = bases_of(&described, pointers)?;
        let (descriptions, pieces) = engine.block_on(self.subjects())?;
        if descriptions != described.len() {
            return Err(BaseError::Unavailable(format!("object store {NAME}: a server lags")));
        }
        let is_base = |file: &Described| file.nuid.is_some() && bases.contains(&file.name);
        let is_left = |subject: &str, number: u64| before.0.get(subject) == Some(&number);
        let is_gone = |file: &Described| !is_base(file) && is_left(&file.subject, file.sequence);
        // The description goes before the pieces, so that no file is described that is not whole.
        let whole = described.iter().filter(|file| !is_gone(file)).filter_map(|file| file.nuid.as_ref());
        let whole: BTreeSet<_> = whole.map(pieces_of).collect();
        let files = described.iter().filter(|file| !is_base(file));
        let files = files.map(|file| (file.subject.clone(), file.sequence));
        let pieces = pieces.into_iter().filter(|(subject, _)| !whole.contains(subject));
        let (left, orphans): (BTreeMap<_, _>, _) =
            files.chain(pieces).partition(|(subject, number)| is_left(subject, *number));
        for (subject, number) in &left {
            // What was put again since then under the name of a file stays. Pieces have names of their own.
            let before = described.iter().any(|file| file.subject == *subject).then(|| number + 1);
            engine.block_on(self.purge(subject, before))?;
        }
        Ok(Orphans(orphans))
    }

    /// The files as one server describes them.
    async fn described(&self) -> Result<Vec<Described>, BaseError> {
        #[derive(Serialize)]
        struct Question {
            seq: u64,
            next_by_subj: String,
            batch: usize,
        }
        #[derive(Deserialize)]
        struct Description {
            name: String,
            nuid: String,
            #[serde(default)]
            deleted: bool,
        }
        let read = |message: crate::engine::BatchMessage| {
            let Description { name, nuid, deleted } =
                serde_json::from_slice(&message.payload).map_err(unavailable)?;
            let subject = message.headers.get("Nats-Subject").map(|subject| subject.as_str().to_owned());
            let subject = subject.ok_or_else(|| {
                BaseError::Unavailable(format!("object store {NAME}: file {name} has no subject"))
            })?;
            Ok(Described { subject, sequence: message.sequence, name, nuid: (!deleted).then_some(nuid) })
        };
        let mut described: Vec<Described> = Vec::new();
        loop {
            let seq = described.last().map_or(1, |last| last.sequence + 1);
            // Each has one description, the last.
            let next_by_subj = format!("$O.{NAME}.M.>");
            let question = Question { seq, next_by_subj, batch: FILES_AT_ONCE };
            let found = self.engine.batch(&stream(), &question, WITHIN).await.map_err(unavailable)?;
            if found.is_empty() {
                return Ok(described);
            }
            let found: Result<Vec<_>, BaseError> = found.into_iter().map(read).collect();
            described.extend(found?);
        }
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

    /// Deletes what is of a subject, or what of it is before a number.
    async fn purge(&self, subject: &str, before: Option<u64>) -> Result<(), BaseError> {
        #[derive(Serialize)]
        struct Question<'a> {
            filter: &'a str,
            #[serde(skip_serializing_if = "Option::is_none")]
            seq: Option<u64>,
        }
        let endpoint = format!("STREAM.PURGE.{}", stream());
        let purged = self
            .engine
            .call::<IgnoredAny>(&endpoint, &Question { filter: subject, seq: before }, WITHIN)
            .await;
        purged.map(|_| ()).map_err(unavailable)
    }
}

/// Names of the files that are the bases of the maps of which there is one.
fn bases_of(described: &[Described], pointers: &BasePointers) -> Result<BTreeSet<String>, BaseError> {
    let map_of = |file: &Described| Uuid::try_parse(file.name.split('/').next()?).ok();
    let maps: BTreeSet<Uuid> = described.iter().filter_map(map_of).collect();
    let mut bases = BTreeSet::new();
    for map in maps {
        bases.extend(pointers.read(map)?.map(|(base, _)| object_of(&base, map)));
    }
    Ok(bases)
}

fn pieces_of(nuid: &String) -> String {
    format!("$O.{NAME}.C.{nuid}")
}

fn stream() -> String {
    format!("OBJ_{NAME}")
}

fn unavailable(error: impl std::error::Error) -> BaseError {
    BaseError::Unavailable(format!("object store {NAME}: {error}"))
}
