//! Fitting params to the labels of all recordings, in the background: what `fit --labels` does, with the texts of the editor.

use super::labels;
use super::project::Studio;
use super::score::truth_of;
use super::tuning;
use serde_json::{Map, Value, json};
use std::sync::Arc;
use teachtree_analysis::Analysis as AnalysisResult;
use teachtree_analysis::fit::{HeldGroups, Verdict};
use teachtree_analysis::score::{KnownNames, Stage};
use teachtree_base::error::{ErrorKind, InputError};
use teachtree_frames::OpenedLog;
use teachtree_language::param_sites::{ParamSite, param_sites};
use teachtree_report as report;
use teachtree_session::Error;
use teachtree_session::fitting::{Recording, Runner, fitted, space};
use teachtree_session::patch::patch;
use teachtree_session::{ErrorInternals, LogInternals, RulesInternals, RulesOptionsInternals};

/// Groups in which recordings are held out, at most; the same as that of the command.
const GROUPS: usize = 8;

impl Studio {
    /// Starts the thread that fits.
    pub(super) fn wait_for_fits(self: &Arc<Self>) {
        let studio = Arc::clone(self);
        std::thread::spawn(move || studio.fitting.run(|at| studio.fit_now(at)));
    }

    /// Fits the params of the rules of a recording to the labels of all recordings that are read by the same rules.
    fn fit_now(&self, at: usize) -> Result<Value, Error> {
        let argument = |error: InputError| Error::new(error, ErrorKind::Argument);
        let edits = self.state().edits.clone();
        let options = self.rules.clone().buffers(tuning::buffers(&edits));
        let first = self.loaded(at)?;
        let rules = options.clone().for_log(first.log())?;
        let mut recordings = Vec::new();
        for number in 0..self.recordings.len() {
            if self.fitting.is_stopped() {
                return Ok(Value::Null);
            }
            // What cannot be analyzed is said in the list.
            let Ok(loaded) = self.loaded(number) else { continue };
            let log = loaded.log();
            let own = options.clone().for_log(log)?;
            if own.digest() != rules.digest() {
                continue;
            }
            let Some((_, labels)) = labels::read_table(log.opened()?, &loaded.folders.beside).map_err(argument)? else {
                continue;
            };
            let truth = |opened: &OpenedLog, found: &AnalysisResult| {
                truth_of(&labels, opened, found, &KnownNames::new(own.set()))
            };
            let recording = Recording::open(log, &own, truth)?;
            recordings.push(recording);
        }
        if recordings.is_empty() {
            let error = InputError::new("the recordings", "no recording of these rules has labels");
            return Err(argument(error.help("correct labels, or accept those that are right with `All is right`")));
        }
        let fixed = rules.params();
        let sites: Vec<ParamSite> = param_sites(rules.set());
        let sites: Vec<ParamSite> =
            sites.into_iter().filter(|site| !fixed.iter().any(|(name, _)| *name == site.name)).collect();
        if sites.is_empty() {
            let error = InputError::new("the rules", "no param has a range to be searched");
            return Err(argument(error.help("`param NAME = VALUE in LOW .. HIGH` declares one")));
        }
        let space = space(rules.set(), &sites);
        let request = options.request_for(first.log());
        let runner = Runner::new(recordings, rules.set().clone(), request, Stage::Relabeled);
        let logs = runner.names().len();
        let groups = HeldGroups::of_recordings(logs, logs.min(GROUPS));
        let mut objectives = |points: &[Vec<f64>]| {
            let is_stopped = self.fitting.is_stopped();
            // When no point can run, the search ends at once.
            if is_stopped { vec![None; points.len()] } else { runner.objectives(&space, points) }
        };
        let mut shown = |part: f64| self.fitting.set_part(part);
        let fitted = fitted(&runner, &space, &groups, true, &mut objectives, &mut shown);
        let files: Vec<String> = rules.files().map(str::to_string).collect();
        let changed = fitted.changed();
        let values: Map<String, Value> = changed
            .iter()
            .filter_map(|(at, value)| Some((space.params.get(*at)?.name.clone(), json!(value))))
            .collect();
        let diff = (!changed.is_empty()).then(|| patch(rules.set(), &sites, &space.params, &fitted.point).diff);
        Ok(json!({
            "text": report::fit(&fitted, &files), "diff": diff, "values": values,
            "borne_out": fitted.verdict == Verdict::Gain,
        }))
    }
}
