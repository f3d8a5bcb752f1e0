//! A real browser without a window, driven over a pipe by its DevTools protocol: messages in JSON, each ended by a zero byte.

use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

/// Names under which the browser is installed, the usual ones first.
const NAMES: [&str; 6] =
    ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome", "chrome-headless-shell"];
/// Longer than any answer takes, also where many tests share few cores.
const PATIENCE: Duration = Duration::from_secs(120);

/// A browser with one page.
pub struct Browser {
    process: Child,
    to: ChildStdin,
    from: Receiver<Value>,
    session: Option<String>,
    calls: u64,
    /// What the page complained about: exceptions of scripts, refused requests.
    pub complaints: Vec<String>,
    /// The address under which a page may ask for things; files otherwise.
    site: Option<String>,
    _profile: tempfile::TempDir,
}

/// Where a browser is installed.
fn installed() -> Option<PathBuf> {
    let path = std::env::var_os("PATH")?;
    let folders: Vec<PathBuf> = std::env::split_paths(&path).collect();
    let places = NAMES.iter().flat_map(|name| folders.iter().map(move |folder| folder.join(name)));
    let mac = PathBuf::from("/Applications/Google Chrome.app/Contents/MacOS/Google Chrome");
    places.chain([mac]).find(|place| place.is_file())
}

impl Browser {
    /// Starts one; `None`, with a message, where none is installed.
    pub fn start() -> Option<Self> {
        Self::start_with(&["--disable-gpu"])
    }

    /// The same, for pages that draw by WebGL: without a graphics card.
    pub fn start_drawing() -> Option<Self> {
        Self::start_with(&["--use-angle=swiftshader", "--enable-unsafe-swiftshader"])
    }

    /// The same, with a camera: one that shows a file of JPEG pictures, or a pattern that moves.
    pub fn start_with_camera(pictures: Option<&Path>) -> Option<Self> {
        let pictures = pictures.map(|file| format!("--use-file-for-fake-video-capture={}", file.display()));
        let camera = ["--use-fake-device-for-media-stream", "--use-fake-ui-for-media-stream"];
        let drawing = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader"];
        Self::start_with(&[&drawing[..], &camera, &pictures.as_deref().into_iter().collect::<Vec<_>>()].concat())
    }

    fn start_with(flags: &[&str]) -> Option<Self> {
        let Some(program) = installed().filter(|_| cfg!(unix)) else {
            // Past the capture of the harness: whoever runs the tests shall see it.
            let _ = writeln!(std::io::stderr(), "skipped: no Chromium is installed to open the report with");
            return None;
        };
        let profile = tempfile::tempdir().unwrap();
        // The browser reads from 3 and writes to 4.
        let mut process = Command::new("sh")
            .args(["-c", r#"exec "$0" "$@" 3<&0 4>&1 0</dev/null 1>/dev/null"#])
            .arg(program)
            .args(["--headless", "--remote-debugging-pipe", "--no-sandbox", "--disable-dev-shm-usage"])
            .args(flags)
            .args(["--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync"])
            .arg(format!("--user-data-dir={}", profile.path().display()))
            .arg("about:blank")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let to = process.stdin.take().unwrap();
        let mut out = BufReader::new(process.stdout.take().unwrap());
        let (send, from) = channel();
        std::thread::spawn(move || {
            let mut message = Vec::new();
            while out.read_until(0, &mut message).is_ok_and(|length| length > 0) {
                message.pop();
                if serde_json::from_slice(&message).map(|message: Value| send.send(message)).is_err() {
                    break;
                }
                message.clear();
            }
        });
        let (session, complaints, site) = (None, Vec::new(), None);
        let mut browser = Self { process, to, from, session, calls: 0, complaints, site, _profile: profile };
        let target = browser.call("Target.createTarget", json!({ "url": "about:blank" }))["targetId"].clone();
        let attached = browser.call("Target.attachToTarget", json!({ "targetId": target, "flatten": true }));
        browser.session = attached["sessionId"].as_str().map(str::to_string);
        for domain in ["Page", "Runtime", "Log", "Network"] {
            browser.call(&format!("{domain}.enable"), json!({}));
        }
        browser.resize(1200, 900);
        Some(browser)
    }

    fn call(&mut self, method: &str, params: Value) -> Value {
        self.calls += 1;
        let mut message = json!({ "id": self.calls, "method": method, "params": params });
        if let Some(session) = &self.session {
            message["sessionId"] = session.as_str().into();
        }
        self.to.write_all(format!("{message}\0").as_bytes()).unwrap();
        self.to.flush().unwrap();
        let until = Instant::now() + PATIENCE;
        loop {
            let left = until.saturating_duration_since(Instant::now());
            let answer =
                self.from.recv_timeout(left).unwrap_or_else(|_| panic!("the browser does not answer {method}"));
            if answer["id"] == self.calls {
                assert!(answer["error"].is_null(), "{method}: {}", answer["error"]);
                return answer["result"].clone();
            }
            self.hear(&answer);
        }
    }

    /// Keeps what the page complains about, and what it asks the world for.
    fn hear(&mut self, event: &Value) {
        let params = &event["params"];
        match event["method"].as_str() {
            Some("Runtime.exceptionThrown") => self.complaints.push(params["exceptionDetails"].to_string()),
            Some("Log.entryAdded") if params["entry"]["level"] == "error" => {
                self.complaints.push(params["entry"]["text"].to_string());
            }
            Some("Network.requestWillBeSent") => {
                let url = params["request"]["url"].as_str().unwrap_or_default();
                let is_own = self.site.as_ref().is_some_and(|site| url.starts_with(site));
                if !is_own && !["file:", "about:", "data:"].iter().any(|scheme| url.starts_with(scheme)) {
                    self.complaints.push(format!("asks for {url}"));
                }
            }
            _ => {}
        }
    }

    /// Runs a script before those of each page that is opened.
    pub fn before_pages(&mut self, script: &str) {
        self.call("Page.addScriptToEvaluateOnNewDocument", json!({ "source": script }));
    }

    /// Opens a file and waits until it has drawn.
    pub fn open(&mut self, page: &Path) {
        self.open_plain(page);
        self.wait("document.querySelector('#range')?.textContent !== ''");
    }

    /// Opens a file that is complete as it is.
    pub fn open_plain(&mut self, page: &Path) {
        self.call("Page.navigate", json!({ "url": format!("file://{}", page.display()) }));
        self.wait("location.protocol === 'file:' && document.readyState === 'complete'");
    }

    /// Opens the page of a server, which may ask this server for more.
    pub fn visit(&mut self, address: &str) {
        self.site = Some(address.to_string());
        self.call("Page.navigate", json!({ "url": address }));
    }

    /// The size of the window.
    pub fn resize(&mut self, width: u32, height: u32) {
        let size = json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": false });
        self.call("Emulation.setDeviceMetricsOverride", size);
    }

    /// The value of an expression on the page.
    pub fn eval(&mut self, expression: &str) -> Value {
        let result = self.call("Runtime.evaluate", json!({ "expression": expression, "returnByValue": true }));
        assert!(result["exceptionDetails"].is_null(), "{expression}: {}", result["exceptionDetails"]);
        result["result"]["value"].clone()
    }

    /// Whether the page is shown dark.
    pub fn prefer_dark(&mut self, dark: bool) {
        let scheme = if dark { "dark" } else { "light" };
        let features = json!([{ "name": "prefers-color-scheme", "value": scheme }]);
        self.call("Emulation.setEmulatedMedia", json!({ "features": features }));
    }

    /// What axe (Deque Systems), which audits pages for accessibility, calls serious or critical: its rule, where, and why. `None`, with a message, where
    /// the Python package that carries it is not installed.
    pub fn audit(&mut self) -> Option<Vec<String>> {
        const FIND: &str = "import importlib.util as u; print(u.find_spec('axe_playwright_python').submodule_search_locations[0] + '/axe.min.js')";
        const RUN: &str = "axe.run({ resultTypes: ['violations'] }).then((found) => found.violations.filter((one) => ['serious', 'critical'].includes(one.impact)).flatMap((one) => one.nodes.map((node) => `${one.id} ${node.target.join(' ')}: ${node.failureSummary}`)))";
        let python = std::env::var("TEACHTREE_PYTHON").unwrap_or_else(|_| "python3".into());
        let found = Command::new(python).args(["-c", FIND]).output().ok().filter(|found| found.status.success());
        let Some(found) = found else {
            let _ = writeln!(std::io::stderr(), "skipped: axe-playwright-python is not installed to audit pages with");
            return None;
        };
        let script = std::fs::read_to_string(String::from_utf8(found.stdout).unwrap().trim()).unwrap();
        self.eval(&format!("{script}; true"));
        let params = json!({ "expression": RUN, "returnByValue": true, "awaitPromise": true });
        let result = self.call("Runtime.evaluate", params);
        assert!(result["exceptionDetails"].is_null(), "{}", result["exceptionDetails"]);
        Some(serde_json::from_value(result["result"]["value"].clone()).unwrap())
    }

    /// Waits until something is so on the page.
    pub fn wait(&mut self, condition: &str) {
        let until = Instant::now() + PATIENCE;
        while self.eval(condition) != true {
            assert!(Instant::now() < until, "never so: {condition}; {:?}", self.complaints);
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// The text of an element.
    pub fn text(&mut self, element: &str) -> String {
        let text = self.eval(&format!("document.querySelector({})?.textContent ?? ''", json!(element)));
        text.as_str().unwrap().to_string()
    }

    /// The place of the middle of an element in the window.
    pub fn place(&mut self, element: &str) -> (f64, f64) {
        let place = self.eval(&format!(
            "(() => {{ const box = document.querySelector({}).getBoundingClientRect(); return [box.x + box.width / 2, box.y + box.height / 2]; }})()",
            json!(element)
        ));
        (place[0].as_f64().unwrap(), place[1].as_f64().unwrap())
    }

    fn mouse(&mut self, kind: &str, (x, y): (f64, f64), buttons: u32) {
        let button = if kind == "mouseMoved" { "none" } else { "left" };
        let event = json!({ "type": kind, "x": x, "y": y, "button": button, "buttons": buttons, "clickCount": 1 });
        self.call("Input.dispatchMouseEvent", event);
    }

    /// Clicks on an element.
    pub fn click(&mut self, element: &str) {
        let place = self.place(element);
        self.mouse("mousePressed", place, 1);
        self.mouse("mouseReleased", place, 0);
    }

    /// Drags from one place to another.
    pub fn drag(&mut self, from: (f64, f64), to: (f64, f64)) {
        self.mouse("mousePressed", from, 1);
        for share in [0.25, 0.5, 0.75, 1.0] {
            self.mouse("mouseMoved", (from.0 + share * (to.0 - from.0), from.1 + share * (to.1 - from.1)), 1);
        }
        self.mouse("mouseReleased", to, 0);
    }

    /// Turns the wheel; away from the hand is negative.
    pub fn wheel(&mut self, (x, y): (f64, f64), by: f64) {
        let event = json!({ "type": "mouseWheel", "x": x, "y": y, "deltaX": 0, "deltaY": by });
        self.call("Input.dispatchMouseEvent", event);
    }

    /// Presses a key and holds it, or lets it go.
    pub fn hold(&mut self, key: &str, is_down: bool) {
        let kind = if is_down { "rawKeyDown" } else { "keyUp" };
        self.call("Input.dispatchKeyEvent", json!({ "type": kind, "key": key }));
    }

    /// Presses a key.
    pub fn key(&mut self, key: &str) {
        let mut event = json!({ "type": "keyDown", "key": key });
        match key {
            // By its text a button is pressed.
            "Enter" => event["text"] = "\r".into(),
            _ if key.chars().count() == 1 => event["text"] = key.into(),
            _ => {}
        }
        self.call("Input.dispatchKeyEvent", event);
        self.call("Input.dispatchKeyEvent", json!({ "type": "keyUp", "key": key }));
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        // It may be gone already.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}
