//! What comes over a connection: messages of viewers and robots, and requests for the pages.

use crate::{file, repository, scratch};
use std::io::{Read, Write};
use std::net::{Shutdown, TcpStream};
use std::sync::{Arc, LazyLock};
use std::time::Duration;
use teachtree_logs::foxglove::{ClientMessage, ServerMessage, message_data};
use teachtree_serve::{Page, Server};
use teachtree_logs::read::memory_table::InMemoryTable;
use teachtree_studio::Studio;
use teachtree_teaching::{self as teaching, TeachingPage};
use teachtree_world::shipped;
use teachtree::{LogOptions, RulesOptions};

/// How long a page may take to answer.
const PATIENCE: Duration = Duration::from_secs(10);

/// Messages of the Foxglove protocol: texts, one a line, and after an empty line a message of a topic.
pub fn foxglove(data: &[u8]) {
    let end = data.windows(2).position(|two| two == b"\n\n").unwrap_or(data.len());
    let (texts, binary) = data.split_at(end);
    let mut readings = Vec::new();
    for line in texts.split(|byte| *byte == b'\n') {
        let text = String::from_utf8_lossy(line);
        drop(ClientMessage::parse(&text));
        if let ServerMessage::Advertise(channels) = ServerMessage::parse(&text) {
            readings.extend(channels.iter().map(|channel| (channel.kind().to_string(), channel.reading())));
        }
    }
    let Some((_, _, payload)) = message_data(binary.get(2..).unwrap_or_default()) else { return };
    for (_, reading) in &readings {
        let mut row = InMemoryTable::new("message");
        row.begin_row().expect("a row fits");
        let _ = reading.decode(payload, &mut row);
    }
}

/// A page that is served.
struct FuzzServer {
    /// `127.0.0.1:PORT`.
    host: String,
    token: String,
}

impl FuzzServer {
    fn begin<P: Page>(page: Arc<P>) -> Self {
        let server = Server::new(0).expect("a port");
        let address = server.address();
        std::thread::spawn(move || server.run(&page));
        let mut parts = address.trim_start_matches("http://").split('/').map(str::to_string);
        Self { host: parts.next().expect("a host"), token: parts.next().expect("a token") }
    }

    /// Sends bytes with the words `HOST` and `TOKEN` replaced, and what follows; returns the answer.
    fn ask(&self, data: &[u8], then: &[u8]) -> Vec<u8> {
        let mut request = Vec::new();
        let mut rest = data;
        while let Some((first, others)) = rest.split_first() {
            rest = if let Some(behind) = rest.strip_prefix(b"TOKEN") {
                request.extend(self.token.bytes());
                behind
            } else if let Some(behind) = rest.strip_prefix(b"HOST") {
                request.extend(self.host.bytes());
                behind
            } else {
                request.push(*first);
                others
            };
        }
        request.extend(then);
        let mut stream = TcpStream::connect(&self.host).expect("the server listens");
        stream.set_read_timeout(Some(PATIENCE)).expect("a timeout");
        // The server may hang up before it has read everything.
        let _ = stream.write_all(&request);
        let _ = stream.shutdown(Shutdown::Write);
        let mut answer = Vec::new();
        if let Err(error) = stream.read_to_end(&mut answer) {
            assert!(error.kind() == std::io::ErrorKind::ConnectionReset, "no answer: {error}");
        }
        answer
    }
}

/// Requests for the studio.
pub fn studio(data: &[u8]) {
    static STUDIO: LazyLock<FuzzServer> = LazyLock::new(|| {
        let fixtures = repository().join("tests/fixtures/logs");
        let copy = |from: &str, to: &str| file(to, &std::fs::read(fixtures.join(from)).expect("a fixture"));
        copy("box.yaml", "steady_grip.scene.yaml");
        let studio = Studio::new(teachtree_studio::Options {
            paths: vec![copy("steady_grip.csv", "steady_grip.csv")],
            source: LogOptions::default(),
            binding: None,
            each: false,
            rules: RulesOptions::default(),
            against: None,
            who: "fuzz".into(),
        });
        FuzzServer::begin(Arc::new(studio.expect("a studio")))
    });
    let answer = STUDIO.ask(data, b"");
    assert!(!answer.starts_with(b"HTTP/1.1 500"), "{}", String::from_utf8_lossy(&answer));
}

/// Messages for teaching by hand, one a line: the beginning of each text frame of a WebSocket is put before it.
pub fn teaching(data: &[u8]) {
    static TEACHING: LazyLock<FuzzServer> = LazyLock::new(|| {
        let options = teaching::Options {
            scene: shipped::scene("push").expect("a scene"),
            name: "fuzz".into(),
            out: scratch().join("taught.csv"),
            inputs: Vec::new(),
            rules: RulesOptions::default(),
            camera: None,
            perform: Box::new(|_, _| Err("nothing is performed".into())),
        };
        let (teaching, _) = teaching::begin(options).expect("a scene at rest");
        FuzzServer::begin(Arc::new(TeachingPage(teaching)))
    });
    const MASK: [u8; 4] = [1, 2, 3, 4];
    let mut frames = Vec::new();
    for line in data.split(|byte| *byte == b'\n') {
        let Ok(length) = u16::try_from(line.len()) else { continue };
        // A whole text, masked, with a length of 16 bits.
        frames.extend([0x81, 0x80 | 126]);
        frames.extend(length.to_be_bytes());
        frames.extend(MASK);
        frames.extend(line.iter().zip(MASK.iter().cycle()).map(|(byte, mask)| byte ^ mask));
    }
    let request = b"GET /TOKEN/live HTTP/1.1\r\nHost: HOST\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n";
    TEACHING.ask(request, &frames);
}
