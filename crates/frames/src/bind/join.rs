//! Messages of several topics as rows: a row for each stamp that any topic has, as soon as no topic can add to it.
//!
//! A topic may have several writers, each with its own elements and increasing stamps. A row is complete when every writer has sent a later message or
//! its waiting time is over. A message that a writer sends only once, such as a static transform, holds for the whole log.

use indexmap::{IndexMap, IndexSet};
use std::collections::VecDeque;
use std::fmt;
use teachtree_base::error::InputError;
use teachtree_base::short_number::ShortNumber;
use teachtree_logs::issue::{Issue, IssueKind};
use teachtree_logs::read::memory_table::{Cells, InMemoryTable};
use teachtree_logs::read::stamp_order::{Order, RowMerge, StampOrder, Writers, is_of_head, set_back};
use teachtree_logs::read::table::{MAX_COLUMNS, number, shown};

/// Maximum number of messages that wait for those of other topics.
const MAX_WAITING: usize = 1 << 14;
/// A topic that is farther behind the others, s, has another clock, or theirs was wrong.
const OTHER_CLOCK_S: f64 = 60.0;

/// A value of a message.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// A number, or a text that says one; NaN where nothing was measured.
    Number(f64),
    /// Another text.
    Text(String),
}

/// The messages of topics that wait for each other.
pub struct TopicJoin {
    topics: IndexMap<String, Topic>,
    /// The timeout of a topic, s, by the stamps of the others.
    wait_s: f64,
    /// The stamp up to which rows were given, s.
    given_s: f64,
    /// The first stamp, s.
    first_s: Option<f64>,
}

/// A topic, which is a part of a row.
#[derive(Default)]
pub struct Topic {
    /// The names of its columns, without that of the topic.
    pub titles: IndexSet<String>,
    /// The columns that are bound; all until the binding is known.
    bound: Vec<bool>,
    /// The messages that are not yet part of a row, ordered by stamp (s), with values by column.
    waiting: VecDeque<(f64, Vec<Value>)>,
    /// The first message of each writer.
    only: Vec<Value>,
    /// Whether nothing came after it for long, so that it holds all along.
    is_static: bool,
    writers: Writers<Writer>,
}

/// A writer of a topic.
#[derive(Clone, Default)]
struct Writer {
    /// Number of messages, stamp of the newest one (s) and of the one before.
    messages: u64,
    newest_s: Option<f64>,
    before_s: f64,
    /// The order of the stamps. Stamps up to the last finished row are too late as well.
    order: StampOrder,
    /// Whether the last message was left out.
    is_left_out: bool,
    is_silent: bool,
    /// Whether a message lacks columns of the writer's other messages, so that several messages may form one row.
    is_partial: bool,
}

impl Writer {
    fn merge(&mut self, other: Self) {
        self.messages += other.messages;
        self.before_s = self.before_s.max(other.before_s);
        self.newest_s = self.newest_s.into_iter().chain(other.newest_s).reduce(f64::max);
        self.order.raise(other.order.newest_s());
        self.is_partial = true;
    }

    /// Returns the stamp (s) up to which the writer's messages are complete; `first_s` before the first message.
    fn whole_s(&self, first_s: f64) -> f64 {
        if self.is_partial && self.messages > 1 { self.before_s } else { self.newest_s.unwrap_or(first_s) }
    }
}

/// The result of pushing a message.
#[derive(Clone, Debug, PartialEq)]
pub enum PushOutcome {
    /// The message waits for its row.
    Kept,
    /// The message is too late and is left out. The first of several such messages has an issue.
    Late(Option<Issue>),
    /// Too many messages were late: the clock was set back. The caller restarts and pushes the message again.
    SetBack(Issue),
}

impl Value {
    /// The value as a text; empty where nothing was measured.
    pub fn text(&self) -> String {
        match self {
            Self::Number(number) if number.is_nan() => String::new(),
            Self::Number(number) => number.to_string(),
            Self::Text(text) => text.trim().to_string(),
        }
    }
}

impl TopicJoin {
    /// Returns a joiner without topics.
    pub fn new(wait_s: f64) -> Self {
        Self { topics: IndexMap::new(), wait_s, given_s: f64::NEG_INFINITY, first_s: None }
    }

    /// The topics so far, by name.
    pub fn topics(&self) -> &IndexMap<String, Topic> {
        &self.topics
    }

    /// Marks the bound columns by topic and column index. Rows do not wait for the others.
    pub fn mark(&mut self, is_bound: impl Fn(usize, usize) -> bool) {
        for (at, topic) in self.topics.values_mut().enumerate() {
            topic.bound = (0..topic.titles.len()).map(|column| is_bound(at, column)).collect();
            if !topic.is_used() {
                topic.waiting.clear();
            }
        }
    }

    /// Learns the columns of a message; whether any is new.
    ///
    /// # Errors
    /// There are too many.
    pub fn learn(&mut self, name: &str, row: &InMemoryTable) -> Result<bool, InputError> {
        let is_new = !self.topics.contains_key(name);
        if is_new {
            self.topics.insert(name.to_string(), Topic::default());
        }
        let Some(topic) = self.topics.get_mut(name) else { return Ok(is_new) };
        let before = topic.titles.len();
        for title in row.columns().keys() {
            if topic.titles.contains(title) {
                continue;
            }
            if topic.titles.len() >= MAX_COLUMNS {
                let message = format!("found more than {MAX_COLUMNS} columns, the most that are read");
                return Err(InputError::new(&row.place, message));
            }
            topic.titles.insert(title.clone());
        }
        Ok(is_new || topic.titles.len() > before)
    }

    /// Takes a message whose columns are known.
    pub fn push(&mut self, name: &str, time_s: f64, row: &InMemoryTable) -> PushOutcome {
        let given_s = self.given_s;
        let Some(topic) = self.topics.get_mut(name).filter(|topic| topic.is_used()) else { return PushOutcome::Kept };
        let (values, columns) = (values(&topic.titles, row), topic.columns(row));
        let writer = topic.writers.of(&columns, Writer::merge);
        let (messages, newest_s) = (writer.messages, writer.newest_s.unwrap_or(f64::NEG_INFINITY));
        // Rows without topics are complete.
        let has_others = |first: &usize| topic.writers.columns_with(*first).count() > columns.len();
        let is_partial = !name.is_empty() && columns.first().is_some_and(has_others);
        // Columns that are not bound may be late.
        let is_bound = columns.iter().any(|column| topic.bound.get(*column).copied().unwrap_or(true));
        if time_s > given_s && time_s == newest_s && topic.add(time_s, &values) {
            topic.writers.of(&columns, Writer::merge).is_partial |= is_partial;
            return PushOutcome::Kept;
        }
        let writer = topic.writers.of(&columns, Writer::merge);
        writer.is_partial |= is_partial;
        if time_s <= newest_s || time_s <= given_s {
            // A message that is sent once may be repeated to new subscribers.
            if messages == 1 && time_s == newest_s || !is_bound {
                return PushOutcome::Late(None);
            }
            return writer.leave_out(name, time_s, given_s);
        }
        writer.order.push(time_s);
        (writer.is_left_out, writer.is_silent) = (false, false);
        (writer.before_s, writer.newest_s) = (newest_s, Some(time_s));
        writer.messages += 1;
        if messages == 0 {
            topic.only.resize(topic.titles.len(), Value::Number(f64::NAN));
            let said = topic.only.iter_mut().zip(&values).filter(|(_, value)| !value.is_empty());
            said.for_each(|(only, value)| only.clone_from(value));
        } else {
            topic.is_static = false;
        }
        if !topic.is_static {
            topic.insert(time_s, values);
        }
        self.first_s = Some(self.first_s.map_or(time_s, |first_s| first_s.min(time_s)));
        PushOutcome::Kept
    }

    /// Returns the time from the first to the last waiting stamp, s.
    pub fn waits_s(&self) -> f64 {
        let stamps = || self.used().flat_map(|topic| topic.waiting.iter().map(|(stamp, _)| *stamp));
        let (first, last) = (stamps().reduce(f64::min), stamps().reduce(f64::max));
        first.zip(last).map_or(0.0, |(first, last)| last - first)
    }

    /// Leaves out the oldest messages while too many wait for what a binding needs.
    pub fn forget_oldest(&mut self) {
        while self.waiting() > MAX_WAITING {
            let stamp = |topic: &Topic| topic.waiting.front().map_or(f64::INFINITY, |(stamp, _)| *stamp);
            let Some(oldest) = self.topics.values_mut().min_by(|a, b| stamp(a).total_cmp(&stamp(b))) else { return };
            oldest.waiting.pop_front();
        }
    }

    /// Decides what is awaited no more: what was sent once only holds from now on, and a topic that has stopped is reported once.
    pub fn settle(&mut self) -> Vec<Issue> {
        let (Some(newest_s), Some(first_s)) = (self.newest_s(), self.first_s) else { return vec![] };
        let (wait_s, is_alone) = (self.wait_s, self.is_alone());
        let mut issues = vec![];
        for (name, topic) in self.topics.iter_mut().filter(|(_, topic)| topic.is_used() && !topic.is_static) {
            let is_behind = |writer: &Writer| newest_s - writer.newest_s.unwrap_or(first_s) > wait_s;
            if is_alone {
                continue;
            }
            if topic.messages() == 1 {
                if topic.used().all(is_behind) {
                    topic.is_static = true;
                    topic.waiting.clear();
                }
                continue;
            }
            let silent = topic.used().filter(|writer| is_behind(writer) && !writer.is_silent);
            let Some(since_s) = silent.map(|writer| writer.newest_s.unwrap_or(first_s)).reduce(f64::min) else {
                continue;
            };
            topic.writers.all_mut().filter(|writer| is_behind(writer)).for_each(|writer| writer.is_silent = true);
            let message = format!(
                "no message for {:.1} s, by the stamps of the other topics; its channels are not measured until the next one",
                newest_s - since_s
            );
            issues.push(issue(IssueKind::GAP, since_s, newest_s, name, message));
        }
        issues
    }

    /// The next row that no topic can add to, or any that is left when the log `ends`: its stamp, s, and the values of each topic.
    pub fn next(&mut self, ends: bool) -> Option<(f64, Vec<Vec<Value>>)> {
        let whole_s = if ends { f64::INFINITY } else { self.whole_s()? };
        if ends && !self.is_alone() && self.used().any(|topic| topic.messages() > 1) {
            for topic in self.topics.values_mut().filter(|topic| topic.messages() == 1) {
                topic.is_static = true;
                topic.waiting.clear();
            }
        }
        let fronts = self.used().filter_map(|topic| topic.waiting.front().map(|(stamp, _)| *stamp));
        let stamp = fronts.reduce(f64::min).filter(|stamp| *stamp <= whole_s)?;
        self.given_s = self.given_s.max(stamp);
        let values = self.topics.values_mut().map(|topic| {
            if topic.is_static {
                return topic.only.clone();
            }
            let is_here = topic.waiting.front().is_some_and(|(at, _)| *at <= stamp);
            if is_here { topic.waiting.pop_front().map(|(_, values)| values).unwrap_or_default() } else { vec![] }
        });
        Some((stamp, values.collect()))
    }

    /// Up to which stamp rows are whole, s.
    fn whole_s(&self) -> Option<f64> {
        let (newest_s, first_s) = (self.newest_s()?, self.first_s?);
        let (is_full, is_alone) = (self.waiting() > MAX_WAITING, self.is_alone());
        let mut whole_s = f64::INFINITY;
        for topic in self.used().filter(|topic| !topic.is_static) {
            let mut awaited = 0;
            for writer in topic.used() {
                let own_s = writer.newest_s.unwrap_or(first_s);
                if newest_s - own_s > self.wait_s || is_full && topic.waiting.is_empty() {
                    continue;
                }
                awaited += 1;
                whole_s = whole_s.min(writer.whole_s(first_s));
            }
            let is_awaited = awaited > 0 || topic.messages() == 0 && newest_s - first_s <= self.wait_s && !is_full;
            if is_awaited && topic.messages() <= 1 && !is_alone {
                return None;
            }
        }
        Some(whole_s)
    }

    /// Begins anew: topics may send any stamp. What was sent once only is kept until it is sent again.
    pub fn restart(&mut self) {
        self.given_s = f64::NEG_INFINITY;
        for topic in self.topics.values_mut() {
            topic.waiting.clear();
            topic
                .writers
                .all_mut()
                .for_each(|writer| *writer = Writer { is_partial: writer.is_partial, ..Writer::default() });
        }
        self.first_s = None;
    }

    /// Whether rows wait for no other writer.
    fn is_alone(&self) -> bool {
        self.used().map(|topic| topic.used().count().max(1)).sum::<usize>() <= 1
    }

    fn used(&self) -> impl Iterator<Item = &Topic> {
        self.topics.values().filter(|topic| topic.is_used())
    }

    fn waiting(&self) -> usize {
        self.topics.values().map(|topic| topic.waiting.len()).sum()
    }

    fn newest_s(&self) -> Option<f64> {
        self.used().flat_map(Topic::used).filter_map(|writer| writer.newest_s).reduce(f64::max)
    }
}

impl Topic {
    /// Whether any column of the topic is bound.
    fn is_used(&self) -> bool {
        self.bound.len() < self.titles.len() || self.bound.contains(&true) || self.titles.is_empty()
    }

    /// Returns the writers of bound columns.
    fn used(&self) -> impl Iterator<Item = &Writer> {
        self.writers.with(|column| self.bound.get(column).copied().unwrap_or(true))
    }

    /// Returns the maximum number of messages of a writer.
    fn messages(&self) -> u64 {
        self.used().map(|writer| writer.messages).max().unwrap_or(0)
    }

    /// Returns the columns of a message without its header.
    fn columns(&self, row: &InMemoryTable) -> Vec<usize> {
        let of_body = row.columns().keys().filter(|title| !is_of_head(title));
        of_body.filter_map(|title| self.titles.get_index_of(title)).collect()
    }

    /// Merges a message into a waiting one with the same stamp if their elements differ.
    fn add(&mut self, time_s: f64, values: &[Value]) -> bool {
        let Some((_, waiting)) = self.waiting.iter_mut().find(|(stamp, _)| *stamp == time_s) else { return false };
        let mut whole = waiting.clone();
        let mut addition = RowMerge::default();
        whole.resize(values.len().max(whole.len()), Value::Number(f64::NAN));
        for (at, ((kept, other), title)) in whole.iter_mut().zip(values).zip(&self.titles).enumerate() {
            let mut of_column = RowMerge::default();
            kept.add(other, &mut of_column);
            // Columns that are not bound may differ, as in a whole log.
            if self.bound.get(at).copied().unwrap_or(true) && !is_of_head(title) {
                addition.join(of_column);
            }
        }
        let is_new = !addition.is_repeat();
        if is_new {
            *waiting = whole;
        }
        is_new
    }

    /// Inserts a message into the waiting ones.
    fn insert(&mut self, time_s: f64, values: Vec<Value>) {
        if self.add(time_s, &values) {
            return;
        }
        let at = self.waiting.partition_point(|(stamp, _)| *stamp <= time_s);
        self.waiting.insert(at, (time_s, values));
    }
}

impl Writer {
    /// Leaves out a message that is older than the writer's newest one or than the finished rows, which end at `given_s`.
    fn leave_out(&mut self, name: &str, time_s: f64, given_s: f64) -> PushOutcome {
        let newest_s = self.newest_s.unwrap_or(f64::NEG_INFINITY).max(given_s);
        self.order.raise(given_s);
        let is_set_back = self.order.push(time_s) == Order::SetBack;
        let is_first = !std::mem::replace(&mut self.is_left_out, true);
        let is_behind = self.newest_s.is_none_or(|own_s| time_s > own_s);
        let was_silent = self.is_silent;
        if is_behind {
            // The topic is awaited again, so that its next messages are in time.
            (self.newest_s, self.is_silent) = (Some(time_s), false);
            self.messages += 1;
        }
        if is_set_back && (!is_behind || newest_s - time_s > OTHER_CLOCK_S) {
            let message = set_back(newest_s, time_s, "everything restarts");
            return PushOutcome::SetBack(issue(IssueKind::GAP, time_s, newest_s, name, message));
        }
        if !is_first || is_behind && was_silent {
            return PushOutcome::Late(None);
        }
        let [at, newest] = [time_s, newest_s].map(|time| ShortNumber((time * 1e6).round() / 1e6));
        let message = if is_behind {
            format!(
                "the message of {at} s arrived after the rows up to {newest} s were completed; messages are dropped until one arrives in time (--wait)"
            )
        } else {
            format!(
                "the message of {at} s arrived after that of {newest} s; messages are dropped until a later one arrives"
            )
        };
        PushOutcome::Late(Some(issue(IssueKind::DUPLICATE_STAMP, time_s, newest_s, name, message)))
    }
}

impl Value {
    pub(super) fn is_empty(&self) -> bool {
        match self {
            Self::Number(number) => number.is_nan(),
            Self::Text(text) => text.is_empty(),
        }
    }

    /// Fills missing elements of the value from another one.
    pub(super) fn add(&mut self, other: &Self, addition: &mut RowMerge) {
        match (&mut *self, other) {
            (Self::Number(kept), Self::Number(other)) => addition.number(kept, *other),
            (Self::Text(kept), Self::Text(other)) => addition.text(kept, other),
            // The value was not measured, or is a text in a numeric column.
            (kept, other) if kept.is_empty() => {
                kept.clone_from(other);
                if !other.is_empty() {
                    addition.fill();
                }
            }
            _ => {}
        }
    }
}

fn issue(kind: IssueKind, start_s: f64, end_s: f64, channel: &str, message: String) -> Issue {
    Issue { kind, start_s: start_s.min(end_s), end_s: end_s.max(start_s), channel: channel.into(), message }
}

/// The values of the only row of a table, by column.
fn values(titles: &IndexSet<String>, row: &InMemoryTable) -> Vec<Value> {
    titles.iter().map(|title| value(title, row)).collect()
}

/// A value of the only row of a table.
pub fn value(title: &str, row: &InMemoryTable) -> Value {
    match row.columns().get(title) {
        Some(Cells::Texts(texts)) => {
            let text = texts.first().map_or("", String::as_str);
            number(text).map_or_else(|| Value::Text(text.to_string()), Value::Number)
        }
        Some(cells) => {
            let value = cells.numbers().and_then(|values| values.first()).copied().unwrap_or(f64::NAN);
            Value::Number(if value.is_finite() { value } else { f64::NAN })
        }
        None => Value::Number(f64::NAN),
    }
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) if number.is_nan() => Ok(()),
            Self::Number(number) => write!(f, "{number}"),
            Self::Text(text) => write!(f, "{}", shown(text)),
        }
    }
}
