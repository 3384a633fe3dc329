//! Within a crate no two modules beside each other name each other, and code that may be unsafe stays in the kernels.
//! What crates may name is in their manifests.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use syn::visit::{self, Visit};
use syn::{Attribute, Item, ItemMod, ItemUse, UseTree, Visibility};

/// What has SIMD variants: quantization, look-ups, filling a filter, taking a block apart, planners' questions, rays;
/// and the prefetch.
const KERNELS: [&str; 9] = [
    "crates/map/src/voxel/quantize",
    "crates/map/src/voxel/new_keys",
    "crates/map/src/bloom/fill",
    "crates/map/src/map/shards/bounds.rs",
    "crates/map/src/map/lookup",
    "crates/map/src/planning/simd.rs",
    "crates/map/src/planning/rays/interleaved.rs",
    "crates/map/src/util/prefetch.rs",
    "crates/lab/src/rivals/dense/offsets",
];

/// A path in the crate, from its root: `["map", "lookup", "Lookup"]`.
type CratePath = Vec<String>;

/// A source file of one of the crates.
struct Source {
    /// From the root.
    file: PathBuf,
    /// Its module, from the crate's root.
    module: CratePath,
    text: String,
    named: Named,
}

/// What a file names.
#[derive(Default)]
struct Named {
    /// The file's module.
    module: CratePath,
    /// Paths in this crate.
    own: BTreeSet<CratePath>,
    /// Names that the module hands on from its children, with the child's name: `pub use child::Name`.
    handed_on: BTreeMap<String, String>,
}

impl Named {
    /// Notes a path as it is written.
    fn note(&mut self, path: &[String]) {
        let mut from = self.module.clone();
        let mut rest = path;
        match path.first().map(String::as_str) {
            Some("crate") => (from, rest) = (Vec::new(), &path[1..]),
            Some("self") => rest = &path[1..],
            Some("super") => {
                while rest.first().is_some_and(|segment| segment == "super") {
                    from.pop();
                    rest = &rest[1..];
                }
            }
            _ => return,
        }
        from.extend_from_slice(rest);
        self.own.insert(from);
    }

    fn note_imports(&mut self, tree: &UseTree, before: &mut CratePath, is_handed_on: bool) {
        match tree {
            UseTree::Path(path) => {
                before.push(path.ident.to_string());
                self.note_imports(&path.tree, before, is_handed_on);
                before.pop();
            }
            UseTree::Group(group) => {
                group.items.iter().for_each(|tree| self.note_imports(tree, before, is_handed_on));
            }
            UseTree::Name(name) => {
                self.note_import(&name.ident.to_string(), &name.ident.to_string(), before, is_handed_on)
            }
            UseTree::Rename(rename) => {
                self.note_import(&rename.ident.to_string(), &rename.rename.to_string(), before, is_handed_on);
            }
            UseTree::Glob(_) => self.note(before),
        }
    }

    fn note_import(&mut self, name: &str, here: &str, before: &[String], is_handed_on: bool) {
        let path = [before, &[name.to_owned()]].concat();
        let own = path.iter().skip_while(|segment| *segment == "self").cloned().collect::<Vec<_>>();
        if is_handed_on && own.len() > 1 && !["crate", "super"].contains(&own[0].as_str()) {
            self.handed_on.insert(here.to_owned(), own[0].clone());
        }
        self.note(&path);
    }
}

impl<'a> Visit<'a> for Named {
    fn visit_item(&mut self, item: &'a Item) {
        if !is_for_tests(item) {
            visit::visit_item(self, item);
        }
    }

    fn visit_item_use(&mut self, item: &'a ItemUse) {
        let is_handed_on = !matches!(item.vis, Visibility::Inherited);
        self.note_imports(&item.tree, &mut Vec::new(), is_handed_on);
    }

    fn visit_path(&mut self, path: &'a syn::Path) {
        let segments: Vec<_> = path.segments.iter().map(|segment| segment.ident.to_string()).collect();
        if segments.len() > 1 {
            self.note(&segments);
        }
        visit::visit_path(self, path);
    }
}

fn is_for_tests(item: &Item) -> bool {
    let is_test = |attributes: &[Attribute]| {
        attributes.iter().any(|attribute| {
            attribute.path().is_ident("cfg")
                && attribute.parse_args::<syn::Meta>().is_ok_and(|meta| names_tests(&meta))
        })
    };
    match item {
        Item::Mod(ItemMod { attrs, .. }) | Item::Use(ItemUse { attrs, .. }) => is_test(attrs),
        Item::Fn(function) => is_test(&function.attrs),
        Item::Impl(of) => is_test(&of.attrs),
        _ => false,
    }
}

/// True of `test` and `all(test, ...)`.
fn names_tests(meta: &syn::Meta) -> bool {
    match meta {
        syn::Meta::Path(path) => path.is_ident("test"),
        syn::Meta::List(list) if list.path.is_ident("all") => list
            .parse_args_with(syn::punctuated::Punctuated::<syn::Meta, syn::Token![,]>::parse_terminated)
            .is_ok_and(|all| all.iter().any(names_tests)),
        _ => false,
    }
}

/// The folders of sources, one for each crate.
fn crates() -> Vec<PathBuf> {
    let members = fs::read_dir(root().join("crates")).unwrap().map(|entry| entry.unwrap().path().join("src"));
    [root().join("src")].into_iter().chain(members).collect()
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The sources of the crate in a folder.
fn sources(src: &Path) -> Vec<Source> {
    let mut files = Vec::new();
    rust_files(src, &mut files);
    let source = |path: PathBuf| {
        let file = path.strip_prefix(src).unwrap().to_owned();
        let mut module: CratePath =
            file.with_extension("").iter().map(|name| name.to_str().unwrap().to_owned()).collect();
        module.pop_if(|last| ["mod", "lib", "main"].contains(&last.as_str()));
        let text = fs::read_to_string(&path).unwrap();
        let mut named = Named { module: module.clone(), ..Named::default() };
        named.visit_file(&syn::parse_file(&text).unwrap());
        Source { file: path.strip_prefix(root()).unwrap().to_owned(), module, text, named }
    };
    files.into_iter().map(source).collect()
}

fn rust_files(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            rust_files(&path, files);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
}

/// Which modules beside each other name each other: by the module that they are in, from the one that names to the
/// named, with a file in which it does.
fn edges(sources: &[Source]) -> BTreeMap<CratePath, BTreeMap<(String, String), PathBuf>> {
    let modules: BTreeSet<&[String]> = sources.iter().map(|source| source.module.as_slice()).collect();
    let handed_on: BTreeMap<&[String], &BTreeMap<String, String>> =
        sources.iter().map(|source| (source.module.as_slice(), &source.named.handed_on)).collect();
    let mut edges = BTreeMap::<_, BTreeMap<_, _>>::new();
    for source in sources {
        for path in &source.named.own {
            let shared = source.module.iter().zip(path).take_while(|(one, other)| one == other).count();
            let (Some(from), Some(name)) = (source.module.get(shared), path.get(shared)) else { continue };
            let parent = &path[..shared];
            let to = if modules.contains(&path[..=shared]) {
                name
            } else {
                let Some(child) = handed_on.get(parent).and_then(|names| names.get(name)) else { continue };
                child
            };
            if to != from {
                let among = edges.entry(parent.to_vec()).or_default();
                among.entry((from.clone(), to.clone())).or_insert_with(|| source.file.clone());
            }
        }
    }
    edges
}

#[test]
fn no_modules_beside_each_other_name_each_other() {
    let mut circles = Vec::new();
    for (parent, among) in crates().iter().flat_map(|src| edges(&sources(src))) {
        let mut reached: BTreeSet<(String, String)> = among.keys().cloned().collect();
        loop {
            let further: Vec<_> = reached
                .iter()
                .flat_map(|(from, by)| {
                    among
                        .keys()
                        .filter(move |(start, _)| start == by)
                        .map(move |(_, to)| (from.clone(), to.clone()))
                })
                .filter(|edge| !reached.contains(edge))
                .collect();
            if further.is_empty() {
                break;
            }
            reached.extend(further);
        }
        for ((from, to), file) in &among {
            if reached.contains(&(to.clone(), from.clone())) {
                circles.push(format!("in {}: {from} names {to} ({})", parent.join("::"), file.display()));
            }
        }
    }
    assert!(circles.is_empty(), "circles:\n{}", circles.join("\n"));
}

#[test]
fn unsafe_code_stays_in_the_kernels() {
    for Source { file, text, .. } in crates().iter().flat_map(|src| sources(src)) {
        let kernel = KERNELS.iter().any(|kernel| file.starts_with(kernel));
        let has_unsafe = text.contains("unsafe {") || text.contains("unsafe fn");
        assert!(kernel || !has_unsafe, "{} has unsafe code", file.display());
    }
}

/// What a doorway may hold: it hands on what stands in the files beside it.
fn is_of_doorway(item: &Item) -> bool {
    matches!(item, Item::Mod(_) | Item::Use(_) | Item::ExternCrate(_) | Item::Macro(_))
}

#[test]
fn doorways_hold_nothing_but_names() {
    let mut wrong = Vec::new();
    for Source { file, text, .. } in crates().iter().flat_map(|src| sources(src)) {
        let is_doorway = file.ends_with("mod.rs") || file.ends_with("lib.rs");
        let holds_more = || !syn::parse_file(&text).unwrap().items.iter().all(is_of_doorway);
        if is_doorway && !file.components().any(|part| part.as_os_str() == "tests") && holds_more() {
            wrong.push(file.display().to_string());
        }
    }
    assert!(wrong.is_empty(), "more than documentation, mod and use:\n{}", wrong.join("\n"));
}
