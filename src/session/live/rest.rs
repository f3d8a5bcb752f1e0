//! What is new of an analysis that grows, and from which frame on nothing that comes can change what was before.
//!
//! A hand *rests* from where the first primitive of tasks (`Move`) follows the last one (`Release`): there every span of a task ends, and no relabeling
//! rule reaches across, as long as no rule before recognition rewrites the first primitive. Where every hand rests, everything before is final.

use super::event::Inner;
use super::history::History;
use crate::analysis::{Analysis, Segment, TaskSpan, Track, Who};
use crate::base::hands::Side;
use crate::language::rules::{Label, Labels, RelabelKind, Rules};
use std::collections::BTreeMap;
use std::ops::Range;

/// What was reported of each track.
pub struct Rest {
    /// `None` where tasks begin or end with different primitives, or rules rewrite the first one.
    ends: Option<Ends>,
    tracks: BTreeMap<Who, Reported>,
}

/// What was reported of a track, up to which frame of the log.
#[derive(Default)]
struct Reported {
    raw: usize,
    closed: usize,
    last: usize,
    /// The piece in which the history begins, where it was cut: as the tree returned it, and after relabeling.
    cut: Option<[Segment; 2]>,
}

impl Rest {
    /// What rules rest in.
    pub fn new(rules: &Rules) -> Self {
        Self { ends: Ends::of(rules), tracks: BTreeMap::new() }
    }

    /// A new stretch begins.
    pub fn restart(&mut self) {
        self.tracks.clear();
    }

    /// What is new in the analysis of a history, which is cut where nothing before is needed any more. With `ends` no frame follows.
    pub fn news(&mut self, found: &Analysis, history: &mut History, ends: bool) -> Vec<Inner> {
        let len = found.frames;
        let first = history.first;
        let mut news: Vec<(usize, Inner)> = Vec::new();
        for track in &found.tracks {
            let reported = self.tracks.entry(track.who).or_default();
            let closed = |frames: &Range<usize>| ends || frames.end < len;
            for segment in track.segments.iter().filter(|segment| closed(&segment.frames)) {
                let end = first + segment.frames.end;
                if end > reported.raw {
                    reported.raw = end;
                    let segment = reported.whole(segment, 0);
                    news.push((end, Inner::Segment { who: track.who, segment, is_final: false }));
                }
            }
            for task in track.tasks.iter().filter(|task| !ends && !task.open_end && closed(&task.frames)) {
                let end = first + task.frames.end;
                if end > reported.closed {
                    reported.closed = end;
                    let task = reported.whole_task(task);
                    news.push((end, Inner::Task { who: track.who, task, is_final: false }));
                }
            }
        }
        let rests = if ends { Some((len, BTreeMap::new())) } else { self.rests(found) };
        let Some((at, rests)) = rests else { return in_order(news) };
        for track in &found.tracks {
            let reported = self.tracks.entry(track.who).or_default();
            let until = rests.get(&track.who).copied().unwrap_or(at);
            let is_new = |frames: &Range<usize>| frames.end <= until && first + frames.end > reported.last;
            for segment in track.relabeled.iter().filter(|segment| is_new(&segment.frames)) {
                let segment = reported.whole(segment, 1);
                news.push((first + segment.frames.end, Inner::Segment { who: track.who, segment, is_final: true }));
            }
            for task in track.tasks.iter().filter(|task| is_new(&task.frames)) {
                let task = reported.whole_task(task);
                news.push((first + task.frames.end, Inner::Task { who: track.who, task, is_final: true }));
            }
            reported.last = reported.last.max(first + until);
        }
        if !ends && let Some(Ends { first: rest, .. }) = &self.ends {
            let hands = found.tracks.iter().filter_map(|track| match track.who {
                Who::Hand(side) => Some((side, *rest)),
                Who::Both => None,
            });
            let hands: BTreeMap<Side, Label> = hands.collect();
            if let Some(cut) = history.at_rest(&hands, at).filter(|cut| *cut < len) {
                self.cut(found, history, cut);
            }
        }
        in_order(news)
    }

    /// The newest frame at which every hand rests, and since when each does.
    fn rests(&self, found: &Analysis) -> Option<(usize, BTreeMap<Who, usize>)> {
        let hands: Vec<&Track> = found.tracks.iter().filter(|track| track.who != Who::Both).collect();
        let ends = self.ends.as_ref()?;
        let mut resting: Vec<Range<usize>> = std::iter::once(0..found.frames).collect();
        for hand in &hands {
            let own = intervals(hand, ends);
            let common = |one: &Range<usize>| {
                own.iter().map(|other| one.start.max(other.start)..one.end.min(other.end)).collect::<Vec<_>>()
            };
            resting = resting.iter().flat_map(common).filter(|frames| !frames.is_empty()).collect();
        }
        let coordinated = found.track(Who::Both).map_or(&[][..], |track| &track.segments);
        let at = resting
            .iter()
            .rev()
            .map(|frames| frames.start)
            .find(|frame| !coordinated.iter().any(|segment| segment.frames.contains(frame)))?;
        let since = |hand: &&Track| {
            let own = intervals(hand, ends).into_iter().find(|frames| frames.contains(&at))?;
            Some((hand.who, own.start))
        };
        Some((at, hands.iter().filter_map(since).collect()))
    }

    /// Forgets what is before a frame at which every hand rests.
    fn cut(&mut self, found: &Analysis, history: &mut History, at: usize) {
        for track in &found.tracks {
            let reported = self.tracks.entry(track.who).or_default();
            let piece = |segments: &[Segment], which: usize| {
                let piece = segments.iter().find(|segment| segment.frames.contains(&at))?;
                Some(reported.whole(piece, which))
            };
            let pieces = piece(&track.segments, 0).zip(piece(&track.relabeled, 1));
            reported.cut = pieces.map(|(raw, relabeled)| [raw, relabeled]);
        }
        history.forget(at);
    }
}

impl Reported {
    /// A segment with the part of it that was forgotten.
    fn whole(&self, segment: &Segment, which: usize) -> Segment {
        let mut segment = segment.clone();
        if let Some(cut) = self.cut.as_ref().map(|cut| &cut[which]).filter(|_| segment.frames.start == 0) {
            segment.start_s = cut.start_s;
            if !cut.by.is_empty() {
                segment.was = cut.was.iter().chain(&segment.was).cloned().collect();
                segment.was.dedup();
                segment.by = cut.by.iter().chain(&segment.by).cloned().collect();
                segment.by.dedup();
            }
        }
        segment
    }

    fn whole_task(&self, task: &TaskSpan) -> TaskSpan {
        let mut task = task.clone();
        if let Some(segment) = task.segments.first_mut() {
            *segment = self.whole(segment, 0);
            task.start_s = segment.start_s;
        }
        task
    }
}

/// The frames in which a hand rests: where the tree returned the first primitive after the last one, and no rule before recognition changed the last one.
fn intervals(hand: &Track, ends: &Ends) -> Vec<Range<usize>> {
    let [first, last] = &ends.names;
    let segments = &hand.segments;
    let is_kept = |frame: usize| {
        let piece = hand.relabeled.iter().find(|segment| segment.frames.contains(&frame));
        piece.is_some_and(|piece| piece.by.iter().all(|rule| ends.of_tasks.contains(rule)))
    };
    let rests = |at: usize| match at.checked_sub(1).and_then(|before| segments.get(before)) {
        None => true,
        Some(before) => before.primitive == *last && is_kept(before.frames.end - 1),
    };
    let own = segments.iter().enumerate().filter(|(at, segment)| segment.primitive == *first && rests(*at));
    own.map(|(_, segment)| segment.frames.clone()).collect()
}

fn in_order(mut news: Vec<(usize, Inner)>) -> Vec<Inner> {
    news.sort_by_key(|(end, _)| *end);
    news.into_iter().map(|(_, inner)| inner).collect()
}

/// What every task begins and ends with.
struct Ends {
    first: Label,
    /// The names of the first and the last primitive.
    names: [String; 2],
    /// The relabeling rules within tasks, as their authors wrote them.
    of_tasks: Vec<String>,
}

impl Ends {
    /// The first and the last primitive of every task, where no relabeling before recognition and no key depends on the first one.
    fn of(rules: &Rules) -> Option<Self> {
        let task = rules.tasks.first()?;
        // A hand that rests in a kind of the first primitive rests later.
        let (first, last) = (task.first.label, task.last.label);
        let same = rules.tasks.iter().all(|it| it.first == task.first && it.last == task.last);
        let is_key = rules.tasks.iter().flat_map(|task| &task.keys).any(|key| key.label.covers(first));
        let has = |labels: &Labels| labels.iter().any(|label| label.covers(first));
        let rewrites = |kind: &RelabelKind| match kind {
            RelabelKind::Between { what, .. }
            | RelabelKind::BetweenInHands { what, .. }
            | RelabelKind::Become { what, .. } => has(what),
            RelabelKind::Sequence { elements, .. } => elements.iter().any(|(labels, _)| has(labels)),
            RelabelKind::Separate { what, .. } => what.iter().any(|label| label.covers(first)),
        };
        let (of_tasks, before): (Vec<_>, Vec<_>) = rules.relabels.iter().partition(|rule| rule.task.is_some());
        let rewritten = before.iter().any(|rule| rewrites(&rule.kind));
        (same && !is_key && !rewritten && first != last).then(|| Self {
            first,
            names: [first, last].map(|label| rules.label_name(label)),
            of_tasks: of_tasks.into_iter().map(|rule| rule.text.clone()).collect(),
        })
    }
}
