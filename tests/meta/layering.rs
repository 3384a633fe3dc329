//! Layers run one way: a module names only modules of its own layer or below, and the core names no runtime,
//! no protocol and no serialization.

use std::path::{Path, PathBuf};

/// Modules and their layers, bottom first.
const LAYERS: [&[&str]; 9] = [
    &["util", "sync", "voxel", "bloom", "geometry"],
    &["map", "align", "scan", "mapping"],
    &["store"],
    &["service"],
    &["wire", "config", "telemetry", "lifecycle", "admission", "reload", "access"],
    &["grpc", "http", "client"],
    &["server"],
    &["lab"],
    &["cli", "main"],
];

/// Crates that layers 0 and 1 must not know.
const NOT_IN_THE_CORE: [&str; 7] = ["tokio", "tonic", "axum", "prost", "serde", "hyper", "tower"];

fn layer_of(module: &str) -> Option<usize> {
    LAYERS.iter().position(|modules| modules.contains(&module))
}

fn rust_files(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("a source folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            rust_files(&path, files);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
}

/// Every source file with its module and its code, without comments.
fn sources() -> Vec<(String, PathBuf, String)> {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    rust_files(&src, &mut files);
    let read = |path: PathBuf| {
        let within = path.strip_prefix(&src).expect("below src").to_owned();
        let first = within.components().next().expect("a name").as_os_str().to_string_lossy().into_owned();
        let text = std::fs::read_to_string(&path).expect("a text");
        let code = |line: &&str| !line.trim_start().starts_with("//");
        (
            first.trim_end_matches(".rs").to_owned(),
            within,
            text.lines().filter(code).collect::<Vec<_>>().join("\n"),
        )
    };
    files.into_iter().map(read).filter(|(module, ..)| module != "lib").collect()
}

/// The modules that `code` names as `crate::module`, alone or in a list of imports.
fn modules_named(code: &str) -> Vec<String> {
    let word = |text: &str| text.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect::<String>();
    let mut named = Vec::new();
    for (at, marker) in code.match_indices("crate::") {
        let rest = &code[at + marker.len()..];
        match rest.strip_prefix('{') {
            Some(list) => named
                .extend(list.split('}').next().unwrap_or_default().split(',').map(|item| word(item.trim()))),
            None => named.push(word(rest)),
        }
    }
    named
}

#[test]
fn every_module_has_a_layer_and_names_none_above_it() {
    let mut wrong = Vec::new();
    for (module, file, code) in sources() {
        let Some(layer) = layer_of(&module) else {
            wrong.push(format!("{}: module {module} has no layer", file.display()));
            continue;
        };
        for named in modules_named(&code) {
            if layer_of(&named).is_some_and(|other| other > layer) {
                wrong.push(format!("{}: {module} (layer {layer}) names {named}", file.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

#[test]
fn the_core_knows_no_runtime_and_no_protocol() {
    for (module, file, code) in sources() {
        if layer_of(&module).is_some_and(|layer| layer <= 1) {
            for name in NOT_IN_THE_CORE {
                let path = format!("{name}::");
                let own = |at: usize| {
                    code[..at].chars().next_back().is_none_or(|c| !c.is_alphanumeric() && c != '_')
                };
                let named = code.match_indices(&path).any(|(at, _)| own(at));
                assert!(!named, "{} names {name}", file.display());
            }
        }
    }
}

#[test]
fn generated_types_are_named_in_the_wire_layer_alone() {
    // The adapters hand generated messages through; only `wire` names them beside domain types' fields.
    for (module, file, code) in sources() {
        let domain = ["service", "map", "align", "mapping", "voxel", "bloom", "scan", "geometry"]
            .contains(&module.as_str());
        assert!(!(domain && code.contains("pb::")), "{} names generated types", file.display());
    }
}

/// What is written for wide instructions: look-ups, filling a filter, taking a block apart; and the prefetch.
const KERNELS: [&str; 4] = ["map/lookup", "bloom/fill", "voxel/new_keys", "util/prefetch.rs"];

#[test]
fn unsafe_code_stays_in_the_kernels() {
    for (_, file, code) in sources() {
        let kernel = KERNELS.iter().any(|kernel| file.starts_with(kernel));
        let has_unsafe = code.contains("unsafe {") || code.contains("unsafe fn");
        assert!(kernel || !has_unsafe, "{} has unsafe code", file.display());
    }
}
