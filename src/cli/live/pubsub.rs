//! Zenoh: samples of keys as rows, and a key under which events are published and can be asked for.
//!
//! The library has threads of its own. It makes a connection again that broke, and declares anew what was declared.

use super::hub::{ALL_EVENTS, Hub, ReadFrom};
use super::source::{MAX_LINE, Outlet, SourceEvent};
use std::path::PathBuf;
use std::sync::mpsc::TrySendError;
use std::sync::{Arc, Mutex};
use std::thread;
use teachtree_base::error::InputError;
use zenoh::bytes::Encoding;
use zenoh::config::EndPoint;
use zenoh::key_expr::OwnedKeyExpr;
use zenoh::qos::CongestionControl;
use zenoh::query::Query;
use zenoh::sample::{Locality, Sample, SampleKind};
use zenoh::{Config, Session, Wait};

/// The largest message that is taken, bytes.
const MAX_MESSAGE: usize = 64 << 20;

/// Options of Zenoh.
#[derive(clap::Args)]
pub struct ZenohArgs {
    /// Publish all events by Zenoh under this key
    #[arg(long, value_name = "KEY", value_parser = key)]
    zenoh_publish: Option<OwnedKeyExpr>,
    /// Connect to this router or peer of Zenoh, such as tcp/127.0.0.1:7447, and look for no others; of several, to the first that answers
    #[arg(long, value_name = "ENDPOINT", value_parser = endpoint)]
    zenoh_connect: Vec<EndPoint>,
    /// Be a peer of Zenoh that others connect to, such as tcp/127.0.0.1:7447, and look for no others
    #[arg(long, value_name = "ENDPOINT", value_parser = endpoint)]
    zenoh_listen: Vec<EndPoint>,
    /// Take anything else from a configuration file of Zenoh
    #[arg(long, value_name = "FILE", conflicts_with_all = ["zenoh_connect", "zenoh_listen"])]
    zenoh_config: Option<PathBuf>,
}

/// The key that a text says.
fn key(text: &str) -> Result<OwnedKeyExpr, String> {
    let expected = "expected a key such as `cell/labels`";
    let key = OwnedKeyExpr::try_from(text).map_err(|error| format!("{}, {expected}", reason(&error)))?;
    if key.is_wild() { Err(format!("it names several keys, {expected}")) } else { Ok(key) }
}

/// What an error says, without the places in the sources of the library, ` at PATH.rs:61.`.
fn reason(error: &zenoh::Error) -> String {
    let text = error.to_string();
    let parts = text.split(" at ").map(|part| match part.split_once(".rs:") {
        Some((_, rest)) => rest.trim_start_matches(|digit: char| digit.is_ascii_digit()).trim_start_matches('.').into(),
        None => format!(" at {part}"),
    });
    let said = parts.collect::<String>().replace(" - Caused by", ":");
    said.trim_start_matches(" at ").trim_end_matches([' ', '!', '.']).to_string()
}

/// The endpoint that a text says.
fn endpoint(text: &str) -> Result<EndPoint, String> {
    text.parse().map_err(|_: zenoh::Error| "expected an endpoint such as tcp/127.0.0.1:7447".to_string())
}

impl ZenohArgs {
    /// Opens a session where the source or the sink is Zenoh.
    ///
    /// # Errors
    /// It cannot be opened; options name what nothing is done with.
    pub fn open(&self, is_source: bool) -> Result<Option<Network>, InputError> {
        if !is_source && self.zenoh_publish.is_none() {
            let is_named =
                !self.zenoh_connect.is_empty() || !self.zenoh_listen.is_empty() || self.zenoh_config.is_some();
            let message = "its options are not used, expected the source `zenoh:KEY` or `--zenoh-publish KEY`";
            return if is_named { Err(InputError::new("Zenoh", message)) } else { Ok(None) };
        }
        let config = self.config().map_err(|error| {
            let file = self.zenoh_config.as_ref().map_or("Zenoh".into(), |file| file.display().to_string());
            InputError::new(file, reason(&error))
        })?;
        let failed = |error| InputError::new("Zenoh", format!("cannot be used: {}", reason(&error)));
        Ok(Some(Network { session: zenoh::open(config).wait().map_err(failed)? }))
    }

    /// Without endpoints as any other program has it: a peer that looks for others on the network. With endpoints only these are used.
    fn config(&self) -> zenoh::Result<Config> {
        if let Some(file) = &self.zenoh_config {
            return Config::from_file(file);
        }
        let mut config = Config::default();
        config.insert_json5("transport/link/rx/max_message_size", &MAX_MESSAGE.to_string())?;
        if self.zenoh_connect.is_empty() && self.zenoh_listen.is_empty() {
            return Ok(config);
        }
        let list = |endpoints: &[EndPoint]| {
            serde_json::Value::from_iter(endpoints.iter().map(ToString::to_string)).to_string()
        };
        // A router forwards everything to a client, and a client without a router is an error.
        let mode = if self.zenoh_listen.is_empty() { "client" } else { "peer" };
        config.insert_json5("mode", &format!("\"{mode}\""))?;
        config.insert_json5("connect/endpoints", &list(&self.zenoh_connect))?;
        config.insert_json5("listen/endpoints", &list(&self.zenoh_listen))?;
        config.insert_json5("scouting/multicast/enabled", "false")?;
        Ok(config)
    }
}

/// A session.
pub struct Network {
    session: Session,
}

impl Network {
    /// Begins to read the samples of a key expression, `zenoh:KEY`.
    ///
    /// # Errors
    /// It is none.
    pub fn begin(&self, source: &str, outlet: Outlet) -> Result<(), InputError> {
        let failed = |error: zenoh::Error| {
            InputError::new(source, format!("{}, expected a key expression such as `robot/rows`", reason(&error)))
                .help("an endpoint is named with `--zenoh-connect tcp/ADDRESS:PORT` (docs/live.md)")
        };
        let key = OwnedKeyExpr::try_from(source.strip_prefix("zenoh:").unwrap_or(source)).map_err(failed)?;
        let mut lost = 0;
        let each = move |sample: Sample| {
            if sample.kind() == SampleKind::Put {
                take(&sample, &outlet, &mut lost);
            }
        };
        // Not the events that this program publishes.
        let subscriber = self.session.declare_subscriber(key).allowed_origin(Locality::Remote);
        subscriber.callback_mut(each).background().wait().map_err(failed)
    }

    /// Begins to publish events where a key is named; returns the key.
    ///
    /// # Errors
    /// The key cannot be published under.
    pub fn publish<'a>(
        &self,
        args: &'a ZenohArgs,
        hub: &mut Option<Arc<Hub>>,
    ) -> Result<Option<&'a OwnedKeyExpr>, InputError> {
        let Some(key) = &args.zenoh_publish else { return Ok(None) };
        let hub = Arc::clone(hub.get_or_insert_with(|| Arc::new(Hub::new())));
        let failed = |error: zenoh::Error| InputError::new(key.to_string(), reason(&error));
        let publisher = self.session.declare_publisher(key.clone()).encoding(Encoding::APPLICATION_JSON);
        // Each event at once, and none is left out: who does not take it for long is disconnected.
        let publisher = publisher.congestion_control(CongestionControl::Block).express(true);
        let publisher = publisher.wait().map_err(failed)?;
        let (of_queries, replied) = (Arc::clone(&hub), key.clone());
        let each = move |query: Query| answer(&query, &replied, &of_queries);
        self.session.declare_queryable(key.clone()).callback(each).background().wait().map_err(failed)?;
        hub.enter(usize::MAX);
        thread::spawn(move || {
            let subscriptions = Mutex::default();
            hub.subscribe(&subscriptions, 0, ALL_EVENTS, ReadFrom::Kept);
            while let Some(batch) = hub.next(&subscriptions, || false) {
                for (_, message) in &batch.messages {
                    // The call fails when the session is closed, which ends the source.
                    let _ = publisher.put(message.bytes.as_slice()).attachment(&hub.session).wait();
                }
                if batch.is_last {
                    break;
                }
            }
            hub.leave();
        });
        Ok(Some(key))
    }

    /// Ends the session, when what is published has been sent.
    pub fn close(self) {
        let _ = self.session.close().wait();
    }
}

/// Answers `KEY` with all events that are kept, one a line, and `KEY?after=120;session=…` with those after that number.
fn answer(query: &Query, key: &OwnedKeyExpr, hub: &Hub) {
    let asked = query.parameters();
    let from = asked.get("after").map_or(ReadFrom::Kept, |after| hub.resume(asked.get("session"), after));
    let mut lines = vec![];
    for message in hub.kept(ALL_EVENTS, from) {
        lines.extend(&message.bytes);
        lines.push(b'\n');
    }
    let reply = query.reply(key, lines).encoding(Encoding::APPLICATION_JSON);
    // The requester may have disconnected.
    let _ = reply.attachment(&hub.session).wait();
}

/// Sends a sample if there is room for it, else counts it.
fn take(sample: &Sample, outlet: &Outlet, lost: &mut u64) {
    if *lost > 0 && outlet.try_send(SourceEvent::Lost(*lost)).is_ok() {
        *lost = 0;
    }
    let payload = sample.payload();
    let sent = if payload.len() as u64 > MAX_LINE {
        SourceEvent::TooLong
    } else {
        SourceEvent::Line(payload.to_bytes().into_owned())
    };
    if let Err(TrySendError::Full(_)) = outlet.try_send(sent) {
        *lost += 1;
    }
}
