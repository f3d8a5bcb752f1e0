//! Rules with other values of params, evaluated over logs in memory and scored against the truth: what `fit` searches with.

use super::error::Error;
use super::log::Log;
use super::rules::Rules as Loaded;
use super::run::{Run, channels, leaves};
use crate::{ErrorInternals, LogInternals, RulesInternals};
use rayon::prelude::*;
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;
use teachtree_analysis::fit::{
    self, Fit, FitParam, HeldGroups, MIN_LOGS, Objective, Objectives, ParamVector, Space, Verdict,
};
use teachtree_analysis::json::Meta;
use teachtree_analysis::score::{Stage, Tally, Truth, score};
use teachtree_analysis::{self as analysis, Analysis, check_rate};
use teachtree_base::channels::ChannelSpec;
use teachtree_base::diagnostic::Severity;
use teachtree_base::error::{ErrorKind, InputError};
use teachtree_frames::OpenedLog;
use teachtree_language::graph::{Graph, lower};
use teachtree_language::param_sites::{ParamSite, thresholds};
use teachtree_language::rules::ParamId;
use teachtree_language::{self as language, Request, Rules};

/// A recording with what does not change while params do.
pub struct Recording {
    log: Log,
    truth: Truth,
    channels: Vec<ChannelSpec>,
    run: Run,
    meta: Meta,
}

impl Recording {
    /// Runs the rules as they are; `truth` says what is true.
    pub fn open(
        log: &Log,
        rules: &Loaded,
        truth: impl FnOnce(&OpenedLog, &Analysis) -> Result<Truth, InputError>,
    ) -> Result<Self, Error> {
        let opened = log.opened()?;
        let (run, found) = Run::analyzed(rules.set(), opened, false)?;
        let argument = |error| Error::new(error, ErrorKind::Argument);
        let truth = truth(opened, &found).map_err(argument)?;
        let meta = Meta { log: log.name(), ..Meta::default() };
        // A log that cannot be scored at all is refused before the search.
        score(&truth, &found, Stage::Relabeled, &meta).map_err(argument)?;
        Ok(Self { log: log.clone(), truth, channels: channels(rules.set()), run, meta })
    }

    /// What changed rules find in this recording; `None` if they cannot run.
    fn found(&self, set: &CompiledRules) -> Option<Analysis> {
        let CompiledRules { rules, graph, is_base, channels } = set;
        // A default of a channel may read a param: then what is derived is derived again.
        let anew = if *channels == self.channels { None } else { Some(self.log.opened().ok()?.frames(channels).ok()?) };
        let frames = anew.as_ref().unwrap_or(&self.run.frames);
        let same = *is_base && anew.is_none();
        let again = if same {
            check_rate(rules, frames.layout.rate_hz).map(|()| None)
        } else {
            leaves(rules, graph, frames).map(Some)
        };
        Some(analysis::analyze(rules, frames, again.ok()?.as_ref().unwrap_or(&self.run.leaves)))
    }

    /// The objective of changed rules on this recording; `None` if they cannot run.
    fn objective(&self, set: &CompiledRules, stage: Stage, tolerance_s: f64) -> Option<Objective> {
        let found = self.found(set)?;
        let mut tally = Tally::default();
        score(&self.truth, &found, stage, &self.meta).ok()?.iter().for_each(|row| tally.add(&row.tally));
        Some(Objective::new(&tally, tolerance_s))
    }
}

/// Rules with other values.
struct CompiledRules {
    rules: Rules,
    graph: Graph,
    /// Whether the trees give the same leaves as with the values in the files: only settling, tasks or relabeling differ.
    is_base: bool,
    channels: Vec<ChannelSpec>,
}

/// The bits of a point.
type PointBits = Vec<u64>;

/// Runs rules over recordings, each point once.
pub struct Runner {
    /// The rules with the values in the files.
    pub rules: Rules,
    /// The tolerance of boundaries, s.
    tolerance_s: f64,
    recordings: Vec<Recording>,
    graph: Graph,
    request: Request,
    stage: Stage,
    known: RefCell<BTreeMap<PointBits, Option<Rc<[Objective]>>>>,
}

impl Runner {
    /// A runner of the rules that a request loads.
    pub fn new(recordings: Vec<Recording>, rules: Rules, request: Request, stage: Stage) -> Self {
        let graph = lower(&rules);
        let tolerance_s = fit::tolerance_s(recordings.iter().map(|recording| &recording.truth));
        Self { rules, tolerance_s, recordings, graph, request, stage, known: RefCell::default() }
    }

    /// The recordings by name.
    pub fn names(&self) -> Vec<String> {
        self.recordings.iter().map(|recording| recording.meta.log.clone()).collect()
    }

    /// What the rules find in some recordings at a point; `None` if they cannot run.
    pub fn analyses(&self, space: &Space, point: &ParamVector, at: &[usize]) -> Option<Vec<Analysis>> {
        let set = compiled(&self.request, &self.graph, space, point)?;
        let recordings = &self.recordings;
        at.par_iter().map(|at| recordings.get(*at)?.found(&set)).collect()
    }

    /// The objective of each point on each recording; `None` for a point whose rules are invalid or cannot run.
    pub fn objectives(&self, space: &Space, points: &[ParamVector]) -> Vec<Option<Rc<[Objective]>>> {
        let key = |point: &ParamVector| -> PointBits { point.iter().map(|value| value.to_bits()).collect() };
        let mut new: Vec<&ParamVector> = Vec::new();
        for point in points {
            if !self.known.borrow().contains_key(&key(point)) && !new.contains(&point) {
                new.push(point);
            }
        }
        let (request, graph) = (&self.request, &self.graph);
        let sets: Vec<Option<CompiledRules>> =
            new.par_iter().map(|point| compiled(request, graph, space, point)).collect();
        // Every recording of every point by itself; collecting keeps their order, so threads change nothing.
        let (recordings, stage, tolerance_s) = (&self.recordings, self.stage, self.tolerance_s);
        let jobs: Vec<(&Option<CompiledRules>, &Recording)> =
            sets.iter().flat_map(|set| recordings.iter().map(move |recording| (set, recording))).collect();
        let objectives: Vec<Option<Objective>> =
            jobs.par_iter().map(|(set, recording)| recording.objective(set.as_ref()?, stage, tolerance_s)).collect();
        for (point, objectives) in new.iter().zip(objectives.chunks(recordings.len().max(1))) {
            let all: Option<Vec<Objective>> = objectives.iter().copied().collect();
            self.known.borrow_mut().insert(key(point), all.map(Rc::from));
        }
        let known = self.known.borrow();
        points.iter().map(|point| known.get(&key(point)).cloned().flatten()).collect()
    }
}

/// The rules at a point, checked as those of a file are: ranges, orders of thresholds and durations hold.
fn compiled(request: &Request, base: &Graph, space: &Space, point: &ParamVector) -> Option<CompiledRules> {
    let mut request = request.clone();
    for (param, value) in space.params.iter().zip(point) {
        if param.value.to_bits() != value.to_bits() {
            request.overrides.push((param.name.clone(), param.show(*value)));
        }
    }
    let loaded = language::load(&request);
    let wrong = loaded.diagnostics.iter().any(|found| found.severity == Severity::Error);
    let rules = loaded.rules.filter(|_| !wrong)?;
    let graph = lower(&rules);
    let channels = channels(&rules);
    Some(CompiledRules { is_base: graph.decides_like(base), rules, graph, channels })
}

/// What can be changed: these params, and the pairs of them that are the two thresholds of one hysteresis.
pub fn space(rules: &Rules, params: &[ParamSite]) -> Space {
    let param = |one: &ParamSite| FitParam {
        name: one.name.clone(),
        unit: one.unit.clone(),
        value: one.value,
        range: one.range,
    };
    let at = |id: ParamId| {
        let name = &rules.params.get(id.index())?.name;
        params.iter().position(|one| one.name == *name)
    };
    let pairs = thresholds(rules).into_iter().filter_map(|(on, off)| Some((at(on)?, at(off)?)));
    Space { params: params.iter().map(param).collect(), pairs: pairs.collect() }
}

/// Searches, and holds recordings of `runner` out in `groups`. Too few recordings are searched only `anyway`, and none is held out then. `shown` receives the share that
/// is done, 0 to 1.
pub fn fitted(
    runner: &Runner,
    space: &Space,
    groups: &HeldGroups,
    anyway: bool,
    objectives: &mut Objectives,
    shown: &mut fit::Progress,
) -> Fit {
    let logs = runner.names();
    let all: Vec<usize> = (0..logs.len()).collect();
    let start = space.start();
    let objective_of = |objectives: &mut Objectives, point: &ParamVector| {
        let found = objectives(std::slice::from_ref(point)).pop().flatten();
        found.map(|found| fit::mean(&found, &all)).unwrap_or_default()
    };
    let before = objective_of(objectives, &start);
    let mut fitted = Fit {
        space: space.clone(),
        tolerance_s: runner.tolerance_s,
        idle: Vec::new(),
        point: start,
        before,
        after: before,
        held_out: None,
        verdict: Verdict::TooFew,
        logs,
    };
    let too_few = all.len() < MIN_LOGS;
    if too_few && !anyway {
        return fitted;
    }
    let folds = groups.folds as f64;
    let searches = if too_few { 1.0 } else { folds + 1.0 };
    fitted.idle = fit::idle(space, objectives);
    fitted.point = fit::search(space, &all, &fitted.idle, objectives, &mut |part| shown(part / searches));
    fitted.after = objective_of(objectives, &fitted.point);
    if fitted.changed().is_empty() {
        fitted.verdict = Verdict::NothingToGain;
    } else if !too_few {
        let mut inner = |part: f64| shown((1.0 + part * folds) / searches);
        let held_out = fit::cross_validation(space, groups, &fitted.idle, objectives, &mut inner);
        fitted.verdict = if held_out.is_borne_out() { Verdict::Gain } else { Verdict::NotBorneOut };
        fitted.held_out = Some(held_out);
    }
    fitted
}
