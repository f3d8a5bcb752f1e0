//! `teachtree live` and Zenoh: another party's library publishes rows and takes events, over connections that break.

use crate::live_log::{Rows, demonstration};
use crate::live_topics::finals;
use crate::program::{complained, program, python_with, said, teachtree_fed};
use serde_json::Value;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpListener;
use std::path::Path;
use std::process::{Child, ChildStderr, ChildStdout, Command, Output, Stdio};
use std::time::Duration;

/// What both scripts begin with: a session, `client` or `router`, at an endpoint.
const SESSION: &str = r#"
import json, sys, time, zenoh

def session(mode, endpoint):
    config = zenoh.Config()
    config.insert_json5("mode", json.dumps(mode))
    config.insert_json5("scouting/multicast/enabled", "false")
    config.insert_json5("connect/endpoints" if mode == "client" else "listen/endpoints", json.dumps([endpoint]))
    return zenoh.open(config)
"#;

/// A robot, which is the router too: publishes the lines that it reads, one a sample. `restart` ends it, and begins it anew.
const ROBOT: &str = r#"
endpoint = sys.argv[1]

def start():
    router = session("router", endpoint)
    return router, router.declare_publisher("cell/robot/rows", congestion_control=zenoh.CongestionControl.BLOCK)

def wait():
    while not publisher.matching_status.matching:
        time.sleep(0.02)
    print("followed", flush=True)

router, publisher = start()
print("listening", flush=True)
wait()
for number, line in enumerate(sys.stdin):
    if line == "restart\n":
        time.sleep(0.5)
        router.close()
        time.sleep(0.5)
        router, publisher = start()
        wait()
        continue
    publisher.put(line)
    if number % 50 == 0:
        time.sleep(0.05)
time.sleep(0.5)
router.close()
print("done", flush=True)
"#;

/// Takes events to their end, one JSON object a line with the session. It may go once an event of a number has come, and come again.
const CONTROLLER: &str = r#"
import queue
endpoint, leaves_after = sys.argv[1], int(sys.argv[2])

def asked(client, parameters):
    replies = [reply.ok for reply in client.get("cell/labels" + parameters)]
    assert len(replies) == 1, replies
    [reply] = replies
    return [(json.loads(line), reply.attachment.to_string()) for line in reply.payload.to_string().splitlines()]

def read(parameters, last, leaves_after):
    client = session("client", endpoint)
    events = queue.Queue()
    subscriber = client.declare_subscriber("cell/labels", lambda sample: events.put((json.loads(sample.payload.to_string()), sample.attachment.to_string())))
    print(json.dumps({"ready": True}), flush=True)
    waiting = asked(client, parameters)
    # The task is the last event of all; one more would come soon.
    patience_s = 60
    while True:
        while waiting:
            event, id = waiting.pop(0)
            if event["sequence"] > last:
                last = event["sequence"]
                patience_s = 1 if event["event"] == "task" else 60
                print(json.dumps({"session": id, "event": event}), flush=True)
            if 0 <= leaves_after <= last:
                client.close()
                return id, last
        try:
            waiting.append(events.get(timeout=patience_s))
        except queue.Empty:
            client.close()
            return None, last

id, last = read("", -1, leaves_after)
if leaves_after >= 0:
    time.sleep(1)
    read(f"?after={last};session={id}", last, -1)
"#;

/// An endpoint without a listener.
fn endpoint() -> String {
    format!("tcp/{}", TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap())
}

/// A script, and the lines that it prints.
fn script(python: &str, script: &str, args: &[&str]) -> (Child, BufReader<ChildStdout>) {
    let mut command = Command::new(python);
    command.args(["-c", &format!("{SESSION}{script}")]).args(args).stdin(Stdio::piped()).stdout(Stdio::piped());
    let mut child = command.spawn().unwrap();
    let out = BufReader::new(child.stdout.take().unwrap());
    (child, out)
}

/// Waits for a line that begins so.
fn wait_for(lines: &mut impl BufRead, start: &str) {
    let mut line = String::new();
    while !line.starts_with(start) {
        line.clear();
        assert!(lines.read_line(&mut line).unwrap() > 0, "ended before `{start}`");
    }
}

/// The program.
fn started(args: &[&str]) -> (Child, BufReader<ChildStderr>) {
    let mut command = program(Path::new(env!("CARGO_MANIFEST_DIR")), args);
    let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let complaints = BufReader::new(child.stderr.take().unwrap());
    (child, complaints)
}

fn to_end(mut out: impl Read + Send + 'static) -> std::thread::JoinHandle<String> {
    std::thread::spawn(move || {
        let mut text = String::new();
        out.read_to_string(&mut text).unwrap();
        text
    })
}

/// Every fifth row of a demonstration as lines of JSON, fewer than may wait, behind its scene.
fn lines() -> Vec<String> {
    let recording = demonstration("pick_and_place");
    let rows = Rows::of(&recording);
    let object = |row: &Vec<f64>| {
        let values = row.iter().map(|value| serde_json::json!(value));
        let object: serde_json::Map<String, Value> = rows.titles.iter().cloned().zip(values).collect();
        format!("{}\n", Value::Object(object))
    };
    let scene = format!("{}\n", serde_json::json!({ "scene": recording.scene }));
    std::iter::once(scene).chain(rows.rows.iter().step_by(5).map(object)).collect()
}

/// The rows arrive once each and in order, though the router goes and comes again.
#[cfg(unix)]
#[test]
fn rows_of_a_robot_are_labeled_over_a_connection_that_breaks() {
    let Some(python) = python_with("zenoh", "eclipse-zenoh") else { return };
    let (endpoint, lines) = (endpoint(), lines());
    let (mut robot, mut said_by_robot) = script(&python, ROBOT, &[&endpoint]);
    wait_for(&mut said_by_robot, "listening");
    let args = ["live", "zenoh:cell/*/rows", "--zenoh-connect", &endpoint, "--format", "json"];
    let (mut child, complaints) = started(&args);
    let (printed, complained_of) = (to_end(child.stdout.take().unwrap()), to_end(complaints));
    let (early, late) = lines.split_at(lines.len() * 3 / 4);
    let mut orders = robot.stdin.take().unwrap();
    wait_for(&mut said_by_robot, "followed");
    orders.write_all(format!("{}restart\n{}", early.concat(), late.concat()).as_bytes()).unwrap();
    drop(orders);
    wait_for(&mut said_by_robot, "followed");
    wait_for(&mut said_by_robot, "done");
    assert!(robot.wait().unwrap().success());
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    assert!(child.wait().unwrap().success());
    let (found, issues) = finals(&printed.join().unwrap());

    let whole = teachtree_fed(&["live", "-", "--format", "json"], lines.concat().as_bytes());
    let (expected, _) = finals(&said(&whole));
    assert_eq!(found, expected, "{issues:?}");
    assert!(found.tasks.iter().any(|task| task.contains("pick_and_place")), "{found:?}");
    assert_eq!(complained_of.join().unwrap(), "");
}

/// One controller is there all along; the other one goes, and gets what it missed when it comes again.
#[test]
fn controllers_get_every_event_once() {
    let Some(python) = python_with("zenoh", "eclipse-zenoh") else { return };
    let (endpoint, lines) = (endpoint(), lines());
    let args = ["live", "-", "--zenoh-listen", &endpoint, "--zenoh-publish", "cell/labels", "--format", "json"];
    let (mut child, mut complaints) = started(&args);
    wait_for(&mut complaints, "publishing labels under the key `cell/labels`");
    let mut controllers: Vec<_> = ["-1", "4"].map(|leaves| script(&python, CONTROLLER, &[&endpoint, leaves])).into();
    for (_, out) in &mut controllers {
        wait_for(out, "{\"ready\"");
    }
    let printed = to_end(child.stdout.take().unwrap());
    let mut rows = child.stdin.take().unwrap();
    let (early, late) = lines.split_at(lines.len() * 4 / 5);
    // Within the first part one of the two goes; within the wait it comes again.
    for part in [early, late] {
        rows.write_all(part.concat().as_bytes()).unwrap();
        std::thread::sleep(Duration::from_secs(3));
    }
    drop(rows);
    assert!(child.wait().unwrap().success());
    let printed: Vec<Value> = printed.join().unwrap().lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert!(printed.len() > 10, "{printed:?}");
    let mut sessions = std::collections::BTreeSet::new();
    for (mut controller, out) in controllers {
        assert!(controller.wait().unwrap().success());
        let messages: Vec<Value> = out.lines().map(|line| serde_json::from_str(&line.unwrap()).unwrap()).collect();
        let messages: Vec<&Value> = messages.iter().filter(|message| message["ready"].is_null()).collect();
        sessions.extend(messages.iter().map(|message| message["session"].to_string()));
        let events: Vec<&Value> = messages.iter().map(|message| &message["event"]).collect();
        assert_eq!(events, printed.iter().collect::<Vec<_>>());
    }
    assert_eq!(sessions.len(), 1, "{sessions:?}");
}

fn refused(args: &[&str]) -> String {
    let output: Output = teachtree_fed(&[&["live"], args].concat(), b"");
    assert_eq!(output.status.code(), Some(2), "{args:?}");
    complained(&output)
}

#[test]
fn what_is_not_a_key_or_endpoint_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let config = folder.path().join("zenoh.json5");
    std::fs::write(&config, "{ mode: 'somewhere' }").unwrap();
    let config = config.display().to_string();
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let (taken, free) = (format!("tcp/{}", taken.local_addr().unwrap()), endpoint());
    let said = [
        refused(&["zenoh:", "--zenoh-listen", &free]),
        refused(&["zenoh://cell/rows", "--zenoh-listen", &free]),
        refused(&["zenoh:cell/rows", "--zenoh-connect", &free]),
        refused(&["zenoh:cell/rows", "--zenoh-listen", &taken]),
        refused(&["zenoh:cell/rows", "--zenoh-connect", "127.0.0.1:7447"]),
        refused(&["zenoh:cell/rows", "--zenoh-connect", "udp/127.0.0.1:7447"]),
        refused(&["zenoh:cell/rows", "--zenoh-config", &config]),
        refused(&["zenoh:cell/rows", "--zenoh-config", "none.json5"]),
        refused(&["-", "--zenoh-publish", "cell/**"]),
        refused(&["-", "--zenoh-publish", "/cell"]),
        refused(&["-", "--zenoh-connect", &free]),
    ];
    let said = said
        .join("\n")
        .replace(&taken, "TAKEN")
        .replace(&taken[4..], "TAKEN")
        .replace(&free, "FREE")
        .replace(&config, "CONFIG");
    insta::assert_snapshot!(said);
}
