//! `teachtree live --serve`: viewers and controllers of another party's library, some of which go and come again.

use crate::live_log::{Rows, demonstration};
use crate::program::{program, python_with};
use serde_json::Value;
use std::io::{BufRead, BufReader, Read, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};

/// Reads what is served to its end, one JSON object a message. It may go, without a word, once an event of a number has come, and come again.
const CLIENT: &str = r#"
import asyncio, json, struct, sys, websockets
port, topics, leaves_after = sys.argv[1], sys.argv[2].split(","), int(sys.argv[3])

async def read(query, leaves_after):
    last = -1
    async with websockets.connect(f"ws://127.0.0.1:{port}/{query}", subprotocols=["foxglove.sdk.v1"]) as socket:
        session = json.loads(await socket.recv())["sessionId"]
        channels = {c["id"]: c for c in json.loads(await socket.recv())["channels"]}
        wanted = [id for id, c in channels.items() if topics == [""] or c["topic"] in topics]
        await socket.send(json.dumps({"op": "subscribe", "subscriptions": [{"id": 100 + id, "channelId": id} for id in wanted]}))
        print(json.dumps({"ready": sorted(c["topic"] for c in channels.values())}), flush=True)
        async for message in socket:
            if isinstance(message, str):
                print(json.dumps({"status": json.loads(message)["message"]}), flush=True)
                continue
            op, subscription, time = struct.unpack_from("<BIQ", message)
            assert op == 1
            channel = channels[subscription - 100]
            payload = message[13:]
            if channel["encoding"] == "json":
                value = json.loads(payload)
                last = value["sequence"]
            else:
                assert channel["schemaName"] == "std_msgs/msg/String" and payload[:4] == b"\0\1\0\0"
                value = payload[8:8 + struct.unpack_from("<I", payload, 4)[0] - 1].decode()
            print(json.dumps({"topic": channel["topic"], "time": time, "value": value}), flush=True)
            if 0 <= leaves_after <= last:
                socket.transport.abort()
                return session, last
    return session, last

async def main():
    session, last = await read("", leaves_after)
    if leaves_after >= 0:
        await asyncio.sleep(0.5)
        await read(f"?session={session}&after={last}", -1)

asyncio.run(main())
"#;

/// The program, which serves on a port.
fn serving() -> (Child, u16) {
    let mut command = program(
        Path::new(env!("CARGO_MANIFEST_DIR")),
        &["live", "-", "--serve", "0", "--confidence", "--format", "json"],
    );
    let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut line = String::new();
    BufReader::new(child.stderr.as_mut().unwrap()).read_line(&mut line).unwrap();
    let port = line.trim().strip_prefix("serving labels on ws://127.0.0.1:").unwrap().parse().unwrap();
    (child, port)
}

/// A demonstration as JSON lines, in two parts.
fn lines() -> [String; 2] {
    let recording = demonstration("pick_and_place");
    let rows = Rows::of(&recording);
    let object = |row: &Vec<f64>| {
        let values = row.iter().map(|value| serde_json::json!(value));
        let object: serde_json::Map<String, Value> = rows.titles.iter().cloned().zip(values).collect();
        format!("{}\n", Value::Object(object))
    };
    let scene = format!("{}\n", serde_json::json!({ "scene": recording.scene }));
    let lines: Vec<String> = rows.rows.iter().map(object).collect();
    let (one, other) = lines.split_at(lines.len() * 4 / 5);
    [scene + &one.concat(), other.concat()]
}

/// What the program prints, and what clients, which subscribe before anything happens, are sent: with the topics that each wants, and the event after which
/// it goes for a while.
fn run(python: &str, clients: &[(&str, i64)]) -> (Vec<Value>, Vec<Vec<Value>>) {
    let (mut child, port) = serving();
    let mut readers = vec![];
    let (ready, readies) = std::sync::mpsc::channel();
    for (topics, leaves_after) in clients {
        let mut command = Command::new(python);
        command.args(["-c", CLIENT, &port.to_string(), topics, &leaves_after.to_string()]);
        let mut client = command.stdout(Stdio::piped()).spawn().unwrap();
        let mut out = BufReader::new(client.stdout.take().unwrap());
        let ready = ready.clone();
        readers.push(std::thread::spawn(move || {
            let mut messages = Vec::<Value>::new();
            let mut line = String::new();
            while out.read_line(&mut line).unwrap() > 0 {
                messages.push(serde_json::from_str(&line).unwrap());
                if !messages.last().unwrap()["ready"].is_null() {
                    ready.send(()).unwrap();
                }
                line.clear();
            }
            assert!(client.wait().unwrap().success(), "{messages:?}");
            messages
        }));
    }
    let until_ready = |count: usize| (0..count).for_each(|_| readies.recv().unwrap());
    until_ready(clients.len());
    let mut stdout = child.stdout.take().unwrap();
    let printing = std::thread::spawn(move || {
        let mut text = String::new();
        stdout.read_to_string(&mut text).unwrap();
        text.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
    });
    let mut stdin = child.stdin.take().unwrap();
    let [one, other] = lines();
    stdin.write_all(one.as_bytes()).unwrap();
    // A client reconnects while the log continues.
    until_ready(clients.iter().filter(|(_, leaves_after)| *leaves_after >= 0).count());
    stdin.write_all(other.as_bytes()).unwrap();
    drop(stdin);
    assert!(child.wait().unwrap().success());
    (printing.join().unwrap(), readers.into_iter().map(|reader| reader.join().unwrap()).collect())
}

fn of_topic(messages: &[Value], topic: &str) -> Vec<Value> {
    messages.iter().filter(|message| message["topic"] == topic).map(|message| message["value"].clone()).collect()
}

#[test]
fn viewers_and_controllers_get_every_event_once() {
    let Some(python) = python_with("websockets", "websockets") else { return };
    let (printed, clients) = run(&python, &[("", -1), ("/teachtree/events", 4)]);
    assert!(printed.len() > 10, "{printed:?}");
    let [viewer, controller] = clients.as_slice() else { unreachable!() };
    assert_eq!(of_topic(viewer, "/teachtree/events"), printed);
    let labels = printed.iter().filter(|event| event["event"] == "label" && event["track"] == "right");
    let mut labels: Vec<Value> = labels.map(|event| event["primitive"].clone()).collect();
    // A label whose confidence changes is another event and no other label.
    let events = labels.len();
    labels.dedup();
    assert!(labels.len() < events, "{labels:?}");
    assert_eq!(of_topic(viewer, "/teachtree/right/primitive"), labels);
    assert_eq!(of_topic(viewer, "/teachtree/right/task"), ["pick_and_place"]);
    let times: Vec<u64> = viewer.iter().filter_map(|message| message["time"].as_u64()).collect();
    assert!(times.is_sorted() && times.len() > printed.len(), "{times:?}");
    // It was gone for a while.
    assert_eq!(controller.iter().filter(|message| !message["ready"].is_null()).count(), 2);
    assert_eq!(of_topic(controller, "/teachtree/events"), printed);
}

/// A late client gets the present state, then the news; other connections, and silent ones, do not block clients.
#[test]
fn who_comes_late_sees_what_is_so_now() {
    let Some(python) = python_with("websockets", "websockets") else { return };
    let (mut child, port) = serving();
    let _silent = std::net::TcpStream::connect(("127.0.0.1", port)).unwrap();
    let mut odd = std::net::TcpStream::connect(("127.0.0.1", port)).unwrap();
    odd.write_all(b"GET / HTTP/1.1\r\nHost: x\r\n\r\n\0\0\0").unwrap();
    let [one, other] = lines();
    let mut stdin = child.stdin.take().unwrap();
    let mut stdout = BufReader::new(child.stdout.take().unwrap());
    stdin.write_all(one.as_bytes()).unwrap();
    let mut label = Value::Null;
    while label["track"] != "right" || label["event"] != "label" {
        let mut line = String::new();
        stdout.read_line(&mut line).unwrap();
        label = serde_json::from_str(&line).unwrap();
    }
    let printing = std::thread::spawn(move || stdout.read_to_string(&mut String::new()).unwrap());
    let mut command = Command::new(&python);
    command.args(["-c", CLIENT, &port.to_string(), "/teachtree/right/primitive,/teachtree/right/task", "-1"]);
    let mut client = command.stdout(Stdio::piped()).spawn().unwrap();
    let mut out = BufReader::new(client.stdout.take().unwrap());
    let mut lines = String::new();
    out.read_line(&mut lines).unwrap();
    let ready: Value = serde_json::from_str(&lines).unwrap();
    assert_eq!(ready["ready"].as_array().unwrap().len(), 7, "{ready}");
    lines.clear();
    out.read_line(&mut lines).unwrap();
    let first: Value = serde_json::from_str(&lines).unwrap();
    assert_eq!(first["topic"], "/teachtree/right/primitive", "{first}");
    stdin.write_all(other.as_bytes()).unwrap();
    drop(stdin);
    lines.clear();
    out.read_to_string(&mut lines).unwrap();
    assert!(lines.contains("pick_and_place"), "{lines}");
    assert!(client.wait().unwrap().success());
    assert!(child.wait().unwrap().success());
    printing.join().unwrap();
}

/// Returns the response status of a connection request with these header fields.
fn asked(port: u16, fields: &str) -> String {
    let mut socket = std::net::TcpStream::connect(("127.0.0.1", port)).unwrap();
    let request = format!(
        "GET / HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n{fields}\
         Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Protocol: foxglove.sdk.v1\r\n\r\n"
    );
    socket.write_all(request.as_bytes()).unwrap();
    let mut line = String::new();
    BufReader::new(socket).read_line(&mut line).unwrap();
    line.split(' ').nth(1).unwrap_or_default().to_string()
}

#[test]
fn pages_of_other_sites_may_not_read() {
    let named = "https://app.foxglove.dev/";
    let mut command = program(
        Path::new(env!("CARGO_MANIFEST_DIR")),
        &["live", "-", "--serve", "0", "--serve-origin", named, "--serve-origin", "http://Viewer.lan:8080"],
    );
    let mut child = command.stdin(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut line = String::new();
    BufReader::new(child.stderr.as_mut().unwrap()).read_line(&mut line).unwrap();
    let port: u16 = line.trim().strip_prefix("serving labels on ws://127.0.0.1:").unwrap().parse().unwrap();
    for origin in [
        "http://example.org",
        "https://example.org",
        "null",
        "",
        "http://localhost.example.org",
        "http://localhost:80.example.org",
        "http://127.0.0.1.example.org",
        "https://app.foxglove.dev.example.org",
        "http://app.foxglove.dev",
        "http://viewer.lan",
        "localhost",
    ] {
        assert_eq!(asked(port, &format!("Origin: {origin}\r\n")), "403", "{origin}");
    }
    assert_eq!(asked(port, "Origin: http://localhost\r\nOrigin: http://example.org\r\n"), "403");
    for origin in [
        "http://localhost",
        "http://localhost:8080",
        "http://127.0.0.1:3000",
        "http://[::1]:8080",
        "https://app.foxglove.dev",
        "http://viewer.lan:8080",
        "file://",
    ] {
        assert_eq!(asked(port, &format!("Origin: {origin}\r\n")), "101", "{origin}");
    }
    // A program other than a browser sends no origin.
    assert_eq!(asked(port, ""), "101");
    child.kill().unwrap();
    child.wait().unwrap();
    for wrong in ["example.org", "https://", "https://a/b", "*"] {
        let output = crate::program::teachtree(&["live", "-", "--serve", "0", "--serve-origin", wrong]);
        assert_eq!(output.status.code(), Some(2), "{wrong}");
    }
}

#[test]
fn what_cannot_be_served_on_is_refused() {
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port().to_string();
    let refused = |serve: &str| {
        let mut command = program(Path::new(env!("CARGO_MANIFEST_DIR")), &["live", "-", "--serve", serve]);
        let output = command.stdin(Stdio::null()).output().unwrap();
        assert_eq!(output.status.code(), Some(2));
        String::from_utf8_lossy(&output.stderr).replace(&port, "PORT")
    };
    insta::assert_snapshot!([refused(&port), refused("robot")].join("\n"));
}
