//! The studio: its server as a program sees it, and its page in a real browser.

pub mod against;
mod attention;
mod editor;
pub mod fit;
mod labels;
mod learning;
#[cfg(unix)]
mod links;
mod page;
mod server;

use crate::program::program;
use serde_json::Value;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};

/// A studio that runs, and ends with this.
pub struct Studio {
    process: Child,
    /// `http://127.0.0.1:PORT/TOKEN/`.
    pub address: String,
}

/// What the server answered.
struct Answer {
    status: u16,
    head: String,
    body: Vec<u8>,
}

impl Answer {
    fn json(&self) -> Value {
        serde_json::from_slice(&self.body).unwrap_or_else(|_| panic!("{}", String::from_utf8_lossy(&self.body)))
    }
}

impl Studio {
    pub fn start(folder: &Path, args: &[&str]) -> Self {
        let args = [&["studio", "--no-open"], args].concat();
        let mut process = program(folder, &args).stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
        let mut address = String::new();
        BufReader::new(process.stdout.take().unwrap()).read_line(&mut address).unwrap();
        assert!(address.starts_with("http://127.0.0.1:"), "{address}");
        Self { process, address: address.trim().to_string() }
    }

    /// `127.0.0.1:PORT`.
    fn host(&self) -> &str {
        self.address.strip_prefix("http://").unwrap().split('/').next().unwrap()
    }

    /// The path of the page: `/TOKEN/`.
    fn root(&self) -> &str {
        self.address.strip_prefix("http://").unwrap().strip_prefix(self.host()).unwrap()
    }

    /// Sends bytes as they are, and reads until the server hangs up.
    fn send(&self, bytes: &[u8]) -> Answer {
        let mut stream = TcpStream::connect(self.host()).unwrap();
        // The server may hang up before it has read everything.
        let _ = stream.write_all(bytes);
        let mut answer = Vec::new();
        let _ = stream.read_to_end(&mut answer);
        let end = answer.windows(4).position(|four| four == b"\r\n\r\n").expect("a head") + 4;
        let body = answer.split_off(end);
        let head = String::from_utf8(answer).unwrap();
        Answer { status: head.split(' ').nth(1).unwrap().parse().unwrap(), head, body }
    }

    /// Asks for a path below the token, with more fields of the head.
    fn get_with(&self, path: &str, fields: &str) -> Answer {
        let (root, host) = (self.root(), self.host());
        self.send(format!("GET {root}{path} HTTP/1.1\r\nHost: {host}\r\n{fields}Connection: close\r\n\r\n").as_bytes())
    }

    pub fn get(&self, path: &str) -> Value {
        let answer = self.get_with(path, "");
        assert_eq!(answer.status, 200, "{path}: {}", answer.json());
        answer.json()
    }

    /// Sends a body in JSON.
    fn change(&self, method: &str, path: &str, body: &Value) -> Answer {
        let (root, host, body) = (self.root(), self.host(), body.to_string());
        let head = format!(
            "{method} {root}{path} HTTP/1.1\r\nHost: {host}\r\nOrigin: http://{host}\r\nContent-Type: application/json\r\n\
             Content-Length: {}\r\nConnection: close\r\n\r\n",
            body.len()
        );
        self.send((head + &body).as_bytes())
    }

    /// The list, once every recording has been analyzed.
    pub fn list(&self) -> Value {
        loop {
            let list = self.get("api/list");
            if list["waiting"] == 0 {
                return list;
            }
            std::thread::sleep(std::time::Duration::from_millis(50));
        }
    }
}

impl Drop for Studio {
    fn drop(&mut self) {
        // It may be gone already.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

fn demos() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("demos/robosuite")
}

/// A folder with recordings `a.csv`, `b.csv` and `c7.csv`, their binding and their scene.
pub fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("logs")).unwrap();
    for name in ["a.csv", "b.csv", "c7.csv"] {
        std::fs::copy(demos().join("lift_demo_1.csv"), folder.path().join("logs").join(name)).unwrap();
    }
    std::fs::copy(demos().join("panda_lift.binding.yaml"), folder.path().join("lift.yaml")).unwrap();
    folder
}

/// How [`folder`] is opened.
pub const OPENED: [&str; 4] = ["logs", "--binding", "lift.yaml", "--each"];
