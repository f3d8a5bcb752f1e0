//! `teachtree live`: labels while the log is being made.

mod bag;
mod foxglove;
mod hub;
#[cfg(feature = "zenoh")]
mod pubsub;
mod server;
mod source;

use super::output_args::FormatArg;
use super::rules::RuleArgs;
use super::source::SourceArgs;
use super::{Failure, output};
use source::{Kind, MAX_LINE, Outlet, SourceEvent};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, sync_channel};
use std::thread;
use teachtree_base::error::InputError;
use teachtree_frames::bind::{RowBinder, WAIT_S};
use teachtree_logs::read::{csv, text};
use teachtree_session::{Calibration, CalibrationSource, Error, Feed, FeedOptions, LiveEvent, Scene};
use teachtree_session::{RulesOptionsInternals, SceneInternals};

/// The largest calibration file, bytes.
const MAX_CALIBRATION: u64 = 16 << 20;

/// Options of `live`.
#[derive(clap::Args)]
#[command(after_help = "Examples:
  robot_driver | teachtree live - --scene cell.scene.yaml
  teachtree live udp://127.0.0.1:9000 --format json
  arm_driver | teachtree live - --binding arm.binding.yaml
  teachtree live ws://robot:8765 --binding cell.binding.yaml
  teachtree live bag.mcap --binding cell.binding.yaml --follow
  teachtree live demonstration.csv --calibration demonstration.csv --no-labels")]
pub struct Args {
    /// Source of rows: `-` for standard input, `udp://ADDRESS:PORT` for a datagram a row, `zenoh:KEY` for a sample of Zenoh a row, or a file. Rows
    /// are JSON objects or CSV with a header; an MCAP file has messages of topics, and so has a robot that publishes by the Foxglove protocol,
    /// `ws://HOST:8765`
    source: String,
    #[command(flatten)]
    rules: RuleArgs,
    /// The scene; else the first line of JSON lines, or the file beside a file
    #[arg(long, value_name = "FILE")]
    scene: Option<PathBuf>,
    /// Binding file that maps the columns of the log to channels (docs/bindings.md), row by row or message by message
    #[arg(long, value_name = "FILE")]
    binding: Option<PathBuf>,
    /// Continue to read an MCAP file while it is being written
    #[arg(long)]
    follow: bool,
    /// Time for which frames wait for a topic of the binding, by the stamps of the other topics
    #[arg(long, value_name = "SECONDS", default_value_t = WAIT_S, value_parser = seconds)]
    wait: f64,
    /// Calibrate rate and sensors from the first seconds of the log
    #[arg(long, value_name = "SECONDS", default_value_t = 3.0, value_parser = seconds)]
    calibrate: f64,
    /// Read the calibration from a file of `inspect --calibrate`, or calibrate from a recording with the same columns
    #[arg(long, value_name = "FILE")]
    calibration: Option<PathBuf>,
    /// Serve labels, tasks and all events to viewers and controllers by the Foxglove protocol, on this local port, or on an address such as 0.0.0.0:8766
    #[arg(long, value_name = "PORT", value_parser = server::address)]
    serve: Option<std::net::SocketAddr>,
    /// A site whose pages may read the labels, such as https://app.foxglove.dev; may be repeated. Programs and pages of this machine always can
    #[arg(long, value_name = "ORIGIN", requires = "serve", value_parser = server::origin)]
    serve_origin: Vec<String>,
    #[cfg(feature = "zenoh")]
    #[command(flatten)]
    zenoh: pubsub::ZenohArgs,
    /// Also report the confidence of each label, from its age, and report the label again when its confidence changes
    #[arg(long)]
    confidence: bool,
    #[command(flatten)]
    form: FormatArg<Format>,
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

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let kind = Kind::of(&args.source)?;
    let given = SourceArgs { binding: args.binding.clone(), scene: args.scene.clone(), ..SourceArgs::default() };
    // A source that is not a file has the settings of the folder in which the program runs.
    let settings = given.settings(Path::new(&args.source))?;
    let binding = given.binding_of(Path::new(&args.source))?;
    let of_project = settings.scene.as_ref().map(|scene| &scene.value);
    let scene = args.scene.as_ref().or(of_project).map(Scene::open).transpose()?;
    let own = scene.as_ref().map(|scene| scene.inner().clone());
    let binder = binding.as_ref().map(|path| RowBinder::open(path, own, args.wait)).transpose()?;
    match &binder {
        Some(binder) if kind.has_topics() => binder.check_topics()?,
        None if kind.has_topics() => {
            let error = InputError::new(&args.source, "has topics, expected a binding of their fields to channels");
            return Err(error.help("name a binding with --binding (docs/bindings.md)").into());
        }
        _ => {}
    }
    let calibration = args.calibration.as_deref().map(|path| known(path, &given)).transpose()?;
    let topics = binder.as_ref().map(RowBinder::topics);
    let mut feed = Feed::new(FeedOptions {
        name: if args.source == "-" { "standard input".into() } else { args.source.clone() },
        rules: args.rules.options().of_project(&settings),
        scene,
        beside: beside(&args.source, kind),
        binder,
        calibrate_s: args.calibrate,
        calibration,
        confidence: args.confidence,
    });
    let (sender, lines) = sync_channel(kind.most_waiting());
    let stops = Arc::new(AtomicBool::new(false));
    let outlet = Outlet { sender, waiting: Arc::default(), stops };
    super::on_interrupt({
        let outlet = outlet.clone();
        move || {
            outlet.stops.store(true, Ordering::Relaxed);
            // The stop request queues behind the received rows. It is sent from a thread so that the next signal is handled immediately.
            thread::spawn(move || outlet.send(SourceEvent::Stop));
        }
    });
    // Signals end the log as soon as the sink has reported its address.
    let mut sink = Sink::new(args)?;
    #[cfg(feature = "zenoh")]
    let network = args.zenoh.open(kind == Kind::Samples)?;
    #[cfg(feature = "zenoh")]
    if let Some(network) = &network {
        sink.publish(network)?;
    }
    let waiting = Arc::clone(&outlet.waiting);
    match (kind, topics) {
        #[cfg(feature = "zenoh")]
        (Kind::Samples, _) => {
            if let Some(network) = &network {
                network.begin(&args.source, outlet)?;
            }
        }
        (Kind::Bag, Some(topics)) => source::begin_bag(&args.source, topics, args.follow, outlet),
        (Kind::Robot, Some(topics)) => foxglove::FoxgloveSource::new(&args.source, topics)?.begin(outlet)?,
        _ => source::begin(&args.source, kind, outlet)?,
    }
    let reader = Reader { lines, waiting, late: kind.late(), is_timed: kind.is_timed(), is_labeling: true };
    if reader.follow(&mut feed, &mut sink)? {
        sink.take(&feed.finish()?)?;
    }
    sink.finish();
    #[cfg(feature = "zenoh")]
    if let Some(network) = network {
        network.close();
    }
    Ok(())
}

/// Reads a calibration, or a recording to calibrate with.
fn known(path: &Path, source: &SourceArgs) -> Result<CalibrationSource, Failure> {
    if path.extension().is_none_or(|ending| ending != "json") {
        return Ok(CalibrationSource::Recording(source.open(path)?));
    }
    let text = text::read(path, MAX_CALIBRATION)?;
    Ok(CalibrationSource::File(Box::new(Calibration::parse(&path.display().to_string(), &text)?)))
}

/// Takes what a source sends.
struct Reader {
    lines: Receiver<SourceEvent>,
    waiting: Arc<AtomicUsize>,
    /// Numbers of waiting lines or messages at which labeling of the newest frames stops and restarts.
    late: [usize; 2],
    /// Whether the source does not wait for us.
    is_timed: bool,
    is_labeling: bool,
}

impl Reader {
    /// Prints events until the source ends; whether anyone still reads them.
    fn follow(mut self, feed: &mut Feed, sink: &mut Sink) -> Result<bool, Failure> {
        while let Ok(sent) = self.lines.recv() {
            let waiting = self.waiting.fetch_sub(1, Ordering::Relaxed);
            let [many, few] = self.late;
            let keeps_up = waiting <= if self.is_labeling { many } else { few };
            let mut events = vec![];
            if self.is_timed && keeps_up != self.is_labeling {
                self.is_labeling = keeps_up;
                events.extend(feed.label(keeps_up));
            }
            events.extend(match sent {
                SourceEvent::Line(line) => feed.line(&line)?,
                SourceEvent::TooLong => feed.too_long(MAX_LINE),
                SourceEvent::Lost(lines) => feed.lost(lines),
                SourceEvent::Message(topic, stamp_ns, row) => feed.message(&topic, stamp_ns, &row)?,
                SourceEvent::Unreadable(topic, why) => feed.unreadable(&topic, &why)?,
                SourceEvent::Refused(topic, why) => feed.refused(&topic, &why)?,
                SourceEvent::Broken(message) => feed.interrupted(message)?,
                SourceEvent::Connected(message) => feed.connected(message),
                SourceEvent::Failed(error) => return Err(error.into()),
                SourceEvent::Stop => break,
            });
            if !sink.take(&events)? {
                return Ok(false);
            }
        }
        Ok(true)
    }
}

/// The receivers of events.
struct Sink<'a> {
    args: &'a Args,
    /// Where viewers and controllers take them from.
    hub: Option<Arc<hub::Hub>>,
}

impl<'a> Sink<'a> {
    fn new(args: &'a Args) -> Result<Self, InputError> {
        let hub = match args.serve {
            Some(address) => {
                let hub = Arc::new(hub::Hub::new());
                let address = server::begin(address, &args.serve_origin, &hub)?;
                output::complain(&format!("serving labels on ws://{address}"));
                Some(hub)
            }
            None => None,
        };
        Ok(Self { args, hub })
    }

    /// Publishes events by Zenoh, where a key is named.
    #[cfg(feature = "zenoh")]
    fn publish(&mut self, network: &pubsub::Network) -> Result<(), InputError> {
        if let Some(key) = network.publish(&self.args.zenoh, &mut self.hub)? {
            output::complain(&format!("publishing labels under the key `{key}`"));
        }
        Ok(())
    }

    /// Prints events, and sends them on; whether anyone still reads what is printed.
    fn take(&mut self, events: &[LiveEvent]) -> Result<bool, Failure> {
        if let Some(hub) = &self.hub {
            events.iter().for_each(|event| hub.event(event));
        }
        let shown = events.iter().filter(|event| !(self.args.no_labels && event.name() == "label"));
        let mut text = String::new();
        for event in shown {
            match self.args.form.format {
                Format::Json => text.push_str(&event.json()),
                Format::Text => text.push_str(&line(event)),
            }
            text.push('\n');
        }
        match self.args.form.format {
            _ if text.is_empty() => Ok(true),
            Format::Json => Ok(output::print_json_more(&text)?),
            Format::Text => Ok(output::print_more(&text)?),
        }
    }

    /// Nothing comes any more.
    fn finish(&self) {
        if let Some(hub) = &self.hub {
            hub.finish();
        }
    }
}

/// An event as a line for people: what may still change is marked.
fn line(event: &LiveEvent) -> String {
    let mark = match (event.name(), event.is_final()) {
        ("label", _) => "now    ",
        ("segment", false) => "closed ",
        ("task", false) => "task?  ",
        ("segment", true) => "segment",
        ("task", true) => "task   ",
        ("clock", _) => "clock  ",
        _ => "issue  ",
    };
    format!("{mark} {event}")
}

/// The scene file beside a file, or why it cannot be read: it may be a pipe.
fn beside(source: &str, kind: Kind) -> Option<Result<Scene, Error>> {
    let path = csv::scene_file_beside(Path::new(source));
    path.filter(|_| source != "-" && !kind.is_timed()).map(Scene::open)
}
