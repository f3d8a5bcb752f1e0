//! Drives a real headless browser over a pipe by its DevTools protocol: JSON messages, each terminated by a zero byte. Tests share one browser of each kind.
//! Each test has its own page in its own context.

use serde_json::{Value, json};
use std::collections::HashMap;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, OnceLock};
use std::time::{Duration, Instant};

/// Names under which the browser is installed, the usual ones first.
const NAMES: [&str; 6] =
    ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome", "chrome-headless-shell"];
/// Longer than any answer takes, also where many tests share few cores.
const PATIENCE: Duration = Duration::from_secs(300);
/// Flags for software WebGL and a camera with a test pattern.
const DRAWING: [&str; 4] = [
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--use-fake-device-for-media-stream",
    "--use-fake-ui-for-media-stream",
];

/// A running browser. It ends when its pipe closes, at the latest with this process; its profile is then deleted.
struct Connection {
    to: Mutex<ChildStdin>,
    routes: Mutex<Routes>,
}

/// The receivers of messages from the browser.
#[derive(Default)]
struct Routes {
    calls: u64,
    /// Receivers of answers to calls of the browser itself, by the number of the call.
    answers: HashMap<u64, Sender<Value>>,
    /// Receivers of the answers and events of a page, by session.
    sessions: HashMap<String, Sender<Value>>,
}

/// A page of a browser.
pub struct Browser {
    connection: Arc<Connection>,
    from: Receiver<Value>,
    session: String,
    context: Value,
    /// What the page complained about: exceptions of scripts, refused requests.
    pub complaints: Vec<String>,
    /// The address under which a page may ask for things; files otherwise.
    site: Option<String>,
}

/// Where a browser is installed.
fn installed() -> Option<PathBuf> {
    let path = std::env::var_os("PATH")?;
    let folders: Vec<PathBuf> = std::env::split_paths(&path).collect();
    let places = NAMES.iter().flat_map(|name| folders.iter().map(move |folder| folder.join(name)));
    let mac = PathBuf::from("/Applications/Google Chrome.app/Contents/MacOS/Google Chrome");
    places.chain([mac]).find(|place| place.is_file())
}

impl Connection {
    /// Starts a browser; `None`, with a message, where none is installed.
    fn start(flags: &[&str]) -> Option<Arc<Self>> {
        let Some(program) = installed().filter(|_| cfg!(unix)) else {
            // Past the capture of the harness, so that it is always visible.
            let _ = writeln!(std::io::stderr(), "skipped: no Chromium is installed to open pages with");
            return None;
        };
        // The browser reads from file descriptor 3 and writes to 4. A separate process deletes the profile, since statics are not dropped.
        const SCRIPT: &str = r#"profile=$(mktemp -d); "$0" "$@" --user-data-dir="$profile" about:blank 3<&0 4>&1 0</dev/null 1>/dev/null; rm -rf "$profile""#;
        let mut process = Command::new("sh")
            .args(["-c", SCRIPT])
            .arg(program)
            .args(["--headless", "--remote-debugging-pipe", "--no-sandbox", "--disable-dev-shm-usage"])
            .args(flags)
            .args(["--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync"])
            // Pages in the background draw as fast as the one in front.
            .args(["--disable-background-timer-throttling", "--disable-backgrounding-occluded-windows"])
            .arg("--disable-renderer-backgrounding")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let to = Mutex::new(process.stdin.take().unwrap());
        let mut out = BufReader::new(process.stdout.take().unwrap());
        let connection = Arc::new(Self { to, routes: Mutex::default() });
        let reader = Arc::downgrade(&connection);
        std::thread::spawn(move || {
            let mut message = Vec::new();
            while out.read_until(0, &mut message).is_ok_and(|length| length > 0) {
                message.pop();
                let Some(connection) = reader.upgrade() else { break };
                connection.routes.lock().unwrap().route(serde_json::from_slice(&message).unwrap());
                message.clear();
            }
            // Dropping the senders wakes all callers that wait for an answer.
            if let Some(connection) = reader.upgrade() {
                *connection.routes.lock().unwrap() = Routes::default();
            }
            let _ = process.wait();
        });
        Some(connection)
    }

    fn send(&self, message: &Value) {
        let mut to = self.to.lock().unwrap();
        to.write_all(format!("{message}\0").as_bytes()).unwrap();
        to.flush().unwrap();
    }

    /// Calls a method of the browser itself.
    fn call(&self, method: &str, params: Value) -> Value {
        let (send, answers) = channel();
        let id = {
            let mut routes = self.routes.lock().unwrap();
            let id = routes.number();
            routes.answers.insert(id, send);
            id
        };
        self.send(&json!({ "id": id, "method": method, "params": params }));
        let answer = answers.recv_timeout(PATIENCE).unwrap_or_else(|_| panic!("the browser does not answer {method}"));
        assert!(answer["error"].is_null(), "{method}: {}", answer["error"]);
        answer["result"].clone()
    }
}

impl Routes {
    fn number(&mut self) -> u64 {
        self.calls += 1;
        self.calls
    }

    fn route(&mut self, message: Value) {
        let to = match message["sessionId"].as_str() {
            Some(session) => self.sessions.get(session).cloned(),
            None => message["id"].as_u64().and_then(|id| self.answers.remove(&id)),
        };
        // A closed page receives no messages.
        let _ = to.map(|to| to.send(message));
    }
}

impl Browser {
    /// Opens a page; `None`, with a message, where no browser is installed.
    pub fn start() -> Option<Self> {
        static PLAIN: OnceLock<Option<Arc<Connection>>> = OnceLock::new();
        Some(Self::new(PLAIN.get_or_init(|| Connection::start(&["--disable-gpu"])).clone()?))
    }

    /// Opens a page in a browser with software WebGL and a camera that shows a moving pattern.
    pub fn start_drawing() -> Option<Self> {
        static SHARED: OnceLock<Option<Arc<Connection>>> = OnceLock::new();
        Some(Self::new(SHARED.get_or_init(|| Connection::start(&DRAWING)).clone()?))
    }

    /// Opens a page in a separate browser whose camera shows a file of JPEG pictures.
    pub fn start_with_camera(pictures: &Path) -> Option<Self> {
        let pictures = format!("--use-file-for-fake-video-capture={}", pictures.display());
        Some(Self::new(Connection::start(&[&DRAWING[..], &[&pictures]].concat())?))
    }

    fn new(connection: Arc<Connection>) -> Self {
        let context = connection.call("Target.createBrowserContext", json!({}))["browserContextId"].clone();
        let page = json!({ "url": "about:blank", "browserContextId": context, "newWindow": true });
        let target = connection.call("Target.createTarget", page)["targetId"].clone();
        let attached = connection.call("Target.attachToTarget", json!({ "targetId": target, "flatten": true }));
        let session = attached["sessionId"].as_str().unwrap().to_string();
        let (send, from) = channel();
        connection.routes.lock().unwrap().sessions.insert(session.clone(), send);
        let (complaints, site) = (Vec::new(), None);
        let mut browser = Self { connection, from, session, context, complaints, site };
        for domain in ["Page", "Runtime", "Log", "Network"] {
            browser.call(&format!("{domain}.enable"), json!({}));
        }
        // Each page behaves as the one in front does.
        browser.call("Emulation.setFocusEmulationEnabled", json!({ "enabled": true }));
        browser.resize(1200, 900);
        browser
    }

    fn call(&mut self, method: &str, params: Value) -> Value {
        let id = self.connection.routes.lock().unwrap().number();
        self.connection.send(&json!({ "id": id, "sessionId": self.session, "method": method, "params": params }));
        let until = Instant::now() + PATIENCE;
        loop {
            let left = until.saturating_duration_since(Instant::now());
            let answer =
                self.from.recv_timeout(left).unwrap_or_else(|_| panic!("the browser does not answer {method}"));
            if answer["id"] == id {
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
        const RUN: &str = "axe.run({ resultTypes: ['violations'] }).then((found) => found.violations.filter((one) => ['serious', 'critical'].includes(one.impact)).flatMap((one) => one.nodes.map((node) => `${one.id} ${node.target.join(' ')}: ${node.failureSummary}`)))";
        let script = axe()?;
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
            "(() => {{ const element = document.querySelector({});
               const within = (box) => box.top >= 0 && box.bottom <= innerHeight;
               if (!within(element.getBoundingClientRect())) element.scrollIntoView({{ block: 'center' }});
               const box = element.getBoundingClientRect(); return [box.x + box.width / 2, box.y + box.height / 2]; }})()",
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
        self.connection.routes.lock().unwrap().sessions.remove(&self.session);
        // The browser may have ended already, so no answer is awaited.
        let mut to = self.connection.to.lock().unwrap();
        let call = json!({ "id": 0, "method": "Target.disposeBrowserContext", "params": { "browserContextId": self.context } });
        let _ = to.write_all(format!("{call}\0").as_bytes());
    }
}

/// Returns the script of axe; `None`, with a message, if the Python package that contains it is not installed.
fn axe() -> Option<&'static str> {
    const FIND: &str = "import importlib.util as u; print(u.find_spec('axe_playwright_python').submodule_search_locations[0] + '/axe.min.js')";
    static SCRIPT: OnceLock<Option<String>> = OnceLock::new();
    let script = SCRIPT.get_or_init(|| {
        let python = std::env::var("TEACHTREE_PYTHON").unwrap_or_else(|_| "python3".into());
        let found = Command::new(python).args(["-c", FIND]).output().ok().filter(|found| found.status.success())?;
        Some(std::fs::read_to_string(String::from_utf8(found.stdout).unwrap().trim()).unwrap())
    });
    if script.is_none() {
        let _ = writeln!(std::io::stderr(), "skipped: axe-playwright-python is not installed to audit pages with");
    }
    script.as_deref()
}
