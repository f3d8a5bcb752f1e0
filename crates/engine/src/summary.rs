//! Numbers over time, as the engine runs them: one state for blocks ([`State::block`]) and for single frames ([`State::value`] and [`State::advance`]).
//!
//! The last `n` samples are put together in two parts. Frames are counted from the beginning of the memory and cut into pieces of `n`: what is left of the
//! piece before, put together from its end, and what has come of this piece, from its beginning. So a frame costs the same however long the window is,
//! nothing is ever taken away from a sum, and the memory is one ring of `n` numbers: the samples of this piece overwrite what is not needed any more.

use teachtree_language::ops::{Samples, Summary};

/// A summary of samples; a window is in samples, at least 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aggregation {
    /// The summary.
    pub summary: Summary,
    /// The rate of the log, Hz.
    pub rate: f64,
}

/// The state between frames.
#[derive(Clone, Debug)]
pub enum State {
    /// A summary of the last samples.
    Last {
        /// In front of `at` the samples of this piece; from there on the piece before, each number put together with all that follow in it. (Of
        /// [`Summary::Earliest`] the samples themselves.)
        ring: Box<[f64]>,
        /// Number of samples of this piece, less than the size of the ring.
        at: usize,
        /// Whether there is a piece before.
        full: bool,
        /// The samples of this piece, combined.
        running: f64,
    },
    /// A summary of the samples since a condition began.
    Since {
        /// These samples, combined.
        running: f64,
        /// Number of samples; 0 until the condition has begun.
        count: u64,
        /// Whether it held on the frame before.
        held: bool,
    },
}

/// A frame: the number, whether the condition of `since` holds, and whether the state is reset.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    /// The number.
    pub now: f64,
    /// Whether the condition holds.
    pub holds: bool,
    /// Whether the memory begins here.
    pub anew: bool,
}

/// Combines two numbers; the frame of the second one is farther from the start of the first one.
#[inline(always)]
fn joined(summary: Summary, one: f64, other: f64) -> f64 {
    match summary {
        Summary::Mean | Summary::Integral => one + other,
        Summary::Min => one.min(other),
        Summary::Max => one.max(other),
        Summary::Earliest => one,
    }
}

impl Aggregation {
    /// Returns the result for `count` combined samples.
    #[inline(always)]
    fn result(self, joined: f64, count: u64) -> f64 {
        match self.summary {
            Summary::Mean => joined / counted(count),
            Summary::Integral => joined / self.rate,
            Summary::Min | Summary::Max | Summary::Earliest => joined,
        }
    }
}

/// Converts a count to a number.
#[inline(always)]
fn counted(count: u64) -> f64 {
    count as f64
}

impl State {
    /// The state before the first frame.
    pub fn new<C>(samples: &Samples<u32, C>) -> Self {
        match samples {
            Samples::Last(frames) => {
                Self::Last { ring: vec![0.0; (*frames).max(1) as usize].into(), at: 0, full: false, running: 0.0 }
            }
            Samples::Since(_) => Self::Since { running: 0.0, count: 0, held: false },
        }
    }

    /// Forgets everything.
    pub fn restart(&mut self) {
        match self {
            Self::Last { at, full, .. } => (*at, *full) = (0, false),
            Self::Since { count, held, .. } => (*count, *held) = (0, false),
        }
    }

    /// Returns the result for the samples up to this frame.
    #[inline(always)]
    pub fn value(&self, aggregation: Aggregation, frame: Frame) -> f64 {
        let Aggregation { summary, .. } = aggregation;
        match self {
            Self::Last { ring, at, full, running } => {
                let (at, full) = if frame.anew { (0, false) } else { (*at, *full) };
                let piece = if at == 0 { frame.now } else { joined(summary, *running, frame.now) };
                match ring.get(at + 1).filter(|_| full) {
                    Some(before) => aggregation.result(joined(summary, *before, piece), ring.len() as u64),
                    None => aggregation.result(piece, at as u64 + 1),
                }
            }
            Self::Since { running, count, .. } => match self.since(frame) {
                // The condition has not begun.
                None if summary == Summary::Integral => 0.0,
                None => frame.now,
                Some(true) => aggregation.result(frame.now, 1),
                Some(false) => aggregation.result(joined(summary, *running, frame.now), count + 1),
            },
        }
    }

    /// Whether the condition of `since` begins on this frame; `None` when it has not begun so far.
    #[inline(always)]
    const fn since(&self, frame: Frame) -> Option<bool> {
        let Self::Since { count, held, .. } = self else { return None };
        if frame.holds && (frame.anew || !*held) {
            Some(true)
        } else if *count == 0 || frame.anew {
            None
        } else {
            Some(false)
        }
    }

    /// Advances to the next frame.
    #[inline(always)]
    pub fn advance(&mut self, aggregation: Aggregation, frame: Frame) {
        let summary = aggregation.summary;
        let begins = self.since(frame);
        match self {
            Self::Last { ring, at, full, running } => {
                if frame.anew {
                    (*at, *full) = (0, false);
                }
                *running = if *at == 0 { frame.now } else { joined(summary, *running, frame.now) };
                if let Some(place) = ring.get_mut(*at) {
                    *place = frame.now;
                }
                *at += 1;
                if *at == ring.len() {
                    join_from_the_end(summary, ring);
                    (*at, *full) = (0, true);
                }
            }
            Self::Since { running, count, held } => {
                (*running, *count) = match begins {
                    None => (frame.now, 0),
                    Some(true) => (frame.now, 1),
                    Some(false) => (joined(summary, *running, frame.now), *count + 1),
                };
                *held = frame.holds;
            }
        }
    }

    /// The results of a block, whose numbers stand in `out`: `at` says of a frame of it whether the condition of `since` holds, and whether the memory
    /// begins there.
    #[inline(always)]
    pub fn block(&mut self, aggregation: Aggregation, out: &mut [f64], at: impl Fn(usize) -> (bool, bool)) {
        // Which summary it is, is decided once.
        match aggregation.summary {
            Summary::Mean => self.each(Aggregation { summary: Summary::Mean, ..aggregation }, out, at),
            Summary::Min => self.each(Aggregation { summary: Summary::Min, ..aggregation }, out, at),
            Summary::Max => self.each(Aggregation { summary: Summary::Max, ..aggregation }, out, at),
            Summary::Integral => self.each(Aggregation { summary: Summary::Integral, ..aggregation }, out, at),
            Summary::Earliest => self.each(Aggregation { summary: Summary::Earliest, ..aggregation }, out, at),
        }
    }

    #[inline(always)]
    fn each(&mut self, aggregation: Aggregation, out: &mut [f64], at: impl Fn(usize) -> (bool, bool)) {
        for (place, out) in out.iter_mut().enumerate() {
            let (holds, anew) = at(place);
            let frame = Frame { now: *out, holds, anew };
            *out = self.value(aggregation, frame);
            self.advance(aggregation, frame);
        }
    }
}

/// Puts each number of a piece together with all that follow.
fn join_from_the_end(summary: Summary, piece: &mut [f64]) {
    // `Earliest` returns the sample itself.
    if summary == Summary::Earliest {
        return;
    }
    let Some((last, rest)) = piece.split_last_mut() else { return };
    let mut all = *last;
    for number in rest.iter_mut().rev() {
        all = joined(summary, all, *number);
        *number = all;
    }
}
