//! `teachtree live`: labels while the log is being made.

use super::rules::RuleArgs;
use super::{Failure, output};
use crate::base::error::InputError;
use crate::session::{Calibration, Feed, FeedOptions, Known, LiveEvent, Log, Scene};
use crate::stream::bind::RowBinder;
use crate::stream::read::text;
use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::net::UdpSocket;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::thread;

/// The longest line, bytes.
const MAX_LINE: u64 = 1 << 20;
/// How many lines may wait.
const WAITING: usize = 256;
/// The largest calibration file, bytes.
const MAX_CALIBRATION: u64 = 16 << 20;
/// While more than so many wait, the newest frames are not labeled …
const MANY_WAITING: usize = 128;
/// … until only so many do.
const FEW_WAITING: usize = 16;

/// Options of `live`.
#[derive(clap::Args)]
#[command(after_help = "Examples:
  robot_driver | teachtree live - --scene cell.scene.yaml
  teachtree live udp://127.0.0.1:9000 --format json
  arm_driver | teachtree live - --binding arm.binding.yaml
  teachtree live demonstration.csv --calibration demonstration.csv --no-labels")]
pub struct Args {
    /// Where rows come from: `-` for standard input, `udp://ADDRESS:PORT` for a datagram a row, or a file. Rows are JSON objects or CSV with a header
    source: String,
    #[command(flatten)]
    rules: RuleArgs,
    /// The scene; else the first line of JSON lines, or the file beside a file
    #[arg(long, value_name = "FILE")]
    scene: Option<PathBuf>,
    /// How the columns of the log become channels (docs/bindings.md); each row is bound by itself
    #[arg(long, value_name = "FILE")]
    binding: Option<PathBuf>,
    /// Learn the rate and the sensors from the first seconds of the log
    #[arg(long, value_name = "SECONDS", default_value_t = 3.0, value_parser = seconds)]
    calibrate: f64,
    /// Take them from a file of `inspect --calibrate`, or from a recording with the same columns
    #[arg(long, value_name = "FILE")]
    calibration: Option<PathBuf>,
    /// How events are printed
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
    /// Print segments and tasks only, not the labels of the newest frames
    #[arg(long)]
    no_labels: bool,
}

/// Forms of events.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Format {
    /// A line an event, for people
    Text,
    /// `teachtree.live/1`: a JSON object a line
    Json,
}

fn seconds(text: &str) -> Result<f64, String> {
    let seconds: f64 = text.parse().map_err(|_| "expected a number of seconds, such as 3")?;
    if (0.1..=600.0).contains(&seconds) { Ok(seconds) } else { Err("expected 0.1 to 600 seconds".into()) }
}

/// What a source sends.
enum Sent {
    Line(Vec<u8>),
    /// A line that is too long was left out.
    TooLong,
    /// Lines that nobody waited for.
    Lost(u64),
    Failed(InputError),
    Stop,
}

/// Where a source sends to.
#[derive(Clone)]
struct Outlet {
    sender: SyncSender<Sent>,
    waiting: Arc<AtomicUsize>,
}

impl Outlet {
    /// Sends when there is room, waiting for it; whether anyone takes it.
    fn send(&self, sent: Sent) -> bool {
        self.waiting.fetch_add(1, Ordering::Relaxed);
        self.sender.send(sent).is_ok()
    }

    /// Sends if there is room; returns what was not sent.
    fn try_send(&self, sent: Sent) -> Result<(), TrySendError<Sent>> {
        self.waiting.fetch_add(1, Ordering::Relaxed);
        let tried = self.sender.try_send(sent);
        if tried.is_err() {
            self.waiting.fetch_sub(1, Ordering::Relaxed);
        }
        tried
    }
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let scene = args.scene.as_ref().map(Scene::open).transpose()?;
    let calibration = args.calibration.as_deref().map(|path| known(path, args)).transpose()?;
    let own = scene.as_ref().map(|scene| scene.inner().clone());
    let binder = args.binding.as_ref().map(|path| RowBinder::open(path, own)).transpose()?;
    let mut feed = Feed::new(FeedOptions {
        name: if args.source == "-" { "standard input".into() } else { args.source.clone() },
        rules: args.rules.options(),
        scene,
        beside: beside(&args.source)?,
        binder,
        calibrate_s: args.calibrate,
        calibration,
    });
    let (sender, lines) = sync_channel(WAITING);
    let outlet = Outlet { sender, waiting: Arc::default() };
    let stops = Arc::new(AtomicBool::new(false));
    super::on_interrupt({
        let (outlet, stops) = (outlet.clone(), Arc::clone(&stops));
        move || {
            stops.store(true, Ordering::Relaxed);
            // Where there is no room, a line comes next, and the flag is seen.
            let _ = outlet.try_send(Sent::Stop);
        }
    });
    let waiting = Arc::clone(&outlet.waiting);
    let is_timed = begin(&args.source, outlet)?;
    let reader = Reader { args, lines, waiting, stops, is_timed, is_labeling: true };
    if reader.follow(&mut feed)? {
        print(args, &feed.finish()?)?;
    }
    Ok(())
}

/// Reads a calibration, or a recording to calibrate with.
fn known(path: &Path, args: &Args) -> Result<Known, Failure> {
    if path.extension().is_none_or(|ending| ending != "json") {
        let options = args.binding.iter().fold(Log::options(), |options, binding| options.binding(binding));
        let options = args.scene.iter().fold(options, |options, scene| options.scene(scene));
        return Ok(Known::Recording(options.open(path)?));
    }
    let text = text::read(path, MAX_CALIBRATION)?;
    Ok(Known::File(Box::new(Calibration::parse(&path.display().to_string(), &text)?)))
}

/// Takes what a source sends.
struct Reader<'a> {
    args: &'a Args,
    lines: Receiver<Sent>,
    waiting: Arc<AtomicUsize>,
    stops: Arc<AtomicBool>,
    /// Whether the source does not wait for us.
    is_timed: bool,
    is_labeling: bool,
}

impl Reader<'_> {
    /// Prints events until the source ends; whether anyone still reads them.
    fn follow(mut self, feed: &mut Feed) -> Result<bool, Failure> {
        while let Ok(sent) = self.lines.recv() {
            let waiting = self.waiting.fetch_sub(1, Ordering::Relaxed);
            if self.stops.load(Ordering::Relaxed) {
                break;
            }
            let keeps_up = if self.is_labeling { waiting <= MANY_WAITING } else { waiting <= FEW_WAITING };
            let mut events = vec![];
            if self.is_timed && keeps_up != self.is_labeling {
                self.is_labeling = keeps_up;
                events.extend(feed.label(keeps_up));
            }
            events.extend(match sent {
                Sent::Line(line) => feed.line(&line)?,
                Sent::TooLong => feed.too_long(MAX_LINE),
                Sent::Lost(lines) => feed.lost(lines),
                Sent::Failed(error) => return Err(error.into()),
                Sent::Stop => break,
            });
            if !print(self.args, &events)? {
                return Ok(false);
            }
        }
        Ok(true)
    }
}

/// Prints events; whether anyone still reads them.
fn print(args: &Args, events: &[LiveEvent]) -> Result<bool, Failure> {
    let shown = events.iter().filter(|event| !(args.no_labels && event.name() == "label"));
    let mut text = String::new();
    for event in shown {
        match args.format {
            Format::Json => text.push_str(&event.json()),
            Format::Text => text.push_str(&line(event)),
        }
        text.push('\n');
    }
    if text.is_empty() { Ok(true) } else { Ok(output::print_more(&text)?) }
}

/// An event as a line for people: what may still change is marked.
fn line(event: &LiveEvent) -> String {
    let mark = match (event.name(), event.is_final()) {
        ("label", _) => "now    ",
        ("segment", false) => "closed ",
        ("task", false) => "task?  ",
        ("segment", true) => "segment",
        ("task", true) => "task   ",
        _ => "issue  ",
    };
    format!("{mark} {event}")
}

/// The scene beside a file.
fn beside(source: &str) -> Result<Option<Scene>, Failure> {
    let path = Path::new(source).with_extension("scene.yaml");
    if source != "-" && !source.contains("://") && path.is_file() { Ok(Some(Scene::open(path)?)) } else { Ok(None) }
}

/// Begins to read a source; whether it does not wait for us.
fn begin(source: &str, outlet: Outlet) -> Result<bool, InputError> {
    if let Some(address) = source.strip_prefix("udp://") {
        let failed = |error: std::io::Error| InputError::new(source, format!("cannot be listened to: {error}"));
        let socket = UdpSocket::bind(address).map_err(failed)?;
        thread::spawn(move || datagrams(&socket, &outlet));
        return Ok(true);
    }
    if source.contains("://") {
        return Err(InputError::new(source, "expected `-`, `udp://ADDRESS:PORT` or a file"));
    }
    let name = if source == "-" { "standard input".to_string() } else { source.to_string() };
    let bytes: Box<dyn Read + Send> = if source == "-" {
        Box::new(std::io::stdin())
    } else {
        let open = File::open(source);
        Box::new(open.map_err(|error| InputError::new(source, format!("cannot be opened: {error}")))?)
    };
    thread::spawn(move || read(BufReader::new(bytes), &name, &outlet));
    Ok(false)
}

/// Sends the lines of a stream to its end, waiting where nobody takes them.
fn read(mut bytes: impl BufRead, name: &str, outlet: &Outlet) {
    loop {
        let mut line = vec![];
        let sent = match bytes.by_ref().take(MAX_LINE + 1).read_until(b'\n', &mut line) {
            Ok(0) => Sent::Stop,
            Ok(_) if line.len() as u64 <= MAX_LINE || line.ends_with(b"\n") => Sent::Line(line),
            Ok(_) => match bytes.skip_until(b'\n') {
                Ok(_) => Sent::TooLong,
                Err(error) => failed(name, &error),
            },
            Err(error) => failed(name, &error),
        };
        let ends = matches!(sent, Sent::Stop | Sent::Failed(_));
        if !outlet.send(sent) || ends {
            return;
        }
    }
}

fn failed(name: &str, error: &std::io::Error) -> Sent {
    Sent::Failed(InputError::new(name, format!("cannot be read: {error}")))
}

/// Sends datagrams, as long as there is room for them; counts the others.
fn datagrams(socket: &UdpSocket, outlet: &Outlet) {
    let mut buffer = vec![0; 1 << 16];
    let mut lost = 0;
    while let Ok(length) = socket.recv(&mut buffer) {
        if lost > 0 && outlet.try_send(Sent::Lost(lost)).is_ok() {
            lost = 0;
        }
        match outlet.try_send(Sent::Line(buffer[..length].to_vec())) {
            Ok(()) => {}
            Err(TrySendError::Full(_)) => lost += 1,
            Err(TrySendError::Disconnected(_)) => return,
        }
    }
}
