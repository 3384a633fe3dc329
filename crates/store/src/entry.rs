//! Names in the folder of maps, and what they mean.

use std::path::Path;

use uuid::Uuid;

use super::folder::UNFINISHED;
use mrol_map::map::MapName;

const MAP_FILE_SUFFIX: &str = ".mrol";
const SET_ASIDE_SUFFIX: &str = ".damaged";

/// Meaning of a name in the folder of maps. A map's name has no dot, so that each name means one thing.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Entry {
    /// The folder of a map.
    Map { name: MapName, uuid: Uuid },
    /// The folder of a map of a former release, without a uuid.
    OldMap(MapName),
    /// A map file to be imported.
    MapFile(MapName),
    /// The folder of a map whose files are damaged: an operator set it aside, and nobody reads it.
    SetAside,
    /// Something unfinished that a crash left.
    Unfinished,
    /// Not part of a data folder.
    Unknown,
}

impl Entry {
    pub(super) fn of(entry: &str) -> Self {
        if entry.starts_with(UNFINISHED) {
            return Self::Unfinished;
        }
        if let Some(name) = entry.strip_suffix(MAP_FILE_SUFFIX).and_then(|name| MapName::new(name).ok()) {
            return Self::MapFile(name);
        }
        if let Some(folder) = entry.strip_suffix(SET_ASIDE_SUFFIX) {
            return if matches!(Self::of(folder), Self::Map { .. }) { Self::SetAside } else { Self::Unknown };
        }
        match entry.split_once('.') {
            None => MapName::new(entry).map_or(Self::Unknown, Self::OldMap),
            Some((name, uuid)) => match (MapName::new(name), Uuid::parse_str(uuid)) {
                (Ok(name), Ok(uuid)) if Self::folder_name(&name, uuid) == entry => Self::Map { name, uuid },
                _ => Self::Unknown,
            },
        }
    }

    pub(super) fn of_path(path: &Path) -> Self {
        Self::of(&path.file_name().unwrap_or_default().to_string_lossy())
    }

    /// The name of the map, where the entry is a map's folder.
    pub(super) fn into_map(self) -> Option<MapName> {
        match self {
            Self::Map { name, .. } | Self::OldMap(name) => Some(name),
            Self::MapFile(_) | Self::SetAside | Self::Unfinished | Self::Unknown => None,
        }
    }

    /// The name of a map's folder.
    pub(super) fn folder_name(name: &MapName, uuid: Uuid) -> String {
        format!("{name}.{uuid}")
    }

    /// The name of the folder of a map that is set aside.
    pub(super) fn set_aside_name(folder_name: &str) -> String {
        format!("{folder_name}{SET_ASIDE_SUFFIX}")
    }

    /// The name of a map file.
    pub(super) fn file_name(name: &MapName) -> String {
        format!("{name}{MAP_FILE_SUFFIX}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_name_means_one_thing() {
        let (office, uuid) = (MapName::new("office").unwrap(), Uuid::from_u128(7));
        let folder = Entry::folder_name(&office, uuid);
        assert_eq!(Entry::of(&folder), Entry::Map { name: office.clone(), uuid });
        assert_eq!(Entry::of("office"), Entry::OldMap(office.clone()));
        assert_eq!(Entry::of("office.mrol"), Entry::MapFile(office));
        assert_eq!(Entry::of(&format!(".unfinished-{folder}")), Entry::Unfinished);
        assert_eq!(Entry::of(&Entry::set_aside_name(&folder)), Entry::SetAside);
        let simple = format!("office.{}", uuid.simple());
        for other in
            ["Office", "office.txt", "office.damaged", "office.mrol.bak", ".mrol", "lost+found", &simple, ""]
        {
            assert_eq!(Entry::of(other), Entry::Unknown, "{other}");
        }
    }
}
