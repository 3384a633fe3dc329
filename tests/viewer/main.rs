//! The viewer's page in a real browser: what it shows, does and refuses to do. Skipped, which is said, where there is
//! no Chromium.
#![expect(clippy::unwrap_used, reason = "a test may fail where it stands")]

mod browser;
mod coloring;
mod figures;
mod keys;
mod live;
mod looking;
mod names;
mod nothing_yet;
mod pictures;
#[path = "../support/mod.rs"]
mod support;
mod views;

use browser::{Browser, Told};
use serde_json::Value;
use tokio::sync::{Mutex, MutexGuard};

use crate::support::daemon::Daemon;

/// One browser at a time: each draws with all cores.
async fn turn() -> MutexGuard<'static, ()> {
    static TURN: Mutex<()> = Mutex::const_new(());
    TURN.lock().await
}

/// True once the picture shows all that it will show.
const DRAWN: &str = "scene.drawn.is_complete && scene.drawn.tiles > 0 && page.session.voxels >= 0";

/// The number of voxels in the picture.
async fn shown(browser: &Browser) -> u64 {
    browser.eval("scene.drawn.voxels").await.as_u64().unwrap()
}

/// The color at the place that the camera looks at, as the GPU has it: red, green, blue.
async fn middle_color(browser: &Browser) -> [u64; 3] {
    let read = "new Promise((resolve) => {
        let isRead = false;
        scene.whenDrawn(() => {
            if (isRead) return;
            isRead = true;
            const gl = document.getElementById('picture').getContext('webgl2');
            const color = new Uint8Array(4);
            const [x, y] = scene.pageOf(scene.camera.target);
            gl.readPixels(x, gl.drawingBufferHeight - y, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, color);
            resolve(Array.from(color));
        });
        scene.invalidate();
    })";
    let color: Vec<u64> = serde_json::from_value(browser.eval(read).await).unwrap();
    [color[0], color[1], color[2]]
}

/// Where in the page the place is that the camera looks at: in the middle of what the panels leave.
async fn middle(browser: &Browser) -> [f64; 2] {
    serde_json::from_value(browser.eval("scene.pageOf(scene.camera.target)").await).unwrap()
}

/// A wall of 21 x 21 voxels of 0.1 m, in the plane y = 0 about the origin.
fn wall() -> Vec<[f32; 3]> {
    let steps = || (-10..=10).map(|i| i as f32 * 0.1 + 0.05);
    steps().flat_map(|x| steps().map(move |z| [x, 0.05, z])).collect()
}

/// Looks at the wall from before it, so that it fills the middle of the picture.
fn link(daemon: &Daemon, map: &str) -> String {
    daemon.url(&format!("/#map={map}&at=0.05,0.05,0.05&distance=4&yaw=-1.5&pitch=0.2"))
}

/// A browser before the wall of a map `a`; none where there is no browser.
async fn before_wall() -> Option<(MutexGuard<'static, ()>, Browser, Daemon)> {
    let turn = turn().await;
    let browser = Browser::start().await?;
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    daemon.put_in("a", &wall()).await;
    browser.open(&link(&daemon, "a")).await;
    browser.wait(DRAWN).await;
    Some((turn, browser, daemon))
}

/// No error, and no request to another place than the server.
fn assert_clean(told: &Told, daemon: &Daemon) {
    assert!(told.errors.is_empty(), "{told:?}");
    let own = daemon.url("/");
    let foreign: Vec<_> = told.requests.iter().filter(|url| !url.starts_with(&own)).collect();
    assert!(foreign.iter().all(|url| url.starts_with("about:")), "{foreign:?}");
}

/// The text of an element.
async fn text(browser: &Browser, selector: &str) -> String {
    let text = browser.eval(&format!("document.querySelector({selector:?})?.textContent ?? ''")).await;
    match text {
        Value::String(text) => text,
        other => panic!("{other}"),
    }
}
