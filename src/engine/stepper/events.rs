//! What is made of conditions, on the frames on which something happens.
//!
//! Between two such frames everything stands still, so windows and delays keep the frame on which something began rather than count frames.

use crate::engine::plan::{BitId, Condition, Plan, Step};
use crate::engine::ranks::Ranks;
use std::collections::VecDeque;

/// Frames that a delay line has room for; one that holds more changes than this grows.
const ROOM: usize = 4096;

/// The conditions of one rank, in the order of evaluation.
#[derive(Clone, Debug)]
pub struct Events(Vec<(BitId, Memory)>);

/// What is kept from one event to the next.
#[derive(Clone, Debug)]
enum Memory {
    None,
    /// What the argument was.
    Was(bool),
    /// `for`: when it began to hold.
    Since(Option<u64>),
    /// `within last`: whether it held, and the last frame on which it did before that.
    Last {
        held: bool,
        frame: Option<u64>,
    },
    /// The frames on which what comes out changes, and what went in last.
    Changes {
        frames: VecDeque<u64>,
        last: bool,
    },
}

impl Events {
    /// The conditions of a rank that are made of conditions.
    pub fn of(plan: &Plan, ranks: &Ranks, rank: u32) -> Self {
        let steps = plan.steps.iter().filter(|step| ranks.of_step(**step) == rank);
        let events = steps.filter_map(|step| match step {
            Step::Condition(id) => Some((*id, Memory::of(&plan.conditions[id.index()].0)?)),
            Step::Number(_) => None,
        });
        Self(events.collect())
    }

    /// Forgets everything.
    pub fn restart(&mut self, bits: &mut [bool]) {
        for (id, memory) in &mut self.0 {
            bits[id.index()] = false;
            match memory {
                Memory::None => {}
                // What begins true can not rise.
                Memory::Was(was) => *was = true,
                Memory::Since(since) => *since = None,
                Memory::Last { held, frame } => (*held, *frame) = (false, None),
                Memory::Changes { frames, last } => {
                    frames.clear();
                    *last = false;
                }
            }
        }
    }

    /// Works out frame `now` and returns the frame on which something changes by itself.
    pub fn run(&mut self, plan: &Plan, bits: &mut [bool], now: u64, inside: bool) -> u64 {
        let mut due = u64::MAX;
        for (id, memory) in &mut self.0 {
            let is = |id: &BitId| bits[id.index()];
            let anew = |restart: &Option<BitId>| restart.as_ref().is_some_and(is);
            let holds = match &plan.conditions[id.index()].0 {
                Condition::Input(_) | Condition::Changes(_) | Condition::Compare(..) | Condition::Length(..) => {
                    continue;
                }
                Condition::Constant(value) => *value,
                Condition::Inside => inside,
                Condition::First => {
                    if now == 0 {
                        due = 1;
                    }
                    now == 0
                }
                Condition::Not(a) => !is(a),
                Condition::And(all) => all.iter().all(is),
                Condition::Or(any) => any.iter().any(is),
                Condition::AtLeast(all, wanted) => all.iter().filter(|id| is(id)).count() >= *wanted as usize,
                Condition::FlipFlop { set, keep } => is(set) || is(keep) && bits[id.index()],
                Condition::For(a, frames, restart) => {
                    let Memory::Since(since) = memory else { continue };
                    if anew(restart) || !is(a) {
                        *since = None;
                    }
                    if is(a) {
                        // It begins on every frame that restarts, also where nothing else tells one from the next.
                        if anew(restart) {
                            due = due.min(now + 1);
                        }
                        let full = *since.get_or_insert(now) + u64::from(*frames) - 1;
                        if now < full {
                            due = due.min(full);
                        }
                        now >= full
                    } else {
                        false
                    }
                }
                Condition::WithinLast(a, frames, restart) => {
                    let Memory::Last { held, frame } = memory else { continue };
                    if *held && now > 0 {
                        *frame = Some(now - 1);
                    }
                    if anew(restart) {
                        *frame = None;
                    }
                    *held = is(a);
                    let until = frame.map_or(0, |frame| frame + u64::from(*frames));
                    if !*held && now < until {
                        due = due.min(until);
                    }
                    *held || now < until
                }
                Condition::Rises(a, restart) => {
                    let Memory::Was(was) = memory else { continue };
                    let rises = is(a) && !*was && !anew(restart);
                    *was = is(a);
                    if rises {
                        due = due.min(now + 1);
                    }
                    rises
                }
                Condition::Delay(a, by) => {
                    let Memory::Changes { frames, last } = memory else { continue };
                    if is(a) != *last {
                        frames.push_back(now + u64::from(*by));
                        *last = is(a);
                    }
                    let mut out = bits[id.index()];
                    while frames.front().is_some_and(|frame| *frame <= now) {
                        frames.pop_front();
                        out = !out;
                    }
                    due = due.min(frames.front().copied().unwrap_or(u64::MAX));
                    out
                }
            };
            bits[id.index()] = holds;
        }
        due
    }
}

impl Memory {
    /// The memory of a condition that is made of conditions, before the first frame.
    fn of(condition: &Condition) -> Option<Self> {
        Some(match condition {
            Condition::Input(_) | Condition::Changes(_) | Condition::Compare(..) | Condition::Length(..) => {
                return None;
            }
            Condition::Rises(..) => Self::Was(true),
            Condition::For(..) => Self::Since(None),
            Condition::WithinLast(..) => Self::Last { held: false, frame: None },
            Condition::Delay(_, frames) => {
                Self::Changes { frames: VecDeque::with_capacity((*frames as usize + 1).min(ROOM)), last: false }
            }
            _ => Self::None,
        })
    }
}
