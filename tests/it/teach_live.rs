//! `teachtree teach --live`: its server, and a haptic device that speaks to it over a local socket as docs/teaching.md says.

use crate::program::{complained, program, said, teachtree_in};
use nalgebra::Vector3;
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Stdio};
use tungstenite::{Message, WebSocket};

/// A program that runs, and ends with this.
pub struct Teaching {
    process: Child,
    out: BufReader<ChildStdout>,
    /// `http://127.0.0.1:PORT/TOKEN/`.
    pub address: String,
}

impl Teaching {
    pub fn start(folder: &Path, args: &[&str]) -> Self {
        let args = [&["teach"], args, &["--live", "--no-open"]].concat();
        let mut process = program(folder, &args).stdout(Stdio::piped()).stderr(Stdio::inherit()).spawn().unwrap();
        let mut out = BufReader::new(process.stdout.take().unwrap());
        let mut lines = [String::new(), String::new()];
        for line in &mut lines {
            out.read_line(line).unwrap();
        }
        assert!(lines[0].starts_with("http://127.0.0.1:") && lines[1].contains("Ctrl-C"), "{lines:?}");
        Self { process, out, address: lines[0].trim().to_string() }
    }

    fn host(&self) -> &str {
        self.address.strip_prefix("http://").unwrap().split('/').next().unwrap()
    }

    fn root(&self) -> &str {
        self.address.strip_prefix("http://").unwrap().strip_prefix(self.host()).unwrap()
    }

    /// The head and the body of an answer.
    fn get(&self, path: &str, fields: &str) -> (u16, String) {
        let (root, host) = (self.root(), self.host());
        self.ask(&format!("GET {root}{path} HTTP/1.1\r\nHost: {host}\r\n{fields}Connection: close\r\n\r\n"))
    }

    fn ask(&self, request: &str) -> (u16, String) {
        let mut stream = TcpStream::connect(self.host()).unwrap();
        stream.write_all(request.as_bytes()).unwrap();
        let mut answer = Vec::new();
        let _ = stream.read_to_end(&mut answer);
        let answer = String::from_utf8_lossy(&answer).into_owned();
        (answer.split(' ').nth(1).unwrap().parse().unwrap(), answer)
    }

    fn connect(&self) -> Device {
        let stream = TcpStream::connect(self.host()).unwrap();
        let (socket, _) = tungstenite::client(format!("ws://{}{}live", self.host(), self.root()), stream).unwrap();
        Device { socket }
    }

    /// Ends the program by Ctrl-C; what it printed last.
    fn end(mut self) -> String {
        let killed = Command::new("kill").args(["-INT", &self.process.id().to_string()]).status().unwrap();
        assert!(killed.success());
        let mut text = String::new();
        self.out.read_to_string(&mut text).unwrap();
        assert!(self.process.wait().unwrap().success(), "{text}");
        text
    }
}

impl Drop for Teaching {
    fn drop(&mut self) {
        // It may be gone already.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// What a driver of a haptic device would be.
struct Device {
    socket: WebSocket<TcpStream>,
}

impl Device {
    fn send(&mut self, message: &Value) {
        self.socket.send(Message::text(message.to_string())).unwrap();
    }

    /// The next message of a type.
    fn next(&mut self, kind: &str) -> Value {
        loop {
            let message = self.socket.read().unwrap();
            let message: Value = serde_json::from_str(message.to_text().unwrap()).unwrap();
            if message["type"] == kind {
                return message;
            }
        }
    }

    /// The next message of a type that is as it should be.
    fn until(&mut self, kind: &str, is_so: impl Fn(&Value) -> bool) -> Value {
        loop {
            let message = self.next(kind);
            if is_so(&message) {
                return message;
            }
        }
    }

    /// Moves the fingertips along a path in a number of simulated seconds, by the times in the messages of the program.
    /// Returns the last forces.
    fn go(&mut self, seconds: f64, from: (Vector3<f64>, f64), to: (Vector3<f64>, f64)) -> Value {
        self.go_until(seconds, from, to, |_| false).1
    }

    /// The same until forces are as they should be; also where the fingertips are asked to be then.
    fn go_until(
        &mut self,
        seconds: f64,
        from: (Vector3<f64>, f64),
        to: (Vector3<f64>, f64),
        is_there: impl Fn(&Value) -> bool,
    ) -> (Vector3<f64>, Value) {
        let start = self.next("forces")["time"].as_f64().unwrap();
        loop {
            let forces = self.next("forces");
            let share = ((forces["time"].as_f64().unwrap() - start) / seconds).min(1.0);
            let eased = share * share * (3.0 - 2.0 * share);
            let (middle, open) = (from.0.lerp(&to.0, eased), from.1 + (to.1 - from.1) * eased);
            let tip = |x: f64, y: f64| [middle.x + x, middle.y + y, middle.z];
            self.send(&json!({ "type": "tips", "hand": "right", "tips": [tip(0.0, -open), tip(-0.014, open), tip(0.014, open)] }));
            if share >= 1.0 || is_there(&forces) {
                return (middle, forces);
            }
        }
    }
}

#[test]
fn a_device_over_a_socket_feels_the_box_and_teaches_pick_and_place() {
    let folder = tempfile::tempdir().unwrap();
    let teaching = Teaching::start(folder.path(), &["pick_and_place", "--out", "taught.csv"]);
    let mut device = teaching.connect();
    let state = device.next("state");
    assert_eq!(state["recording"], false);
    let at = |index: usize| state["bodies"][0][index].as_f64().unwrap();
    let grip = Vector3::new(at(0), at(1), at(2) + 0.012);
    device.send(&json!({ "type": "forces", "every_ms": 4 }));
    let up = Vector3::new(0.0, 0.0, 1.0);
    let goal = Vector3::new(0.11, 0.03, grip.z);
    let (away, open, closed) = (grip + Vector3::new(-0.05, -0.12, 0.2), 0.06, 0.035);
    device.go(2.0, (away, open), (away, open));
    device.send(&json!({ "type": "start" }));
    device.go(0.5, (away, open), (away, open));
    device.go(1.5, (away, open), (grip + up * 0.1, open));
    let free = device.go(1.0, (grip + up * 0.1, open), (grip, open));
    assert_eq!(free["hands"][0][0], json!([0.0, 0.0, 0.0]));
    device.go(0.8, (grip, open), (grip, closed));
    let held = device.go(0.4, (grip, closed), (grip, closed));
    // The thumb is pushed out of the box, in newtons, in the frame of the scene.
    let thumb = held["hands"][0][0][1].as_f64().unwrap();
    assert!((-2.0..-1.0).contains(&thumb), "{held}");
    device.go(0.8, (grip, closed), (grip + up * 0.05, closed));
    device.go(1.5, (grip + up * 0.05, closed), (goal + up * 0.05, closed));
    // Down until the table bears the box: what pulled the fingertips down no longer does.
    let lifted = |forces: &Value| {
        let tips = forces["hands"][0].as_array().unwrap();
        tips.iter().map(|force| force[2].as_f64().unwrap()).sum::<f64>() > -0.1
    };
    let (goal, _) = device.go_until(2.0, (goal + up * 0.05, closed), (goal - up * 0.01, closed), lifted);
    device.go(0.4, (goal, closed), (goal, closed));
    // A device that is silent is asked for no force, and its fingertips hold what they hold.
    let silent = device.until("state", |state| state["hands"][0]["silent"] == true);
    assert!(silent["hands"][0]["forces"][0][1].as_f64().unwrap() < -1.0, "{silent}");
    let forces = device.next("forces");
    assert!(forces["hands"][0].as_array().unwrap().iter().all(|force| *force == json!([0.0, 0.0, 0.0])), "{forces}");
    device.go(0.6, (goal, closed), (goal, open));
    device.go(1.0, (goal, open), (goal + up * 0.12, open));
    device.go(0.5, (goal + up * 0.12, open), (goal + up * 0.12, open));
    device.send(&json!({ "type": "stop" }));
    // Labels came on the way, and the task.
    let labels = device.until("labels", |labels| labels["tracks"][0]["tasks"][0][3] == true);
    assert_eq!(labels["tracks"][0]["tasks"][0][0], "pick_and_place");
    let segments: Vec<&str> =
        labels["tracks"][0]["segments"].as_array().unwrap().iter().map(|it| it[0].as_str().unwrap()).collect();
    assert!(segments.starts_with(&["Move", "Approach", "Grasp", "Translate"]), "{segments:?}");
    let takes = device.until("takes", |takes| takes["writing"] == 0 && takes["takes"][0]["written"] == true);
    let told = takes["takes"][0]["tasks"][0].as_str().unwrap();
    assert!(told.starts_with("right pick_and_place box"), "{takes}");
    let printed = teaching.end();
    assert!(printed.starts_with("written: taught.csv\nservo: ") && printed.contains("within 1 ms"), "{printed}");
    let analyzed = said(&teachtree_in(folder.path(), &["analyze", "taught.csv"]));
    assert!(analyzed.contains("pick_and_place box"), "{analyzed}");
}

#[test]
fn an_interrupted_recording_is_written_and_no_file_is_replaced() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("taught.csv"), "mine").unwrap();
    let teaching = Teaching::start(folder.path(), &["pick_and_place", "-o", "taught.csv"]);
    let mut device = teaching.connect();
    device.send(&json!({ "type": "start" }));
    device.until("state", |state| state["recorded"].as_f64().unwrap() > 0.5);
    let printed = teaching.end();
    assert!(printed.starts_with("written: taught_2.csv\n"), "{printed}");
    assert_eq!(std::fs::read_to_string(folder.path().join("taught.csv")).unwrap(), "mine");
    assert!(folder.path().join("taught_2.scene.yaml").is_file());
}

#[test]
fn only_who_has_the_address_may_ask_and_nothing_leads_to_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let teaching = Teaching::start(folder.path(), &["pick_and_place", "--behind", "https://teach.example.org"]);
    let (host, root) = (teaching.host(), teaching.root());
    let upgrade = "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";
    let socket = |path: &str, host: &str, origin: &str| {
        let origin = if origin.is_empty() { String::new() } else { format!("Origin: {origin}\r\n") };
        let mut stream = TcpStream::connect(teaching.host()).unwrap();
        stream.write_all(format!("GET {path} HTTP/1.1\r\nHost: {host}\r\n{origin}{upgrade}\r\n").as_bytes()).unwrap();
        let mut line = String::new();
        BufReader::new(stream).read_line(&mut line).unwrap();
        line.split(' ').nth(1).unwrap().parse::<u16>().unwrap()
    };
    let live = format!("{root}live");
    assert_eq!(socket(&live, host, ""), 101);
    assert_eq!(socket(&live, host, &format!("http://{host}")), 101);
    assert_eq!(socket(&live, "teach.example.org", "https://teach.example.org"), 101);
    assert_eq!(socket("/live", host, ""), 403);
    assert_eq!(socket(&format!("/{}/live", "0".repeat(32)), host, ""), 403);
    assert_eq!(socket(&live, "example.org", ""), 403);
    for origin in ["http://example.org", "null", "https://example.org", &format!("https://{host}")] {
        assert_eq!(socket(&live, host, origin), 403, "{origin}");
    }
    assert_eq!(socket(root, host, ""), 200, "only one path is a WebSocket");
    let page = teaching.get("", "");
    assert!(page.0 == 200 && page.1.contains("default-src 'none'") && page.1.contains("id=\"stage\""), "{}", page.1);
    for path in ["../taught.csv", "%2e%2e/Cargo.toml", "taught.csv", "robot.html", "api/robot", "api", "teach.js/x"] {
        assert_eq!(teaching.get(path, "").0, 404, "{path}");
    }
    let change = format!(
        "POST {root}api/scene HTTP/1.1\r\nHost: {host}\r\nContent-Type: application/json\r\nContent-Length: 2\r\nConnection: close\r\n\r\n{{}}"
    );
    assert_eq!(teaching.ask(&change).0, 404);
}

#[test]
fn what_is_not_a_message_is_answered_with_a_sentence_and_harms_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let teaching = Teaching::start(folder.path(), &["hand_over_left_to_right"]);
    let mut device = teaching.connect();
    device.next("state");
    for (sent, wanted) in [
        ("", "no message"),
        ("{}", "type"),
        ("[1, 2]", "no message"),
        (r#"{"type":"jump"}"#, "jump"),
        (r#"{"type":"tips","hand":"right","tips":[]}"#, "5 fingertips, found 0"),
        (r#"{"type":"tips","hand":"middle","tips":[]}"#, "middle"),
        (r#"{"type":"tips","hand":"right","tips":[[0,0],[0,0,0],[0,0,0]]}"#, "no message"),
        (r#"{"type":"tips","hand":"right","tips":[[1e999,0,0],[0,0,0],[0,0,0]]}"#, "number"),
        (r#"{"type":"palm","hand":"left","palm":[0,0,0,0,0,0,0]}"#, "quaternion"),
        (r#"{"type":"palm","hand":"left","palm":[0,0,0,1,0,0,0],"more":1}"#, "more"),
        (r#"{"type":"robot"}"#, "no recording"),
        (r#"{"type":"robot","take":99999999}"#, "no recording"),
    ] {
        device.socket.send(Message::text(sent)).unwrap();
        let error = device.next("error");
        assert!(error["message"].as_str().unwrap().contains(wanted), "{sent}: {error}");
    }
    device.socket.send(Message::binary(vec![0; 100])).unwrap();
    assert!(device.next("error")["message"].as_str().unwrap().contains("bytes"));
    // Places that no hand reaches are not taken: the hand stays.
    let before = device.next("state")["hands"][1]["tips"].clone();
    device
        .socket
        .send(Message::text(r#"{"type":"tips","hand":"right","tips":[[1e9,0,0],[0,0,0],[0,0,0],[0,0,0],[0,0,0]]}"#))
        .unwrap();
    let time = device.next("state")["time"].as_f64().unwrap();
    let after = device.until("state", |state| state["time"].as_f64().unwrap() > time + 0.2)["hands"][1]["tips"].clone();
    assert_eq!(before, after);
    // More than a message may have ends the connection, and only that one.
    let _ = device.socket.send(Message::text("x".repeat(1 << 20)));
    while device.socket.read().is_ok() {}
    let mut other = teaching.connect();
    other.next("state");
    // Many at once: the last one counts.
    for at in 0..20_000 {
        other.send(
            &json!({ "type": "palm", "hand": "right", "palm": [0.1, 0.0, 0.2 + f64::from(at) * 1e-6, 1, 0, 0, 0] }),
        );
    }
    for _ in 0..100 {
        other.send(&json!({ "type": "undo" }));
    }
    other.until("state", |state| state["epoch"].as_u64().unwrap() > 0);
}

#[test]
fn what_cannot_be_taught_by_hand_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let scene = "bodies:\n  table: {role: support, parts: [{box: [1 m, 1 m, 20 mm]}]}\n";
    std::fs::write(folder.path().join("handless.yaml"), scene).unwrap();
    for (args, wanted) in [
        (&["handless.yaml", "--live"][..], "the scene has no hand"),
        (&["no_such_scene", "--live"], "no_such_scene"),
        (&["pick_and_place", "--live", "-o", "x.mcap"], "expected .csv or .parquet"),
        (&["pick_and_place", "pick_and_place", "--live"], "cannot be used with"),
        (&["pick_and_place", "--live", "--seed", "2"], "cannot be used with"),
        (&["pick_and_place", "--live", "--behind", "http://example.org"], "expected https://"),
        (&["pick_and_place", "--live", "--rules", "none.rules"], "none.rules"),
        (&["pick_and_place", "--live", "--robot", "none"], "none"),
        (&["pick_and_place", "-o", "x.csv"], "OPERATOR"),
        (&["pick_and_place", "pick_and_place"], "--out"),
        (&["pick_and_place", "pick_and_place", "-o", "x.csv", "--port", "1"], "--live"),
    ] {
        let output = teachtree_in(folder.path(), &[&["teach"], args].concat());
        assert_eq!(output.status.code(), Some(2), "{args:?}");
        assert!(complained(&output).contains(wanted), "{args:?}: {}", complained(&output));
    }
}
