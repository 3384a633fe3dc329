//! A Chromium without a window, driven over its DevTools protocol.

use std::env;
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use futures_util::{SinkExt, StreamExt};
use serde_json::{Value, json};
use tempfile::TempDir;
use tokio::net::TcpStream;
use tokio::sync::{mpsc, oneshot};
use tokio::time::{sleep, timeout};
use tokio_tungstenite::tungstenite::Message;
use tokio_tungstenite::{MaybeTlsStream, WebSocketStream, connect_async};

use crate::support::skipped::skipped;

/// Set where a browser has to be there: the tests fail without one then.
const REQUIRED: &str = "BROWSER_REQUIRED";
const PROGRAMS: [&str; 3] = ["chromium", "chromium-browser", "google-chrome"];
/// How long anything in the browser may take before a test gives up.
const PATIENCE: Duration = Duration::from_secs(40);
const POLL: Duration = Duration::from_millis(50);

type Socket = WebSocketStream<MaybeTlsStream<TcpStream>>;
type Answer = oneshot::Sender<Value>;

/// A browser with one page.
pub(crate) struct Browser {
    process: Child,
    _profile: TempDir,
    calls: mpsc::UnboundedSender<(String, Value, Answer)>,
    told: Arc<Mutex<Told>>,
}

/// What the browser told of its page.
#[derive(Debug, Default)]
pub(crate) struct Told {
    /// Errors of scripts, of the security policy and on the console; not those of requests.
    pub(crate) errors: Vec<String>,
    /// Requests that were refused or found nobody.
    pub(crate) failures: Vec<String>,
    /// The addresses that were asked for.
    pub(crate) requests: Vec<String>,
}

impl Browser {
    /// Starts the browser; none, which is said, where the machine has no Chromium.
    pub(crate) async fn start() -> Option<Self> {
        let Some(program) = PROGRAMS.iter().find(|program| is_there(program)) else {
            assert!(env::var_os(REQUIRED).is_none(), "{REQUIRED} is set, and none of {PROGRAMS:?} is there");
            skipped(format_args!("none of {PROGRAMS:?} is there: apt-get install chromium"));
            return None;
        };
        let profile = tempfile::tempdir().unwrap();
        let process = Command::new(program)
            .args([
                "--headless",
                "--no-sandbox",
                "--no-first-run",
                "--disable-extensions",
                "--remote-debugging-port=0",
            ])
            .args([
                "--use-gl=angle",
                "--use-angle=swiftshader",
                "--enable-unsafe-swiftshader",
                "--window-size=900,600",
            ])
            .arg(format!("--user-data-dir={}", profile.path().display()))
            .arg("about:blank")
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let socket = connect(&profile).await;
        let (calls, asked) = mpsc::unbounded_channel();
        let told = Arc::default();
        tokio::spawn(talk(socket, asked, Arc::clone(&told)));
        let browser = Self { process, _profile: profile, calls, told };
        for domain in ["Page", "Runtime", "Log", "Network"] {
            browser.call(&format!("{domain}.enable"), json!({})).await;
        }
        let size = json!({"width": 900, "height": 600, "deviceScaleFactor": 1, "mobile": false});
        browser.call("Emulation.setDeviceMetricsOverride", size).await;
        Some(browser)
    }

    /// Calls a method of the protocol.
    pub(crate) async fn call(&self, method: &str, parameters: Value) -> Value {
        let (answer, answered) = oneshot::channel();
        self.calls.send((method.to_owned(), parameters, answer)).unwrap();
        let answer = timeout(PATIENCE, answered).await.unwrap_or_else(|_| panic!("{method} got no answer"));
        answer.unwrap()
    }

    pub(crate) async fn open(&self, address: &str) {
        self.call("Page.navigate", json!({"url": address})).await;
    }

    /// The value of an expression in the page, where `page` is the viewer; promises are waited for.
    pub(crate) async fn eval(&self, expression: &str) -> Value {
        let expression = format!(
            "(async () => {{ const {{ page }} = await import(new URL('viewer/main.js', document.baseURI)); \
             const {{ scene, session }} = page; return {expression}; }})()"
        );
        let parameters = json!({"expression": expression, "awaitPromise": true, "returnByValue": true});
        let answer = self.call("Runtime.evaluate", parameters).await;
        assert!(answer["result"]["exceptionDetails"].is_null(), "{expression}: {answer}");
        answer["result"]["result"]["value"].clone()
    }

    /// Waits until an expression is true.
    pub(crate) async fn wait(&self, expression: &str) {
        let become_true = async {
            // Until its page is there, the viewer is not.
            while !self.is_true(expression).await {
                sleep(POLL).await;
            }
        };
        if timeout(PATIENCE, become_true).await.is_err() {
            panic!("never true: {expression}; {:?}", self.told.lock().unwrap());
        }
    }

    async fn is_true(&self, expression: &str) -> bool {
        self.eval(&format!("(() => {{ try {{ return Boolean({expression}) }} catch {{ return false }} }})()"))
            .await
            == true
    }

    /// Presses the mouse at a place of the page, moves it by `x` and `y`, and lets it go.
    pub(crate) async fn drag(&self, [at_x, at_y]: [f64; 2], [x, y]: [f64; 2]) {
        let mouse = |kind: &'static str, x: f64, y: f64| {
            let buttons = u8::from(kind != "mouseReleased");
            let event =
                json!({"type": kind, "x": x, "y": y, "button": "left", "buttons": buttons, "clickCount": 1});
            self.call("Input.dispatchMouseEvent", event)
        };
        mouse("mousePressed", at_x, at_y).await;
        if x != 0.0 || y != 0.0 {
            for step in 1..=4 {
                let share = f64::from(step) / 4.0;
                mouse("mouseMoved", at_x + x * share, at_y + y * share).await;
            }
        }
        mouse("mouseReleased", at_x + x, at_y + y).await;
    }

    pub(crate) async fn click(&self, at: [f64; 2]) {
        self.drag(at, [0.0, 0.0]).await;
    }

    /// Clicks the element that a selector names.
    pub(crate) async fn press(&self, selector: &str) {
        self.wait(&format!("document.querySelector({selector:?})")).await;
        self.eval(&format!("document.querySelector({selector:?}).click()")).await;
    }

    /// Writes into a field.
    pub(crate) async fn fill(&self, selector: &str, text: &str) {
        self.eval(&format!("document.querySelector({selector:?}).value = {}", json!(text))).await;
    }

    /// What was told so far.
    pub(crate) fn told(&self) -> Told {
        std::mem::take(&mut *self.told.lock().unwrap())
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        // It may have ended by itself.
        drop(self.process.kill());
        drop(self.process.wait());
    }
}

fn is_there(program: &str) -> bool {
    let version = Command::new(program).arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status();
    version.is_ok_and(|status| status.success())
}

/// Connects to the browser's first page, whose port it writes into its profile.
async fn connect(profile: &TempDir) -> Socket {
    let file = profile.path().join("DevToolsActivePort");
    let page = async {
        loop {
            let port = std::fs::read_to_string(&file).ok();
            if let Some(port) = port.as_deref().and_then(|text| text.lines().next()) {
                let listed = reqwest::get(format!("http://127.0.0.1:{port}/json/list")).await;
                let pages: Vec<Value> = match listed {
                    Ok(listed) => listed.json().await.unwrap_or_default(),
                    Err(_) => Vec::new(),
                };
                if let Some(page) = pages.iter().find(|page| page["type"] == "page") {
                    return page["webSocketDebuggerUrl"].as_str().unwrap().to_owned();
                }
            }
            sleep(POLL).await;
        }
    };
    let address = timeout(PATIENCE, page).await.expect("a browser that starts");
    connect_async(address).await.unwrap().0
}

/// Hands calls to the browser and answers back, and keeps what is told besides.
async fn talk(
    socket: Socket,
    mut calls: mpsc::UnboundedReceiver<(String, Value, Answer)>,
    told: Arc<Mutex<Told>>,
) {
    let (mut to_browser, mut from_browser) = socket.split();
    let mut waiting: Vec<Option<Answer>> = Vec::new();
    loop {
        tokio::select! {
            call = calls.recv() => {
                let Some((method, params, answer)) = call else { return };
                let call = json!({"id": waiting.len(), "method": method, "params": params});
                waiting.push(Some(answer));
                if to_browser.send(Message::text(call.to_string())).await.is_err() {
                    return;
                }
            }
            message = from_browser.next() => {
                let Some(Ok(message)) = message else { return };
                let Ok(message) = serde_json::from_slice::<Value>(&message.into_data()) else { continue };
                let answered = message["id"].as_u64().and_then(|id| waiting.get_mut(id as usize)?.take());
                match answered {
                    // Whoever asked may have given up.
                    Some(answer) => drop(answer.send(message)),
                    None => told.lock().unwrap().hear(&message),
                }
            }
        }
    }
}

impl Told {
    fn hear(&mut self, message: &Value) {
        let of = &message["params"];
        let text = |value: &Value| value.as_str().unwrap_or_default().to_owned();
        match message["method"].as_str().unwrap_or_default() {
            "Runtime.exceptionThrown" => self.errors.push(of["exceptionDetails"].to_string()),
            "Runtime.consoleAPICalled" if of["type"] == "error" => self.errors.push(of["args"].to_string()),
            "Log.entryAdded" if of["entry"]["level"] == "error" && of["entry"]["source"] != "network" => {
                self.errors.push(text(&of["entry"]["text"]));
            }
            "Network.requestWillBeSent" => self.requests.push(text(&of["request"]["url"])),
            "Network.responseReceived" if of["response"]["status"].as_u64() >= Some(400) => {
                self.failures.push(format!("{} {}", of["response"]["status"], of["response"]["url"]));
            }
            _ => {}
        }
    }
}
