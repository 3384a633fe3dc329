//! A server with keys: the page asks for one, and does no more than it is for.

use mrol::access::{Key, KeyName, Scope, Secret, add_to_file};
use mrol::service::AllowedMaps;
use reqwest::Method;
use serde_json::json;

use crate::browser::Browser;
use crate::support::daemon::{Daemon, client, identity_json};
use crate::{DRAWN, assert_clean, link, middle, text, turn, wall};

#[tokio::test(flavor = "multi_thread")]
async fn a_key_is_asked_for_and_one_that_reads_deletes_nothing() {
    let _turn = turn().await;
    let Some(browser) = Browser::start().await else { return };
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("keys.toml");
    let [master, reader] = [("master", Scope::Admin), ("reader", Scope::Read)].map(|(name, scope)| {
        let secret = Secret::random().unwrap();
        let key = Key::new(KeyName::new(name).unwrap(), secret.digest(), scope, AllowedMaps::Every);
        add_to_file(&file, &key).unwrap();
        secret
    });
    let daemon = Daemon::start_with(|config| config.access.keys_file = Some(file.clone())).await;
    let ask = |method: Method, path: &str, body| {
        client().request(method, daemon.url(path)).bearer_auth(master.reveal()).json(&body).send()
    };
    ask(Method::PUT, "/v1/maps/a", json!({"resolution_m": 0.1, "levels": 4})).await.unwrap();
    let scan = json!({"robot": "r", "points": wall(), "guess": identity_json(), "align": false});
    assert!(ask(Method::POST, "/v1/maps/a/scans", scan).await.unwrap().status().is_success());

    browser.open(&link(&daemon, "a")).await;
    browser.wait("document.getElementById('key-dialog').open").await;
    assert!(text(&browser, "#key-said").await.contains("needs a key"));
    browser.fill("#key", reader.reveal()).await;
    browser.press("#key-form button").await;
    browser.wait(&format!("{DRAWN} && scene.drawn.voxels === 441")).await;

    browser.press("[data-tool=region]").await;
    browser.click(middle(&browser).await).await;
    browser.press("#delete").await;
    browser.wait("document.getElementById('notices').textContent.includes('takes scope write')").await;
    let map: serde_json::Value =
        ask(Method::GET, "/v1/maps/a", json!({})).await.unwrap().json().await.unwrap();
    assert_eq!((&map["revision"], &map["levels"][0]["voxels"]), (&json!(1), &json!(441)));

    // The key is nowhere that outlives the page.
    browser.wait("location.hash.includes('map=a')").await;
    let kept = browser.eval("location.href + document.cookie + JSON.stringify(localStorage) + JSON.stringify(sessionStorage) + document.getElementById('key').value").await;
    assert!(!kept.as_str().unwrap().contains(reader.reveal()), "{kept}");
    assert_clean(&browser.told(), &daemon);
}
