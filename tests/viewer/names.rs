//! Whatever others named is text: nothing of it runs.

use serde_json::{Value, json};

use crate::browser::Browser;
use crate::support::daemon::{Daemon, identity_json};
use crate::{assert_clean, turn, wall};

/// What would run if it were taken for markup.
const HOSTILE: &str = "<img src=x onerror=\"globalThis.ran=1\">";

#[tokio::test(flavor = "multi_thread")]
async fn what_a_link_a_file_or_an_answer_names_runs_nothing() {
    let _turn = turn().await;
    let Some(browser) = Browser::start().await else { return };
    let daemon = Daemon::start().await;
    daemon.make_map("a").await;
    // Names with as much in them as the server takes.
    let scan = json!({"robot": "r.2-_X", "session": "s.1", "scan_id": 1, "points": wall(), "guess": identity_json(), "align": false});
    assert!(daemon.post("/v1/maps/a/scans", scan).await.status().is_success());

    // A link that names no map but markup is told so.
    let link = daemon.url(&format!("/#{}", Value::String(HOSTILE.into()).as_str().unwrap()));
    browser.open(&link.replace("/#", "/#map=")).await;
    browser.wait("document.getElementById('notices').textContent.includes('<img src=x')").await;
    assert_eq!(browser.eval("document.querySelectorAll('img').length").await, 0);

    // A server that says it of everything: its answers are stood in for.
    let stand_in = format!(
        "(() => {{
            const hostile = {};
            const pose = {{ translation_m: [0, 0, 0], rotation_xyzw: [0, 0, 0, 1] }};
            const real = globalThis.fetch;
            globalThis.fetch = async (path, options) => {{
                const answer = await real(path, options);
                if (!answer.headers.get('content-type')?.includes('json')) return answer;
                const said = await answer.json();
                for (const map of said.maps ?? []) said.unavailable = [{{ map: hostile, reason: hostile }}];
                if (Array.isArray(said.poses)) said.poses = said.poses.map((of) => ({{ ...of, robot: hostile, session: hostile }}));
                if (said.keep_outs) said.keep_outs = [{{ name: hostile, made_by: hostile, sphere: {{ center_m: [0, 0, 0], radius_m: 1 }} }}];
                const failed = {{ number: 1, time_ms: 0, robot: hostile, session: hostile, points: 1, duration_ms: 1, answer: null,
                                  error: {{ reason: hostile, detail: hostile }} }};
                if (said.events) said.events = [failed];
                if (said.settings) said.sightings = [{{ robot: hostile, verdict: hostile, seen_at_ns: 0, map_from_sensor: pose }}];
                return new Response(JSON.stringify(said), {{ status: answer.status, headers: answer.headers }});
            }};
            location.hash = 'map=a';
            return page.start();
        }})()",
        json!(HOSTILE)
    );
    browser.eval(&stand_in).await;
    for list in ["scans", "answers"] {
        browser.eval(&format!("document.getElementById('{list}').parentElement.open = true")).await;
    }
    for list in ["#robots", "#answers", "#scans", "#keep-outs", "#labels", "#notices"] {
        browser.wait(&format!("document.querySelector({list:?}).textContent.includes('<img src=x')")).await;
    }
    assert_eq!(browser.eval("document.querySelectorAll('img').length").await, 0);
    assert_eq!(browser.eval("globalThis.ran ?? 0").await, 0);
    assert_clean(&browser.told(), &daemon);
}
