//! The files that the page is made of, as they are in the program.

use std::sync::LazyLock;

use axum::http::HeaderValue;
use sha2::{Digest, Sha256};

/// A file of the page.
pub(crate) struct File {
    pub(super) name: &'static str,
    /// What it holds: all of them are text.
    pub(super) text: &'static str,
}

impl File {
    /// The media type, by the end of the name.
    pub(super) fn content_type(&self) -> &'static str {
        match self.name.rsplit('.').next() {
            Some("js") => "text/javascript; charset=utf-8",
            Some("css") => "text/css; charset=utf-8",
            Some("svg") => "image/svg+xml",
            _ => "text/html; charset=utf-8",
        }
    }
}

/// Makes the table of files from their names.
macro_rules! files {
    ($($name:literal,)+) => {
        &[$(File { name: $name, text: include_str!(concat!("../../../clients/viewer/page/", $name)) },)+]
    };
}

/// The page.
pub(super) const INDEX: File =
    File { name: "index.html", text: include_str!("../../../clients/viewer/page/index.html") };

/// What the page loads.
pub(crate) const FILES: &[File] = files! {
    "answers.js",
    "api.js",
    "arrivals.js",
    "blocks.js",
    "body.js",
    "camera.js",
    "ceiling.js",
    "chooser.js",
    "coloring.js",
    "connection.js",
    "controls.js",
    "cuts.js",
    "detail.js",
    "dom.js",
    "events.js",
    "explored.js",
    "forest.js",
    "format.js",
    "gpu.js",
    "help.js",
    "icon.svg",
    "labels.js",
    "layers.js",
    "link.js",
    "loader.js",
    "main.js",
    "notices.js",
    "page.js",
    "pages.js",
    "palette.js",
    "past.js",
    "pick.js",
    "picking.js",
    "protobuf.js",
    "region.js",
    "robots.js",
    "room.js",
    "ruler.js",
    "scene.js",
    "seen.js",
    "session.js",
    "shapes.js",
    "steps.js",
    "style.css",
    "tags.js",
    "tile.js",
    "vector.js",
    "views.js",
    "voxels.js",
    "watch.js",
};

/// The file of that name.
pub(super) fn find(name: &str) -> Option<&'static File> {
    FILES.iter().find(|file| file.name == name)
}

/// The tag of this state of all files. It is one, so that modules of two programs never meet in one page.
pub(super) fn etag() -> &'static HeaderValue {
    static ETAG: LazyLock<HeaderValue> = LazyLock::new(|| {
        let mut hash = Sha256::new();
        for File { name, text } in FILES.iter().chain([&INDEX]) {
            hash.update(name);
            hash.update(text);
        }
        let digits: String = hash.finalize().iter().take(16).map(|byte| format!("{byte:02x}")).collect();
        HeaderValue::try_from(format!("\"{digits}\"")).unwrap_or(HeaderValue::from_static("\"\""))
    });
    &ETAG
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;
    use std::fs;
    use std::path::Path;

    #[test]
    fn every_file_of_the_folder_is_served() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("clients/viewer/page");
        let there: BTreeSet<String> = fs::read_dir(folder)
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        let served: BTreeSet<String> =
            FILES.iter().chain([&INDEX]).map(|file| file.name.to_owned()).collect();
        assert_eq!(there, served);
    }

    #[test]
    fn what_a_module_imports_is_served_and_every_module_is_imported() {
        let mut imported = BTreeSet::from(["main.js", "style.css", "icon.svg"]);
        for File { name, text } in FILES {
            for line in text.lines().filter(|line| line.contains(" from \"")) {
                let module = line.rsplit('"').nth(1).unwrap();
                let module = module.strip_prefix("./").unwrap_or_else(|| panic!("{name} imports {module}"));
                assert!(find(module).is_some(), "{name} imports {module}");
                imported.insert(module);
            }
        }
        let served: BTreeSet<_> = FILES.iter().map(|file| file.name).collect();
        assert_eq!(imported, served);
    }

    #[test]
    fn files_name_nothing_of_another_place_and_nothing_is_inline() {
        for File { name, text } in FILES.iter().chain([&INDEX]) {
            let text = text.replace("xmlns=\"http://www.w3.org/2000/svg\"", "");
            for foreign in
                ["http://", "https://", "=\"/", "style=", "innerHTML", "insertAdjacentHTML", "eval("]
            {
                assert!(!text.contains(foreign), "{name} has {foreign}");
            }
            assert!(!text.contains("<script>") && !text.contains(" onclick"), "{name}");
        }
    }

    #[test]
    fn a_file_is_short() {
        for File { name, text } in FILES {
            assert!(text.lines().count() <= 400, "{name}");
        }
    }
}
