//! `teachtree live`: labels while the log is being made.

use super::rules::RuleArgs;
use super::{Failure, output};
use crate::base::error::InputError;
use crate::session::{Feed, FeedOptions, LiveEvent, Log, Scene};
use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::net::UdpSocket;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::thread;

/// The longest line, bytes.
const MAX_LINE: u64 = 4 << 20;
/// How many lines may wait.
const WAITING: usize = 4096;

/// Options of `live`.
#[derive(clap::Args)]
#[command(after_help = "Examples:
  robot_driver | teachtree live - --scene cell.scene.yaml
  teachtree live udp://127.0.0.1:9000 --format json
  teachtree live demonstration.csv --calibration demonstration.csv --no-labels")]
pub struct Args {
    /// Where rows come from: `-` for standard input, `udp://ADDRESS:PORT` for a datagram a row, or a file. Rows are JSON objects or CSV with a header
    source: String,
    #[command(flatten)]
    rules: RuleArgs,
    /// The scene; else the first line of JSON lines, or the file beside a file
    #[arg(long, value_name = "FILE")]
    scene: Option<PathBuf>,
    /// Learn the rate and the sensors from the first seconds of the log
    #[arg(long, value_name = "SECONDS", default_value_t = 3.0, value_parser = seconds)]
    calibrate: f64,
    /// Learn them from this recording instead, which has the same columns
    #[arg(long, value_name = "LOG")]
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
    /// Lines that nobody waited for.
    Lost(u64),
    Failed(InputError),
    Stop,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let scene = match &args.scene {
        Some(path) => Some(Scene::open(path)?),
        None => beside(&args.source)?,
    };
    let calibration = args.calibration.as_ref().map(Log::open).transpose()?;
    let mut feed = Feed::new(FeedOptions {
        name: if args.source == "-" { "standard input".into() } else { args.source.clone() },
        rules: args.rules.options(),
        scene,
        calibrate_s: args.calibrate,
        calibration,
    });
    let (sender, lines) = sync_channel(WAITING);
    super::on_interrupt({
        let sender = sender.clone();
        move || drop(sender.send(Sent::Stop))
    });
    begin(&args.source, sender)?;
    follow(args, &mut feed, &lines)?;
    print(args, &feed.finish()?)
}

fn follow(args: &Args, feed: &mut Feed, lines: &Receiver<Sent>) -> Result<(), Failure> {
    while let Ok(sent) = lines.recv() {
        let events = match sent {
            Sent::Line(line) => feed.line(&line)?,
            Sent::Lost(lines) => feed.lost(lines),
            Sent::Failed(error) => return Err(error.into()),
            Sent::Stop => break,
        };
        print(args, &events)?;
    }
    Ok(())
}

fn print(args: &Args, events: &[LiveEvent]) -> Result<(), Failure> {
    let shown = events.iter().filter(|event| !(args.no_labels && event.name() == "label"));
    let mut text = String::new();
    for event in shown {
        match args.format {
            Format::Json => text.push_str(&event.json()),
            Format::Text => text.push_str(&line(event)),
        }
        text.push('\n');
    }
    if text.is_empty() { Ok(()) } else { Ok(output::print_data(&text)?) }
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

/// Begins to read a source.
fn begin(source: &str, sender: SyncSender<Sent>) -> Result<(), InputError> {
    if let Some(address) = source.strip_prefix("udp://") {
        let failed = |error: std::io::Error| InputError::new(source, format!("cannot be listened to: {error}"));
        let socket = UdpSocket::bind(address).map_err(failed)?;
        thread::spawn(move || datagrams(&socket, &sender));
        return Ok(());
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
    thread::spawn(move || read(BufReader::new(bytes), &name, &sender));
    Ok(())
}

/// Sends the lines of a stream to its end, waiting where nobody takes them.
fn read(mut bytes: impl BufRead, name: &str, sender: &SyncSender<Sent>) {
    loop {
        let mut line = vec![];
        let sent = match bytes.by_ref().take(MAX_LINE).read_until(b'\n', &mut line) {
            Ok(0) => Sent::Stop,
            Ok(read) if read as u64 == MAX_LINE => {
                Sent::Failed(InputError::new(name, format!("found a line that is longer than {MAX_LINE} bytes")))
            }
            Ok(_) => Sent::Line(line),
            Err(error) => Sent::Failed(InputError::new(name, format!("cannot be read: {error}"))),
        };
        let ends = !matches!(sent, Sent::Line(_));
        if sender.send(sent).is_err() || ends {
            return;
        }
    }
}

/// Sends datagrams, as long as they are taken; counts the others.
fn datagrams(socket: &UdpSocket, sender: &SyncSender<Sent>) {
    let mut buffer = vec![0; 1 << 16];
    let mut lost = 0;
    while let Ok(length) = socket.recv(&mut buffer) {
        if lost > 0 && sender.try_send(Sent::Lost(lost)).is_ok() {
            lost = 0;
        }
        match sender.try_send(Sent::Line(buffer[..length].to_vec())) {
            Ok(()) => {}
            Err(TrySendError::Full(_)) => lost += 1,
            Err(TrySendError::Disconnected(_)) => return,
        }
    }
}
