//! The sequential half of the evaluator: latches that read `from`, and the trees. It is run on the frames on which one of its
//! conditions changes, and goes on frame by frame until nothing changes any more; then nothing can, and it rests.

use super::bits::get;
use super::columns::Columns;
use super::plan::{Memory, MemoryId, Plan};
use super::runs::Run;
use super::width::Real;
use crate::graph::{Decision, Leaf, Target};
use crate::language::rules::Label;

/// What a tree said on the frame before.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    /// Nothing yet.
    None,
    /// `separate`, from a tree over both hands.
    Separate,
    /// A primitive.
    Label(Label),
}

/// Memories and leaves between frames.
#[derive(Clone, Debug)]
pub struct Machine {
    /// The values of this frame.
    values: Vec<bool>,
    /// What each memory keeps: a count, or 0 and 1 for a bit.
    kept: Vec<u32>,
    states: Vec<State>,
    /// The bits of the imports on the frame before.
    last: Vec<bool>,
    /// Whether the next frame must be run even if no condition changes.
    restless: bool,
    /// Frames run so far in this stretch, in the machine's time.
    frames: usize,
    /// Where each tree's running leaf began.
    since: Vec<usize>,
}

impl Machine {
    /// A machine for a plan, before the first frame.
    pub fn new(plan: &Plan) -> Self {
        let mut machine = Self {
            values: vec![false; plan.memories.len()],
            kept: vec![0; plan.memories.len()],
            states: vec![State::None; plan.trees.len()],
            last: vec![false; plan.imports.len()],
            restless: true,
            frames: 0,
            since: vec![0; plan.trees.len()],
        };
        machine.restart(plan);
        machine
    }

    /// Forgets everything: the next frame is the first one of a stretch.
    pub fn restart(&mut self, plan: &Plan) {
        for (kept, memory) in self.kept.iter_mut().zip(&plan.memories) {
            *kept = beginning(memory);
        }
        self.states.fill(State::None);
        self.last.fill(false);
        self.since.fill(0);
        self.restless = true;
        self.frames = 0;
    }

    /// Runs the block that `columns` holds, but for its first `skip` frames, which lie before the machine's first one.
    /// Runs of leaves that end are given to `emit` with the position of their tree; frames are counted from the stretch's beginning.
    pub fn run<R: Real>(
        &mut self,
        plan: &Plan,
        columns: &Columns<R>,
        skip: usize,
        len: usize,
        emit: &mut impl FnMut(usize, Run),
    ) {
        if skip >= len {
            return;
        }
        let changes = columns.changes(&plan.imports, &mut self.last, len);
        let mut at = skip;
        while at < len {
            if !self.restless {
                match next(&changes, at, len) {
                    Some(change) => at = change,
                    None => break,
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
        if changed || self.restless {
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
        let mut moved = false;
        for (id, memory) in plan.memories.iter().enumerate() {
            let kept = self.kept[id];
            let (value, keep) = self.memory(import, memory, kept);
            self.values[id] = value;
            self.kept[id] = keep;
            moved |= keep != kept;
        }
        for (tree, open) in plan.trees.iter().enumerate() {
            let before = self.states[tree];
            let now = match decide(&open.decision, &self.values) {
                Leaf::Primitive(label) => State::Label(label),
                Leaf::Separate => State::Separate,
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

    /// A memory's value on this frame and what it keeps.
    fn memory(&self, import: &impl Fn(u32) -> bool, memory: &Memory, kept: u32) -> (bool, u32) {
        let value = |id: &MemoryId| self.values[id.index()];
        let anew = |restart: &Option<MemoryId>| restart.as_ref().is_some_and(value);
        match memory {
            Memory::Import(at) => (import(*at), 0),
            Memory::From { tree, labels, none } => (
                match self.states[*tree as usize] {
                    State::None => *none,
                    State::Separate => false,
                    State::Label(label) => labels.iter().any(|pattern| pattern.covers(label)),
                },
                0,
            ),
            Memory::Constant(constant) => (*constant, 0),
            Memory::Not(a) => (!value(a), 0),
            Memory::And(all) => (all.iter().all(value), 0),
            Memory::Or(any) => (any.iter().any(value), 0),
            Memory::Count(memories, comparison, number) => {
                let count: u32 = memories.iter().map(|memory| u32::from(value(memory))).sum();
                (comparison.holds(f64::from(count), number.get()), 0)
            }
            Memory::Latch { set, clear, restart } => {
                let before = kept != 0 && !anew(restart);
                let now = !value(clear) && (value(set) || before);
                (now, u32::from(now))
            }
            Memory::For(a, frames, restart) => {
                let before = if anew(restart) { 0 } else { kept };
                let count = if value(a) { (before + 1).min(*frames) } else { 0 };
                (count >= *frames, count)
            }
            Memory::WithinLast(a, frames, restart) => {
                let before = if anew(restart) { *frames } else { kept };
                let count = if value(a) { 0 } else { (before + 1).min(*frames) };
                (count < *frames, count)
            }
            Memory::Rises(a, restart) => {
                let before = kept != 0 || anew(restart);
                (value(a) && !before, u32::from(value(a)))
            }
        }
    }
}

impl State {
    const fn label(self) -> Option<Label> {
        match self {
            Self::Label(label) => Some(label),
            Self::None | Self::Separate => None,
        }
    }
}

/// What a memory keeps before the first frame.
const fn beginning(memory: &Memory) -> u32 {
    match memory {
        Memory::WithinLast(_, frames, _) => *frames,
        // What begins true can not rise.
        Memory::Rises(..) => 1,
        _ => 0,
    }
}

fn decide(decision: &Decision<MemoryId>, values: &[bool]) -> Leaf {
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
