//! The last revisions that a client was told, map by map.

use std::collections::HashMap;

use parking_lot::Mutex;
use uuid::Uuid;

use super::answers::Answers;
use crate::wire::pb;
use mrol_map::map::MapName;
use mrol_service::{
    AtVersion, BlockAnswer, DeletionAnswer, KeepOutAnswer, KeepOutList, LocalizationAnswer, MapInfo,
    MapVersion, ObserversAnswer, PointAnswer, ScanAnswer, TrajectoryAnswer, UndoAnswer, VoxelListing,
};

/// The uuid and the highest revision of each map that answers have named, by the map's name.
///
/// Servers of the same maps need not be equally far. A question that passes on what is known here is answered at that
/// revision or a later one, whichever of them is asked.
#[derive(Debug, Default)]
pub(super) struct ToldRevisions {
    by_name: Mutex<HashMap<String, Floor>>,
}

/// A revision of a map behind which no question goes back.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Floor {
    map_uuid: Uuid,
    revision: u64,
}

impl ToldRevisions {
    /// Notes the version that an answer about `map` names, if it names one. A map with another uuid starts anew.
    pub(super) fn note(&self, map: &MapName, version: Option<MapVersion>) {
        let Some(MapVersion { revision, map_uuid, .. }) = version else { return };
        let mut by_name = self.by_name.lock();
        match by_name.get_mut(map.as_str()) {
            Some(known) if known.map_uuid == map_uuid => known.revision = known.revision.max(revision),
            Some(known) => *known = Floor { map_uuid, revision },
            None => drop(by_name.insert(map.to_string(), Floor { map_uuid, revision })),
        }
    }

    /// What is known of `map`.
    pub(super) fn floor(&self, map: &MapName) -> Option<Floor> {
        self.by_name.lock().get(map.as_str()).copied()
    }

    /// Forgets `map` where it is still the one of `floor`: the name is that of another map now.
    pub(super) fn forget(&self, map: &MapName, floor: Floor) {
        let mut by_name = self.by_name.lock();
        if by_name.get(map.as_str()).is_some_and(|known| known.map_uuid == floor.map_uuid) {
            by_name.remove(map.as_str());
        }
    }
}

impl Floor {
    /// Makes a question wait for this revision; returns whether it names the uuid now and named none before. A larger
    /// `min_revision` of the caller stays, and so does a question about a map of another uuid.
    pub(super) fn raise(self, question: &mut impl Question) -> bool {
        let Self { map_uuid: known, revision } = self;
        let (min_revision, map_uuid) = question.scope();
        let is_any = map_uuid.is_empty();
        if !is_any && Uuid::parse_str(map_uuid).ok() != Some(known) {
            return false;
        }
        *min_revision = Some(min_revision.map_or(revision, |own| own.max(revision)));
        *map_uuid = known.to_string();
        is_any
    }
}

/// A question that can wait for a revision.
pub(super) trait Question {
    /// Its `min_revision`, and its `map_uuid`, which is empty where it has none.
    fn scope(&mut self) -> (&mut Option<u64>, &mut String);
}

impl Question for pb::QueryPointsRequest {
    fn scope(&mut self) -> (&mut Option<u64>, &mut String) {
        (&mut self.min_revision, &mut self.map_uuid)
    }
}

macro_rules! questions {
    ($($request:ident),+) => {$(
        impl Question for pb::$request {
            fn scope(&mut self) -> (&mut Option<u64>, &mut String) {
                let asked = self.asked.get_or_insert_default();
                (&mut asked.min_revision, &mut asked.map_uuid)
            }
        }
    )+};
}

questions!(
    CheckPosesRequest,
    CheckSpheresRequest,
    CheckMotionsRequest,
    CastRaysRequest,
    FindNearestRequest,
    ClassifyPointsRequest,
    ListFrontiersRequest,
    ProjectGridRequest
);

/// An answer that may name the version of the map it is of.
pub(super) trait Versioned {
    /// The version, if it names one.
    fn version(&self) -> Option<MapVersion>;
}

macro_rules! versioned {
    ($($answer:ty),+) => {$(
        impl Versioned for $answer {
            fn version(&self) -> Option<MapVersion> {
                Some(self.version)
            }
        }
    )+};
}

versioned!(
    BlockAnswer,
    DeletionAnswer,
    KeepOutAnswer,
    KeepOutList,
    LocalizationAnswer,
    MapInfo,
    ObserversAnswer,
    PointAnswer,
    ScanAnswer,
    TrajectoryAnswer,
    UndoAnswer,
    VoxelListing
);

impl<A> Versioned for AtVersion<A> {
    fn version(&self) -> Option<MapVersion> {
        Some(self.version)
    }
}

impl Versioned for (MapInfo, bool) {
    fn version(&self) -> Option<MapVersion> {
        Some(self.0.version)
    }
}

impl<A> Versioned for (A, [MapVersion; 2]) {
    fn version(&self) -> Option<MapVersion> {
        Some(self.1[1])
    }
}

impl<T> Versioned for Answers<T> {
    /// None: each of them has its own.
    fn version(&self) -> Option<MapVersion> {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn version(uuid: u128, revision: u64) -> Option<MapVersion> {
        Some(MapVersion { revision, map_uuid: Uuid::from_u128(uuid), content_hash: None })
    }

    fn asked(told: &ToldRevisions, own: Option<u64>, own_uuid: &str) -> (Option<u64>, String) {
        let mut question = pb::CastRaysRequest::default();
        *question.scope().0 = own;
        own_uuid.clone_into(question.scope().1);
        told.floor(&MapName::new("a").unwrap()).map(|floor| floor.raise(&mut question));
        let (min_revision, map_uuid) = question.scope();
        (*min_revision, map_uuid.clone())
    }

    #[test]
    fn a_question_waits_for_the_highest_revision_told_and_a_larger_one_of_the_caller_wins() {
        let (told, map, uuid) = (ToldRevisions::default(), MapName::new("a").unwrap(), Uuid::from_u128(1));
        assert_eq!(asked(&told, None, ""), (None, String::new()));
        for revision in [3, 7, 5] {
            told.note(&map, version(1, revision));
        }
        assert_eq!(asked(&told, None, ""), (Some(7), uuid.to_string()));
        assert_eq!(asked(&told, Some(6), ""), (Some(7), uuid.to_string()));
        assert_eq!(asked(&told, Some(9), &uuid.to_string()), (Some(9), uuid.to_string()));
        // A question about another map is left alone.
        let other = Uuid::from_u128(2).to_string();
        assert_eq!(asked(&told, Some(1), &other), (Some(1), other));
    }

    #[test]
    fn a_map_that_was_made_again_starts_anew() {
        let (told, map) = (ToldRevisions::default(), MapName::new("a").unwrap());
        told.note(&map, version(1, 7));
        let former = told.floor(&map).unwrap();
        told.note(&map, version(2, 1));
        assert_eq!(asked(&told, None, ""), (Some(1), Uuid::from_u128(2).to_string()));
        told.forget(&map, former);
        assert_eq!(asked(&told, None, "").0, Some(1));
        told.forget(&map, told.floor(&map).unwrap());
        assert_eq!(asked(&told, None, ""), (None, String::new()));
    }
}
