//! A server without a map: what to do, a map that is made, and one that is restored.

use serde_json::json;

use crate::browser::Browser;
use crate::support::daemon::Daemon;
use crate::{DRAWN, assert_clean, text, turn, wall};

#[tokio::test(flavor = "multi_thread")]
async fn who_has_no_map_is_told_what_to_do_makes_one_and_restores_one() {
    let _turn = turn().await;
    let Some(browser) = Browser::start().await else { return };
    let other = Daemon::start().await;
    other.make_map("a").await;
    other.put_in("a", &wall()).await;
    let file = other.get("/v1/maps/a/snapshot").await.bytes().await.unwrap();

    let daemon = Daemon::start().await;
    browser.open(&daemon.url("/")).await;
    browser.wait("document.getElementById('empty').textContent.includes('No map yet')").await;
    assert!(text(&browser, "#empty").await.contains(&format!(
        "curl -X PUT -H 'content-type: application/json' -d '{{\"resolution_m\":0.05}}' {}",
        daemon.url("/v1/maps/office")
    )));

    browser.fill("#create [name=map]", "office").await;
    browser.press("#create button").await;
    browser.wait("document.getElementById('empty').textContent.includes('office is empty')").await;
    let office = daemon.get("/v1/maps/office").await;
    assert!(office.status().is_success());

    // A file is dropped anywhere: its name becomes the map's, made fit for one.
    let bytes: Vec<u8> = file.to_vec();
    let drop_it = format!(
        "(() => {{
            const data = new DataTransfer();
            data.items.add(new File([Uint8Array.from({})], 'My Map (2).mrol'));
            dispatchEvent(new DragEvent('drop', {{ dataTransfer: data }}));
        }})()",
        json!(bytes)
    );
    browser.eval(&drop_it).await;
    browser
        .wait(&format!("page.session?.name === 'my-map-2-' && {DRAWN} && scene.drawn.voxels === 441"))
        .await;
    assert_eq!(daemon.contents("my-map-2-").await.1.len(), 441);

    // What is no map file is refused, and said.
    browser.eval("(() => { const data = new DataTransfer(); data.items.add(new File(['no map'], 'b.mrol')); dispatchEvent(new DragEvent('drop', { dataTransfer: data })); })()").await;
    browser.wait("document.querySelector('#notices .bad')").await;
    assert!(!daemon.get("/v1/maps/b").await.status().is_success());
    assert_clean(&browser.told(), &daemon);
}
