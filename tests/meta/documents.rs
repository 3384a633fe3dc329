//! Commands of README and guides run as they stand: those in blocks after `<!-- run -->`.

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::support::process::Process;
use crate::support::skipped::skipped;

/// Programs that the commands call, besides this one.
const TOOLS: [&str; 5] = ["bash", "curl", "openssl", "od", "python3"];

/// The blocks of a page that can be run, as they follow each other.
fn blocks(page: &str) -> Vec<&str> {
    let blocks = page.split("<!-- run -->\n```sh\n").skip(1);
    blocks.map(|rest| rest.split("\n```").next().unwrap()).collect()
}

/// README and every page below `docs`.
fn pages() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut folders = vec![root.join("docs")];
    let mut pages = vec![root.join("README.md")];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            match path.extension() {
                None if path.is_dir() => folders.push(path),
                Some(extension) if extension == "md" => pages.push(path),
                _ => {}
            }
        }
    }
    pages.sort_unstable();
    pages
}

fn is_there(tool: &str) -> bool {
    Command::new(tool).arg("--version").output().is_ok()
}

/// A folder in front of `PATH`: this program, and a curl for which an answer that is an error is one.
fn programs(folder: &Path) -> PathBuf {
    let programs = folder.join("programs");
    fs::create_dir(&programs).unwrap();
    std::os::unix::fs::symlink(env!("CARGO_BIN_EXE_mrol"), programs.join("mrol")).unwrap();
    let curl = programs.join("curl");
    let real = "PATH=${PATH#*:} exec curl --fail-with-body --silent --show-error \"$@\"";
    fs::write(&curl, format!("#!/bin/bash\n{real}\n")).unwrap();
    fs::set_permissions(&curl, fs::Permissions::from_mode(0o755)).unwrap();
    programs
}

/// Runs the blocks of a page from an empty folder, with a fresh server at the default addresses of the page.
fn run(page: &Path, blocks: &[&str]) {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path().join("repository");
    fs::create_dir(&root).unwrap();
    // What commands read of the repository.
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).join("crates");
    std::os::unix::fs::symlink(crates, root.join("crates")).unwrap();
    let server = Process::start(folder.path().join("data").to_str().unwrap(), &[]);
    let programs = programs(folder.path());
    let path = format!("{}:{}", programs.display(), std::env::var("PATH").unwrap());
    for block in blocks {
        // Later blocks are run from the root again, each by a shell of its own.
        let commands = block
            .replace("export PATH=\"$PWD/target/release:$PATH\"\n", "")
            .replace("http://127.0.0.1:7333", &server.http);
        let output = Command::new("bash")
            .args(["-euo", "pipefail", "-c", &commands])
            .current_dir(&root)
            .env("PATH", &path)
            .env("MROL_SERVER", &server.grpc)
            .env_remove("MROL_CONFIG")
            .env_remove("MROL_KEY")
            .env_remove("MROL_KEY_FILE")
            .env_remove("MROL_CA")
            .output()
            .unwrap();
        let said = [output.stdout, output.stderr].map(|said| String::from_utf8_lossy(&said).into_owned());
        assert!(output.status.success(), "{}:\n{block}\n\n{}\n{}", page.display(), said[0], said[1]);
    }
    assert_eq!(server.stop(), Some(0));
}

#[test]
fn commands_of_the_documents_run_as_they_stand() {
    if let Some(lacking) = TOOLS.iter().find(|tool| !is_there(tool)) {
        skipped(format!("{lacking} is not there, which the commands of the documents call"));
        return;
    }
    let mut found = 0;
    for page in pages() {
        let text = fs::read_to_string(&page).unwrap();
        let blocks = blocks(&text);
        assert_eq!(blocks.len(), text.matches("\n<!-- run -->\n").count(), "{}", page.display());
        if !blocks.is_empty() {
            run(&page, &blocks);
        }
        found += blocks.len();
    }
    assert!(found >= 15, "{found} blocks");
}

/// Folders of the repository that pages name files of.
const FOLDERS: [&str; 8] = [".ci", "clients", "crates", "docker", "examples", "proto", "src", "tests"];

/// The files and folders of the repository that a page names, from its root: `src/lib.rs`, `crates/map/src/align/`.
fn named_paths(text: &str) -> Vec<&str> {
    let is_of_path = |c: char| c.is_ascii_alphanumeric() || "._-/".contains(c);
    let words = text.split(|c: char| !is_of_path(c)).map(|word| word.trim_end_matches(['.', '/']));
    // Links of pages in folders of `docs` begin at the page.
    let words = words.map(|word| word.trim_start_matches("../"));
    let is_named = |word: &&str| {
        word.split_once('/').is_some_and(|(first, rest)| FOLDERS.contains(&first) && !rest.is_empty())
    };
    words.filter(is_named).collect()
}

#[test]
fn paths_are_found_in_sentences() {
    let text = "In `src/lib.rs` and ([it](../../tests/a-b/main.rs)), crates/map/src/align/. Not in src/, a/src/b or x.";
    assert_eq!(named_paths(text), ["src/lib.rs", "tests/a-b/main.rs", "crates/map/src/align"]);
}

#[test]
fn every_path_that_a_page_names_is_there() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut missing = Vec::new();
    let mut found = 0;
    for page in pages() {
        let text = fs::read_to_string(&page).unwrap();
        for (number, line) in text.lines().enumerate() {
            for path in named_paths(line) {
                found += 1;
                if !root.join(path).exists() {
                    missing.push(format!("{}:{}: {path}", page.display(), number + 1));
                }
            }
        }
    }
    assert!(missing.is_empty(), "named, and not there:\n{}", missing.join("\n"));
    assert!(found >= 100, "{found} paths");
}
