//! Sources of rows and messages of a live log. A source reads in its own thread. While its consumer is busy, it waits, or drops rows and counts them.

use super::bag;
use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::net::UdpSocket;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{SendError, SyncSender, TrySendError};
use std::thread;
use teachtree_base::error::InputError;
use teachtree_frames::bind::TopicFilter;
use teachtree_logs::read::formats;
use teachtree_logs::read::formats::rosmsg::Failure;
use teachtree_logs::read::formats::topics::MessageDecoder;
use teachtree_logs::read::memory_table::InMemoryTable;
use teachtree_session::files::{all_logs, listed};

/// The longest line, bytes.
pub const MAX_LINE: u64 = 1 << 20;

/// The messages of a source.
pub enum SourceEvent {
    Line(Vec<u8>),
    /// A line that is too long was left out.
    TooLong,
    /// Lines or messages that were dropped.
    Lost(u64),
    /// A message: its topic, its stamp, ns, and its fields as a row.
    Message(String, i64, Box<InMemoryTable>),
    /// A message that cannot be read: its topic, and why.
    Unreadable(String, String),
    /// A topic of which no message can be read, and why.
    Refused(String, String),
    /// The connection broke; what has come after it is another stretch.
    Broken(String),
    /// The source is available again.
    Connected(String),
    Failed(InputError),
    Stop,
}

/// The receiver of a source.
#[derive(Clone)]
pub struct Outlet {
    pub sender: SyncSender<SourceEvent>,
    pub waiting: Arc<AtomicUsize>,
    /// Whether the source is to stop.
    pub stops: Arc<AtomicBool>,
}

impl Outlet {
    /// Sends when there is room, waiting for it; whether anyone takes it.
    pub fn send(&self, sent: SourceEvent) -> bool {
        self.waiting.fetch_add(1, Ordering::Relaxed);
        !matches!(self.sender.send(sent), Err(SendError(_)))
    }

    /// Sends if there is room; returns what was not sent.
    pub fn try_send(&self, sent: SourceEvent) -> Result<(), TrySendError<SourceEvent>> {
        self.waiting.fetch_add(1, Ordering::Relaxed);
        let tried = self.sender.try_send(sent);
        if tried.is_err() {
            self.waiting.fetch_sub(1, Ordering::Relaxed);
        }
        tried
    }

    /// Whether the source is to stop.
    pub fn stops(&self) -> bool {
        self.stops.load(Ordering::Relaxed)
    }
}

/// Refuses folders and episodes of data sets.
fn refuse_sets(source: &str) -> Result<(), InputError> {
    const EXPECTED: &str = "which `live` does not follow, expected a file of rows, an MCAP file or a stream";
    let path = Path::new(source);
    let set = formats::without_episode(path);
    if set != path && !path.exists() && set.exists() {
        let message = format!("is an episode of a data set, {EXPECTED}");
        return Err(InputError::new(source, message).help("use `analyze`"));
    }
    if !path.is_dir() {
        return Ok(());
    }
    let error = InputError::new(source, format!("is a folder, {EXPECTED}"));
    let is_one_log = formats::is_set(path) || formats::is_zarr(path) || formats::is_bag(path);
    Err(match all_logs(&[path.into()]) {
        Ok(logs) if !is_one_log => error.help(format!("name one of its recordings: {}", listed(&logs))),
        _ => error.help("use `analyze`"),
    })
}

/// The kind of a source.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Lines,
    Datagrams,
    /// Samples of keys, by Zenoh.
    Samples,
    /// Messages of topics, by the Foxglove protocol.
    Robot,
    /// Messages of topics, in a file.
    Bag,
}

impl Kind {
    /// Returns the kind of a source by its name.
    ///
    /// # Errors
    /// No source has this name.
    pub fn of(source: &str) -> Result<Self, InputError> {
        if source.starts_with("udp://") {
            return Ok(Self::Datagrams);
        }
        if source.starts_with("ws://") || source.starts_with("wss://") {
            return Ok(Self::Robot);
        }
        if source.starts_with("zenoh:") {
            return if cfg!(feature = "zenoh") {
                Ok(Self::Samples)
            } else {
                Err(InputError::new(source, "this program was built without the feature `zenoh`")
                    .help("build it with `cargo install --path . --locked --features zenoh` (docs/live.md)"))
            };
        }
        if source.contains("://") {
            let expected = "expected `-`, `ws://HOST:PORT`, `udp://ADDRESS:PORT`, `zenoh:KEY` or a file";
            return Err(InputError::new(source, expected));
        }
        let ends_in = |wanted: &str| Path::new(source).extension().is_some_and(|it| it.eq_ignore_ascii_case(wanted));
        if ends_in("mcap") {
            return Ok(Self::Bag);
        }
        if ends_in("db3") {
            let message = "is a bag in SQLite, which `live` does not follow, expected MCAP";
            return Err(InputError::new(source, message).help("convert it with `ros2 bag convert`, or use `analyze`"));
        }
        refuse_sets(source)?;
        Ok(Self::Lines)
    }

    /// Whether it does not wait for us.
    pub fn is_timed(self) -> bool {
        match self {
            Self::Datagrams | Self::Samples | Self::Robot => true,
            Self::Lines | Self::Bag => false,
        }
    }

    /// Maximum number of waiting lines or messages.
    pub fn most_waiting(self) -> usize {
        match (self.has_topics(), self.is_timed()) {
            // Several topics send at a time, and images are not among them.
            (true, _) => 8192,
            // These do not wait while the rows of the calibration are analyzed.
            (false, true) => 4096,
            (false, false) => 256,
        }
    }

    /// Numbers of waiting rows at which labeling of the newest frames stops and restarts.
    pub fn late(self) -> [usize; 2] {
        if self.has_topics() { [4096, 512] } else { [128, 16] }
    }

    /// Whether it has topics, each with messages of its own.
    pub fn has_topics(self) -> bool {
        matches!(self, Self::Bag | Self::Robot)
    }
}

/// Begins to read a source.
pub fn begin(source: &str, kind: Kind, outlet: Outlet) -> Result<(), InputError> {
    if kind == Kind::Datagrams {
        let address = source.trim_start_matches("udp://");
        let failed = |error: std::io::Error| {
            if error.kind() == std::io::ErrorKind::InvalidInput {
                let message =
                    format!("found `{address}`, expected `ADDRESS:PORT`, the address of this machine to listen on");
                return InputError::new(source, message)
                    .help("`udp://127.0.0.1:9000` takes rows of this machine, `udp://0.0.0.0:9000` those of all");
            }
            InputError::new(source, format!("cannot be listened to: {error}"))
        };
        let socket = UdpSocket::bind(address).map_err(failed)?;
        thread::spawn(move || datagrams(&socket, &outlet));
        return Ok(());
    }
    if source == "-" {
        thread::spawn(move || read(BufReader::new(std::io::stdin()), "standard input", &outlet));
        return Ok(());
    }
    open(source, outlet, |file, name, outlet| read(BufReader::new(file), name, outlet));
    Ok(())
}

/// Opens a file and reads it in a thread of its own: a pipe cannot be opened until it has a writer, and a signal ends the log also while that is awaited.
fn open(source: &str, outlet: Outlet, read: impl FnOnce(File, &str, &Outlet) + Send + 'static) {
    let name = source.to_string();
    thread::spawn(move || match File::open(&name) {
        Ok(file) => read(file, &name, &outlet),
        Err(error) => {
            outlet.send(SourceEvent::Failed(InputError::new(name, format!("cannot be opened: {error}"))));
        }
    });
}

/// Begins to read a file of messages; while it is being written if it is `followed`.
pub fn begin_bag(source: &str, topics: TopicFilter, followed: bool, outlet: Outlet) {
    open(source, outlet, move |file, name, outlet| bag::play(file, name, &topics, followed, outlet));
}

/// A forwarded message, with the time at which it was recorded or received, ns. This time counts for a message without a stamp.
pub fn message(topic: &str, reading: &MessageDecoder, recorded_ns: i64, bytes: &[u8]) -> SourceEvent {
    if let MessageDecoder::Refused(why) = reading {
        return SourceEvent::Refused(topic.into(), why.clone());
    }
    let mut row = InMemoryTable::new(format!("topic {topic}"));
    let decoded = row.begin_row().map_err(Failure::Log).and_then(|()| reading.decode(bytes, &mut row));
    match decoded {
        Ok(stamp) => SourceEvent::Message(topic.into(), stamp.unwrap_or(recorded_ns), Box::new(row)),
        Err(Failure::Message(why)) => SourceEvent::Unreadable(topic.into(), why),
        Err(Failure::Log(error)) => SourceEvent::Unreadable(topic.into(), error.message),
    }
}

/// Sends the lines of a stream to its end; waits while the consumer is busy.
fn read(mut bytes: impl BufRead, name: &str, outlet: &Outlet) {
    loop {
        let mut line = vec![];
        let sent = match bytes.by_ref().take(MAX_LINE + 1).read_until(b'\n', &mut line) {
            Ok(0) => SourceEvent::Stop,
            Ok(_) if line.len() as u64 <= MAX_LINE || line.ends_with(b"\n") => SourceEvent::Line(line),
            Ok(_) => match bytes.skip_until(b'\n') {
                Ok(_) => SourceEvent::TooLong,
                Err(error) => failed(name, &error),
            },
            Err(error) => failed(name, &error),
        };
        let ends = matches!(sent, SourceEvent::Stop | SourceEvent::Failed(_));
        if !outlet.send(sent) || ends {
            return;
        }
    }
}

fn failed(name: &str, error: &std::io::Error) -> SourceEvent {
    SourceEvent::Failed(InputError::new(name, format!("cannot be read: {error}")))
}

/// Sends datagrams, as long as there is room for them; counts the others.
fn datagrams(socket: &UdpSocket, outlet: &Outlet) {
    let mut buffer = vec![0; 1 << 16];
    let mut lost = 0;
    while let Ok(length) = socket.recv(&mut buffer) {
        if lost > 0 && outlet.try_send(SourceEvent::Lost(lost)).is_ok() {
            lost = 0;
        }
        match outlet.try_send(SourceEvent::Line(buffer[..length].to_vec())) {
            Ok(()) => {}
            Err(TrySendError::Full(_)) => lost += 1,
            Err(TrySendError::Disconnected(_)) => return,
        }
    }
}
