//! The rules evaluated over a log that is read in windows, with constant memory. The analysis is the same as of a log in memory.

use super::run::channels;
use teachtree_analysis::{self as analysis, Analysis};
use teachtree_base::error::InputError;
use teachtree_engine::evaluator::Evaluator;
use teachtree_engine::runs::{Leaves, Run, append};
use teachtree_frames::frames::{ColumnKey, Frames, Layout};
use teachtree_frames::spilled_columns::SpilledColumns;
use teachtree_frames::streaming::{Chunk, FirstPass, StreamedLog};
use teachtree_language::Rules;
use teachtree_language::graph::{Graph, lower};
use teachtree_logs::issue::Issue;

/// Analyzes a log, and returns what its stamps show at 0 s, too; `None` when the log has to be in memory for that, or when something is wrong with it: reading it into memory then returns
/// the error.
pub fn analyze(rules: &Rules, flow: StreamedLog) -> Option<(Analysis, f64)> {
    let known = flow.look_through(&channels(rules))?;
    analysis::check_rate(rules, known.rate_hz).ok()?;
    let run = StreamRun::new(rules, lower(rules)).over(&known).ok()?;
    let (objects, bodies, attached) = known.names();
    let FirstPass { time, stretches, zero_stamp_s, .. } = known;
    let StreamRun { leaves, spilled, layout, issues, .. } = run;
    let (channels, len) = (channels(rules), time.len());
    let frames =
        Frames { channels, len, time, stretches, layout, objects, bodies, attached, issues, ..Frames::default() };
    let mut found = analysis::analyze_series(rules, &frames, &spilled, &leaves);
    analysis::explain_by_motion(&mut found, rules, &frames, &spilled);
    (!spilled.failed()).then_some((found, zero_stamp_s))
}

/// A run of rules over a log.
struct StreamRun {
    graph: Graph,
    evaluator: Option<Evaluator>,
    leaves: Vec<Leaves>,
    /// The columns that the tasks ask for later.
    kept: Vec<u32>,
    spilled: SpilledColumns,
    layout: Layout,
    issues: Vec<Issue>,
}

impl StreamRun {
    fn new(rules: &Rules, graph: Graph) -> Self {
        let is_kept = |name: &str| analysis::reads_later(rules, name) || analysis::reads_motion(name);
        let kept = (0..).zip(channels(rules)).filter(|(_, channel)| is_kept(&channel.name));
        let kept = kept.map(|(channel, _)| channel).collect();
        Self {
            graph,
            evaluator: None,
            leaves: vec![],
            kept,
            spilled: SpilledColumns::default(),
            layout: Layout::default(),
            issues: vec![],
        }
    }

    fn over(mut self, known: &FirstPass) -> Result<Self, InputError> {
        for stretch in &known.stretches {
            self.leaves.push(Leaves { frames: stretch.clone(), ..Leaves::default() });
        }
        let mut stretch = 0;
        let (layout, issues) = known.parts(&mut |part| {
            self.take(&part, stretch)?;
            stretch += usize::from(part.ends);
            Ok(())
        })?;
        (self.layout, self.issues) = (layout, issues);
        Ok(self)
    }

    fn take(&mut self, part: &Chunk, stretch: usize) -> Result<(), InputError> {
        let Chunk { frames, core, ends, .. } = part;
        let evaluator = match &mut self.evaluator {
            Some(evaluator) => evaluator,
            none => none.insert(Evaluator::new(&self.graph, &frames.layout)?),
        };
        for (key, column) in &frames.columns {
            if self.kept.contains(&key.channel) {
                self.spilled.push(*key, column.get(core.clone()).unwrap_or(&[]))?;
            }
        }
        let inputs: Vec<ColumnKey> = evaluator.plan().inputs.clone();
        let columns: Vec<&[f64]> = inputs.iter().map(|key| frames.column(*key).unwrap_or(&[])).collect();
        let sides: Vec<_> = evaluator.plan().trees.iter().map(|tree| tree.side).collect();
        let Some(leaves) = self.leaves.get_mut(stretch) else { return Ok(()) };
        let first = leaves.frames.start;
        let mut emit = |tree: usize, run: Run| {
            let run = Run { start: run.start + first, end: run.end + first, ..run };
            match sides.get(tree).copied().flatten() {
                Some(side) => append(leaves.hands.entry(side).or_default(), run),
                None => append(&mut leaves.both, run),
            }
        };
        evaluator.push(&columns, core.start, core.len(), &mut emit);
        if *ends {
            evaluator.finish(&mut emit);
        }
        Ok(())
    }
}
