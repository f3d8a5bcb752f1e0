//! Finds the new results of a growing analysis, and the frame before which they are final.
//!
//! A hand *rests* from the frame on which the first primitive of tasks (`Move`) follows the last one (`Release`) or a kind of it. Every span of a task ends
//! there, and no relabeling rule reaches across, if no rule before recognition rewrites the first primitive. When all hands rest, all results before are final.

use super::event::Inner;
use super::history::History;
use std::collections::BTreeMap;
use std::ops::Range;
use teachtree_analysis::composites::Composites;
use teachtree_analysis::{Analysis, Segment, TaskSpan, Track, TrackId};
use teachtree_base::hands::Side;
use teachtree_language::rules::{Label, Labels, RelabelKind, Rules};

/// The time before the known end of a rest at which the history is cut, s.
const BEFORE_END_SECS: f64 = 1.0;
/// The time for which frames are kept on which a resting hand touches an object, s.
const TOUCHED_SECS: f64 = 60.0;
/// The minimum duration that is dropped from the history, s.
const LEAST_SECS: f64 = 0.5;

/// The reported results of each track.
pub struct FinalityTracker {
    /// `None` if tasks begin or end with different primitives, or rules rewrite the first one.
    ends: Option<TaskEnds>,
    tracks: BTreeMap<TrackId, ReportedFrames>,
    /// The tasks of each hand from which composite tasks may continue.
    composites: BTreeMap<TrackId, Composites>,
    made_of: Composites,
}

/// The frames of the log up to which the results of a track were reported.
#[derive(Default)]
struct ReportedFrames {
    raw: usize,
    closed: usize,
    last: usize,
    /// The segment at which the history was cut, before and after relabeling.
    cut: Option<[Segment; 2]>,
}

impl FinalityTracker {
    /// Returns the tracker for these rules.
    pub fn new(rules: &Rules) -> Self {
        let made_of = Composites::new(rules);
        Self { ends: TaskEnds::of(rules), tracks: BTreeMap::new(), composites: BTreeMap::new(), made_of }
    }

    /// Begins a new stretch.
    pub fn restart(&mut self) {
        self.tracks.clear();
        self.composites.clear();
    }

    /// Returns the new results in the analysis of a history, and cuts the history before the frames that are still needed. With `ends` no frame follows.
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
            for task in track.tasks.iter().filter(|task| !ends && !task.lacks_last && closed(&task.frames)) {
                let end = first + task.frames.end;
                if end > reported.closed {
                    reported.closed = end;
                    let task = reported.whole_task(task);
                    news.push((end, Inner::Task { who: track.who, task, is_final: false }));
                }
            }
        }
        let rests = if ends { Some((len..len, BTreeMap::new())) } else { self.rests(found) };
        let Some((resting, rests)) = rests else { return in_order(news) };
        for track in &found.tracks {
            let until = rests.get(&track.who).copied().unwrap_or(resting.start);
            self.finals(track, first, until, &mut news);
            if ends && let Some(composites) = self.composites.get_mut(&track.who) {
                let end = first + len;
                news.extend(
                    composites.finish().into_iter().map(|found| (end, Inner::Composite { who: track.who, found })),
                );
            }
        }
        if let Some(cut) = self.cut_frame(&resting, found, history) {
            for track in &found.tracks {
                self.tracks.entry(track.who).or_default().keep(track, cut);
            }
            history.forget(cut);
        }
        in_order(news)
    }

    /// Drops the frames before `before` although no hand rests, and returns the results that become final. A segment at the cut is split.
    pub fn forget(&mut self, found: &Analysis, history: &mut History, before: usize) -> Vec<Inner> {
        let mut news = Vec::new();
        let end_s = history.time_s(before).unwrap_or(found.end_s);
        let first = history.first;
        for track in &found.tracks {
            self.finals(track, first, before, &mut news);
            let reported = self.tracks.entry(track.who).or_default();
            let goes_on = |segment: &&Segment| segment.frames.start < before && before < segment.frames.end;
            for (which, lane) in [&track.segments, &track.relabeled].into_iter().enumerate() {
                let Some(segment) = lane.iter().find(goes_on) else { continue };
                let segment = Segment { end_s, ..reported.whole(segment, which) };
                news.push((first + before, Inner::Segment { who: track.who, segment, is_final: which == 1 }));
            }
            (reported.raw, reported.closed) = (reported.raw.max(first + before), reported.closed.max(first + before));
            reported.cut = None;
        }
        history.forget(before);
        in_order(news)
    }

    /// The segments and tasks of a track that are over at a frame before which nothing changes any more.
    fn finals(&mut self, track: &Track, first: usize, until: usize, news: &mut Vec<(usize, Inner)>) {
        let reported = self.tracks.entry(track.who).or_default();
        let is_new = |frames: &Range<usize>| frames.end <= until && first + frames.end > reported.last;
        for segment in track.relabeled.iter().filter(|segment| is_new(&segment.frames)) {
            let segment = reported.whole(segment, 1);
            news.push((first + segment.frames.end, Inner::Segment { who: track.who, segment, is_final: true }));
        }
        for task in track.tasks.iter().filter(|task| is_new(&task.frames)) {
            let task = reported.whole_task(task);
            let end = first + task.frames.end;
            let composites = self.composites.entry(track.who).or_insert_with(|| self.made_of.clone());
            let found = composites.push(&task);
            news.push((end, Inner::Task { who: track.who, task, is_final: true }));
            news.extend(found.into_iter().map(|found| (end, Inner::Composite { who: track.who, found })));
        }
        reported.last = reported.last.max(first + until);
    }

    /// The newest frames on which every hand rests, and since when each does.
    fn rests(&self, found: &Analysis) -> Option<(Range<usize>, BTreeMap<TrackId, usize>)> {
        let hands: Vec<&Track> = found.tracks.iter().filter(|track| track.who != TrackId::Both).collect();
        let ends = self.ends.as_ref()?;
        let mut resting: Vec<Range<usize>> = std::iter::once(0..found.frames).collect();
        for hand in &hands {
            let own = intervals(hand, ends);
            let common = |one: &Range<usize>| {
                own.iter().map(|other| one.start.max(other.start)..one.end.min(other.end)).collect::<Vec<_>>()
            };
            resting = resting.iter().flat_map(common).filter(|frames| !frames.is_empty()).collect();
        }
        for segment in found.track(TrackId::Both).map_or(&[][..], |track| &track.segments) {
            let apart = |rest: &Range<usize>| {
                let (before, after) =
                    (rest.start..rest.end.min(segment.frames.start), rest.start.max(segment.frames.end)..rest.end);
                [before, after]
            };
            resting = resting.iter().flat_map(apart).filter(|frames| !frames.is_empty()).collect();
        }
        let newest = resting.last()?.clone();
        let since = |hand: &&Track| {
            let own = intervals(hand, ends).into_iter().find(|frames| frames.contains(&newest.start))?;
            Some((hand.who, own.start))
        };
        let since = hands.iter().filter_map(since).collect();
        Some((newest, since))
    }

    /// Returns the frame before which a history is cut while the hands rest: shortly before the known end of the rest, or at its beginning. Frames with
    /// contacts at rest are kept for some time, because segments are named after the touched objects.
    fn cut_frame(&self, resting: &Range<usize>, found: &Analysis, history: &History) -> Option<usize> {
        let ends = self.ends.as_ref()?;
        let rests: BTreeMap<Side, Label> =
            found.tracks.iter().filter_map(|track| Some((track.who.side()?, ends.first))).collect();
        let frames = |secs: f64| (secs * found.rate_hz).round() as usize;
        let last = resting.end.saturating_sub(frames(BEFORE_END_SECS)).max(resting.start);
        let kept = resting.end.saturating_sub(frames(TOUCHED_SECS)).max(resting.start);
        let touched = rests.keys().filter_map(|side| history.first_touched(*side, kept..last)).min();
        let last = touched.unwrap_or(last);
        let latest = history.last_at_rest(&rests, resting.start..last + 1);
        let cut = latest.or_else(|| history.first_at_rest(&rests, last..resting.end))?;
        // The cost of a cut is that of the kept part.
        (cut >= frames(LEAST_SECS)).then_some(cut)
    }
}

impl ReportedFrames {
    /// Keeps the first parts of the segments of a track at a cut.
    fn keep(&mut self, track: &Track, at: usize) {
        let piece = |segments: &[Segment], which: usize| {
            let segment = segments.iter().find(|segment| segment.frames.contains(&at))?;
            let mut piece = self.whole(segment, which);
            if !segment.by.is_empty() {
                // The labels after the cut repeat.
                let known = segment.was.len();
                let is_before = |raw: &&Segment| raw.frames.start <= at && raw.frames.end > segment.frames.start;
                let before = track.segments.iter().filter(is_before).count();
                piece.was.truncate((piece.was.len() + before).saturating_sub(known));
            }
            Some(piece)
        };
        let pieces = piece(&track.segments, 0).zip(piece(&track.relabeled, 1));
        self.cut = pieces.map(|(raw, relabeled)| [raw, relabeled]);
    }

    /// Returns a segment with its dropped part.
    fn whole(&self, segment: &Segment, which: usize) -> Segment {
        let mut segment = segment.clone();
        if let Some(cut) = self.cut.as_ref().map(|cut| &cut[which]).filter(|_| segment.frames.start == 0) {
            segment.start_s = cut.start_s;
            if !cut.by.is_empty() {
                // Both parts contain the piece at the cut.
                segment.was = cut.was.iter().chain(segment.was.iter().skip(1)).cloned().collect();
                let new = segment.by.iter().filter(|rule| !cut.by.contains(rule));
                segment.by = cut.by.iter().chain(new).cloned().collect();
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

/// Returns the frames in which a hand rests: the tree returned the first primitive after the last one or a kind of it, and no rule before recognition changed
/// that.
fn intervals(hand: &Track, ends: &TaskEnds) -> Vec<Range<usize>> {
    let segments = &hand.segments;
    let is_kept = |frame: usize| {
        let piece = hand.relabeled.iter().find(|segment| segment.frames.contains(&frame));
        piece.is_some_and(|piece| piece.by.iter().all(|rule| ends.of_tasks.contains(rule)))
    };
    let rests = |at: usize| match at.checked_sub(1).and_then(|before| segments.get(before)) {
        None => true,
        Some(before) => ends.last_names.contains(&before.primitive) && is_kept(before.frames.end - 1),
    };
    let own = segments.iter().enumerate().filter(|(at, segment)| segment.primitive == ends.first_name && rests(*at));
    own.map(|(_, segment)| segment.frames.clone()).collect()
}

fn in_order(mut news: Vec<(usize, Inner)>) -> Vec<Inner> {
    news.sort_by_key(|(end, _)| *end);
    news.into_iter().map(|(_, inner)| inner).collect()
}

/// The first and last primitives of all tasks.
struct TaskEnds {
    first: Label,
    /// The name of the first primitive.
    first_name: String,
    /// The names of the last primitive, and of its kinds with which every task ends.
    last_names: Vec<String>,
    /// The relabeling rules within tasks, as their authors wrote them.
    of_tasks: Vec<String>,
}

impl TaskEnds {
    /// Returns the first and last primitives of all tasks; `None` if relabeling before recognition or a key depends on the first one.
    fn of(rules: &Rules) -> Option<Self> {
        let task = rules.tasks.first()?;
        // A hand that rests in a kind of the first primitive rests later.
        let (first, last) = (task.first.label, task.last.label);
        let same = rules.tasks.iter().all(|it| it.first.label == first && it.last.label == last);
        // A task with the key `Drop`, which is a kind of Release, does not end with a Drop.
        let ends_all = |label: &Label| rules.tasks.iter().all(|it| it.last.covers(*label));
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
            first_name: rules.label_name(first),
            last_names: task.last.labels().filter(ends_all).map(|label| rules.label_name(label)).collect(),
            of_tasks: of_tasks.into_iter().map(|rule| rule.text.clone()).collect(),
        })
    }
}
