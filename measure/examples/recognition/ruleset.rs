//! Loads rule files into a rule set that is ready to run, and scales all params of a rule set.

use teachtree_analysis::{self as analysis, Analysis};
use teachtree_base::channels::ChannelSpec;
use teachtree_base::diagnostic::{Severity, render};
use teachtree_base::error::InputError;
use teachtree_base::recording::Recording;
use teachtree_engine::evaluator::evaluate;
use teachtree_engine::runs::Leaves;
use teachtree_frames::frames::Frames;
use teachtree_language::graph::{Graph, lower};
use teachtree_language::{self as language, Request, Rules};
use teachtree_report as report;

/// Compiled rules.
pub struct RuleSet {
    pub rules: Rules,
    graph: Graph,
    channels: Vec<ChannelSpec>,
}

/// The result of a run on a recording.
pub struct RuleRun {
    pub frames: Frames,
    pub leaves: Vec<Leaves>,
    pub analysis: Analysis,
}

impl RuleSet {
    /// Loads a shipped file; `overrides` are pairs of a param's name and its value with unit.
    pub fn load(file: &str, overrides: Vec<(String, String)>) -> Result<Self, String> {
        let request = Request { files: vec![file.into()], overrides, needs_tree: true, ..Request::default() };
        let loaded = language::load(&request);
        let errors: Vec<_> = loaded.diagnostics.into_iter().filter(|found| found.severity == Severity::Error).collect();
        let rules = loaded.rules.ok_or_else(|| render(&errors, &loaded.sources, false))?;
        Ok(Self { graph: lower(&rules), channels: report::channels(&rules), rules })
    }

    /// Runs the rules over a recording, as `teachtree analyze` does.
    pub fn over(&self, recording: &Recording) -> Result<RuleRun, InputError> {
        let frames = teachtree_frames::frames(recording, &self.channels)?;
        analysis::check_rate(&self.rules, frames.layout.rate_hz)?;
        let leaves = evaluate(&self.graph, &frames)?;
        let analysis = analysis::analyze(&self.rules, &frames, &leaves);
        Ok(RuleRun { frames, leaves, analysis })
    }

    /// Returns all params times `factor`, limited to their ranges, and the names of those that were limited.
    pub fn scaled(&self, factor: f64) -> (Vec<(String, String)>, Vec<String>) {
        let mut at_their_end = Vec::new();
        let params = self.rules.params.iter().map(|param| {
            let wanted = param.value * factor;
            let value = param.range.map_or(wanted, |(low, high)| wanted.clamp(low, high));
            if value != wanted {
                at_their_end.push(param.name.clone());
            }
            (param.name.clone(), format!("{value} {}", param.dimension.si_unit()))
        });
        (params.collect(), at_their_end)
    }
}
