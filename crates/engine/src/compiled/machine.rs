//! The sequential half of the evaluator: latches that read `from`, and the trees. It is run on the frames on which one of its
//! conditions changes, and continues frame by frame until its state does not change; the state then stays constant, and the machine rests.

use super::bits::get;
use super::columns::Columns;
use super::plan::{Plan, StatefulId, StatefulNode};
use crate::runs::Run;
use crate::semantics::mismatched;
use crate::temporal_state::State;
use teachtree_language::graph::{Decision, Leaf, Target};
use teachtree_language::rules::Label;

/// The leaf that a tree gave on the frame before.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum LastLeaf {
    /// No state yet.
    None,
    /// `separate`, from a tree over both hands.
    Separate,
    /// A primitive.
    Label(Label),
}

/// The state of a stateful node between frames.
#[derive(Clone, Debug)]
enum NodeMemory {
    Nothing,
    /// A latch.
    Bit(bool),
    /// An operator over time.
    Temporal(State),
}

impl NodeMemory {
    fn new(memory: &StatefulNode) -> Self {
        match memory {
            StatefulNode::Latch { .. } => Self::Bit(false),
            StatefulNode::Temporal(operator, ..) => Self::Temporal(State::new(*operator)),
            _ => Self::Nothing,
        }
    }

    fn restart(&mut self) {
        match self {
            Self::Nothing => {}
            Self::Bit(bit) => *bit = false,
            Self::Temporal(state) => state.restart(),
        }
    }
}

/// Memories and leaves between frames.
#[derive(Clone, Debug)]
pub struct Machine {
    /// The values of this frame.
    values: Vec<bool>,
    /// The state of each stateful node.
    kept: Vec<NodeMemory>,
    states: Vec<LastLeaf>,
    /// The bits of the imports on the frame before.
    last: Vec<bool>,
    /// Whether the next frame must be run even if no condition changes.
    restless: bool,
    /// The frame on which a window may change though nothing else does.
    due: usize,
    /// Frames run so far in this stretch, in the machine's time.
    frames: usize,
    /// The start of each tree's current leaf.
    since: Vec<usize>,
}

impl Machine {
    /// A machine for a plan, before the first frame.
    pub fn new(plan: &Plan) -> Self {
        Self {
            values: vec![false; plan.stateful.len()],
            kept: plan.stateful.iter().map(NodeMemory::new).collect(),
            states: vec![LastLeaf::None; plan.trees.len()],
            last: vec![false; plan.imports.len()],
            restless: true,
            due: usize::MAX,
            frames: 0,
            since: vec![0; plan.trees.len()],
        }
    }

    /// Forgets everything: the next frame is the first one of a stretch.
    pub fn restart(&mut self) {
        self.kept.iter_mut().for_each(NodeMemory::restart);
        self.states.fill(LastLeaf::None);
        self.last.fill(false);
        self.since.fill(0);
        self.restless = true;
        self.due = usize::MAX;
        self.frames = 0;
    }

    /// Runs the block that `columns` holds, but for its first `skip` frames, which lie before the machine's first one.
    /// Runs of leaves that end are given to `emit` with the position of their tree; frames are counted from the stretch's beginning.
    pub fn run(&mut self, plan: &Plan, columns: &Columns, skip: usize, len: usize, emit: &mut impl FnMut(usize, Run)) {
        if skip >= len {
            return;
        }
        let changes = columns.changes(&plan.imports, &mut self.last, len);
        let mut at = skip;
        while at < len {
            if !self.restless {
                let due = self.due.saturating_add(skip).saturating_sub(self.frames).max(at);
                at = next(&changes, at, len).unwrap_or(len).min(due);
                if at >= len {
                    break;
                }
            }
            let import = |import: u32| get(columns.condition(plan.imports[import as usize]), at);
            self.frame(plan, &import, self.frames + at - skip, emit);
            at += 1;
        }
        self.frames += len - skip;
    }

    /// Runs one frame; nothing is done when no import has changed and nothing else can.
    pub fn step(
        &mut self,
        plan: &Plan,
        import: impl Fn(u32) -> bool,
        changed: bool,
        emit: &mut impl FnMut(usize, Run),
    ) {
        if changed || self.restless || self.frames >= self.due {
            self.frame(plan, &import, self.frames, emit);
        }
        self.frames += 1;
    }

    /// Ends the stretch: the running leaves end with it.
    pub fn finish(&self, emit: &mut impl FnMut(usize, Run)) {
        for (tree, (state, start)) in self.states.iter().zip(&self.since).enumerate() {
            emit(tree, Run { start: *start, end: self.frames, label: state.label() });
        }
    }

    fn frame(&mut self, plan: &Plan, import: &impl Fn(u32) -> bool, frame: usize, emit: &mut impl FnMut(usize, Run)) {
        let (mut moved, mut due) = (false, u64::MAX);
        for (id, memory) in plan.stateful.iter().enumerate() {
            let value = |id: &StatefulId| self.values[id.index()];
            let anew = |restart: &Option<StatefulId>| restart.as_ref().is_some_and(value);
            let now = match memory {
                StatefulNode::Import(at) => import(*at),
                StatefulNode::From { tree, labels, none } => match self.states[*tree as usize] {
                    LastLeaf::None => *none,
                    LastLeaf::Separate => false,
                    LastLeaf::Label(label) => labels.iter().any(|pattern| pattern.covers(label)),
                },
                StatefulNode::Constant(constant) => *constant,
                StatefulNode::Not(a) => !value(a),
                StatefulNode::And(all) => all.iter().all(value),
                StatefulNode::Or(any) => any.iter().any(value),
                StatefulNode::Count(stateful, comparison, number) => {
                    let count: u32 = stateful.iter().map(|memory| u32::from(value(memory))).sum();
                    comparison.holds(f64::from(count), number.get())
                }
                StatefulNode::Latch { set, clear, restart } => {
                    let NodeMemory::Bit(kept) = &mut self.kept[id] else {
                        mismatched();
                        continue;
                    };
                    let before = *kept && !restart.as_ref().is_some_and(|restart| self.values[restart.index()]);
                    let now = !self.values[clear.index()] && (self.values[set.index()] || before);
                    moved |= *kept != now;
                    *kept = now;
                    now
                }
                StatefulNode::Temporal(operator, a, restart) => {
                    let (holds, anew) = (value(a), anew(restart));
                    let NodeMemory::Temporal(state) = &mut self.kept[id] else {
                        mismatched();
                        continue;
                    };
                    let (now, changes) = state.frame(*operator, frame as u64, holds, anew);
                    due = due.min(changes);
                    now
                }
            };
            self.values[id] = now;
        }
        self.due = usize::try_from(due).unwrap_or(usize::MAX);
        for (tree, open) in plan.trees.iter().enumerate() {
            let before = self.states[tree];
            let now = match decide(&open.decision, &self.values) {
                Leaf::Primitive(label) => LastLeaf::Label(label),
                Leaf::Separate => LastLeaf::Separate,
                Leaf::Stay => before,
            };
            if now != before {
                if frame > self.since[tree] {
                    emit(tree, Run { start: self.since[tree], end: frame, label: before.label() });
                }
                self.since[tree] = frame;
                self.states[tree] = now;
                moved = true;
            }
        }
        self.restless = moved;
    }
}

impl LastLeaf {
    const fn label(self) -> Option<Label> {
        match self {
            Self::Label(label) => Some(label),
            Self::None | Self::Separate => None,
        }
    }
}

fn decide(decision: &Decision<StatefulId>, values: &[bool]) -> Leaf {
    let mut target = decision.root;
    loop {
        match target {
            Target::Leaf(leaf) => return leaf,
            Target::Test(at) => {
                let test = &decision.tests[at as usize];
                target = if values[test.condition.index()] { test.yes } else { test.no };
            }
        }
    }
}

/// The first set bit at or after `at`.
fn next(bits: &super::bits::Bits, at: usize, len: usize) -> Option<usize> {
    let mut word = at / 64;
    let mut left = bits[word] & (u64::MAX << (at % 64));
    while left == 0 {
        word += 1;
        if word >= super::bits::words(len) {
            return None;
        }
        left = bits[word];
    }
    Some(word * 64 + left.trailing_zeros() as usize)
}
