//! The hub for viewers and controllers: the topics with their newest messages, which each connection reads at its own pace.

use std::collections::{BTreeMap, VecDeque};
use std::hash::{BuildHasher, Hasher, RandomState};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use teachtree_analysis::TrackId;
use teachtree_logs::foxglove::ServedTopic;
use teachtree_logs::read::formats::mcap::ros2_message;
use teachtree_session::LiveEvent;

/// Maximum number of messages, and of their bytes, that are kept for late connections.
const MOST_MESSAGES: usize = 1 << 16;
const MOST_BYTES: usize = 32 << 20;
/// The time for which the end of a log waits for slow readers.
const LAST_WAIT: Duration = Duration::from_secs(3);

/// Maximum number of subscriptions of a connection.
const MOST_SUBSCRIPTIONS: usize = 1000;

/// The topic of all events, and its channel.
const EVENTS: &str = "/teachtree/events";
pub const ALL_EVENTS: usize = 0;
/// Whose labels and tasks have topics.
const TRACKS: [&str; 3] = ["left", "right", "both"];

/// Messages for all connections.
pub struct Hub {
    /// The topics; a channel is a place in this list.
    pub topics: Vec<ServedTopic>,
    /// A name of this run: sequence numbers of another one mean something else.
    pub session: String,
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Default)]
struct State {
    /// The newest messages, in order.
    kept: VecDeque<Arc<ServedMessage>>,
    bytes: usize,
    /// The number of the first of them.
    first: u64,
    /// The last message of each channel.
    last: BTreeMap<usize, Arc<ServedMessage>>,
    /// The last label of each track: a label is repeated when its confidence changes.
    labels: BTreeMap<TrackId, Option<String>>,
    /// The last task of each track: its start, s, and name.
    tasks: BTreeMap<TrackId, (f64, String)>,
    /// The time of 0 s, and of the newest event, ns since 1970.
    origin_ns: i64,
    newest_ns: u64,
    is_over: bool,
    /// Number of connections.
    readers: usize,
}

/// A message.
pub struct ServedMessage {
    pub channel: usize,
    /// The number of the event that it is of.
    pub sequence: u64,
    pub time_ns: u64,
    pub bytes: Vec<u8>,
}

/// The position from which a connection reads a channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReadFrom {
    /// The last message there is, and new ones.
    Last,
    /// The events after this number.
    After(u64),
    /// Everything that is kept.
    Kept,
}

/// The subscriptions of a connection.
#[derive(Default)]
pub struct Subscriptions {
    of: BTreeMap<u32, Subscription>,
}

struct Subscription {
    channel: usize,
    /// The number of the next message.
    next: u64,
    /// Messages before it.
    before: Vec<Arc<ServedMessage>>,
    after: Option<u64>,
}

/// The messages for a connection.
pub struct Batch {
    /// Subscription and message.
    pub messages: Vec<(u32, Arc<ServedMessage>)>,
    /// Number of messages of all channels that were dropped before they could be sent.
    pub dropped: u64,
    /// Whether these are the last ones.
    pub is_last: bool,
}

impl Hub {
    /// Returns the state before the first message.
    pub fn new() -> Self {
        let mut hasher = RandomState::new().build_hasher();
        hasher.write_u32(std::process::id());
        let session = format!("{:016x}", hasher.finish());
        let text = |who: &str, what: &str| ServedTopic::Text(format!("/teachtree/{who}/{what}"));
        let tracks = TRACKS.iter().flat_map(|who| [text(who, "primitive"), text(who, "task")]);
        let topics = std::iter::once(ServedTopic::Events(EVENTS.into())).chain(tracks).collect();
        Self { topics, session, state: Mutex::default(), changed: Condvar::new() }
    }

    /// Returns the position at which a reader continues after an event of a session: after it, or at the first kept event for another session.
    pub fn resume(&self, session: Option<&str>, after: &str) -> ReadFrom {
        let is_same = session.is_none_or(|session| session == self.session);
        match after.parse() {
            Ok(after) if is_same => ReadFrom::After(after),
            _ => ReadFrom::Kept,
        }
    }

    /// Takes an event.
    pub fn event(&self, event: &LiveEvent) {
        let (sequence, bytes) = (event.sequence(), event.json().into_bytes());
        let mut state = self.state();
        let time_ns = state.time_ns(event);
        let mut messages = vec![ServedMessage { channel: ALL_EVENTS, sequence, time_ns, bytes }];
        let mut text = |who: String, what: &str, text: &str| {
            let name = format!("/teachtree/{who}/{what}");
            if let Some(channel) = self.topics.iter().position(|topic| topic.name() == name) {
                messages.push(ServedMessage { channel, sequence, time_ns, bytes: ros2_message::text(text) });
            }
        };
        if let Some((who, primitive, _)) = event.label() {
            let label = primitive.map(str::to_string);
            if state.labels.insert(who, label.clone()) != Some(label) {
                text(who.to_string(), "primitive", primitive.unwrap_or_default());
            }
        }
        if let Some(task) = event.task() {
            // At the end of a log a task may be final at once.
            let span = (task.start_s(), task.name().to_string());
            let is_new = !event.is_final() || state.tasks.get(&task.track()) != Some(&span);
            if is_new {
                text(task.track().to_string(), "task", task.name());
            }
            state.tasks.insert(task.track(), span);
        }
        for message in messages {
            state.keep(message);
        }
        drop(state);
        self.changed.notify_all();
    }

    /// Ends the log: waits briefly until all messages were sent.
    pub fn finish(&self) {
        let mut state = self.state();
        state.is_over = true;
        self.changed.notify_all();
        let waited = self.changed.wait_timeout_while(state, LAST_WAIT, |state| state.readers > 0);
        drop(waited.unwrap_or_else(PoisonError::into_inner));
    }

    /// Counts a connection, if there is room for it.
    pub fn enter(&self, most: usize) -> bool {
        let mut state = self.state();
        let has_room = state.readers < most && !state.is_over;
        state.readers += usize::from(has_room);
        has_room
    }

    /// A connection has ended.
    pub fn leave(&self) {
        self.state().readers -= 1;
        self.changed.notify_all();
    }

    /// Wakes the waiting threads.
    pub fn wake(&self) {
        // A thread that is about to wait holds the lock.
        drop(self.state());
        self.changed.notify_all();
    }

    /// Begins to read a channel.
    pub fn subscribe(&self, subscriptions: &Mutex<Subscriptions>, id: u32, channel: usize, from: ReadFrom) {
        // In this order, as in `next`.
        let state = self.state();
        let mut subscriptions = subscriptions.lock().unwrap_or_else(PoisonError::into_inner);
        if channel >= self.topics.len() || subscriptions.of.len() >= MOST_SUBSCRIPTIONS {
            return;
        }
        let end = state.first + state.kept.len() as u64;
        let (next, before, after) = match from {
            ReadFrom::Last => (end, state.last.get(&channel).cloned().into_iter().collect(), None),
            ReadFrom::Kept => (state.first, vec![], None),
            ReadFrom::After(sequence) => (state.first, vec![], Some(sequence)),
        };
        subscriptions.of.insert(id, Subscription { channel, next, before, after });
    }

    /// Waits for something to send; `None` when the connection `is_gone`.
    pub fn next(&self, subscriptions: &Mutex<Subscriptions>, is_gone: impl Fn() -> bool) -> Option<Batch> {
        let mut state = self.state();
        loop {
            if is_gone() {
                return None;
            }
            let batch = state.batch(&mut subscriptions.lock().unwrap_or_else(PoisonError::into_inner));
            if !batch.messages.is_empty() || batch.is_last {
                return Some(batch);
            }
            state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// The messages of a channel that are kept, from a place on.
    #[cfg(feature = "zenoh")]
    pub fn kept(&self, channel: usize, from: ReadFrom) -> Vec<Arc<ServedMessage>> {
        let mut subscriptions = Mutex::default();
        self.subscribe(&subscriptions, 0, channel, from);
        let subscriptions = subscriptions.get_mut().unwrap_or_else(PoisonError::into_inner);
        self.state().batch(subscriptions).messages.into_iter().map(|(_, message)| message).collect()
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl State {
    /// When an event happened, ns since 1970.
    fn time_ns(&mut self, event: &LiveEvent) -> u64 {
        if let Some(origin_ns) = event.origin_ns() {
            self.origin_ns = origin_ns;
        }
        let ends_s = event.label().map(|(_, _, at_s)| at_s);
        let ends_s = ends_s.or_else(|| event.segment().map(|segment| segment.end_s()));
        let ends_s = ends_s.or_else(|| event.task().map(|task| task.end_s()));
        let ends_s = ends_s.or_else(|| event.issue().map(|issue| issue.end_s)).unwrap_or_default();
        // A cast from f64 saturates.
        let time_ns = self.origin_ns.saturating_add((ends_s * 1e9) as i64);
        // Viewers want times that do not go back.
        self.newest_ns = self.newest_ns.max(u64::try_from(time_ns).unwrap_or_default());
        self.newest_ns
    }

    fn keep(&mut self, message: ServedMessage) {
        let message = Arc::new(message);
        self.bytes += message.bytes.len();
        self.last.insert(message.channel, Arc::clone(&message));
        self.kept.push_back(message);
        while self.kept.len() > MOST_MESSAGES || self.bytes > MOST_BYTES {
            let Some(oldest) = self.kept.pop_front() else { return };
            self.bytes -= oldest.bytes.len();
            self.first += 1;
        }
    }

    fn batch(&self, subscriptions: &mut Subscriptions) -> Batch {
        let end = self.first + self.kept.len() as u64;
        let (mut messages, mut dropped) = (vec![], 0);
        for (id, subscription) in &mut subscriptions.of {
            messages.extend(subscription.before.drain(..).map(|message| (*id, message)));
            dropped = dropped.max(self.first.saturating_sub(subscription.next));
            let from = subscription.next.max(self.first) - self.first;
            let new = self.kept.iter().skip(usize::try_from(from).unwrap_or(usize::MAX));
            let is_wanted = |message: &&Arc<ServedMessage>| {
                message.channel == subscription.channel
                    && subscription.after.is_none_or(|after| message.sequence > after)
            };
            messages.extend(new.filter(is_wanted).map(|message| (*id, Arc::clone(message))));
            subscription.next = end;
        }
        // Messages of several channels go out in the order of their events.
        messages.sort_by_key(|(_, message)| message.sequence);
        Batch { messages, dropped, is_last: self.is_over }
    }
}

impl Subscriptions {
    /// Does not read a channel any more.
    pub fn remove(&mut self, id: u32) {
        self.of.remove(&id);
    }
}
