//! The analysis frame by frame: labels, objects, and values of signals and channels as columns of a table.

use super::analysis::Analysis;
use super::error::Error;
use super::run::Run;
use crate::{AnalysisInternals, ErrorInternals, RulesInternals};
use std::ops::Range;
use std::path::Path;
use teachtree_analysis::explain::{Row, of_channel, of_expr};
use teachtree_analysis::{Segment, Track};
use teachtree_base::channels::{ChannelSpec, HANDLING, Shape};
use teachtree_base::error::{ErrorKind, InputError};
use teachtree_base::hands::Side;
use teachtree_base::recording::{Column, Recording};
use teachtree_base::spelling::nearest;
use teachtree_base::units::Dimension;
use teachtree_engine::inspect::Inspector;
use teachtree_language::rules::{Expr, ExprKind, Hand, LatchId, Rules, SignalId, Type};
use teachtree_logs::atomic_write::Files;
use teachtree_logs::read::formats;

/// An analysis as a table with one row per frame, made by [`Analysis::frames`].
///
/// Columns of numbers come first: `time` in s, `row` (the row of the log, counted from 0), then the signals and channels that were asked for, in
/// SI. Columns of texts follow, for each track: `right.raw` (the primitive before relabeling), `right.label` (after it), `right.task`,
/// `right.object`, `right.partner`; empty for missing values. docs/formats.md describes each.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameTable {
    table: Recording,
}

/// The values of a column of a [`FrameTable`], one per frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FrameValues<'a> {
    /// Numbers in SI; truth is 1 and 0. NaN where a value is not known.
    Numbers(&'a [f64]),
    /// Texts; empty for missing values.
    Texts(&'a [String]),
}

impl FrameTable {
    /// The columns: name, unit (empty for none), values.
    pub fn columns(&self) -> impl Iterator<Item = (&str, String, FrameValues<'_>)> {
        let Recording { time, columns, labels, .. } = &self.table;
        let time = std::iter::once(("time", "s".to_string(), FrameValues::Numbers(time)));
        let numbers = columns.iter().map(|(name, column)| {
            (name.as_str(), column.dimension.si_unit(), FrameValues::Numbers(column.values.as_slice()))
        });
        let texts = labels.iter().map(|(name, texts)| (name.as_str(), String::new(), FrameValues::Texts(texts)));
        time.chain(numbers).chain(texts)
    }

    /// The values of a column.
    pub fn column(&self, name: &str) -> Option<FrameValues<'_>> {
        self.columns().find(|(known, ..)| *known == name).map(|(.., values)| values)
    }

    /// Writes the table: Parquet when the name ends in `.parquet`, CSV when it ends in `.csv` or another ending of text. The file is written whole or not
    /// at all.
    ///
    /// # Errors
    /// [`ErrorKind::Argument`], when the name ends otherwise, or in `.parquet` without the feature `parquet`; [`ErrorKind::Io`], when it cannot be written.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), Error> {
        let mut files = Files::default();
        self.add(&mut files, path.as_ref())?;
        files.commit().map_err(|error| Error::new(error, ErrorKind::Io))
    }

    pub(super) fn new(analysis: &Analysis, signals: &[String]) -> Result<Self, Error> {
        let Run { frames, leaves } = analysis.run()?;
        let rules = analysis.rules().set();
        let mut table = Recording { time: frames.time.clone(), ..Recording::default() };
        let row = |frame: usize| frames.rows(&(frame..frame + 1)).start as f64;
        let rows = Column { dimension: Dimension::NONE, values: (0..frames.len).map(row).collect() };
        table.columns.insert("row".into(), rows);

        let sides = frames.layout.hands.iter().map(|hand| hand.side).collect();
        let channels = (0..).zip(&frames.channels).filter(|(_, spec)| !HANDLING.contains(&spec.name.as_str()));
        let known = ValueCatalog { rules, sides, channels: channels.collect() };
        let mut inspectors: Vec<Inspector> =
            leaves.iter().map(|leaves| Inspector::new(rules, frames, leaves)).collect();
        for name in signals {
            for (side, of) in known.find(name)? {
                let (rows, ty) = match &of {
                    ValueSource::Expr(expr) => (of_expr(expr, side, frames, &mut inspectors), expr.ty),
                    ValueSource::Channel(at, ty) => (Ok(of_channel(*at, side, frames)), *ty),
                };
                let bare = split_hand(name).1;
                let title = side.map_or_else(|| bare.to_string(), |side| format!("{side}.{bare}"));
                for Row { slot, component, values } in rows.map_err(|error| Error::new(error, ErrorKind::Mismatch))? {
                    let parts = [title.as_str(), slot.as_str(), component];
                    let title: Vec<&str> = parts.into_iter().filter(|part| !part.is_empty()).collect();
                    if ty.shape == Shape::Object {
                        let name = |value: &f64| (*value >= 0.0).then(|| frames.objects.get(*value as usize)).flatten();
                        let texts = values.iter().map(|value| name(value).cloned().unwrap_or_default()).collect();
                        table.labels.insert(title.join("."), texts);
                    } else {
                        table.columns.insert(title.join("."), Column { dimension: ty.dimension, values });
                    }
                }
            }
        }
        for track in &analysis.found().tracks {
            labels(&mut table, track, frames.len);
        }
        Ok(Self { table })
    }
}

/// The columns of texts of a track.
fn labels(table: &mut Recording, track: &Track, frames: usize) {
    let Track { who, segments: raw, relabeled: segments, tasks, .. } = track;
    let mut add = |name: &str, spans: &[(&Range<usize>, Option<&String>)]| {
        let mut texts = vec![String::new(); frames];
        for (span, text) in spans.iter().filter_map(|(span, text)| Some((*span, (*text)?))) {
            texts.get_mut(span.clone()).unwrap_or_default().fill(text.clone());
        }
        table.labels.insert(format!("{who}.{name}"), texts);
    };
    add("raw", &spans(raw, |segment| Some(&segment.primitive)));
    add("label", &spans(segments, |segment| Some(&segment.primitive)));
    if who.side().is_some() {
        add("task", &tasks.iter().map(|task| (&task.frames, Some(&task.task))).collect::<Vec<_>>());
    }
    add("object", &spans(segments, |segment| segment.subject.object.as_ref()));
    add("partner", &spans(segments, |segment| segment.subject.partner.as_ref()));
}

fn spans(segments: &[Segment], text: impl Fn(&Segment) -> Option<&String>) -> Vec<(&Range<usize>, Option<&String>)> {
    segments.iter().map(|segment| (&segment.frames, text(segment))).collect()
}

/// A source of values on frames.
enum ValueSource {
    /// A signal or latch.
    Expr(Expr),
    /// A channel, by its position.
    Channel(u32, Type),
}

/// What can be asked for.
struct ValueCatalog<'a> {
    rules: &'a Rules,
    sides: Vec<Side>,
    /// With their positions in the frames.
    channels: Vec<(u32, &'a ChannelSpec)>,
}

/// A name without the hand before it, `left.near`, and that hand.
fn split_hand(name: &str) -> (Option<Side>, &str) {
    let split = name.split_once('.').and_then(|(side, rest)| Some((Side::from_name(side)?, rest)));
    split.map_or((None, name), |(side, rest)| (Some(side), rest))
}

impl ValueCatalog<'_> {
    /// The values of this name: of one hand, of each hand, or of none.
    fn find(&self, name: &str) -> Result<Vec<(Option<Side>, ValueSource)>, Error> {
        let (asked, bare) = split_hand(name);
        let owners = |per_hand: bool| -> Vec<Option<Side>> {
            let all = if per_hand { self.sides.iter().copied().map(Some).collect() } else { vec![None] };
            all.into_iter().filter(|side| asked.is_none() || *side == asked).collect()
        };
        let expr = |side: Option<Side>, kind: &dyn Fn(Hand) -> ExprKind, ty: Type, span| {
            let hand = if side.is_some() { Hand::This } else { Hand::Shared };
            (side, ValueSource::Expr(Expr { kind: kind(hand), ty, span }))
        };
        let mut found = Vec::new();
        for (at, signal) in (0..).zip(&self.rules.signals).filter(|(_, signal)| signal.name == bare) {
            let of = |side| expr(side, &|hand| ExprKind::Signal(SignalId(at), hand), signal.ty, signal.expr.span);
            found.extend(owners(signal.per_hand).into_iter().map(of));
        }
        for (at, latch) in (0..).zip(&self.rules.latches).filter(|(_, latch)| latch.name == bare) {
            let of = |side| expr(side, &|hand| ExprKind::Latch(LatchId(at), hand), Type::BOOL, latch.span);
            found.extend(owners(latch.per_hand).into_iter().map(of));
        }
        for (at, channel) in self.channels.iter().filter(|(_, channel)| channel.name == bare) {
            let ty = Type { shape: channel.shape, dimension: channel.dimension, axis: None };
            found.extend(owners(channel.per_hand).into_iter().map(|side| (side, ValueSource::Channel(*at, ty))));
        }
        if found.is_empty() {
            return Err(Error::new(self.unknown(name, bare), ErrorKind::Argument));
        }
        Ok(found)
    }

    fn unknown(&self, name: &str, bare: &str) -> InputError {
        let signals = self.rules.signals.iter().map(|signal| signal.name.as_str());
        let latches = self.rules.latches.iter().map(|latch| latch.name.as_str());
        let known: Vec<&str> =
            signals.chain(latches).chain(self.channels.iter().map(|(_, channel)| channel.name.as_str())).collect();
        let message = format!("expected a signal, latch or channel of the rules, found `{name}`");
        let help = match nearest(bare, known.iter().copied()) {
            Some(near) => format!("did you mean `{near}`?"),
            None => format!("known are {}", known.join(", ")),
        };
        InputError::new("--signals", message).help(help)
    }
}

/// The methods of [`FrameTable`] for the other crates of the workspace; not a part of the public interface.
#[doc(hidden)]
pub trait FrameTableInternals: Sized {
    /// Adds the table in the form of [`write`](Self::write) to a group of files.
    fn add(&self, files: &mut Files, path: &Path) -> Result<(), Error>;
}

impl FrameTableInternals for FrameTable {
    fn add(&self, files: &mut Files, path: &Path) -> Result<(), Error> {
        formats::check_name(path).map_err(|error| Error::new(error, ErrorKind::Argument))?;
        formats::add_table(files, &self.table, path).map_err(|error| Error::new(error, ErrorKind::Io))
    }
}
