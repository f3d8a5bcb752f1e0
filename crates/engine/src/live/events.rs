//! Steps on conditions, evaluated on the frames with an event.
//!
//! Between two such frames everything stands still, so windows and delays keep the frame on which something began rather than count frames.

use super::ranks::Ranks;
use crate::compiled::plan::{BitId, Condition, Plan, Step};
use crate::semantics::mismatched;
use crate::temporal_state::State;
use std::collections::VecDeque;

/// Frames that a delay line has room for; one that holds more changes than this grows.
const ROOM: usize = 4096;

/// The conditions of one rank, in the order of evaluation.
#[derive(Clone, Debug)]
pub struct Events(Vec<(BitId, Memory)>);

/// The state between events.
#[derive(Clone, Debug)]
enum Memory {
    None,
    Temporal(State),
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
                Memory::Temporal(state) => state.restart(),
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
                Condition::Input(_)
                | Condition::Changes(_)
                | Condition::Compare(..)
                | Condition::NormSquaredCmp(..) => {
                    continue;
                }
                Condition::Constant(value) => *value,
                // Known leaves are not evaluated live.
                Condition::Leaf(_) => false,
                Condition::InLog => inside,
                Condition::FirstFrame => {
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
                Condition::Temporal(operator, a, restart) => {
                    let Memory::Temporal(state) = memory else {
                        mismatched();
                        continue;
                    };
                    let (holds, changes) = state.frame(*operator, now, is(a), anew(restart));
                    due = due.min(changes);
                    holds
                }
                Condition::Delay(a, by) => {
                    let Memory::Changes { frames, last } = memory else {
                        mismatched();
                        continue;
                    };
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
            Condition::Input(_) | Condition::Changes(_) | Condition::Compare(..) | Condition::NormSquaredCmp(..) => {
                return None;
            }
            Condition::Temporal(operator, ..) => Self::Temporal(State::new(*operator)),
            Condition::Delay(_, frames) => {
                Self::Changes { frames: VecDeque::with_capacity((*frames as usize + 1).min(ROOM)), last: false }
            }
            _ => Self::None,
        })
    }
}
