//! The compiled evaluator for a log that is still being made: one frame in, and the leaves that end with it out. It says the same as
//! [`super::compiled::evaluator`], frame for frame, and allocates nothing after it was made.
//!
//! Numbers and comparisons are worked out on every frame (`sources`). What is made of conditions (`events`) changes only when a comparison does,
//! or when an open window ends, and is not evaluated before: most frames cause no work.

mod events;
mod ranks;
mod sources;

use super::compiled::instantiate::instantiate;
use super::compiled::machine::Machine;
use super::compiled::plan::Plan;
use super::runs::Run;
use events::Events;
use sources::Sources;
use teachtree_base::error::InputError;
use teachtree_frames::frames::Layout;
use teachtree_language::graph::Graph;

/// A run in progress.
#[derive(Clone, Debug)]
pub struct Stepper {
    plan: Plan,
    /// The steps by rank: those on numbers, then those on conditions.
    ranks: Vec<(Sources, Events)>,
    machine: Machine,
    /// Inputs, constants and numbers of this frame.
    values: Vec<f64>,
    /// The conditions of this frame.
    bits: Vec<bool>,
    /// The bits that the machine saw last.
    imports: Vec<bool>,
    /// Frames of this stretch before this one.
    now: u64,
    /// The frame on which something made of conditions may change although no comparison does.
    due: u64,
}

impl Stepper {
    /// Instantiates a graph for a log with these slots.
    ///
    /// # Errors
    /// When the rate cannot honour a duration of the rules.
    pub fn new(graph: &Graph, layout: &Layout) -> Result<Self, InputError> {
        let plan = instantiate(graph, layout)?;
        let ranks = ranks::Ranks::of(&plan);
        let mut stepper = Self {
            ranks: (0..=ranks.highest())
                .map(|rank| (Sources::of(&plan, &ranks, rank), Events::of(&plan, &ranks, rank)))
                .collect(),
            machine: Machine::new(&plan),
            values: sources::constants(&plan),
            bits: vec![false; plan.conditions.len()],
            imports: vec![false; plan.imports.len()],
            now: 0,
            due: 0,
            plan,
        };
        stepper.restart();
        Ok(stepper)
    }

    /// The plan that is run.
    pub const fn plan(&self) -> &Plan {
        &self.plan
    }

    /// Takes a frame: its columns in the order of `Plan::inputs`. Runs of leaves that end are given to `emit` with the position of their tree in
    /// `Plan::trees`; frames are counted from the beginning of the stretch.
    pub fn push(&mut self, frame: &[f64], emit: &mut impl FnMut(usize, Run)) {
        for (value, input) in self.values.iter_mut().zip(frame.iter().take(self.plan.inputs.len())) {
            *value = *input;
        }
        self.step(true, emit);
    }

    /// Ends a stretch: the delayed frames come out, the running leaves end, and the next frame begins anew.
    pub fn finish(&mut self, emit: &mut impl FnMut(usize, Run)) {
        if self.now > 0 {
            self.values[..self.plan.inputs.len()].fill(0.0);
            for _ in 0..self.plan.delay {
                self.step(false, emit);
            }
            self.machine.finish(emit);
        }
        self.restart();
    }

    fn restart(&mut self) {
        self.bits.fill(false);
        self.imports.fill(false);
        for (sources, events) in &mut self.ranks {
            sources.restart();
            events.restart(&mut self.bits);
        }
        self.machine.restart();
        self.now = 0;
        self.due = 0;
    }

    fn step(&mut self, inside: bool, emit: &mut impl FnMut(usize, Run)) {
        let Self { plan, ranks, values, bits, .. } = self;
        let first = self.now == 0;
        let mut changed = self.now >= self.due;
        for (sources, _) in &mut *ranks {
            changed |= sources.run(values, bits, first, inside);
        }
        let mut imports_changed = false;
        if changed {
            let mut due = u64::MAX;
            for (rank, (sources, events)) in ranks.iter_mut().enumerate() {
                // Steps on conditions used those of the frame before.
                if rank > 0 {
                    sources.run(values, bits, first, inside);
                }
                due = due.min(events.run(plan, bits, self.now, inside));
            }
            self.due = due;
            for (import, id) in self.imports.iter_mut().zip(&plan.imports) {
                imports_changed |= *import != bits[id.index()];
                *import = bits[id.index()];
            }
        }
        for (sources, _) in ranks {
            sources.advance(values, bits);
        }
        // The machine is behind by the plan's delay.
        if self.now >= u64::from(plan.delay) {
            let imports = &self.imports;
            self.machine.step(plan, |import| imports[import as usize], imports_changed, emit);
        }
        self.now += 1;
    }
}
