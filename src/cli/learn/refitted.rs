//! The present rules with fitted params as a candidate: fitted to all groups but those of a fold, and run on the recordings of that fold.

use super::super::Failure;
use super::super::groups::Groups;
use super::{Args, LabeledLog};
use std::collections::BTreeMap;
use teachtree_analysis::Analysis;
use teachtree_analysis::fit::{idle, search};
use teachtree_analysis::score::Stage;
use teachtree_language::param_sites::{ParamSite, param_sites};
use teachtree_learn::fold_of;
use teachtree_session::fitting::{Recording, Runner, space};
use teachtree_session::{RulesInternals, RulesOptionsInternals};

/// What the present rules find in each recording with params that were fitted without its fold; `None` where no param can be fitted, or recordings have
/// different rules. `shown` receives the share that is done, 0 to 1.
///
/// # Errors
/// Recordings that cannot be scored.
pub fn analyses(
    args: &Args,
    logs: &[LabeledLog],
    groups: &Groups,
    shown: &dyn Fn(f64),
) -> Result<Option<Vec<Analysis>>, Failure> {
    let mut recordings = Vec::new();
    let mut first = None;
    for LabeledLog { log, truth, present, .. } in logs {
        if present.is_none() {
            return Ok(None);
        }
        let rules = args.analysis.rules.load(log)?;
        recordings.push(Recording::open(log, &rules, |_, _| Ok(truth.clone()))?);
        let (_, known) = first.get_or_insert_with(|| (log, rules.clone()));
        if known.digest() != rules.digest() {
            return Ok(None);
        }
    }
    let Some((log, rules)) = first else { return Ok(None) };
    let is_free = |site: &ParamSite| !rules.params().iter().any(|(name, _)| *name == site.name);
    let sites: Vec<ParamSite> = param_sites(rules.set()).into_iter().filter(is_free).collect();
    if sites.is_empty() {
        return Ok(None);
    }
    let space = space(rules.set(), &sites);
    let request = args.analysis.rules.options().request_for(log);
    let runner = Runner::new(recordings, rules.set().clone(), request, Stage::Relabeled);
    let mut objectives = |points: &[Vec<f64>]| runner.objectives(&space, points);
    let idle = idle(&space, &mut objectives);
    let mut folds: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (at, group) in groups.of_logs.iter().enumerate() {
        folds.entry(fold_of(*group)).or_default().push(at);
    }
    let mut found: BTreeMap<usize, Analysis> = BTreeMap::new();
    for (done, held) in folds.values().enumerate() {
        let others: Vec<usize> = (0..logs.len()).filter(|at| !held.contains(at)).collect();
        let mut inner = |part: f64| shown((done as f64 + part) / folds.len() as f64);
        let point = search(&space, &others, &idle, &mut objectives, &mut inner);
        let Some(analyses) = runner.analyses(&space, &point, held) else { return Ok(None) };
        found.extend(held.iter().copied().zip(analyses));
    }
    Ok(Some(found.into_values().collect()))
}
