//! Operators over time on conditions, as the engine runs them: one state for blocks of words ([`State::block`]) and for single frames ([`State::frame`]),
//! with memory and work per frame that do not grow with the window.

use super::compiled::bits::{Runs, frames_of, get, ones, shifted, words};
use teachtree_language::ops::TemporalOperator;

/// An operator on the past of a condition; durations are in samples, at least 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum PastOperator {
    /// True on each of the last frames.
    For(u32),
    /// True on at least one of the last frames.
    WithinLast(u32),
    /// Whether the condition began on at least `times` of the last frames; `times` is at least 1.
    AtLeast {
        /// The required number of beginnings.
        times: u32,
        /// The frames.
        within: u32,
    },
    /// True now, false on the frame before; false on a first frame.
    Rises,
}

/// A temporal operator, reduced to an operator on the past.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReducedOperator {
    /// The operator on the past.
    pub operator: PastOperator,
    /// Whether it is the negation of the condition.
    pub negated: bool,
    /// Returns the number of frames by which the result is delayed; the condition does not hold after the end of a stretch.
    pub ahead: Option<u32>,
}

impl ReducedOperator {
    /// Takes an operator apart whose constants are in samples; `None` for one that a graph writes out by others.
    pub fn of(temporal: TemporalOperator<u32>) -> Option<Self> {
        let plain = |operator| Self { operator, negated: false, ahead: None };
        Some(match temporal {
            TemporalOperator::For(frames) => plain(PastOperator::For(frames)),
            TemporalOperator::WithinLast(frames) => plain(PastOperator::WithinLast(frames)),
            // `within next` n frames equals `within last` n frames, n - 1 frames later.
            TemporalOperator::WithinNext(frames) => {
                Self { operator: PastOperator::WithinLast(frames), negated: false, ahead: Some(frames - 1) }
            }
            TemporalOperator::AtLeast { times, within } => plain(PastOperator::AtLeast { times, within }),
            TemporalOperator::Rises => plain(PastOperator::Rises),
            TemporalOperator::Falls => Self { operator: PastOperator::Rises, negated: true, ahead: None },
            TemporalOperator::Bridging(_) | TemporalOperator::Lasting(_) => return None,
        })
    }
}

impl PastOperator {
    /// Bytes of its state.
    pub const fn bytes(self) -> usize {
        match self {
            Self::For(_) | Self::WithinLast(_) => 8,
            Self::AtLeast { times, .. } => 8 * times as usize + 8,
            Self::Rises => 1,
        }
    }
}

/// The state between frames. Frames are counted from the beginning of a stretch.
#[derive(Clone, Debug)]
pub enum State {
    /// `for`: the first frame of those on which it has held without a break.
    For(Option<u64>),
    /// `within last`.
    WithinLast {
        /// Whether it held on the last evaluated frame, and therefore on all skipped frames since.
        held: bool,
        /// One past the last frame for which one on which it held is near enough.
        until: u64,
    },
    /// `at least times within last`.
    AtLeast {
        /// Whether it held on the last evaluated frame.
        held: bool,
        /// For each of the last `times` beginnings, one past the last frame for which it counts; 0 for none.
        ends: Box<[u64]>,
        /// The position of the oldest.
        oldest: usize,
    },
    /// `rises`: whether it held on the frame before.
    Rises(bool),
}

impl State {
    /// The state before the first frame.
    pub fn new(operator: PastOperator) -> Self {
        match operator {
            PastOperator::For(_) => Self::For(None),
            PastOperator::WithinLast(_) => Self::WithinLast { held: false, until: 0 },
            PastOperator::AtLeast { times, .. } => {
                Self::AtLeast { held: false, ends: vec![0; times as usize].into(), oldest: 0 }
            }
            // A condition that is true at the beginning does not rise.
            PastOperator::Rises => Self::Rises(true),
        }
    }

    /// Forgets everything.
    pub fn restart(&mut self) {
        match self {
            Self::For(since) => *since = None,
            Self::WithinLast { held, until } => (*held, *until) = (false, 0),
            Self::AtLeast { held, ends, .. } => {
                *held = false;
                ends.fill(0);
            }
            Self::Rises(was) => *was = true,
        }
    }

    /// The result on frame `now`, and the frame on which it may change though the condition does not (`u64::MAX` for never). Frames before that one on
    /// which neither the condition nor `anew` changes may be skipped. `anew` says that what came before is forgotten.
    pub fn frame(&mut self, operator: PastOperator, now: u64, holds: bool, anew: bool) -> (bool, u64) {
        // Where the target changes on one frame after the other, each of them begins anew, and nothing else separates one from the next.
        let again = if anew && holds { now + 1 } else { u64::MAX };
        match (self, operator) {
            (Self::For(since), PastOperator::For(frames)) => {
                if anew || !holds {
                    *since = None;
                }
                if !holds {
                    return (false, u64::MAX);
                }
                let full = *since.get_or_insert(now) + u64::from(frames) - 1;
                (now >= full, if now < full { full.min(again) } else { again })
            }
            (Self::WithinLast { held, until }, PastOperator::WithinLast(frames)) => {
                if *held && now > 0 {
                    *until = now - 1 + u64::from(frames);
                }
                if anew {
                    *until = 0;
                }
                *held = holds;
                let near = now < *until;
                (holds || near, if near && !holds { *until } else { u64::MAX })
            }
            (Self::AtLeast { held, ends, oldest }, PastOperator::AtLeast { within, .. }) => {
                if anew {
                    ends.fill(0);
                }
                if holds && (anew || !*held) {
                    begin(ends, oldest, now + u64::from(within));
                }
                *held = holds;
                let until = ends[*oldest];
                (now < until, if now < until { until.min(again) } else { again })
            }
            (Self::Rises(was), PastOperator::Rises) => {
                let rises = holds && !*was && !anew;
                *was = holds;
                (rises, if rises { now + 1 } else { u64::MAX })
            }
            (state, operator) => {
                debug_assert!(false, "{state:?} is not the state of {operator:?}");
                (false, u64::MAX)
            }
        }
    }

    /// The results of `len` frames from frame `now` on, 64 a word; all frames before were seen. Bits beyond `len` are garbage.
    #[inline]
    pub fn block(
        &mut self,
        operator: PastOperator,
        now: u64,
        condition: &[u64],
        restart: Option<&[u64]>,
        len: usize,
        out: &mut [u64],
    ) {
        let words = (0..words(len)).map(|word| {
            let inside = frames_of(len, word);
            let restarts = restart.map_or(0, |bits| bits[word]) & inside;
            Word { first: now + 64 * word as u64, inside, restarts, held: condition[word] & inside }
        });
        match (self, operator) {
            (Self::For(since), PastOperator::For(frames)) => {
                words.zip(out).for_each(|(word, out)| *out = word.throughout(since, frames.into()));
            }
            (Self::WithinLast { until, .. }, PastOperator::WithinLast(frames)) => {
                words.zip(out).for_each(|(word, out)| *out = word.at_least_once(until, frames.into()));
            }
            (Self::AtLeast { held, ends, oldest }, PastOperator::AtLeast { within, .. }) => {
                words.zip(out).for_each(|(word, out)| *out = word.repeatedly(held, ends, oldest, within.into()));
            }
            (Self::Rises(was), PastOperator::Rises) => {
                shifted(condition, *was, out);
                for (word, (out, now)) in out.iter_mut().zip(condition).enumerate() {
                    *out = now & !*out & !restart.map_or(0, |restart| restart[word]);
                }
                *was = get(condition, len - 1);
            }
            (state, operator) => debug_assert!(false, "{state:?} is not the state of {operator:?}"),
        }
    }
}

/// Notes that a condition began: it counts until `end`.
fn begin(ends: &mut [u64], oldest: &mut usize, end: u64) {
    ends[*oldest] = end;
    *oldest = if *oldest + 1 == ends.len() { 0 } else { *oldest + 1 };
}

/// 64 frames.
struct Word {
    first: u64,
    /// The bits that are frames.
    inside: u64,
    restarts: u64,
    held: u64,
}

impl Word {
    /// The runs of frames on which the condition is the same, each with its first frame.
    fn runs(&self) -> Runs {
        Runs::of(self.held, self.restarts, self.inside.count_ones())
    }

    /// True on each of the last `limit` frames.
    #[inline]
    fn throughout(&self, since: &mut Option<u64>, limit: u64) -> u64 {
        if self.restarts == 0 && self.held == 0 {
            *since = None;
            return 0;
        }
        if self.restarts == 0 && self.held == u64::MAX && since.is_some_and(|since| self.first - since >= limit) {
            return u64::MAX;
        }
        let mut result = 0;
        for run in self.runs() {
            if run.restarts || !run.on {
                *since = None;
            }
            if run.on {
                let first = self.first + run.start;
                // The frame of the run on which the window is full.
                let full = (*since.get_or_insert(first) + limit - 1).saturating_sub(first);
                if full < run.len {
                    result |= ones(run.start + full, run.len - full);
                }
            }
        }
        result
    }

    /// True on at least one of the last `limit` frames.
    #[inline]
    fn at_least_once(&self, until: &mut u64, limit: u64) -> u64 {
        if self.restarts == 0 && self.held == 0 && *until <= self.first {
            return 0;
        }
        if self.restarts == 0 && self.held == u64::MAX {
            *until = self.first + 63 + limit;
            return u64::MAX;
        }
        let mut result = 0;
        for run in self.runs() {
            if run.restarts {
                *until = 0;
            }
            let first = self.first + run.start;
            // For how many frames of the run the last true one is near enough.
            let near = if run.on { run.len } else { until.saturating_sub(first).min(run.len) };
            result |= ones(run.start, near);
            if run.on {
                *until = first + run.len - 1 + limit;
            }
        }
        result
    }

    /// Begun as many times as there are `ends` within the last `limit` frames.
    #[inline]
    fn repeatedly(&self, held: &mut bool, ends: &mut [u64], oldest: &mut usize, limit: u64) -> u64 {
        let begun = self.held & (!(self.held << 1 | u64::from(*held)) | self.restarts);
        let mut events = begun | self.restarts;
        let (mut result, mut at) = (0, 0);
        let len = u64::from(self.inside.count_ones());
        loop {
            let event = u64::from(events.trailing_zeros()).min(len);
            // Between two events only time passes.
            let near = ends[*oldest].saturating_sub(self.first + at).min(event - at);
            result |= ones(at, near);
            if event == len {
                break;
            }
            if self.restarts >> event & 1 != 0 {
                ends.fill(0);
            }
            if begun >> event & 1 != 0 {
                begin(ends, oldest, self.first + event + limit);
            }
            events &= events - 1;
            at = event;
        }
        if len > 0 {
            *held = self.held >> (len - 1) & 1 != 0;
        }
        result
    }
}
