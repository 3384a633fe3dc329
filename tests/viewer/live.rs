//! A map that changes while it is looked at, and a server that goes away.

use crate::browser::Browser;
use crate::support::daemon::Daemon;
use crate::{DRAWN, assert_clean, link, shown, turn, wall};

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
