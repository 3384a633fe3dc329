//! A map that changes while it is looked at, and a server that goes away.

use serde_json::json;

use crate::browser::Browser;
use crate::support::daemon::{Daemon, identity_json, json_of, pose_json};
use crate::support::map_folders::copy_folder;
use crate::{DRAWN, assert_clean, before_wall, link, middle_color, shown, text, turn, wall};

#[tokio::test(flavor = "multi_thread")]
async fn a_map_grows_in_the_picture_and_a_lost_connection_is_said_and_resumed() {
    let _turn = turn().await;
    let Some(browser) = Browser::start().await else { return };
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    browser.open(&link(&daemon, "a")).await;
    browser.wait("document.getElementById('connection').dataset.state === 'live'").await;
    browser.wait("document.getElementById('empty').textContent.includes('a is empty')").await;

    daemon.put_in("a", &wall()).await;
    browser.wait(&format!("{DRAWN} && scene.drawn.voxels === 441")).await;
    browser.wait("document.getElementById('empty').hidden").await;

    // While the server is down, the page says so; when it is back, it has what came in between.
    let http = daemon.http;
    let data = daemon.stop().await;
    browser.wait("document.getElementById('connection').dataset.state === 'lost'").await;
    assert_eq!(shown(&browser).await, 441);
    let daemon = Daemon::start_in(data, |config| config.http.listen = http).await;
    daemon.put_in("a", &[[0.05, 0.55, 0.05], [0.05, 0.65, 0.05]]).await;
    browser.wait("document.getElementById('connection').dataset.state === 'live'").await;
    browser.wait(&format!("{DRAWN} && scene.drawn.voxels === 443")).await;
    assert_clean(&browser.told(), &daemon);
}

/// An older data folder is put back, and what happens to it then leaves the voxels and the revision that the page
/// knows: the hash of the whole state alone tells that the keep-out is another one.
#[tokio::test(flavor = "multi_thread")]
async fn what_a_restored_map_holds_is_shown_where_its_voxels_are_the_same() {
    let _turn = turn().await;
    let Some(browser) = Browser::start().await else { return };
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    daemon.put_in("a", &wall()).await;
    let (http, data) = (daemon.http, daemon.stop().await);
    let cold = tempfile::tempdir().unwrap();
    copy_folder(data.path(), cold.path());
    let region = json!({"box": {"min_m": [-0.5, -1, -0.5], "max_m": [0.5, -0.5, 0.5]}});

    let daemon = Daemon::start_in(data, |config| config.http.listen = http).await;
    browser.open(&link(&daemon, "a")).await;
    browser.wait("document.getElementById('connection').dataset.state === 'live'").await;
    assert!(daemon.put("/v1/maps/a/keep-outs/left", region.clone()).await.status().is_success());
    browser.wait("document.getElementById('keep-outs').textContent.includes('left')").await;
    let (revision, _) = daemon.contents("a").await;
    daemon.stop().await;
    browser.wait("document.getElementById('connection').dataset.state === 'lost'").await;

    // On another port, so that the page comes back when the other keep-out is already there.
    let daemon = Daemon::start_in(cold, |_| ()).await;
    assert!(daemon.put("/v1/maps/a/keep-outs/right", region).await.status().is_success());
    assert_eq!(daemon.contents("a").await.0, revision);
    let cold = daemon.stop().await;
    let daemon = Daemon::start_in(cold, |config| config.http.listen = http).await;
    browser.wait("document.getElementById('keep-outs').textContent.includes('right')").await;
    assert!(!text(&browser, "#keep-outs").await.contains("left"));
    assert_clean(&browser.told(), &daemon);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_robot_whose_scan_is_refused_comes_first_and_its_scan_is_drawn_where_its_guess_was() {
    let Some((_turn, browser, daemon)) = before_wall().await else { return };
    browser.wait("document.querySelector('#robots .soft') && document.getElementById('attention').textContent === ''").await;

    // A name that would come last, a guess where nothing is.
    let lost = json!({"robot": "zz", "points": wall(), "guess": pose_json([0.0, 9.0, 0.0])});
    let answer = json_of(daemon.post("/v1/maps/a/scans", lost).await).await;
    assert_eq!(answer["accepted"], false, "{answer}");
    browser.wait("document.getElementById('attention').textContent === '1 of 2 needs attention'").await;
    let first = text(&browser, "#robots li").await;
    assert!(first.starts_with("zz") && first.contains(answer["verdict"].as_str().unwrap()), "{first}");
    browser.eval("document.getElementById('answers').parentElement.open = true").await;
    browser.wait("document.getElementById('answers').textContent.includes('zz')").await;

    // Its points fill the middle of the picture where its guess put them, unless they are not to be shown.
    browser.press("#robots li button").await;
    browser.eval("scene.camera.distance = 2").await;
    let refused = middle_color(&browser).await;
    browser.press("#show-refused").await;
    let without = middle_color(&browser).await;
    assert_ne!(refused, without);

    // Once it fits, nothing needs attention.
    let fits = json!({"robot": "zz", "points": wall(), "guess": identity_json(), "align": false});
    assert_eq!(json_of(daemon.post("/v1/maps/a/scans", fits).await).await["accepted"], true);
    browser.wait("document.getElementById('attention').textContent === ''").await;
    assert_clean(&browser.told(), &daemon);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_scan_that_is_spread_far_and_robots_without_number_leave_the_page_answering() {
    let Some((_turn, browser, daemon)) = before_wall().await else { return };
    // More places, tens of kilometers apart, than the page keeps.
    let scattered: Vec<[f32; 3]> = (0..3000u32)
        .map(|i| [7919, 104_729, 611].map(|step| (i * step % 90_001) as f32 - 45_000.0))
        .collect();
    daemon.put_in("a", &scattered).await;
    browser.wait("document.getElementById('notices').textContent.includes('some are not shown')").await;
    assert!(browser.eval("session.forest.size").await.as_u64().unwrap() <= 3000);
    for robot in 0..400 {
        let failing = json!({"robot": format!("r{robot}"), "points": [[null, 0, 0]]});
        daemon.post("/v1/maps/a/scans", failing).await;
    }
    browser.wait("session.events.last.has('r399')").await;
    assert!(browser.eval("session.events.last.size").await.as_u64().unwrap() <= 256);
    browser.wait("document.querySelectorAll('#robots li').length === 100").await;
    assert_clean(&browser.told(), &daemon);
}
