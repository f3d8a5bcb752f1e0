//! Messages of several topics as rows: a row for each stamp that any topic has, as soon as no topic can add to it.
//!
//! Stamps of a topic rise. So a row is whole when every topic has sent a later message; a topic is awaited for a limited time. What a topic has sent
//! once only, such as a transform that never changes, holds all along.

use crate::base::error::InputError;
use crate::base::shown::Shown;
use crate::stream::issue::{Issue, IssueKind};
use crate::stream::read::sheet::{Cells, InMemoryTable};
use crate::stream::read::table::{MAX_COLUMNS, number, shown};
use indexmap::{IndexMap, IndexSet};
use std::collections::VecDeque;
use std::fmt;

/// How many messages wait for those of other topics.
const MAX_WAITING: usize = 1 << 14;
/// How many messages in order that all come too late show that the clock was set back.
const SET_BACK: usize = 10;
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
pub struct Join {
    topics: IndexMap<String, Topic>,
    /// How long a topic is awaited, s, by the stamps of the others.
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
    /// Whether anything of it is bound.
    pub is_used: bool,
    /// The messages that are not in a row yet: stamp, s, and values by column.
    waiting: VecDeque<(f64, Vec<Value>)>,
    /// The first message.
    only: Vec<Value>,
    /// Whether nothing came after it for long, so that it holds all along.
    is_static: bool,
    /// How many messages have come, and the stamp of the newest, s.
    messages: u64,
    newest_s: Option<f64>,
    is_silent: bool,
    /// How many messages in order came too late, one after the other, and the stamp of the last one.
    late: Option<(usize, f64)>,
}

/// What becomes of a message.
#[derive(Clone, Debug, PartialEq)]
pub enum Pushed {
    /// It waits for its row.
    Kept,
    /// It is left out, with an issue for the first of several.
    Late(Option<Issue>),
    /// So many came too late that the clock was set back: the message is to be pushed anew after a restart.
    SetBack(Issue),
}

impl Join {
    /// No topics yet.
    pub fn new(wait_s: f64) -> Self {
        Self { topics: IndexMap::new(), wait_s, given_s: f64::NEG_INFINITY, first_s: None }
    }

    /// The topics so far, by name.
    pub fn topics(&self) -> &IndexMap<String, Topic> {
        &self.topics
    }

    /// Marks the topics of which something is bound; the others are not awaited.
    pub fn mark(&mut self, is_used: impl Fn(usize) -> bool) {
        for (at, topic) in self.topics.values_mut().enumerate() {
            topic.is_used = is_used(at);
            if !topic.is_used {
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
            self.topics.insert(name.to_string(), Topic { is_used: true, ..Topic::default() });
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
    pub fn push(&mut self, name: &str, time_s: f64, row: &InMemoryTable) -> Pushed {
        let given_s = self.given_s;
        let Some(topic) = self.topics.get_mut(name).filter(|topic| topic.is_used) else { return Pushed::Kept };
        let newest_s = topic.newest_s.unwrap_or(f64::NEG_INFINITY);
        if time_s <= newest_s || time_s <= given_s {
            // What is sent once only may be sent again to whoever connects anew.
            if topic.messages == 1 && time_s == newest_s {
                return Pushed::Late(None);
            }
            return topic.leave_out(name, time_s, newest_s.max(given_s));
        }
        (topic.late, topic.is_silent, topic.newest_s) = (None, false, Some(time_s));
        topic.messages += 1;
        let values = values(&topic.titles, row);
        if topic.messages == 1 {
            topic.only.clone_from(&values);
        } else {
            topic.is_static = false;
        }
        if !topic.is_static {
            topic.waiting.push_back((time_s, values));
        }
        self.first_s = Some(self.first_s.map_or(time_s, |first_s| first_s.min(time_s)));
        Pushed::Kept
    }

    /// From the first to the last stamp that waits, s.
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
        for (name, topic) in &mut self.topics {
            let own_s = topic.newest_s.unwrap_or(first_s);
            if !topic.is_used || topic.is_silent || topic.is_static || is_alone || newest_s - own_s <= wait_s {
                continue;
            }
            if topic.messages == 1 {
                topic.is_static = true;
                topic.waiting.clear();
                continue;
            }
            topic.is_silent = true;
            let message = format!(
                "no message for {:.1} s, by the stamps of the others; its channels are not measured until the next one",
                newest_s - own_s
            );
            issues.push(issue(IssueKind::GAP, own_s, newest_s, name, message));
        }
        issues
    }

    /// The next row that no topic can add to, or any that is left when the log `ends`: its stamp, s, and the values of each topic.
    pub fn next(&mut self, ends: bool) -> Option<(f64, Vec<Vec<Value>>)> {
        let whole_s = if ends { f64::INFINITY } else { self.whole_s()? };
        if ends && !self.is_alone() && self.used().any(|topic| topic.messages > 1) {
            for topic in self.topics.values_mut().filter(|topic| topic.messages == 1) {
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
            let own_s = topic.newest_s.unwrap_or(first_s);
            if newest_s - own_s > self.wait_s || is_full && topic.waiting.is_empty() {
                continue;
            }
            if topic.messages <= 1 && !is_alone {
                return None;
            }
            whole_s = whole_s.min(own_s);
        }
        Some(whole_s)
    }

    /// Begins anew: topics may send any stamp. What was sent once only is kept until it is sent again.
    pub fn restart(&mut self) {
        self.given_s = f64::NEG_INFINITY;
        for topic in self.topics.values_mut() {
            topic.waiting.clear();
            (topic.newest_s, topic.late, topic.is_silent, topic.messages) = (None, None, false, 0);
        }
        self.first_s = None;
    }

    /// Whether there is no topic to wait for.
    fn is_alone(&self) -> bool {
        self.used().count() <= 1
    }

    fn used(&self) -> impl Iterator<Item = &Topic> {
        self.topics.values().filter(|topic| topic.is_used)
    }

    fn waiting(&self) -> usize {
        self.topics.values().map(|topic| topic.waiting.len()).sum()
    }

    fn newest_s(&self) -> Option<f64> {
        self.used().filter_map(|topic| topic.newest_s).reduce(f64::max)
    }
}

impl Topic {
    /// Leaves out a message that comes after a later one, of its own or when the rows up to there were made.
    fn leave_out(&mut self, name: &str, time_s: f64, newest_s: f64) -> Pushed {
        let (messages, before_s) = self.late.unwrap_or((0, f64::NEG_INFINITY));
        let messages = if time_s > before_s { messages + 1 } else { 1 };
        let is_first = self.late.replace((messages, time_s)).is_none();
        let is_behind = self.newest_s.is_none_or(|own_s| time_s > own_s);
        let was_silent = self.is_silent;
        if is_behind {
            // It is awaited again, so that the next ones come in time.
            (self.newest_s, self.is_silent) = (Some(time_s), false);
            self.messages += 1;
        }
        let [at, newest] = [time_s, newest_s].map(|time| Shown((time * 1e6).round() / 1e6));
        let is_set_back = if is_behind { newest_s - time_s > OTHER_CLOCK_S } else { true };
        if messages >= SET_BACK && is_set_back {
            let message = format!("the clock was set back from {newest} s to {at} s; everything restarts");
            return Pushed::SetBack(issue(IssueKind::GAP, time_s, newest_s, name, message));
        }
        if !is_first || is_behind && was_silent {
            return Pushed::Late(None);
        }
        let message = if is_behind {
            format!(
                "the message of {at} s came when the rows up to {newest} s were made; messages are left out until one comes in time (--wait)"
            )
        } else {
            format!(
                "the message of {at} s came after that of {newest} s; messages are left out until a later one comes"
            )
        };
        Pushed::Late(Some(issue(IssueKind::DUPLICATE_STAMP, time_s, newest_s, name, message)))
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
