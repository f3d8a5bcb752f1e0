//! `teachtree live ws://…`: a robot that publishes by another party's server of the Foxglove protocol, over connections that break.

use crate::live_topics::{BEGIN_NS, Message, analyzed, bag, binding, finals, messages};
use crate::program::{program, python_with};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

/// A robot made of the `foxglove-sdk`: publishes the messages that it reads from standard input, and prints how many topics are subscribed to.
const ROBOT: &str = r#"
import sys, time, json, foxglove
from foxglove.websocket import ServerListener

class Listener(ServerListener):
    subscribed = 0
    def on_subscribe(self, client, channel):
        Listener.subscribed += 1
        print("subscribed", Listener.subscribed, flush=True)

def start(port):
    return foxglove.start_server(name="robot", host="127.0.0.1", port=port, server_listener=Listener(), message_backlog_size=100000)

server = start(0)
print("port", server.port, flush=True)
channels = {}
for line in sys.stdin:
    order = json.loads(line)
    if order["op"] == "channel":
        schema = order["schema"]
        schema = schema and foxglove.Schema(name=schema[0], encoding=schema[1], data=schema[2].encode())
        channels[order["topic"]] = foxglove.Channel(order["topic"], schema=schema, message_encoding=order["encoding"])
    elif order["op"] == "message":
        channels[order["topic"]].log(bytes.fromhex(order["data"]), log_time=order["time"])
    elif order["op"] == "restart":
        port = server.port
        server.stop()
        time.sleep(0.3)
        server = start(port)
    elif order["op"] == "answer":
        print("published", flush=True)
server.stop()
"#;

struct Robot {
    child: Child,
    orders: ChildStdin,
    said: BufReader<ChildStdout>,
    port: u16,
}

impl Robot {
    fn start(python: &str) -> Self {
        let mut command = Command::new(python);
        let mut child = command.args(["-c", ROBOT]).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
        let (orders, stdout) = (child.stdin.take().unwrap(), child.stdout.take().unwrap());
        let mut robot = Self { child, orders, said: BufReader::new(stdout), port: 0 };
        robot.port = robot.wait_for("port ").parse().unwrap();
        robot
    }

    /// What follows the next line that begins so.
    fn wait_for(&mut self, start: &str) -> String {
        loop {
            let mut line = String::new();
            assert!(self.said.read_line(&mut line).unwrap() > 0, "the robot has ended");
            if let Some(rest) = line.trim_end().strip_prefix(start) {
                return rest.to_string();
            }
        }
    }

    fn order(&mut self, order: &serde_json::Value) {
        writeln!(self.orders, "{order}").unwrap();
    }

    fn advertise(&mut self, topic: &str, encoding: &str, schema: Option<[&str; 3]>) {
        self.order(&serde_json::json!({ "op": "channel", "topic": topic, "encoding": encoding, "schema": schema }));
    }

    /// Publishes messages and waits until the robot has sent them.
    fn publish(&mut self, messages: &[Message]) {
        for message in messages {
            let data: String = encoded(message).iter().map(|byte| format!("{byte:02x}")).collect();
            let order = serde_json::json!({ "op": "message", "topic": message.topic, "time": message.recorded_ns, "data": data });
            self.order(&order);
        }
        self.order(&serde_json::json!({ "op": "answer" }));
        self.wait_for("published");
    }
}

impl Drop for Robot {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The encoding of each topic: that of ROS 2, of ROS 1, and JSON.
fn encoding(topic: &str) -> &'static str {
    match topic {
        "/hand" => "cdr",
        "/touch" => "ros1",
        _ => "json",
    }
}

/// A message as its topic encodes it.
fn encoded(message: &Message) -> Vec<u8> {
    let (sec, nanosec) = ((message.stamp_ns / 1_000_000_000) as u32, (message.stamp_ns % 1_000_000_000) as u32);
    let values: Vec<f64> = message.fields.as_object().unwrap().values().map(|value| value.as_f64().unwrap()).collect();
    let numbers = |bytes: &mut Vec<u8>| values.iter().for_each(|value| bytes.extend(value.to_le_bytes()));
    let mut bytes = vec![];
    match encoding(message.topic) {
        "cdr" => {
            let words = [sec, nanosec, 4];
            words.iter().for_each(|word| bytes.extend(word.to_le_bytes()));
            bytes.extend(b"arm\0");
            bytes.resize(bytes.len().next_multiple_of(8), 0);
            numbers(&mut bytes);
            [vec![0, 1, 0, 0], bytes].concat()
        }
        "ros1" => {
            let words = [7, sec, nanosec, 3];
            words.iter().for_each(|word| bytes.extend(word.to_le_bytes()));
            bytes.extend(b"arm");
            numbers(&mut bytes);
            bytes
        }
        _ => message.text().into_bytes(),
    }
}

/// The definition of the messages of a topic.
fn definition(message: &Message) -> Option<[String; 3]> {
    let fields: String = message.fields.as_object().unwrap().keys().map(|name| format!("float64 {name}\n")).collect();
    let rule = "=".repeat(80);
    match encoding(message.topic) {
        "cdr" => {
            let header = format!("{rule}\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n");
            Some(["lab_msgs/msg/Hand".into(), "ros2msg".into(), format!("std_msgs/Header header\n{fields}{header}")])
        }
        "ros1" => {
            let header = format!("{rule}\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n");
            Some(["lab_msgs/Touch".into(), "ros1msg".into(), format!("Header header\n{fields}{header}")])
        }
        _ => None,
    }
}

/// A proxy between the robot and the program, which can be cut.
struct Cable {
    port: u16,
    is_cut: Arc<AtomicBool>,
    ends: Arc<Mutex<Vec<TcpStream>>>,
    /// All bytes that were forwarded to the program.
    delivered: Arc<Mutex<Vec<u8>>>,
    /// All bytes that were forwarded to the robot.
    answered: Arc<Mutex<Vec<u8>>>,
}

/// Copies what a connection receives to another one and to a record, until it ends.
fn forward(mut from: TcpStream, mut to: TcpStream, record: Arc<Mutex<Vec<u8>>>) {
    let mut bytes = [0; 1 << 16];
    while let Ok(count @ 1..) = from.read(&mut bytes) {
        if to.write_all(&bytes[..count]).is_err() {
            break;
        }
        record.lock().unwrap().extend_from_slice(&bytes[..count]);
    }
    let _ = to.shutdown(Shutdown::Both);
}

/// Whether bytes that a client sent contain a pong with this payload (RFC 6455, sections 5.2 and 5.3: a client masks what it sends).
fn has_pong(bytes: &[u8], payload: &[u8]) -> bool {
    bytes.windows(6 + payload.len()).any(|frame| {
        let (head, masked) = frame.split_at(6);
        let mask = head[2..].iter().cycle();
        head[..2] == [0x8a, 0x80 | payload.len() as u8]
            && masked.iter().zip(mask).map(|(byte, key)| byte ^ key).eq(payload.iter().copied())
    })
}

impl Cable {
    fn to(robot: u16) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let port = listener.local_addr().unwrap().port();
        let (delivered, answered) = (Arc::default(), Arc::default());
        let cable = Self { port, is_cut: Arc::default(), ends: Arc::default(), delivered, answered };
        let (is_cut, ends) = (Arc::clone(&cable.is_cut), Arc::clone(&cable.ends));
        let (delivered, answered) = (Arc::clone(&cable.delivered), Arc::clone(&cable.answered));
        std::thread::spawn(move || {
            for near in listener.incoming().flatten() {
                let far = TcpStream::connect(("127.0.0.1", robot)).ok().filter(|_| !is_cut.load(Ordering::SeqCst));
                let Some(far) = far else { continue };
                for (from, to, record) in [(&near, &far, &answered), (&far, &near, &delivered)] {
                    let record = Arc::clone(record);
                    let (from, to) = (from.try_clone().unwrap(), to.try_clone().unwrap());
                    std::thread::spawn(move || forward(from, to, record));
                }
                ends.lock().unwrap().extend([near, far]);
            }
        });
        cable
    }

    fn cut(&self) {
        self.is_cut.store(true, Ordering::SeqCst);
        for end in self.ends.lock().unwrap().drain(..) {
            let _ = end.shutdown(Shutdown::Both);
        }
    }

    /// Waits until the program has taken these messages. The messages of a topic stay in order. When all of them have been forwarded, the proxy sends a
    /// ping: the program reads a connection in order, so it has taken the messages once it answers.
    fn delivers(&self, messages: &[Message]) {
        for topic in ["/hand", "/touch", "/objects"] {
            let last = messages.iter().rfind(|message| message.topic == topic).map(encoded).unwrap();
            while memchr::memmem::find(&self.delivered.lock().unwrap(), &last).is_none() {
                std::thread::sleep(std::time::Duration::from_millis(10));
            }
        }
        // Each ping has a payload of its own.
        let payload = self.delivered.lock().unwrap().len().to_be_bytes();
        let ping = [&[0x89, payload.len() as u8], payload.as_slice()].concat();
        let mut near = match self.ends.lock().unwrap().as_slice() {
            [.., near, _] => near.try_clone().unwrap(),
            _ => panic!("the program is not connected"),
        };
        near.write_all(&ping).unwrap();
        while !has_pong(&self.answered.lock().unwrap(), &payload) {
            std::thread::sleep(std::time::Duration::from_millis(10));
        }
    }

    fn mend(&self) {
        self.is_cut.store(false, Ordering::SeqCst);
    }
}

/// The program, until it is interrupted.
fn started(args: &[&str]) -> Child {
    let mut command = program(Path::new(env!("CARGO_MANIFEST_DIR")), args);
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
}

fn interrupted(mut child: Child) -> String {
    let mut stdout = child.stdout.take().unwrap();
    let reading = std::thread::spawn(move || {
        let mut text = String::new();
        stdout.read_to_string(&mut text).unwrap();
        text
    });
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    reading.join().unwrap()
}

#[cfg(unix)]
#[test]
fn a_robot_is_followed_over_connections_that_break() {
    let Some(python) = python_with("foxglove", "foxglove-sdk") else { return };
    let folder = tempfile::tempdir().unwrap();
    let all = messages("SawyerNutAssembly_demo_1.csv");
    let at = |secs: u64| all.iter().position(|message| message.recorded_ns >= BEGIN_NS + secs * 1_000_000_000).unwrap();
    // Messages between these are published without a connection.
    let cuts = [(at(10), at(12)), (at(24), at(25))];
    let kept = [&all[..cuts[0].0], &all[cuts[0].1..cuts[1].0], &all[cuts[1].1..]];
    let path = folder.path().join("log.mcap");
    bag(&kept.concat(), &path);
    let (path, binding) = (path.display().to_string(), binding("sawyer_nut_assembly.binding.yaml", folder.path()));

    let mut robot = Robot::start(&python);
    robot.advertise("/camera", "protobuf", Some(["foxglove.CompressedImage", "protobuf", ""]));
    for topic in ["/hand", "/touch", "/objects"] {
        let schema = definition(all.iter().find(|message| message.topic == topic).unwrap());
        robot.advertise(topic, encoding(topic), schema.as_ref().map(|schema| schema.each_ref().map(String::as_str)));
    }
    let cable = Cable::to(robot.port);
    let address = format!("ws://127.0.0.1:{}", cable.port);
    let args = ["live", &address, "--binding", &binding, "--calibration", &path, "--format", "json"];
    let child = started(&args);
    robot.wait_for("subscribed 3");
    robot.publish(kept[0]);
    cable.delivers(kept[0]);
    cable.cut();
    robot.publish(&all[cuts[0].0..cuts[0].1]);
    cable.mend();
    robot.wait_for("subscribed 6");
    robot.publish(kept[1]);
    cable.delivers(kept[1]);
    robot.order(&serde_json::json!({ "op": "restart" }));
    robot.wait_for("subscribed 9");
    robot.publish(kept[2]);
    cable.delivers(kept[2]);
    let events = interrupted(child);

    let (found, issues) = finals(&events);
    let (whole, broken) = (analyzed(&path, &binding), issues.iter().filter(|issue| issue.starts_with("disconnected")));
    assert_eq!(found, whole, "{issues:?}");
    assert_eq!(broken.count(), 4, "{issues:?}");
    assert!(found.tasks.len() >= 2, "{found:?}");
}

fn refused(args: &[&str]) -> String {
    let output = program(Path::new(env!("CARGO_MANIFEST_DIR")), args).stdin(Stdio::null()).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn what_is_not_a_robot_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let binding = binding("sawyer_lift.binding.yaml", folder.path());
    // A port without a listener, and one where another program answers.
    let free = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let other = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = other.local_addr().unwrap().port();
    std::thread::spawn(move || {
        for mut stream in other.incoming().flatten() {
            let _ = stream.read(&mut [0; 1000]);
            let _ = stream.write_all(b"HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\n\r\n");
        }
    });
    let to = |address: &str| refused(&["live", address, "--binding", &binding]);
    let said = [
        to(&format!("ws://127.0.0.1:{free}")).replace(&free.to_string(), "PORT"),
        to(&format!("ws://127.0.0.1:{port}")).replace(&port.to_string(), "PORT"),
        to("wss://127.0.0.1:8765"),
        to("ws://"),
        refused(&["live", "ws://127.0.0.1:8765"]),
    ];
    insta::assert_snapshot!(said.join("\n"));
}

#[test]
fn topics_that_do_not_fit_are_listed() {
    let Some(python) = python_with("foxglove", "foxglove-sdk") else { return };
    let folder = tempfile::tempdir().unwrap();
    let binding = binding("sawyer_lift.binding.yaml", folder.path());
    let mut robot = Robot::start(&python);
    robot.advertise(
        "/joint_states",
        "cdr",
        Some(["sensor_msgs/msg/JointState", "ros2msg", "string[] name\nfloat64[] position\n"]),
    );
    robot.advertise("/camera", "protobuf", Some(["foxglove.CompressedImage", "protobuf", ""]));
    let address = format!("ws://127.0.0.1:{}", robot.port);
    let said = refused(&["live", &address, "--binding", &binding]).replace(&robot.port.to_string(), "PORT");
    let mut other = Robot::start(&python);
    other.advertise("/hand", "protobuf", Some(["foxglove.Pose", "protobuf", ""]));
    let address = format!("ws://127.0.0.1:{}", other.port);
    let of_encoding =
        refused(&["live", &address, "--binding", &binding]).replace(&folder.path().display().to_string(), "FOLDER");
    insta::assert_snapshot!(format!("{said}\n{of_encoding}"));
}
