//! Who may ask the server, for what, and how much.

use super::{OPENED, Studio, folder};
use crate::program::{complained, teachtree_in};
use serde_json::{Value, json};

#[test]
fn only_the_page_of_this_server_may_ask() {
    let folder = folder();
    let studio = Studio::start(folder.path(), &OPENED);
    let (host, root) = (studio.host(), studio.root());
    let token = root.trim_matches('/');
    let zeros = "0".repeat(token.len());
    let asked = |path: &str, host: &str, more: &str| {
        let request = format!("GET {path} HTTP/1.1\r\nHost: {host}\r\n{more}Connection: close\r\n\r\n");
        studio.send(request.as_bytes()).status
    };
    let port = host.split(':').nth(1).unwrap();
    assert_eq!(asked(root, host, ""), 200);
    assert_eq!(asked(root, &format!("localhost:{port}"), ""), 200);
    assert_eq!(asked(root, host, &format!("Origin: http://{host}\r\n")), 200);
    // Without the token, with half of it, with another one.
    for path in ["/", "/api/list", &format!("/{}/", &token[..16]), &format!("/{zeros}/api/list"), "//"] {
        assert_eq!(asked(path, host, ""), 403, "{path}");
    }
    // A name of somebody else that leads to this machine, another port, no host.
    for other in ["example.org", &format!("example.org:{port}"), "127.0.0.1:1", "127.0.0.1", ""] {
        assert_eq!(asked(root, other, ""), 403, "{other}");
    }
    for origin in ["http://example.org", "null", "http://127.0.0.1:1", &format!("https://{host}")] {
        assert_eq!(asked(root, host, &format!("Origin: {origin}\r\n")), 403, "{origin}");
    }
}

#[test]
fn no_address_leads_to_a_file() {
    let folder = folder();
    std::fs::write(folder.path().join("secret.txt"), "secret").unwrap();
    let studio = Studio::start(folder.path(), &OPENED);
    for path in [
        "../secret.txt",
        "../../../../etc/passwd",
        "%2e%2e/secret.txt",
        "..%2fsecret.txt",
        "logs/a.csv",
        "/etc/passwd",
        "api/recording/../../secret.txt",
        "api/recording/3",
        "api/recording/-1",
        "api/recording/99999999999999999999",
        "style.css/../../secret.txt",
    ] {
        let answer = studio.get_with(path, "");
        assert_eq!(answer.status, 404, "{path}");
        assert!(!String::from_utf8_lossy(&answer.body).contains("root:"), "{path}");
    }
}

#[test]
fn requests_are_bounded() {
    let folder = folder();
    let studio = Studio::start(folder.path(), &OPENED);
    let (root, host) = (studio.root(), studio.host());
    let send = |text: &str| studio.send(text.replace('\n', "\r\n").as_bytes()).status;
    let head = format!("POST {root}api/list HTTP/1.1\nHost: {host}\nConnection: close\n");
    assert_eq!(send(&format!("{head}Content-Type: application/json\nContent-Length: 100000000000\n\n")), 413);
    assert_eq!(send(&format!("{head}Content-Type: application/json\nTransfer-Encoding: chunked\n\n0\n\n")), 411);
    assert_eq!(send(&format!("{head}Content-Type: application/json\nContent-Length: -1\n\n")), 400);
    // Media types that a form of another page can send without a preflight request, and types that only begin with that of JSON.
    for kind in ["text/plain", "application/jsonx", "application/json-patch+json", "text/plain; application/json", ""] {
        assert_eq!(send(&format!("{head}Content-Type: {kind}\nContent-Length: 2\n\n{{}}")), 415, "{kind}");
    }
    for kind in ["application/json", "Application/JSON", "application/json; charset=utf-8", "application/json ;x"] {
        let kind = format!("Content-Type: {kind}\nContent-Length: 2\n\n{{}}");
        let head = head.replace("api/list", "api/rules");
        assert_eq!(send(&format!("{head}{kind}")), 200, "{kind}");
    }
    // A header field that affects access must have one value.
    let own = format!("Host: {host}");
    for field in ["Host: example.org", &own, "Content-Type: application/json", "Content-Length: 2"] {
        let twice = format!("{head}Content-Type: application/json\nContent-Length: 2\n{field}\n\n{{}}");
        assert_eq!(send(&twice), 400, "{field}");
    }
    let page = format!("Origin: http://{host}\n");
    assert_eq!(send(&format!("GET {root} HTTP/1.1\nHost: {host}\nConnection: close\n{page}\n")), 200);
    for other in ["Origin: http://example.org\n", &page] {
        let twice = format!("GET {root} HTTP/1.1\nHost: {host}\nConnection: close\n{page}{other}\n");
        assert_eq!(send(&twice), 400, "{other}");
    }
    assert_eq!(send(&format!("{head}X: {}\n\n", "x".repeat(40_000))), 431);
    assert_eq!(send("no request at all\n\n"), 400);
    assert_eq!(send(&format!("DELETE {root} HTTP/1.1\nHost: {host}\nConnection: close\n\n")), 405);
    // The server is well all the same.
    assert_eq!(studio.list()["recordings"].as_array().unwrap().len(), 3);
}

/// A client that sends its whole body before reading, as most do, can read the reason for the refusal.
#[test]
fn the_answer_to_a_long_body_is_read() {
    use std::io::{Read as _, Write as _};
    let folder = folder();
    let studio = Studio::start(folder.path(), &OPENED);
    let (root, host) = (studio.root(), studio.host());
    let length = 64 << 20;
    let head = format!(
        "POST {root}api/rules HTTP/1.1\r\nHost: {host}\r\nContent-Type: application/json\r\nContent-Length: {length}\r\n\r\n"
    );
    let mut stream = std::net::TcpStream::connect(host).unwrap();
    stream.write_all(head.as_bytes()).unwrap();
    stream.write_all(&vec![b' '; length]).unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    assert!(answer.starts_with("HTTP/1.1 413 ") && answer.contains("at most 8388608 are taken"), "{answer}");
}

#[test]
fn nothing_is_loaded_from_elsewhere() {
    let folder = folder();
    let studio = Studio::start(folder.path(), &OPENED);
    let page = studio.get_with("", "");
    let policy = page.head.lines().find(|line| line.starts_with("Content-Security-Policy:")).unwrap();
    assert!(policy.contains("default-src 'none'") && policy.contains("script-src 'self';"), "{policy}");
    assert!(!policy.contains("script-src 'self' 'unsafe") && !policy.contains("http"), "{policy}");
    for field in ["X-Content-Type-Options: nosniff", "Referrer-Policy: no-referrer", "Cache-Control: no-store"] {
        assert!(page.head.contains(field), "{}", page.head);
    }
    let text = String::from_utf8(page.body).unwrap();
    assert!(text.contains("id=\"bench\"") && !text.contains("http"), "{text}");
}

/// Rules without failures decide no outcome: the list shows none, as `analyze` prints none.
#[test]
fn the_list_has_no_outcome_that_nothing_decides() {
    let folder = folder();
    let studio = Studio::start(folder.path(), &[&OPENED[..], &["--rules", "contact.rules"]].concat());
    let list = studio.list();
    let rows = list["recordings"].as_array().unwrap();
    assert!(!rows.is_empty() && rows.iter().all(|row| row["status"] == "done" && row["outcome"].is_null()), "{list}");
}

#[test]
fn the_list_and_a_recording_are_what_analyze_finds() {
    let folder = folder();
    let studio = Studio::start(folder.path(), &OPENED);
    let list = studio.list();
    let output = teachtree_in(folder.path(), &["analyze", "logs/a.csv", "--binding", "lift.yaml", "--format", "json"]);
    let found: Value = serde_json::from_slice(&output.stdout).unwrap_or_else(|_| panic!("{}", complained(&output)));
    for (row, name) in list["recordings"].as_array().unwrap().iter().zip(["a", "b", "c7"]) {
        assert_eq!(row["name"], name);
        assert_eq!(row["status"], "done");
        let tasks: Vec<&str> = row["tasks"].as_array().unwrap().iter().map(|task| task[1].as_str().unwrap()).collect();
        let expected = found["tracks"].as_array().unwrap().iter().flat_map(|track| track["tasks"].as_array().unwrap());
        let expected: Vec<&str> = expected.map(|task| task["task"].as_str().unwrap()).collect();
        assert_eq!(tasks.len(), expected.len());
        assert!(tasks.iter().zip(&expected).all(|(task, name)| task.starts_with(name)), "{tasks:?} {expected:?}");
        assert_eq!(row["outcome"], found["outcome"]["result"]);
        assert_eq!(row["issue_count"], found["issues"].as_array().unwrap().len());
    }
    let recording = studio.get("api/recording/1");
    assert_eq!(recording["name"], "b");
    let (shown, track) = (&recording["data"]["tracks"][0], &found["tracks"][0]);
    for (lane, key) in [("raw", "segments"), ("relabeled", "relabeled")] {
        let names = |list: &Value, name: &dyn Fn(&Value) -> Value| {
            list.as_array().unwrap().iter().map(name).collect::<Vec<_>>()
        };
        assert_eq!(
            names(&shown[lane], &|one| one[0].clone()),
            names(&track[key], &|one| one["primitive"].clone()),
            "{lane}"
        );
    }
    // Once it has all, the list says only that nothing is new.
    let known = studio.list()["revision"].clone();
    let again = studio.get(&format!("api/list?since={known}"));
    assert!(again == json!({ "revision": known }) || again["revision"] != known, "{again}");
}

#[test]
fn what_cannot_be_opened_is_refused_before_the_page() {
    let folder = folder();
    for (args, message) in [
        (&["studio", "nothing.csv", "--no-open"][..], "there is no such file"),
        (&["studio", "logs", "--rules", "--no-open"], "a value is required"),
    ] {
        let output = teachtree_in(folder.path(), args);
        assert_eq!(output.status.code(), Some(2), "{args:?}");
        assert!(complained(&output).contains(message), "{args:?}: {}", complained(&output));
    }
    // One recording that cannot be analyzed does not keep the others from being shown.
    std::fs::write(folder.path().join("logs/bad.csv"), "time,x\n0,1\n").unwrap();
    let studio = Studio::start(folder.path(), &OPENED);
    let list = studio.list();
    let row = list["recordings"].as_array().unwrap().iter().find(|row| row["name"] == "bad").unwrap();
    assert_eq!(row["status"], "failed");
    assert!(row["error"].as_str().unwrap().contains("has no column"), "{row}");
    assert_eq!(studio.get_with("api/recording/2", "").status, 422);
}
