//! A robot that publishes by the Foxglove WebSocket protocol, such as by `foxglove_bridge`: its topics that the binding names are subscribed to.
//!
//! A connection that breaks is made again, after 0.1 s at first and up to 5 s later on. Messages are taken as they come; those for which there is no
//! room are counted.

use super::source::{Outlet, SourceEvent, message};
use std::collections::{BTreeMap, BTreeSet};
use std::net::{TcpStream, ToSocketAddrs};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::TrySendError;
use std::thread;
use std::time::Duration;
use teachtree_base::error::InputError;
use teachtree_frames::bind::TopicFilter;
use teachtree_logs::foxglove::{AdvertisedChannel, ServerMessage, subscribe};
use teachtree_logs::read::formats::topics::MessageDecoder;
use tungstenite::client::{ClientRequestBuilder, client_with_config};
use tungstenite::error::ProtocolError;
use tungstenite::handshake::HandshakeError;
use tungstenite::http::Uri;
use tungstenite::protocol::WebSocketConfig;
use tungstenite::{Bytes, Error, Message, WebSocket};

/// The names of the protocol: the one that `foxglove_bridge` has had since its version 3.2, and the one before.
pub const PROTOCOLS: [&str; 2] = ["foxglove.sdk.v1", "foxglove.websocket.v1"];
/// The largest message, bytes.
const MAX_MESSAGE: usize = 64 << 20;
/// The timeout of a connection attempt.
const CONNECTING: Duration = Duration::from_secs(5);
/// Interval of the checks of an idle connection.
const LOOK: Duration = Duration::from_secs(1);
/// Number of checks after which a ping is sent …
const IDLE_LOOKS: usize = 5;
/// … and after which the connection is lost.
const GONE_LOOKS: usize = 15;
/// The timeout for the first advertisement of a topic that the binding names.
const ADVERTISING: Duration = Duration::from_secs(5);
/// The first and the longest time before a connection is made again.
const FIRST_WAIT: Duration = Duration::from_millis(100);
const LONGEST_WAIT: Duration = Duration::from_secs(5);
/// Maximum number of topics that a message lists.
const MOST_NAMED: usize = 20;

/// A source with its address, such as `ws://localhost:8765`.
pub struct FoxgloveSource {
    address: String,
    uri: Uri,
    /// Host and port.
    authority: String,
    topics: TopicFilter,
}

/// Why a connection is not read any more.
enum ConnectionEnd {
    /// The connection broke and is to be restored.
    Broken(String),
    /// The connection failed permanently.
    Failed(InputError),
    /// The receiver is gone.
    Gone,
}

impl FoxgloveSource {
    /// A robot at an address.
    ///
    /// # Errors
    /// It is none.
    pub fn new(address: &str, topics: TopicFilter) -> Result<Self, InputError> {
        let wrong =
            |what: &str| InputError::new(address, format!("{what}, expected an address such as `ws://localhost:8765`"));
        if address.starts_with("wss://") {
            return Err(wrong("is encrypted, which is not supported"));
        }
        let uri: Uri = address.parse().map_err(|_| wrong("is not an address"))?;
        let host = uri.host().filter(|host| !host.is_empty()).ok_or_else(|| wrong("names no host"))?;
        let authority = format!("{host}:{}", uri.port_u16().unwrap_or(8765));
        Ok(Self { address: address.to_string(), authority, uri, topics })
    }

    /// Connects, and begins to read.
    ///
    /// # Errors
    /// There is no such server.
    pub fn begin(self, outlet: Outlet) -> Result<(), InputError> {
        let socket = self.connect().map_err(|why| {
            let error = InputError::new(&self.address, format!("cannot be connected to: {why}"));
            error.help("on the robot, start `ros2 launch foxglove_bridge foxglove_bridge_launch.xml` (docs/live.md)")
        })?;
        thread::spawn(move || self.follow(socket, &outlet));
        Ok(())
    }

    fn connect(&self) -> Result<WebSocket<TcpStream>, String> {
        let addresses = self.authority.to_socket_addrs().map_err(|error| error.to_string())?;
        let mut why = "its name has no address".to_string();
        for address in addresses {
            match TcpStream::connect_timeout(&address, CONNECTING) {
                Ok(stream) => return self.shake_hands(stream),
                Err(error) => why = error.to_string(),
            }
        }
        Err(why)
    }

    fn shake_hands(&self, stream: TcpStream) -> Result<WebSocket<TcpStream>, String> {
        let failed = |error: std::io::Error| error.to_string();
        stream.set_nodelay(true).map_err(failed)?;
        stream.set_read_timeout(Some(CONNECTING)).map_err(failed)?;
        stream.set_write_timeout(Some(CONNECTING)).map_err(failed)?;
        let request = PROTOCOLS.iter().fold(ClientRequestBuilder::new(self.uri.clone()), |request, protocol| {
            request.with_sub_protocol(*protocol)
        });
        let config = WebSocketConfig::default().max_message_size(Some(MAX_MESSAGE)).max_frame_size(Some(MAX_MESSAGE));
        match client_with_config(request, stream, Some(config)) {
            Ok((socket, _)) => {
                socket.get_ref().set_read_timeout(Some(LOOK)).map_err(failed)?;
                Ok(socket)
            }
            Err(HandshakeError::Interrupted(_)) => Err("it does not answer".into()),
            Err(HandshakeError::Failure(Error::Protocol(ProtocolError::SecWebSocketSubProtocolError(_)))) => {
                Err(format!("it does not speak the protocol `{}`", PROTOCOLS.join("` or `")))
            }
            Err(HandshakeError::Failure(Error::Http(answer))) => {
                Err(format!("it answers {}, expected a server of `{}`", answer.status(), PROTOCOLS.join("` or `")))
            }
            Err(HandshakeError::Failure(error)) => Err(error.to_string()),
        }
    }

    /// Reads the connection, and others after it.
    fn follow(&self, socket: WebSocket<TcpStream>, outlet: &Outlet) {
        let mut socket = Some(socket);
        let mut is_first = true;
        let mut wait = FIRST_WAIT;
        loop {
            if let Some(socket) = socket.take() {
                match self.read(socket, is_first, outlet) {
                    ConnectionEnd::Broken(why) => {
                        let message = format!("the connection to {} broke: {why}; reconnecting", self.address);
                        if !outlet.send(SourceEvent::Broken(message)) {
                            return;
                        }
                    }
                    ConnectionEnd::Failed(error) => {
                        outlet.send(SourceEvent::Failed(error));
                        return;
                    }
                    ConnectionEnd::Gone => return,
                }
                (is_first, wait) = (false, FIRST_WAIT);
            }
            thread::sleep(wait);
            wait = LONGEST_WAIT.min(wait * 2);
            if outlet.stops() {
                return;
            }
            socket = self.connect().ok();
            if socket.is_some() && !outlet.send(SourceEvent::Connected(format!("connected to {} again", self.address)))
            {
                return;
            }
        }
    }

    /// Reads a connection until it ends.
    fn read(&self, mut socket: WebSocket<TcpStream>, is_first: bool, outlet: &Outlet) -> ConnectionEnd {
        let mut session = ConnectionState {
            robot: self,
            channels: BTreeMap::new(),
            subscribed: BTreeMap::new(),
            topics: BTreeSet::new(),
            next: 0,
            lost: 0,
        };
        let is_late = Arc::new(AtomicBool::new(false));
        if is_first {
            let is_late = Arc::clone(&is_late);
            thread::spawn(move || {
                thread::sleep(ADVERTISING);
                is_late.store(true, Ordering::Relaxed);
            });
        }
        let mut looks: usize = 0;
        loop {
            if outlet.stops() {
                return ConnectionEnd::Gone;
            }
            if !session.has_named() && is_late.load(Ordering::Relaxed) {
                return ConnectionEnd::Failed(session.nothing());
            }
            let read = socket.read();
            let is_idle = matches!(&read, Err(Error::Io(error)) if is_timeout(error));
            looks = if is_idle { looks + 1 } else { 0 };
            let taken = match read {
                Ok(Message::Text(text)) => session.text(text.as_str(), &mut socket, outlet),
                Ok(Message::Binary(bytes)) => session.binary(&bytes, outlet),
                Ok(Message::Close(frame)) => {
                    let reason = frame.map(|frame| frame.reason.to_string()).filter(|reason| !reason.is_empty());
                    Err(ConnectionEnd::Broken(reason.unwrap_or_else(|| "the other side has closed it".into())))
                }
                Ok(_) => Ok(()),
                Err(_) if looks == IDLE_LOOKS => socket.send(Message::Ping(Bytes::new())).map_err(broken),
                Err(_) if looks >= GONE_LOOKS => {
                    Err(ConnectionEnd::Broken(format!("nothing came for {} s", LOOK.as_secs() * GONE_LOOKS as u64)))
                }
                Err(_) if is_idle => Ok(()),
                Err(error) => Err(broken(error)),
            };
            if let Err(end) = taken {
                return end;
            }
        }
    }
}

fn is_timeout(error: &std::io::Error) -> bool {
    matches!(error.kind(), std::io::ErrorKind::WouldBlock | std::io::ErrorKind::TimedOut)
}

fn broken(error: Error) -> ConnectionEnd {
    ConnectionEnd::Broken(match error {
        Error::ConnectionClosed | Error::AlreadyClosed => "the other side has closed it".into(),
        Error::Protocol(ProtocolError::ResetWithoutClosingHandshake) => "the other side has disconnected".into(),
        Error::Io(error) => error.to_string(),
        error => error.to_string(),
    })
}

/// The state of a connection.
struct ConnectionState<'a> {
    robot: &'a FoxgloveSource,
    /// Topic of each channel, and how its messages are read.
    channels: BTreeMap<u64, (String, MessageDecoder)>,
    /// The channel of each subscription.
    subscribed: BTreeMap<u32, u64>,
    /// All topics that were advertised, with the types of their messages.
    topics: BTreeSet<String>,
    /// The number of the next subscription.
    next: u32,
    /// Messages for which there was no room.
    lost: u64,
}

impl ConnectionState<'_> {
    fn text(&mut self, text: &str, socket: &mut WebSocket<TcpStream>, outlet: &Outlet) -> Result<(), ConnectionEnd> {
        match ServerMessage::parse(text) {
            ServerMessage::Advertise(channels) => self.advertise(channels, socket, outlet),
            ServerMessage::Unadvertise(ids) => {
                for id in ids {
                    self.channels.remove(&id);
                    self.subscribed.retain(|_, channel| *channel != id);
                }
                Ok(())
            }
            ServerMessage::Other => Ok(()),
        }
    }

    fn advertise(
        &mut self,
        channels: Vec<AdvertisedChannel>,
        socket: &mut WebSocket<TcpStream>,
        outlet: &Outlet,
    ) -> Result<(), ConnectionEnd> {
        let mut wanted = vec![];
        for channel in channels {
            if self.topics.len() < 10_000 {
                self.topics.insert(format!("{} ({})", channel.topic, channel.kind()));
            }
            if !self.robot.topics.takes(&channel.topic) {
                continue;
            }
            match channel.reading() {
                MessageDecoder::Refused(why) => self.send(SourceEvent::Refused(channel.topic, why), outlet)?,
                reading => {
                    self.channels.insert(channel.id, (channel.topic, reading));
                    self.subscribed.insert(self.next, channel.id);
                    wanted.push((self.next, channel.id));
                    self.next += 1;
                }
            }
        }
        if wanted.is_empty() { Ok(()) } else { socket.send(Message::text(subscribe(&wanted))).map_err(broken) }
    }

    fn binary(&mut self, bytes: &[u8], outlet: &Outlet) -> Result<(), ConnectionEnd> {
        let Some((subscription, received_ns, payload)) = teachtree_logs::foxglove::message_data(bytes) else {
            return Ok(());
        };
        let channel = self.subscribed.get(&subscription).and_then(|id| self.channels.get(id));
        let Some((topic, reading)) = channel else { return Ok(()) };
        let sent = message(topic, reading, received_ns, payload);
        if self.lost > 0 && outlet.try_send(SourceEvent::Lost(self.lost)).is_ok() {
            self.lost = 0;
        }
        match outlet.try_send(sent) {
            Ok(()) => Ok(()),
            Err(TrySendError::Full(_)) => {
                self.lost += 1;
                Ok(())
            }
            Err(TrySendError::Disconnected(_)) => Err(ConnectionEnd::Gone),
        }
    }

    /// Whether a topic that the binding may name is subscribed to.
    fn has_named(&self) -> bool {
        let mut topics = self.subscribed.values().filter_map(|id| self.channels.get(id));
        topics.any(|(topic, _)| self.robot.topics.may_name(topic))
    }

    fn send(&self, sent: SourceEvent, outlet: &Outlet) -> Result<(), ConnectionEnd> {
        if outlet.send(sent) { Ok(()) } else { Err(ConnectionEnd::Gone) }
    }

    /// No topic that the binding names is advertised.
    fn nothing(&self) -> InputError {
        let named: Vec<&str> = self.topics.iter().take(MOST_NAMED).map(String::as_str).collect();
        let more = self.topics.len() - named.len();
        let more = if more > 0 { format!(" and {more} more") } else { String::new() };
        let found = match named.is_empty() {
            true => "it advertises no topic".to_string(),
            false => format!("it advertises {}{more}", named.join(", ")),
        };
        InputError::new(&self.robot.address, format!("it has none of the topics in the binding; {found}")).help(
            "columns of topics are called `<topic>.<field>`, such as `/wrench.wrench.force.<xyz>` (docs/bindings.md)",
        )
    }
}
