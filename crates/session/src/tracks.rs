//! Tracks of an analysis, with their segments, tasks and composite tasks.

use std::fmt;
use std::ops::Range;
use teachtree_analysis::{CompositeSpan, Confidence, Segment as Stretch, TaskSpan, Track as Lane, TrackId};
use teachtree_report as report;

/// The segments and tasks of one hand, or the coordination of both.
#[derive(Clone, Copy, Debug)]
pub struct Track<'a> {
    pub(crate) inner: &'a Lane,
}

impl<'a> Track<'a> {
    /// Whose it is.
    pub fn who(self) -> TrackId {
        self.inner.who
    }

    /// The tasks, in order of time; none for both hands, whose coordination is part of each hand's tasks.
    pub fn tasks(self) -> impl Iterator<Item = Task<'a>> {
        let who = self.who();
        self.inner.tasks.iter().map(move |span| Task { who, span })
    }

    /// The tasks that are made of tasks, in order of time.
    pub fn composites(self) -> impl Iterator<Item = Composite<'a>> {
        let who = self.who();
        self.inner.composites.iter().map(move |span| Composite { who, span })
    }

    /// The segments after relabeling, in order of time. Those of a hand leave out no frame, except in gaps of the log.
    pub fn segments(self) -> impl Iterator<Item = Segment<'a>> {
        let who = self.who();
        self.inner.relabeled.iter().map(move |inner| Segment { who, inner })
    }

    /// The segments as the trees returned them, settled, before relabeling.
    pub fn raw_segments(self) -> impl Iterator<Item = Segment<'a>> {
        let who = self.who();
        self.inner.segments.iter().map(move |inner| Segment { who, inner })
    }
}

/// A task that is made of tasks: some tasks of a hand, one after the other.
#[derive(Clone, Copy, Debug)]
pub struct Composite<'a> {
    who: TrackId,
    span: &'a CompositeSpan,
}

impl<'a> Composite<'a> {
    pub(crate) const fn of(who: TrackId, span: &'a CompositeSpan) -> Self {
        Self { who, span }
    }

    /// Its name in the rules.
    pub fn name(self) -> &'a str {
        &self.span.task
    }

    /// Whether the rules declare it as a failure (`is failure`). Every other one is a success.
    pub fn is_failure(self) -> bool {
        self.span.failure
    }

    /// Whose it is.
    pub fn track(self) -> TrackId {
        self.who
    }

    /// The names of its tasks, in order of time; `unknown` ones between them are among them.
    pub fn parts(self) -> &'a [String] {
        &self.span.parts
    }

    /// Its tasks, by their positions in [`Track::tasks`].
    pub fn tasks(self) -> Range<usize> {
        self.span.tasks.clone()
    }

    /// When it starts, s.
    pub fn start_s(self) -> f64 {
        self.span.start_s
    }

    /// When it ends, s.
    pub fn end_s(self) -> f64 {
        self.span.end_s
    }
}

/// A named task: some segments of a hand, one after the other.
///
/// `Display` writes one line: `right pick_and_place right_cube, 0.310 – 4.820 s`.
#[derive(Clone, Copy, Debug)]
pub struct Task<'a> {
    who: TrackId,
    span: &'a TaskSpan,
}

impl<'a> Task<'a> {
    pub(crate) const fn of(who: TrackId, span: &'a TaskSpan) -> Self {
        Self { who, span }
    }

    /// The name of the task in the rules, or `unknown` where something was handled in a way that no task of the rules describes.
    pub fn name(self) -> &'a str {
        &self.span.task
    }

    /// Whether the rules declare it as a failure (`is failure`). Every other named task is a success; `unknown` is neither.
    pub fn is_failure(self) -> bool {
        self.span.failure
    }

    /// Whose it is.
    pub fn track(self) -> TrackId {
        self.who
    }

    /// The frames `[start, end)`, counted from the first frame of the log.
    pub fn frames(self) -> Range<usize> {
        self.span.frames.clone()
    }

    /// When it starts, s.
    pub fn start_s(self) -> f64 {
        self.span.start_s
    }

    /// When it ends, s.
    pub fn end_s(self) -> f64 {
        self.span.end_s
    }

    /// Which attempt at its object and target it belongs to, from 1: one begins when the hand regains the object after a failed task.
    pub fn attempt(self) -> usize {
        self.span.attempt
    }

    /// The object that it is about: that of its key segments, `None` where the log has no object, or does not say which.
    pub fn object(self) -> Option<&'a str> {
        self.span.subject.object.as_deref()
    }

    /// The body that the object is in or against in its key segments.
    pub fn partner(self) -> Option<&'a str> {
        self.span.subject.partner.as_deref()
    }

    /// The rows of the log `[start, end)`, counted from 0: those of the file, also where rows were left out or frames were resampled.
    pub fn rows(self) -> Range<usize> {
        self.span.rows.clone()
    }

    /// The other tasks of the rules that match here too, by priority.
    pub fn also(self) -> &'a [String] {
        &self.span.secondary
    }

    /// Whether its beginning is cut off, by the start of the log or by a gap.
    pub fn is_cut_at_start(self) -> bool {
        self.span.open_start
    }

    /// Whether its end is cut off, by the end of the log or by a gap.
    pub fn is_cut_at_end(self) -> bool {
        self.span.open_end
    }

    /// The share of the variations with a task of this name, if [`Analysis::with_confidence`](crate::Analysis::with_confidence) was called. It is not a probability that the task is right.
    pub fn stability(self) -> Option<f64> {
        self.span.stability
    }

    /// Its segments after relabeling.
    pub fn segments(self) -> impl Iterator<Item = Segment<'a>> {
        let who = self.who;
        self.span.segments.iter().map(move |inner| Segment { who, inner })
    }
}

impl fmt::Display for Task<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let TaskSpan { task, subject, start_s, end_s, .. } = self.span;
        write!(f, "{} {task}{}, {start_s:.3} – {end_s:.3} s", self.who, subject.suffix())?;
        match report::remarks(self.span).as_str() {
            "" => Ok(()),
            remarks => write!(f, "; {remarks}"),
        }
    }
}

/// A stretch of time with one primitive.
///
/// `Display` writes one line: `right Grasp right_cube, 1.250 – 1.500 s`, with the partner in parentheses: `right Insert peg (holder), …`.
#[derive(Clone, Copy, Debug)]
pub struct Segment<'a> {
    who: TrackId,
    inner: &'a Stretch,
}

impl<'a> Segment<'a> {
    pub(crate) const fn of(who: TrackId, inner: &'a Stretch) -> Self {
        Self { who, inner }
    }

    /// The primitive: `Grasp`, `MainGrasp(left)`.
    pub fn primitive(self) -> &'a str {
        &self.inner.primitive
    }

    /// Whose it is.
    pub fn track(self) -> TrackId {
        self.who
    }

    /// The frames `[start, end)`, counted from the first frame of the log.
    pub fn frames(self) -> Range<usize> {
        self.inner.frames.clone()
    }

    /// When it starts, s.
    pub fn start_s(self) -> f64 {
        self.inner.start_s
    }

    /// When it ends, s: when the next one starts.
    pub fn end_s(self) -> f64 {
        self.inner.end_s
    }

    /// The object that it is about: the one that the hand touches on most of its frames. Where the hand touches none, the one that it touches
    /// next, else the one nearest to its fingertips at the end. `None` where the log has no object, or does not say which.
    pub fn object(self) -> Option<&'a str> {
        self.inner.subject.object.as_deref()
    }

    /// The body that the object is in or against for most of the time: the one whose socket it is in, the object of the other hand, a wall
    /// that it touches, an object that carries it.
    pub fn partner(self) -> Option<&'a str> {
        self.inner.subject.partner.as_deref()
    }

    /// The rows of the log `[start, end)`, counted from 0: those of the file, also where rows were left out or frames were resampled.
    pub fn rows(self) -> Range<usize> {
        self.inner.rows.clone()
    }

    /// Returns the confidence of its start, if [`Analysis::with_confidence`](crate::Analysis::with_confidence) was called.
    pub fn confidence(self) -> Option<Confidence> {
        self.inner.confidence
    }

    /// The primitives of this time before relabeling, in order; empty where no rule changed anything.
    pub fn was(self) -> &'a [String] {
        &self.inner.was
    }

    /// The relabeling rules that changed it, as their authors wrote them, in the order in which they did.
    pub fn changed_by(self) -> &'a [String] {
        &self.inner.by
    }
}

impl fmt::Display for Segment<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Stretch { primitive, subject, start_s, end_s, .. } = self.inner;
        write!(f, "{} {primitive}{}, {start_s:.3} – {end_s:.3} s", self.who, subject.suffix())
    }
}
