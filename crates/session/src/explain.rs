//! Questions about an analysis: why a track has its label at a time, and why not another one.

use super::analysis::Analysis;
use super::error::Error;
use crate::{AnalysisInternals, ErrorInternals};
use std::fmt;
use teachtree_analysis::TrackId;
use teachtree_analysis::explain::{self, Step};
use teachtree_analysis::json::Meta;
use teachtree_base::error::{ErrorKind, InputError};
use teachtree_logs::read::first_stamp::in_recording;
use teachtree_report as report;

/// A question: the labels at which time, of which track, and which primitive was expected.
///
/// ```
/// use teachtree::{Question, Side, TrackId};
/// let question = Question::between(7.0, 10.0).track(TrackId::Hand(Side::Right)).why_not("Press");
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Question {
    time_s: (f64, f64),
    track: Option<TrackId>,
    why_not: Option<String>,
}

impl Question {
    /// Why each track has its label at a time, s.
    pub fn at(time_s: f64) -> Self {
        Self::between(time_s, time_s)
    }

    /// Why each track has its labels from one time to another, s.
    pub fn between(start_s: f64, end_s: f64) -> Self {
        Self { time_s: (start_s, end_s), track: None, why_not: None }
    }

    /// Asks about one track only.
    #[must_use]
    pub fn track(mut self, track: TrackId) -> Self {
        self.track = Some(track);
        self
    }

    /// Also asks why the label is not this primitive: the nearest path to it in the tree, and which conditions on it fail.
    #[must_use]
    pub fn why_not(mut self, primitive: impl Into<String>) -> Self {
        self.why_not = Some(primitive.into());
        self
    }
}

/// The answers to a [`Question`]. `Display` writes them as `teachtree explain` does.
#[derive(Clone, Debug)]
pub struct Explanations {
    explained: Vec<(TrackId, explain::Explanation)>,
    meta: Meta,
}

impl Explanations {
    pub(crate) fn new(analysis: &Analysis, question: &Question) -> Result<Self, Error> {
        let argument = |error| Error::new(error, ErrorKind::Argument);
        let zero_stamp_s = analysis.meta().zero_stamp_s;
        let (start_s, end_s) = question.time_s;
        let time_s = (in_recording(start_s, zero_stamp_s), in_recording(end_s, zero_stamp_s));
        if end_s < start_s {
            let message = format!("found an interval from {start_s} s to {end_s} s, expected the earlier time first");
            return Err(argument(InputError::new("--at", message)));
        }
        let analyzed = analysis.explained()?;
        let tracks: Vec<TrackId> = match question.track {
            Some(track) => vec![track],
            None => analyzed.analysis.tracks.iter().map(|track| track.who).collect(),
        };
        let mut explained = Vec::new();
        let mut unable: Option<InputError> = None;
        for who in tracks {
            let asked = explain::Question { who, time_s, why_not: question.why_not.clone() };
            match explain::explain(&analyzed, &asked) {
                Ok(more) => explained.extend(more.into_iter().map(|one| (who, one))),
                // A primitive of one tree need not be one of the other: it is unknown only when no tree has it.
                Err(error) if question.track.is_none() => unable = Some(error),
                Err(error) => return Err(argument(error)),
            }
        }
        match unable.filter(|_| explained.is_empty()) {
            Some(error) => Err(argument(error)),
            None => Ok(Self { explained, meta: analysis.meta().clone() }),
        }
    }

    /// One explanation for each run of frames on which a tree takes the same choices, by track and time.
    pub fn iter(&self) -> impl Iterator<Item = Explanation<'_>> {
        self.explained.iter().map(|(track, inner)| Explanation { track: *track, inner })
    }

    /// The explanations as JSON, schema `teachtree.explain/1` (docs/formats.md).
    pub fn json(&self) -> String {
        explain::json(&self.all(), &self.meta)
    }

    fn all(&self) -> Vec<explain::Explanation> {
        self.explained.iter().map(|(_, one)| one.clone()).collect()
    }
}

/// The choices that are taken, with all their conditions; `{:#}` also has those of the choices that are refused.
impl fmt::Display for Explanations {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&report::explanation(&self.all(), detail(f)))
    }
}

/// Why a track has its label over some frames.
#[derive(Clone, Copy, Debug)]
pub struct Explanation<'a> {
    track: TrackId,
    inner: &'a explain::Explanation,
}

impl<'a> Explanation<'a> {
    /// The track.
    pub fn track(self) -> TrackId {
        self.track
    }

    /// The first frame that is explained.
    pub fn frame(self) -> usize {
        self.inner.frame
    }

    /// When that frame begins, s.
    pub fn start_s(self) -> f64 {
        self.inner.time_s
    }

    /// Until when the tree takes the same choices, s; not beyond what was asked.
    pub fn end_s(self) -> f64 {
        self.inner.until_s
    }

    /// The primitive that the tree returns, before settling and relabeling; `separate` where the tree over both hands returns none.
    pub fn primitive(self) -> &'a str {
        &self.inner.leaf
    }

    /// The object of the segment that this frame came to be in.
    pub fn object(self) -> Option<&'a str> {
        self.inner.object.as_deref()
    }

    /// The body that the object is in or against.
    pub fn partner(self) -> Option<&'a str> {
        self.inner.partner.as_deref()
    }

    /// The choices of the tree that were evaluated, from the root to the leaf.
    pub fn choices(self) -> impl Iterator<Item = Choice<'a>> {
        self.inner.path.iter().map(|step| Choice { step })
    }
}

impl fmt::Display for Explanation<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&report::explanation(std::slice::from_ref(self.inner), detail(f)))
    }
}

/// What is written by `{}`, and by `{:#}`.
fn detail(f: &fmt::Formatter<'_>) -> report::Detail {
    if f.alternate() { report::Detail::Full } else { report::Detail::Short }
}

/// A choice of a tree that was evaluated.
#[derive(Clone, Copy, Debug)]
pub struct Choice<'a> {
    step: &'a Step,
}

impl<'a> Choice<'a> {
    /// The condition as its author wrote it.
    pub fn condition(self) -> &'a str {
        &self.step.choice
    }

    /// Where it stands: `rules/contact.rules:120:5`.
    pub fn place(self) -> &'a str {
        &self.step.place
    }

    /// Whether the condition holds, so that the tree takes this choice.
    pub fn is_taken(self) -> bool {
        self.step.taken
    }
}
