//! `mrol doctor`: checks a data folder.

use std::fmt;
use std::fmt::Display;
use std::path::PathBuf;

use serde::Serialize;

use mrol::console::CliError;
use mrol::console::Output;
use mrol::console::parse;
use mrol::console::{bytes, count};
use mrol_map::map::MapName;
use mrol_store::doctor::{
    AsideFile, Diagnosis, SetAside, diagnose, diagnose_file, set_aside, set_file_aside,
};
use mrol_store::{DataDir, StoreSettings};

const EXAMPLES: &str = "\
EXAMPLES:
  mrol doctor mrol-data                            check every file of every map; changes nothing
  mrol doctor mrol-data --set-aside office         get a map with a damaged journal to start again

No server may use the folder meanwhile. Every snapshot and every record of the journals is read, the journal is
replayed from the oldest snapshot, and the map is compared with each snapshot on the way. The exit code is 1 where
something is wrong.

--set-aside makes a map of what can be read before the damage, and renames the damaged folder to NAME.UUID.damaged, as it
is. Nothing is deleted. The new map has a uuid of its own, so that robots and planners notice, and undo does not reach
behind its beginning. Of a damaged map file, as the first format has, nothing can be read: the file is renamed, and no map is
made. The folder stays, and is reported, until you remove it. Damaged snapshots, which a server sets
aside by itself, are removed together with the snapshots of their age.";

/// Check a data folder, file by file, while no server uses it
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Doctor {
    /// The data folder of a server
    #[arg(value_name = "DATA_DIR")]
    data_dir: PathBuf,
    /// Set this map's damaged folder aside, and make a map of what can be read of it
    #[arg(long, value_name = "MAP", value_parser = parse::map_name)]
    set_aside: Option<MapName>,
}

impl Doctor {
    pub(super) fn run(self, output: Output) -> Result<(), CliError> {
        if !self.data_dir.join("maps").is_dir() {
            let folder = self.data_dir.display();
            return Err(CliError::usage(format!("{folder} is no data folder: it has no folder maps")));
        }
        let data_dir = DataDir::open(&self.data_dir, StoreSettings::default())?;
        match self.set_aside {
            Some(name) => self::aside(&data_dir, &name, &output),
            None => check(&data_dir, output),
        }
    }
}

fn check(data_dir: &DataDir, output: Output) -> Result<(), CliError> {
    let names = data_dir.names()?;
    for path in data_dir.not_understood()? {
        output.note(format!("not understood, and left alone: {}", path.display()));
    }
    for path in data_dir.set_aside()? {
        output.note(format!("set aside, and read by nobody: {}", path.display()));
    }
    // Both a file and a folder may have a map's name: the next start refuses the file then.
    let files = data_dir.file_names()?;
    let maps = names.into_iter().map(|name| (name, false)).chain(files.into_iter().map(|name| (name, true)));
    let maps: Vec<(MapName, bool)> = maps.collect();
    let output = output.with_bar_of(maps.len(), "maps");
    let mut problems = 0;
    for (name, is_file) in maps {
        let diagnosis = if is_file { diagnose_file(data_dir, &name)? } else { diagnose(data_dir, &name)? };
        problems += diagnosis.problems.len();
        output.print(&Report::of(&name, diagnosis))?;
        output.step();
    }
    output.clear_bar();
    match problems {
        0 => Ok(()),
        n => Err(CliError::failed(format!("{n} problems were found"))),
    }
}

fn aside(data_dir: &DataDir, name: &MapName, output: &Output) -> Result<(), CliError> {
    // A map file has no folder, and a map's folder may have a file beside it that the next start refuses.
    let has_folder = data_dir.names()?.contains(name);
    let has_file = data_dir.file_names()?.contains(name);
    let of_folder = if has_folder || !has_file { set_aside(data_dir, name)? } else { None };
    match of_folder {
        None => match set_file_aside(data_dir, name)? {
            None => output.say(format!("map {name} can be opened as it is")),
            Some(file) => output.print(&FileAside { map: name.to_string(), set_aside: file, has_folder }),
        },
        Some(SetAside { folder, revision, keep_outs, viewpoints }) => {
            output.note(format!("set aside: {}", folder.display()));
            output.print(&Opens { map: name.to_string(), revision, keep_outs, viewpoints })
        }
    }
}

#[derive(Serialize)]
struct FileAside {
    map: String,
    set_aside: PathBuf,
    /// There is a map of that name besides the file.
    #[serde(skip)]
    has_folder: bool,
}

impl Display for FileAside {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { map, set_aside, has_folder } = self;
        write!(f, "set aside: {}; ", set_aside.display())?;
        match has_folder {
            true => write!(f, "map {map} opens as it is, without the file"),
            false => write!(
                f,
                "nothing can be read of it, and there is no map {map} now: put a backup there with `mrol restore`"
            ),
        }
    }
}

#[derive(Serialize)]
struct Opens {
    map: String,
    revision: u64,
    keep_outs: usize,
    viewpoints: usize,
}

impl Display for Opens {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "map {} opens at revision {} with {} keep-outs and {} viewpoints; what came after it is lost to the map: scans, deletions, undos, and \
             keep-outs that were put or deleted",
            self.map,
            self.revision,
            count(self.keep_outs),
            count(self.viewpoints)
        )
    }
}

#[derive(Serialize)]
struct Report {
    map: String,
    revision: Option<u64>,
    voxels: usize,
    viewpoints: usize,
    snapshots: Vec<u64>,
    segments: usize,
    records: u64,
    torn_bytes: u64,
    set_aside: Vec<AsideOut>,
    not_understood: Vec<String>,
    problems: Vec<String>,
}

#[derive(Serialize)]
struct AsideOut {
    file: String,
    bytes: u64,
}

impl Report {
    fn of(name: &MapName, diagnosis: Diagnosis) -> Self {
        let Diagnosis { snapshots, segments, records, revision, voxels, viewpoints, torn_bytes, .. } =
            diagnosis;
        let Diagnosis { set_aside, not_understood, problems, .. } = diagnosis;
        let map = name.to_string();
        let aside = |AsideFile { name, bytes }| AsideOut { file: name, bytes };
        let set_aside = set_aside.into_iter().map(aside).collect();
        Self {
            map,
            revision,
            voxels,
            viewpoints,
            snapshots,
            segments,
            records,
            torn_bytes,
            set_aside,
            not_understood,
            problems,
        }
    }
}

impl Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let state = if self.problems.is_empty() { "well" } else { "NOT WELL" };
        let revision = self.revision.map_or("none".into(), |revision| revision.to_string());
        write!(f, "map {}: {state}; revision {revision}, {} voxels, ", self.map, count(self.voxels))?;
        write!(f, "{} viewpoints; ", count(self.viewpoints))?;
        let (snapshots, records) = (self.snapshots.len(), count(self.records as usize));
        write!(f, "{snapshots} snapshots, {records} records in {} segments", self.segments)?;
        if self.torn_bytes > 0 {
            let torn = bytes(self.torn_bytes as usize);
            write!(f, "; {torn} at the end were never acknowledged, the next start cuts them off")?;
        }
        for AsideOut { file, bytes: size } in &self.set_aside {
            write!(f, "\n  set aside, and read by nobody: {file}, {}", bytes(*size as usize))?;
        }
        for file in &self.not_understood {
            write!(f, "\n  not understood, and left alone: {file}")?;
        }
        self.problems.iter().try_for_each(|problem| write!(f, "\n  {problem}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_map_that_opens_again_is_told_with_its_keep_outs() {
        let opens = Opens { map: "office".into(), revision: 7, keep_outs: 2, viewpoints: 5 };
        let text = opens.to_string();
        assert!(
            text.starts_with("map office opens at revision 7 with 2 keep-outs and 5 viewpoints;"),
            "{text}"
        );
        assert!(text.contains("undos, and keep-outs"), "{text}");
        assert_eq!(serde_json::to_value(&opens).unwrap()["keep_outs"], 2);
    }
}
