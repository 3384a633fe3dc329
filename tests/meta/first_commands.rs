//! What each README and guide says to type first, and which step of the gate runs it.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// How it is known that the first shell command of a page works.
#[derive(Debug, Clone, Copy, PartialEq)]
enum RunBy {
    /// The page has none.
    Nothing,
    /// `documents` runs the block, which stands after `<!-- run -->`.
    Documents,
    /// `.ci/first_commands` runs the block, which stands after `<!-- first -->`, in a clean environment; this script
    /// calls it.
    FirstCommands(&'static str),
    /// A step of the gate does the same in its own words, which are these.
    Step(&'static str),
    /// The page says before the block that what it installs is not published; this form of `.ci/long` makes and
    /// installs it.
    NotPublished(&'static str),
    /// It calls a program of others, which the page says before the block is not published here.
    OfOthers,
}

use RunBy::{Documents, FirstCommands, NotPublished, Nothing, OfOthers, Step};

const GATE: &str = ".ci/run";
const LONG: &str = ".ci/long";
const DEMO: RunBy = Step("\"$target/release/mrol\" demo --once");
const VENV: &str = "python3 -m venv target/venv && . target/venv/bin/activate";

/// A page, its first shell command, and how that is run.
type Row = (&'static str, &'static str, RunBy);

const PAGES: [Row; 25] = [
    (".ci/README.md", "", Nothing),
    ("README.md", "cargo run --release -- demo", DEMO),
    ("clients/c/README.md", "cargo build --release -p mrol-c", FirstCommands(LONG)),
    ("clients/cpp/README.md", "clients/cpp/install PREFIX", Step("clients/cpp/check \"$target/debug/mrol\"")),
    (
        "clients/python-replica/README.md",
        "pip install ./clients/python ./clients/python-replica",
        FirstCommands(LONG),
    ),
    ("clients/python/README.md", VENV, FirstCommands(GATE)),
    ("clients/ros2/README.md", "pip install ./clients/python", NotPublished("ros")),
    ("clients/viewer/README.md", "cargo run -- demo", DEMO),
    ("docs/README.md", "", Nothing),
    (
        "docs/guide/access.md",
        "mkdir -p target/tour && cd target/tour && umask 077 && rm -f keys.toml",
        Documents,
    ),
    (
        "docs/guide/api.md",
        "grpcurl -plaintext -d '{\"map\":\"office\",\"points\":{\"xyz\":[1.01,2.01,0.51]}}' \\",
        OfOthers,
    ),
    (
        "docs/guide/cluster.md",
        "mkdir -p target/tour/cluster && cd target/tour/cluster && umask 077 && rm -f keys.toml",
        Documents,
    ),
    ("docs/guide/files.md", "mkdir -p target/tour", Documents),
    ("docs/guide/frames.md", "mrol map --help | grep -A3 -e --axes -e --sensor-height", Documents),
    ("docs/guide/logs.md", "mrol log crates/logs/tests/fixtures/zstd.mcap", Documents),
    (
        "docs/guide/many-maps.md",
        "mrol maps create building-17 --resolution 0.05 --no-filter --no-moments",
        Documents,
    ),
    ("docs/guide/operations.md", "sudo apt install ./mrol_0.2.0_amd64.deb", NotPublished("debian")),
    (
        "docs/guide/planners.md",
        "curl -H 'content-type: application/json' -d '{\"points\":[[4.6,9.0,1.0],[4.6,6.9,1.0]]}' \\",
        FirstCommands(GATE),
    ),
    ("docs/guide/python-replica.md", VENV, FirstCommands(LONG)),
    ("docs/guide/python.md", VENV, FirstCommands(GATE)),
    ("docs/guide/robots.md", "mrol maps create hall --resolution 0.1 --levels 5", Documents),
    ("docs/guide/ros2.md", "pip install ./clients/python", NotPublished("ros")),
    ("docs/guide/upgrades.md", "", Nothing),
    ("docs/guide/viewer.md", "", Nothing),
    (
        "examples/ompl/README.md",
        "python3 -m venv target/ompl-example",
        Step("examples/ompl/check \"$target/release/mrol\""),
    ),
];

/// Pages without a row: they are no doorway for users.
const INTERNAL: [&str; 1] = ["tests/fuzz/README.md"];

/// A page's first block of shell commands: the line before it, what stands before that, and its first command without
/// the comment behind it.
fn first_block(page: &str) -> Option<(&str, &str, &str)> {
    let at = ["```sh\n", "```bash\n", "```console\n"].iter().filter_map(|fence| page.find(fence)).min()?;
    let (before, block) = page.split_at(at);
    let line = block.lines().nth(1)?;
    let command = line.split("  #").next().unwrap_or(line).trim().trim_start_matches("$ ");
    Some((before.lines().next_back().unwrap_or_default(), before, command))
}

/// What is wrong with a page's row; `scripts` are those of the gate, by name.
fn fault(page: &str, text: &str, rows: &[Row], scripts: &BTreeMap<&str, String>) -> Option<String> {
    let found = first_block(text);
    let Some((_, command, run_by)) = rows.iter().find(|(name, ..)| *name == page) else {
        let command = found.map_or("none", |(.., command)| command);
        return Some(format!("{page} has no row; its first command is: {command}"));
    };
    let Some((mark, before, first)) = found else {
        return (*run_by != Nothing).then(|| format!("{page} has no shell command, and its row {command:?}"));
    };
    if first != *command {
        return Some(format!("{page} begins with {first:?}, its row with {command:?}"));
    }
    let has = |script: &str, words: &str| scripts.get(script).is_some_and(|text| text.contains(words));
    let is_run = match run_by {
        Nothing => false,
        Documents => mark == "<!-- run -->",
        FirstCommands(script) => {
            mark == "<!-- first -->" && has(script, ".ci/first_commands") && has(script, page)
        }
        Step(words) => has(GATE, words),
        OfOthers => before.contains("not published"),
        NotPublished(form) => before.contains("not published") && has(LONG, &format!("\n{form}() {{")),
    };
    (!is_run).then(|| format!("{page}: {run_by:?} does not run {first:?}"))
}

fn scripts() -> BTreeMap<&'static str, String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    [GATE, LONG].map(|script| (script, fs::read_to_string(root.join(script)).unwrap())).into()
}

/// Every README of the repository and every guide, by their paths from its root.
fn pages() -> BTreeMap<String, String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let (mut pages, mut folders) = (BTreeMap::new(), vec![root.to_owned()]);
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            let at = path.strip_prefix(root).unwrap().to_string_lossy().into_owned();
            if path.is_dir() {
                // What tools leave there is not of the repository.
                let is_left = ["target", "node_modules"].contains(&name.as_str()) || name.starts_with('.');
                if !is_left || name == ".ci" {
                    folders.push(path);
                }
            } else if name == "README.md" || at.starts_with("docs/guide/") && at.ends_with(".md") {
                pages.insert(at, fs::read_to_string(&path).unwrap());
            }
        }
    }
    pages
}

#[test]
fn the_gate_runs_what_each_page_says_to_type_first() {
    let (pages, scripts) = (pages(), scripts());
    let faults = pages.iter().filter(|(page, _)| !INTERNAL.contains(&page.as_str()));
    let mut faults: Vec<String> =
        faults.filter_map(|(page, text)| fault(page, text, &PAGES, &scripts)).collect();
    let gone = PAGES.iter().filter(|(page, ..)| !pages.contains_key(*page));
    faults.extend(gone.map(|(page, ..)| format!("{page} has a row, and is not there")));
    assert!(faults.is_empty(), "put right PAGES of this test, or the gate:\n{}", faults.join("\n"));
}

#[test]
fn a_page_that_is_new_or_says_something_else_is_found() {
    let scripts = scripts();
    let first =
        |mark: &str, command: &str| format!("# Page\n\n{mark}\n```sh\n{command}     # why\nmore\n```\n");
    let rows: [Row; 2] =
        [("a/README.md", "pip install a", FirstCommands(GATE)), ("b/README.md", "b", Documents)];
    let found = |page: &str, text: &str| fault(page, text, &rows, &scripts).unwrap_or_default();
    assert_eq!(found("b/README.md", &first("<!-- run -->", "b")), "");
    assert!(
        found("new/README.md", &first("", "pip install new"))
            .contains("has no row; its first command is: pip")
    );
    assert!(
        found("a/README.md", &first("<!-- first -->", "pip install b"))
            .contains("begins with \"pip install b\"")
    );
    // Nothing calls it with this page.
    assert!(found("a/README.md", &first("<!-- first -->", "pip install a")).contains("does not run"));
    assert!(found("b/README.md", &first("", "b")).contains("does not run"));
    assert!(found("b/README.md", "# Page\n").contains("has no shell command"));
}
