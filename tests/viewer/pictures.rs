//! The pictures of the viewer in README and guides, made anew: `cargo test --release --test viewer pictures --
//! --ignored`.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};

use base64::Engine;
use serde_json::json;

use crate::browser::Browser;
use crate::turn;

/// The demonstration, which goes on serving its map.
struct Demo {
    process: Child,
    http: String,
    _folder: tempfile::TempDir,
}

impl Demo {
    /// Runs it to its end.
    fn run() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let mut demo = Command::new(env!("CARGO_BIN_EXE_mrol"));
        demo.args(["demo", "--http-listen", "127.0.0.1:0", "--grpc-listen", "127.0.0.1:0"]);
        let mut process =
            demo.current_dir(&folder).stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
        let mut http = None;
        for line in BufReader::new(process.stdout.take().unwrap()).lines().map_while(Result::ok) {
            let link = line.split_whitespace().find_map(|word| word.strip_suffix("/#map=demo"));
            http = http.or(link.map(str::to_owned));
            if line.contains("Ctrl-C ends it") {
                break;
            }
        }
        Self { process, http: http.expect("a link to the map"), _folder: folder }
    }
}

impl Drop for Demo {
    fn drop(&mut self) {
        drop(self.process.kill());
        drop(self.process.wait());
    }
}

async fn picture(browser: &Browser, name: &str) {
    browser.wait("scene.drawn.is_complete").await;
    let taken = browser.call("Page.captureScreenshot", json!({"format": "webp", "quality": 85})).await;
    let bytes = taken["result"]["data"].as_str().unwrap();
    let bytes = base64::engine::general_purpose::STANDARD.decode(bytes).unwrap();
    std::fs::write(Path::new(env!("CARGO_MANIFEST_DIR")).join(".readme").join(name), bytes).unwrap();
}

#[tokio::test(flavor = "multi_thread")]
#[ignore = "writes the pictures of README and guides"]
async fn pictures() {
    let _turn = turn().await;
    let Some(browser) = Browser::start().await else { return };
    let demo = Demo::run();
    let size = json!({"width": 1280, "height": 760, "deviceScaleFactor": 1, "mobile": false});
    browser.call("Emulation.setDeviceMetricsOverride", size).await;
    browser.open(&format!("{}/#map=demo", demo.http)).await;
    browser.wait("scene.drawn.is_complete && scene.drawn.tiles > 0 && document.getElementById('attention').textContent").await;
    browser.wait("page.ceiling.range && scene.cut.max[2] < 3").await;
    picture(&browser, "viewer.webp").await;
    let dark = json!({"features": [{"name": "prefers-color-scheme", "value": "dark"}]});
    browser.call("Emulation.setEmulatedMedia", dark).await;
    browser.press("#coloring [value=level]").await;
    picture(&browser, "viewer-dark.webp").await;
    let narrow = json!({"width": 390, "height": 760, "deviceScaleFactor": 1, "mobile": true});
    browser.call("Emulation.setDeviceMetricsOverride", narrow).await;
    browser.press("#frame").await;
    picture(&browser, "viewer-narrow.webp").await;
}
