//! What the viewer takes, for docs/measurements.md: `cargo test --release --test viewer figures -- --ignored
//! --nocapture`.

use std::time::Duration;

use serde_json::{Value, json};
use tokio::time::{Instant, sleep};

use crate::browser::Browser;
use crate::support::daemon::{Daemon, bytes_of, json_of, pose_json};
use crate::turn;

/// Voxels of the generated sites, meters.
const RESOLUTION_M: f32 = 0.1;
/// Points of one scan.
const AT_ONCE: usize = 2_000_000;

/// Numbers from 0 to 1 that look like chance, the same each time.
struct Dice(u64);

impl Dice {
    fn between(&mut self, least: f32, most: f32) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        least + (self.0 >> 40) as f32 / (1u64 << 24) as f32 * (most - least)
    }
}

/// Hilly ground of so many meters a side, and buildings of four walls with windows.
fn site(side_m: f32, buildings: usize) -> Vec<[f32; 3]> {
    let cells =
        |length_m: f32| (0..(length_m / RESOLUTION_M) as usize).map(|i| (i as f32 + 0.5) * RESOLUTION_M);
    let mut points: Vec<[f32; 3]> = cells(side_m)
        .flat_map(|x| cells(side_m).map(move |y| [x, y, 1.5 * (x / 17.0).sin() + 1.2 * (y / 23.0).cos()]))
        .collect();
    let mut dice = Dice(1);
    for _ in 0..buildings {
        let [x, y] = [(); 2].map(|()| dice.between(2.0, (side_m - 24.0).max(3.0)));
        let [width, depth, height] =
            [dice.between(10.0, 22.0), dice.between(10.0, 22.0), dice.between(6.0, 16.0)];
        let walls = [([x, y], [1.0, 0.0], width), ([x, y + depth], [1.0, 0.0], width)];
        let walls =
            walls.into_iter().chain([([x, y], [0.0, 1.0], depth), ([x + width, y], [0.0, 1.0], depth)]);
        for ([x, y], [along_x, along_y], length) in walls {
            for (t, z) in cells(length).flat_map(|t| cells(height).map(move |z| (t, z - 1.0))) {
                if t % 3.0 < 2.0 || z % 3.0 > 1.5 || z < 1.0 {
                    points.push([x + along_x * t, y + along_y * t, z]);
                }
            }
        }
    }
    points
}

async fn put_site(daemon: &Daemon, map: &str, points: &[[f32; 3]]) -> Value {
    let settings = json!({"resolution_m": RESOLUTION_M, "filter": "none", "moments": false});
    assert!(daemon.put(&format!("/v1/maps/{map}"), settings).await.status().is_success());
    for some in points.chunks(AT_ONCE) {
        let path = format!("/v1/maps/{map}/scans?robot=r&align=false&guess=0,0,0,0,0,0,1");
        let answer = daemon.post_bytes(&path, bytes_of(some)).await;
        assert!(answer.status().is_success(), "{}", answer.text().await.unwrap());
    }
    json_of(daemon.get(&format!("/v1/maps/{map}")).await).await["levels"][0]["voxels"].clone()
}

/// Sorted; the median and the largest.
fn median_and_most(mut numbers: Vec<f64>) -> (f64, f64) {
    numbers.sort_by(f64::total_cmp);
    (numbers[numbers.len() / 2], numbers[numbers.len() - 1])
}

/// Turns the camera, and takes the time of scripts in each frame, milliseconds.
async fn scripts_while_turning(browser: &Browser) -> (f64, f64) {
    browser
        .eval("(globalThis.took = [], scene.whenDrawn(() => globalThis.took.push(scene.drawn.script_ms)))")
        .await;
    for _ in 0..40 {
        browser.eval("(scene.camera.yaw += 0.03, scene.moved())").await;
        sleep(Duration::from_millis(100)).await;
    }
    browser.wait("scene.drawn.is_complete").await;
    median_and_most(serde_json::from_value(browser.eval("globalThis.took").await).unwrap())
}

#[tokio::test(flavor = "multi_thread")]
#[ignore = "prints figures, in a minute or two"]
async fn figures_of_sites() {
    let _turn = turn().await;
    let Some(browser) = Browser::start().await else { return };
    let size = json!({"width": 1280, "height": 800, "deviceScaleFactor": 1, "mobile": false});
    browser.call("Emulation.setDeviceMetricsOverride", size).await;
    let daemon = Daemon::start().await;
    for (map, side_m, buildings) in [("small", 24.0, 4), ("middle", 72.0, 14), ("large", 236.0, 100)] {
        let voxels = put_site(&daemon, map, &site(side_m, buildings)).await;
        browser.open("about:blank").await;
        browser.open(&daemon.url(&format!("/#map={map}"))).await;
        browser.wait("scene.drawn.voxels > 0").await;
        let first = browser.eval("session.loader.bytes").await;
        browser.wait("scene.drawn.is_complete && scene.drawn.tiles > 0").await;
        let drawn = browser.eval("scene.drawn").await;
        let kept = "(() => { let [pages, words] = [0, 0];
                    for (const tile of session.forest.tiles()) { pages += tile.pages.length; words += tile.words.length; }
                    return [session.loader.bytes, session.loader.bytes / words, pages * 1024 / words]; })()";
        let kept = browser.eval(kept).await;
        let (median, longest) = scripts_while_turning(&browser).await;
        println!(
            "{voxels} voxels: first picture after {first} bytes; [bytes sent, bytes sent a voxel, bytes on the GPU a \
             voxel] {kept}; drawn {drawn}; scripts of a frame {median:.1} ms, longest {longest:.1} ms"
        );
    }
}

/// The page's way of drawing beside the usual one, in the same run.
#[tokio::test(flavor = "multi_thread")]
#[ignore = "prints figures, in a minute or two"]
async fn figures_of_two_ways() {
    let _turn = turn().await;
    let Some(browser) = Browser::start().await else { return };
    let size = json!({"width": 1280, "height": 800, "deviceScaleFactor": 1, "mobile": false});
    browser.call("Emulation.setDeviceMetricsOverride", size).await;
    let daemon = Daemon::start().await;
    for (map, side_m, buildings) in [("small", 24.0, 4), ("middle", 72.0, 14)] {
        put_site(&daemon, map, &site(side_m, buildings)).await;
        browser.open("about:blank").await;
        browser.open(&daemon.url(&format!("/#map={map}"))).await;
        browser.wait("scene.drawn.is_complete && scene.drawn.tiles > 0").await;
        let drawn =
            browser.eval(&format!("await (async () => {{ {} }})()", include_str!("two_ways.js"))).await;
        let mut times = [Vec::new(), Vec::new()];
        for _ in 0..7 {
            let mut pixels = [0.0; 2];
            for (way, times) in times.iter_mut().enumerate() {
                let frame = browser.eval(&format!("globalThis.frameOf({way})")).await;
                times.push(frame["took"].as_f64().unwrap());
                pixels[way] = frame["colored"].as_f64().unwrap();
            }
            assert!(pixels[0] > 1e4 && (pixels[0] / pixels[1] - 1.0).abs() < 0.01, "{pixels:?}");
        }
        let [pulled, instanced] = times.map(|times| median_and_most(times).0);
        println!(
            "{map}: {drawn}; a frame {pulled:.0} ms by the page, {instanced:.0} ms by instances of a box"
        );
    }
}

/// The heap after a collection: the median of six within a minute, bytes.
async fn heap_of_a_minute(browser: &Browser) -> f64 {
    let mut sizes = Vec::new();
    for _ in 0..6 {
        sleep(Duration::from_secs(10)).await;
        browser.call("HeapProfiler.collectGarbage", json!({})).await;
        let usage = browser.call("Runtime.getHeapUsage", json!({})).await;
        sizes.push(usage["result"]["usedSize"].as_f64().unwrap());
    }
    median_and_most(sizes).0
}

/// Scans at forty places over and over, and now and then a deletion that is undone: the map stays as large as it is.
async fn change_without_end(daemon: &Daemon) -> ! {
    let mut dice = Dice(7);
    let clouds: Vec<Vec<[f32; 3]>> = (0..40)
        .map(|_| {
            (0..1500)
                .map(|_| [dice.between(-5.0, 5.0), dice.between(-5.0, 5.0), dice.between(0.0, 0.3)])
                .collect()
        })
        .collect();
    let mut number = 0;
    loop {
        let turn = (number % 40) as f64 * std::f64::consts::TAU / 40.0;
        let place = [8.0 * turn.cos(), 8.0 * turn.sin(), 0.0];
        let scan = json!({"robot": format!("r{}", number % 4), "scan_id": number, "points": clouds[number % 40],
                          "align": false, "guess": pose_json(place)});
        daemon.post("/v1/maps/live/scans", scan).await;
        if number % 7 == 0 {
            let ball = json!({"sphere": {"center_m": place, "radius_m": 3}});
            let deleted = json_of(daemon.post("/v1/maps/live/deletions", ball).await).await;
            daemon.post("/v1/maps/live/undo", json!({"revision": deleted["revision"]})).await;
        }
        number += 1;
        sleep(Duration::from_millis(400)).await;
    }
}

#[tokio::test(flavor = "multi_thread")]
#[ignore = "prints the heap of each of ten minutes"]
async fn figures_of_the_heap() {
    let _turn = turn().await;
    let Some(browser) = Browser::start().await else { return };
    let daemon = Daemon::start().await;
    assert!(daemon.put("/v1/maps/live", json!({"resolution_m": 0.1})).await.status().is_success());
    browser.call("HeapProfiler.enable", json!({})).await;
    let watching = async {
        // The whole map is there once each place was seen.
        sleep(Duration::from_secs(30)).await;
        browser.open(&daemon.url("/#map=live&color=robot")).await;
        browser.wait("scene.drawn.is_complete && scene.drawn.tiles > 0").await;
        let start = Instant::now();
        for minute in 1..=10 {
            let heap = heap_of_a_minute(&browser).await;
            let [voxels, scans] = ["scene.drawn.voxels", "session.robots.steps.length"];
            let (voxels, scans) = (browser.eval(voxels).await, browser.eval(scans).await);
            println!(
                "minute {minute} ({:.0?}): {heap} bytes; {voxels} voxels, {scans} scans",
                start.elapsed()
            );
        }
    };
    tokio::select! {
        () = watching => {}
        _ = change_without_end(&daemon) => {}
    }
}
