//! Colors that say who brought what, of scans from before the page too; and the names of those who need attention.

use serde_json::json;

use crate::browser::Browser;
use crate::support::daemon::{Daemon, client, pose_json};
use crate::{DRAWN, assert_clean, before_wall, middle_color, text, turn, wall};

/// How many voxels of level 0 that are shown have a tag.
const TAGGED: &str = "Array.from(session.forest.tiles()).filter((tile) => tile.level === 0).reduce((sum, tile) => sum + tile.words.filter((word) => word >>> 24).length, 0)";

#[tokio::test(flavor = "multi_thread")]
async fn robot_and_age_color_what_was_brought_before_the_page_was_opened() {
    let _turn = turn().await;
    let Some(browser) = Browser::start().await else { return };
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    // The first has the left half, the second the whole, and what both saw is the first's.
    let left: Vec<[f32; 3]> = wall().into_iter().filter(|[x, ..]| *x < 0.0).collect();
    for (robot, points) in [("first", left), ("second", wall())] {
        let scan = json!({"robot": robot, "points": points, "align": false, "guess": pose_json([0.0; 3])});
        assert!(daemon.post("/v1/maps/a/scans", scan).await.status().is_success());
    }
    browser.open(&daemon.url("/#map=a&at=0.35,0.05,0.05&distance=4&yaw=-1.5&pitch=0.2")).await;
    browser.wait(DRAWN).await;
    browser.press("#show-robots").await;
    browser.press("#show-paths").await;
    assert_eq!(browser.eval(TAGGED).await, 0);
    browser.press("#coloring [value=robot]").await;
    browser.wait(&format!("{TAGGED} === 441")).await;
    browser
        .wait(
            "document.getElementById('coloring-hint').textContent === 'By the robot that saw a voxel first.'",
        )
        .await;
    let look_at = |x: f64| format!("(scene.camera.target = [{x}, 0.05, 0.05], scene.invalidate())");
    let right = middle_color(&browser).await;
    browser.eval(&look_at(-0.35)).await;
    let left = middle_color(&browser).await;
    assert_ne!(right, left, "two robots");

    browser.press("#coloring [value=age]").await;
    browser.wait("document.getElementById('coloring-hint').textContent.includes('newest')").await;
    let older = middle_color(&browser).await;
    browser.eval(&look_at(0.35)).await;
    let newer = middle_color(&browser).await;
    // Of the accent, which is red, the newer one has more.
    assert!(newer[0] > older[0] && newer[2] < older[2], "{newer:?} {older:?}");

    // What comes now has its color too, and what is gone has none when it comes again.
    let more = json!({"robot": "third", "points": [[0.35, -0.45, 0.05]], "align": false, "guess": pose_json([0.0; 3])});
    assert!(daemon.post("/v1/maps/a/scans", more).await.status().is_success());
    browser.wait(&format!("{TAGGED} === 442")).await;
    assert_clean(&browser.told(), &daemon);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_map_without_a_journal_says_that_older_scans_have_no_color() {
    let _turn = turn().await;
    let Some(browser) = Browser::start().await else { return };
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    daemon.put_in("a", &wall()).await;
    let file = daemon.get("/v1/maps/a/snapshot").await.bytes().await.unwrap();
    let put =
        client().put(daemon.url("/v1/maps/b/snapshot")).header("content-type", "application/octet-stream");
    let restored = put.body(file).send().await.unwrap();
    assert!(restored.status().is_success());
    browser.open(&daemon.url("/#map=b&color=robot")).await;
    browser
        .wait("document.getElementById('coloring-hint').textContent.includes('the server has no older ones')")
        .await;
    assert_eq!(browser.eval(TAGGED).await, 0);
    assert_clean(&browser.told(), &daemon);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_page_without_room_for_who_brought_what_says_so() {
    let Some((_turn, browser, daemon)) = before_wall().await else { return };
    let small = "session.arrivals.tags = new session.arrivals.tags.constructor(1)";
    browser.eval(small).await;
    browser.press("#coloring [value=robot]").await;
    browser.wait("document.getElementById('coloring-hint').textContent.includes('more voxels than this page keeps')").await;
    browser.wait(&format!("{TAGGED} > 0")).await;
    browser.wait(&format!("{DRAWN} && {TAGGED} < 441")).await;
    assert_clean(&browser.told(), &daemon);
}

#[tokio::test(flavor = "multi_thread")]
async fn robots_keep_their_colors_and_ages_their_order_however_long_the_page_is_open() {
    let Some((_turn, browser, daemon)) = before_wall().await else { return };
    // Three robots for two hours, a scan of each every four seconds; each scan is followed by the tag it has by now.
    let kept = "await (async () => {
        const { Arrivals } = await import(new URL('viewer/arrivals.js', document.baseURI));
        const { robotColor, rgba } = await import(new URL('viewer/palette.js', document.baseURI));
        const arrivals = new Arrivals();
        const scans = [];
        const retag = (table) => scans.forEach((scan) => (scan.tag = table[scan.tag]));
        for (let i = 0; i < 5400; i++) {
            const robot = ['a', 'b', 'c'][i % 3];
            const tag = arrivals.tagOf(robot, i + 1, Math.floor(i / 3) * 4000, retag);
            scans.push({ robot, tag });
        }
        const isColored = scans.every(({ robot, tag }) =>
            String(arrivals.colorOf(tag, false)) === String(rgba(robotColor(['a', 'b', 'c'].indexOf(robot)))));
        const ages = scans.filter(({ robot }) => robot === 'a').map(({ tag }) => arrivals.colorOf(tag, true)[3]);
        const isInOrder = ages.every((age, i) => i === 0 || age >= ages[i - 1]);
        return [isColored, isInOrder, new Set(ages).size > 8, Math.max(...scans.map(({ tag }) => tag)) < 255];
    })()";
    assert_eq!(browser.eval(kept).await, json!([true, true, true, true]));
    assert_clean(&browser.told(), &daemon);
}

#[tokio::test(flavor = "multi_thread")]
async fn of_many_robots_those_that_need_attention_are_labeled() {
    let _turn = turn().await;
    let Some(browser) = Browser::start().await else { return };
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    daemon.put_in("a", &wall()).await;
    for robot in 0..80 {
        let guess = pose_json([f64::from(robot % 9), f64::from(robot / 9), 0.0]);
        let scan = json!({"robot": format!("r{robot:02}"), "points": [[0.0, 0.0, 0.1]], "align": false, "guess": guess});
        assert!(daemon.post("/v1/maps/a/scans", scan).await.status().is_success());
    }
    // The last by name.
    let lost = json!({"robot": "zz", "points": wall(), "guess": pose_json([4.0, 4.0, 0.0])});
    assert!(daemon.post("/v1/maps/a/scans", lost).await.status().is_success());
    browser.open(&daemon.url("/#map=a")).await;
    browser.wait("document.querySelector('#labels .bad:not([hidden])')?.textContent === 'zz'").await;
    // No two labels that are shown cover each other.
    let covered = "(() => { const boxes = Array.from(document.querySelectorAll('#labels span:not([hidden])'), (label) => label.getBoundingClientRect());
        return boxes.some((a, i) => boxes.some((b, j) => j > i && a.left < b.right - 1 && b.left < a.right - 1 && a.top < b.bottom - 1 && b.top < a.bottom - 1)); })()";
    browser.wait(DRAWN).await;
    assert_eq!(browser.eval(covered).await, false);
    let words = text(&browser, "#robots li").await;
    assert!(words.starts_with("zz") && words.contains("overlap"), "{words}");
    assert_clean(&browser.told(), &daemon);
}
