//! What is seen of a map at first: its rooms below their roof, beside the panels, and never an empty picture unsaid.

use serde_json::json;

use crate::browser::Browser;
use crate::support::daemon::Daemon;
use crate::{DRAWN, assert_clean, before_wall, middle, text, turn};

/// Voxels of 0.1 m of a room of 6 x 4 x 2.5 m with a floor, walls, and a roof or none.
fn room(has_roof: bool) -> Vec<[f32; 3]> {
    let cells = |number: u32| (0..number).map(|i| i as f32 * 0.1 + 0.05);
    let mut points = Vec::new();
    for (x, y) in cells(60).flat_map(|x| cells(40).map(move |y| (x, y))) {
        points.push([x, y, 0.05]);
        if has_roof {
            points.push([x, y, 2.45]);
        }
        if !(0.1..5.9).contains(&x) || !(0.1..3.9).contains(&y) {
            points.extend(cells(25).map(|z| [x, y, z]));
        }
    }
    points
}

async fn before_room(has_roof: bool) -> Option<(tokio::sync::MutexGuard<'static, ()>, Browser, Daemon)> {
    let turn = turn().await;
    let browser = Browser::start().await?;
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    daemon.put_in("a", &room(has_roof)).await;
    browser.open(&daemon.url("/#map=a")).await;
    browser.wait(&format!("{DRAWN} && page.ceiling.range")).await;
    Some((turn, browser, daemon))
}

#[tokio::test(flavor = "multi_thread")]
async fn a_roof_that_hides_the_rooms_is_left_out_until_somebody_wants_it() {
    let Some((_turn, browser, daemon)) = before_room(true).await else { return };
    browser.wait("scene.cut.max[2] > 1.9 && scene.cut.max[2] < 2.1").await;
    assert_eq!(text(&browser, "#cut-said").await, "without the roof, above 2.0 m");
    assert_eq!(
        browser.eval("location.hash.includes('cut')").await,
        false,
        "what is chosen alone is in no link"
    );

    browser.press("#ceiling").await;
    browser
        .wait("scene.cut.max[2] === Infinity && document.getElementById('cut-said').textContent === ''")
        .await;
    browser.wait("location.hash.includes('cut=')").await;
    // A link carries what was chosen: the roof stays.
    let link = browser.eval("location.href").await;
    browser.open("about:blank").await;
    browser.open(link.as_str().unwrap()).await;
    browser.wait(&format!("{DRAWN} && page.ceiling.range")).await;
    assert_eq!(browser.eval("scene.cut.max[2] === Infinity").await, true);
    browser.press("#ceiling").await;
    browser.wait("document.getElementById('cut-said').textContent === 'without what is above 2.0 m'").await;
    assert_clean(&browser.told(), &daemon);
}

#[tokio::test(flavor = "multi_thread")]
async fn the_help_opens_and_leads_to_what_this_server_has() {
    let Some((_turn, browser, daemon)) = before_wall().await else { return };
    browser.press("#open-help").await;
    browser.wait("document.getElementById('help-dialog').open").await;
    let links = "await Promise.all(Array.from(document.querySelectorAll('#help-dialog a'), async (link) => (await fetch(link.href)).status))";
    assert_eq!(browser.eval(links).await, json!([200, 200]));
    browser.press("#help-dialog button").await;
    browser.wait("!document.getElementById('help-dialog').open").await;
    assert_clean(&browser.told(), &daemon);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_map_without_a_roof_is_shown_whole() {
    let Some((_turn, browser, daemon)) = before_room(false).await else { return };
    assert_eq!(browser.eval("scene.cut.max[2] === Infinity").await, true);
    assert_eq!(text(&browser, "#cut-said").await, "");
    assert_clean(&browser.told(), &daemon);
}

/// True where the corners of the room are in the part of the page that no panel covers, and fill it in one direction.
const FITS: &str = "(() => {
    const places = [0, 6].flatMap((x) => [0, 4].flatMap((y) => [0, 2].map((z) => scene.pageOf([x, y, z]))));
    const box = (id) => document.getElementById(id).getBoundingClientRect();
    const room = [box('tools').right, box('side').left, box('bar').bottom, box('foot').top];
    const [left, right, top, bottom] = [[Math.min, 0], [Math.max, 0], [Math.min, 1], [Math.max, 1]].map(([end, i]) => end(...places.map((at) => at[i])));
    const isIn = left >= room[0] && right <= room[1] && top >= room[2] && bottom <= room[3];
    const fills = Math.max((right - left) / (room[1] - room[0]), (bottom - top) / (room[3] - room[2]));
    return isIn && fills > 0.6;
})()";

#[tokio::test(flavor = "multi_thread")]
async fn all_and_top_fit_what_the_panels_leave_and_top_lies_along_the_axes() {
    let Some((_turn, browser, daemon)) = before_room(true).await else { return };
    browser.wait(FITS).await;
    // The robot is turned to, and back at the whole by a click.
    browser.drag(middle(&browser).await, [90.0, 30.0]).await;
    browser.wait("!page.views.isFollowing").await;
    browser.press("#frame").await;
    browser.wait(FITS).await;

    let yaw = browser.eval("scene.camera.yaw").await;
    browser.press("#top").await;
    browser.wait(FITS).await;
    let axes = "(() => { const [from, x, y] = [[0, 0, 0], [1, 0, 0], [0, 1, 0]].map((at) => scene.pageOf(at));
                return Math.abs(x[1] - from[1]) < 0.01 && x[0] > from[0] && Math.abs(y[0] - from[0]) < 0.01 && y[1] < from[1]; })()";
    browser.wait(axes).await;
    browser.press("#top").await;
    browser.wait(FITS).await;
    assert_eq!(browser.eval("scene.camera.yaw").await, yaw);

    // On a phone the panel lies below the map.
    let phone = json!({"width": 390, "height": 760, "deviceScaleFactor": 1, "mobile": true});
    browser.call("Emulation.setDeviceMetricsOverride", phone).await;
    let below = FITS.replace(
        "box('tools').right, box('side').left, box('bar').bottom, box('foot').top",
        "0, innerWidth, box('tools').bottom, box('foot').top",
    );
    browser.wait(&below).await;
    let small = "Array.from(document.querySelectorAll('button, select, summary, #side label')).filter((one) => {
        const { width, height } = one.getBoundingClientRect(); return width > 0 && height > 0 && (height < 44 || width < 40); }).map((one) => one.textContent)";
    assert_eq!(browser.eval(small).await, json!([]), "boxes that no finger hits");
    assert_clean(&browser.told(), &daemon);
}

#[tokio::test(flavor = "multi_thread")]
async fn the_wheel_leads_to_the_surface_under_it_and_an_empty_picture_says_why() {
    let Some((_turn, browser, daemon)) = before_wall().await else { return };
    let [x, y] = middle(&browser).await;
    let at = [x + 60.0, y - 40.0];
    let point = browser.eval(&format!("scene.pickAt({}, {}).point", at[0], at[1])).await;
    for _ in 0..40 {
        let wheel = json!({"type": "mouseWheel", "x": at[0], "y": at[1], "deltaX": 0, "deltaY": -240});
        browser.call("Input.dispatchMouseEvent", wheel).await;
    }
    // As near as the camera comes, and still before the wall at the same place of it.
    browser.wait("scene.camera.distance < 0.2").await;
    let apart = format!(
        "Math.hypot(...scene.pickAt({}, {}).point.map((value, i) => value - {point}[i]))",
        at[0], at[1]
    );
    assert!(browser.eval(&apart).await.as_f64().unwrap() < 0.02);
    browser.wait(&format!("{DRAWN} && document.getElementById('unseen').hidden")).await;

    // Beside the map is nothing, which is said with a way back.
    browser.eval("(scene.camera.target = [0, 500, 0], scene.moved())").await;
    browser
        .wait(
            "document.getElementById('unseen').textContent.includes('No voxel of the map is in the picture')",
        )
        .await;
    assert_eq!(text(&browser, "#count").await, "no voxel in the picture");
    browser.press("#unseen button").await;
    browser.wait(&format!("{DRAWN} && document.getElementById('unseen').hidden")).await;
    browser.wait("document.getElementById('count').textContent === '441 voxels shown'").await;

    // All is cut off.
    browser.eval("(() => { const z = document.getElementById('cut-z-to'); z.value = 1; z.dispatchEvent(new Event('input')); })()").await;
    browser.wait("document.getElementById('unseen').textContent.includes('cut off')").await;
    browser.press("#unseen button").await;
    browser.wait(&format!("{DRAWN} && document.getElementById('unseen').hidden")).await;
    assert_clean(&browser.told(), &daemon);
}

#[tokio::test(flavor = "multi_thread")]
async fn frames_of_a_second_make_the_picture_coarser_while_it_moves_and_rest_makes_it_whole() {
    let Some((_turn, browser, daemon)) = before_wall().await else { return };
    // From so far that coarser cells would do for a slow machine.
    let moving = "(async () => {
        Object.assign(scene.camera, { distance: 12 });
        const later = performance.now.bind(performance);
        let added = 0;
        performance.now = () => later() + added;
        let least = Infinity;
        scene.whenDrawn(() => (least = Math.min(least, scene.drawn.voxels)));
        for (let i = 0; i < 8; i++) {
            scene.moved();
            added += 1500;
            await new Promise((drawn) => requestAnimationFrame(() => setTimeout(drawn)));
        }
        performance.now = later;
        return least;
    })()";
    let least = browser.eval(&format!("await {moving}")).await.as_u64().unwrap();
    assert!(least < 200, "{least} voxels are drawn while frames take a second and a half");
    browser.wait(&format!("{DRAWN} && scene.drawn.voxels === 441")).await;
    assert_clean(&browser.told(), &daemon);
}
