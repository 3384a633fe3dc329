//! Looking at a map, asking about it, and changing it.

use serde_json::json;

use crate::browser::Browser;
use crate::support::daemon::Daemon;
use crate::{DRAWN, assert_clean, before_wall, link, middle, middle_color, shown, text, turn, wall};

#[tokio::test(flavor = "multi_thread")]
async fn a_map_is_turned_picked_cut_deleted_from_and_undone() {
    let Some((_turn, browser, daemon)) = before_wall().await else { return };
    assert_eq!(shown(&browser).await, 441);
    assert!(browser.eval("scene.drawn.calls").await.as_u64().unwrap() <= 64);
    let at = middle(&browser).await;
    // The robot stands in the middle.
    browser.press("#show-robots").await;
    let wall_color = middle_color(&browser).await;

    // A click says which voxel it hit, and who saw it.
    browser.click(at).await;
    browser.wait("document.querySelector('#tool-panel dd')").await;
    let picked = text(&browser, "#tool-panel dl").await;
    assert!(picked.starts_with("voxel0, 0, 0") && picked.contains("level0"), "{picked}");
    browser.press("#observers").await;
    browser.wait("document.querySelectorAll('#observed li').length === 1").await;
    assert!(text(&browser, "#observed").await.contains("setup"));

    // A drag turns the camera: the middle stays what it is, the link follows.
    let yaw = browser.eval("scene.camera.yaw").await.as_f64().unwrap();
    browser.drag(at, [120.0, 0.0]).await;
    browser.wait(&format!("Math.abs(scene.camera.yaw - {yaw}) > 0.5")).await;
    browser.wait("location.hash.includes('yaw=-2.2')").await;

    // A coarser level has fewer voxels, and the finest again all.
    browser.eval("(document.getElementById('finest').value = 2, document.getElementById('finest').dispatchEvent(new Event('input')))").await;
    browser.wait(&format!("{DRAWN} && scene.drawn.voxels < 60")).await;
    browser.eval("(document.getElementById('finest').value = 0, document.getElementById('finest').dispatchEvent(new Event('input')))").await;
    browser.wait(&format!("{DRAWN} && scene.drawn.voxels === 441")).await;

    // A ball around the middle goes, with the color that was there, and comes back.
    browser.press("[data-tool=region]").await;
    browser.click(at).await;
    browser.press("#delete").await;
    browser.wait(&format!("{DRAWN} && scene.drawn.voxels < 441")).await;
    let (revision, left) = daemon.contents("a").await;
    assert_eq!(revision, 2);
    browser.wait(&format!("scene.drawn.voxels === {}", left.len())).await;
    browser.press("[data-tool=pick]").await;
    let hole_color = middle_color(&browser).await;
    assert_ne!(hole_color, wall_color);
    browser.press("#notices button").await;
    browser.wait(&format!("{DRAWN} && scene.drawn.voxels === 441")).await;
    assert_eq!(daemon.contents("a").await.1.len(), 441);
    assert_ne!(middle_color(&browser).await, hole_color);

    let told = browser.told();
    assert_clean(&told, &daemon);
    assert!(told.failures.is_empty(), "{told:?}");
}

#[tokio::test(flavor = "multi_thread")]
async fn what_lies_over_a_map_is_shown_and_asked_for() {
    let _turn = turn().await;
    let Some(browser) = Browser::start().await else { return };
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    daemon.put_in("a", &wall()).await;
    let dock = json!({"box": {"min_m": [-0.5, -1, -0.5], "max_m": [0.5, -0.5, 0.5]}});
    assert!(daemon.put("/v1/maps/a/keep-outs/dock", dock).await.status().is_success());
    browser.open(&link(&daemon, "a")).await;
    browser
        .wait("document.querySelector('#keep-outs li') && document.querySelector('#robots li button')")
        .await;
    assert!(text(&browser, "#keep-outs").await.contains("dock"));
    assert!(text(&browser, "#robots").await.contains("setup"));
    assert!(text(&browser, "#labels").await.contains("dock"));

    // A body that stands in the wall does not fit; one that is small and before it does.
    browser.wait(DRAWN).await;
    let at = middle(&browser).await;
    browser.press("[data-tool=body]").await;
    browser.click(at).await;
    browser.wait("document.querySelector('#tool-panel dl')").await;
    assert!(text(&browser, "#tool-panel dl").await.contains("does not fit"));

    // Two points of the wall are so far apart as they are.
    browser.press("[data-tool=ruler]").await;
    browser.click(at).await;
    browser.click([at[0] + 100.0, at[1]]).await;
    browser.wait("document.querySelector('#tool-panel dl')").await;
    let apart = text(&browser, "#tool-panel dl").await;
    assert!(apart.contains("distance") && apart.contains(" cm"), "{apart}");

    // What is removed elsewhere goes at once.
    assert!(daemon.delete("/v1/maps/a/keep-outs/dock").await.status().is_success());
    browser.wait("document.querySelectorAll('#keep-outs li').length === 0").await;
    assert_clean(&browser.told(), &daemon);
}
