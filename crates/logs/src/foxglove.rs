//! The Foxglove WebSocket protocol: texts are JSON with an `op`, messages of topics are binary.

use crate::read::formats::mcap::ros2_message::Ros2Type;
use crate::read::formats::topics::MessageDecoder;
use serde::Deserialize;
use serde_json::{Value, json};

/// The first byte of a message of a topic.
const MESSAGE_DATA: u8 = 1;
/// The size of the header before the payload: the kind, the subscription, and the time of reception.
const HEAD: usize = 1 + 4 + 8;

/// A channel that a server advertises.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct AdvertisedChannel {
    /// Its number.
    pub id: u64,
    /// Its name.
    pub topic: String,
    #[serde(default)]
    encoding: String,
    #[serde(default)]
    schema_name: String,
    #[serde(default)]
    schema: Option<String>,
    #[serde(default)]
    schema_encoding: Option<String>,
}

impl AdvertisedChannel {
    /// The decoder of its messages.
    pub fn reading(&self) -> MessageDecoder {
        // Older servers leave out what follows from the encoding.
        let form =
            self.schema_encoding.as_deref().filter(|form| !form.is_empty()).unwrap_or(match self.encoding.as_str() {
                "ros1" => "ros1msg",
                "cdr" => "ros2msg",
                _ => "",
            });
        let schema = self.schema.as_deref().map(|schema| definition(form, schema));
        MessageDecoder::of(&self.encoding, schema.as_deref().map(|schema| (self.schema_name.as_str(), form, schema)))
    }

    /// The type of its messages, else their encoding.
    pub fn kind(&self) -> &str {
        if self.schema_name.is_empty() { &self.encoding } else { &self.schema_name }
    }
}

/// The bytes of a definition: those of protobuf are sent in base 64.
fn definition(form: &str, schema: &str) -> Vec<u8> {
    #[cfg(feature = "protobuf")]
    if form == "protobuf" {
        use base64::Engine as _;
        return base64::engine::general_purpose::STANDARD.decode(schema).unwrap_or_default();
    }
    let _ = form;
    schema.as_bytes().to_vec()
}

/// A text message of a server.
#[derive(Debug)]
pub enum ServerMessage {
    /// Channels that are new.
    Advertise(Vec<AdvertisedChannel>),
    /// Numbers of channels that are gone.
    Unadvertise(Vec<u64>),
    /// Anything else.
    Other,
}

impl ServerMessage {
    /// Reads a text; what is not understood counts for nothing.
    pub fn parse(text: &str) -> Self {
        #[derive(Deserialize)]
        #[serde(tag = "op", rename_all = "camelCase", rename_all_fields = "camelCase")]
        enum Op {
            Advertise {
                channels: Vec<AdvertisedChannel>,
            },
            Unadvertise {
                channel_ids: Vec<u64>,
            },
            #[serde(other)]
            Other,
        }
        match serde_json::from_str(text) {
            Ok(Op::Advertise { channels }) => Self::Advertise(channels),
            Ok(Op::Unadvertise { channel_ids }) => Self::Unadvertise(channel_ids),
            Ok(Op::Other) | Err(_) => Self::Other,
        }
    }
}

/// The text that asks for channels: number of the subscription, and channel.
pub fn subscribe(channels: &[(u32, u64)]) -> String {
    let subscriptions: Vec<_> =
        channels.iter().map(|(id, channel)| json!({ "id": id, "channelId": channel })).collect();
    json!({ "op": "subscribe", "subscriptions": subscriptions }).to_string()
}

/// Subscription, time of receipt, ns, and payload of a message of a topic.
pub fn message_data(bytes: &[u8]) -> Option<(u32, i64, &[u8])> {
    let (head, payload) = bytes.split_at_checked(HEAD)?;
    let (kind, rest) = head.split_first()?;
    let (subscription, received) = rest.split_at_checked(4)?;
    let subscription = u32::from_le_bytes(subscription.try_into().ok()?);
    let received = u64::from_le_bytes(received.try_into().ok()?);
    (*kind == MESSAGE_DATA).then(|| (subscription, i64::try_from(received).unwrap_or(i64::MAX), payload))
}

/// A topic that is served.
#[derive(Clone, Debug)]
pub enum ServedTopic {
    /// All events, in JSON.
    Events(String),
    /// A text at a time: `std_msgs/msg/String`.
    Text(String),
}

impl ServedTopic {
    /// Its name.
    pub fn name(&self) -> &str {
        match self {
            Self::Events(name) | Self::Text(name) => name,
        }
    }

    fn channel(&self, id: usize) -> Value {
        let (encoding, name, form, schema) = match self {
            Self::Events(_) => ("json", "teachtree.live/1", "jsonschema", LIVE_SCHEMA),
            Self::Text(_) => ("cdr", Ros2Type::Text.name(), "ros2msg", Ros2Type::Text.definition()),
        };
        json!({ "id": id, "topic": self.name(), "encoding": encoding, "schemaName": name, "schemaEncoding": form, "schema": schema })
    }
}

/// The schema of events.
const LIVE_SCHEMA: &str = include_str!("../../../schemas/live-1.schema.json");

/// The first message of a server, with its capabilities.
pub fn server_info(session: &str) -> String {
    json!({ "op": "serverInfo", "name": concat!("teachtree ", env!("CARGO_PKG_VERSION")), "capabilities": [],
        "supportedEncodings": [], "metadata": {}, "sessionId": session })
    .to_string()
}

/// The topics that are served; the number of a channel is its place.
pub fn advertise(topics: &[ServedTopic]) -> String {
    let channels: Vec<Value> = topics.iter().enumerate().map(|(id, topic)| topic.channel(id)).collect();
    json!({ "op": "advertise", "channels": channels }).to_string()
}

/// A warning.
pub fn status(message: &str) -> String {
    json!({ "op": "status", "level": 1, "message": message }).to_string()
}

/// A message of a topic.
pub fn data(subscription: u32, time_ns: u64, payload: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(HEAD + payload.len());
    bytes.push(MESSAGE_DATA);
    bytes.extend(subscription.to_le_bytes());
    bytes.extend(time_ns.to_le_bytes());
    bytes.extend(payload);
    bytes
}

/// A text message of a client.
#[derive(Debug)]
pub enum ClientMessage {
    /// Numbers of subscriptions, and their channels.
    Subscribe(Vec<(u32, u64)>),
    /// Numbers of subscriptions.
    Unsubscribe(Vec<u32>),
    /// Anything else.
    Other,
}

impl ClientMessage {
    /// Reads a text; what is not understood counts for nothing.
    pub fn parse(text: &str) -> Self {
        #[derive(Deserialize)]
        #[serde(rename_all = "camelCase")]
        struct Subscription {
            id: u32,
            channel_id: u64,
        }
        #[derive(Deserialize)]
        #[serde(tag = "op", rename_all = "camelCase", rename_all_fields = "camelCase")]
        enum Op {
            Subscribe {
                subscriptions: Vec<Subscription>,
            },
            Unsubscribe {
                subscription_ids: Vec<u32>,
            },
            #[serde(other)]
            Other,
        }
        match serde_json::from_str(text) {
            Ok(Op::Subscribe { subscriptions }) => {
                Self::Subscribe(subscriptions.into_iter().map(|it| (it.id, it.channel_id)).collect())
            }
            Ok(Op::Unsubscribe { subscription_ids }) => Self::Unsubscribe(subscription_ids),
            Ok(Op::Other) | Err(_) => Self::Other,
        }
    }
}
