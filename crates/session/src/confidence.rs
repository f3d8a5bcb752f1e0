//! Variations of the rules and of the log: params that are a fifth smaller and larger, all together and by dimension, and [varied logs](super::varied_logs).

use super::error::Error;
use super::rules::Rules;
use super::run::{Run, channels, leaves};
use super::varied_logs::LogVariation;
use crate::{ErrorInternals, RulesInternals};
use std::collections::BTreeMap;
use teachtree_analysis::{self as analysis, Analysis, confidence, margin};
use teachtree_base::error::ErrorKind;
use teachtree_base::units::Dimension;
use teachtree_engine::inspect::Inspector;
use teachtree_frames::OpenedLog;
use teachtree_frames::frames::Frames;
use teachtree_language::graph::lower;

/// The variation of params.
pub const FACTORS: [f64; 2] = [0.8, 1.2];

/// Gives the boundaries of an analysis their confidence and margins, and the tasks their stability.
pub fn add(found: &mut Analysis, rules: &Rules, run: &Run, opened: &OpenedLog) -> Result<(), Error> {
    let varied: Vec<Vec<(String, String)>> = variations(rules);
    let mut analyses: Vec<Analysis> =
        varied.iter().filter_map(|params| varied_analysis(rules, params, run, opened)).collect();
    let varied = LogVariation::all(opened, &run.frames).into_iter();
    let varied = varied.filter_map(|variation| variation.frames(opened, &run.frames));
    analyses.extend(varied.filter_map(|frames| analysis_of(rules, &frames)));
    confidence::compare(found, &analyses);
    let mut inspectors: Vec<Inspector> =
        run.leaves.iter().map(|leaves| Inspector::new(rules.set(), &run.frames, leaves)).collect();
    let margin = |who: analysis::TrackId, frame: usize| match inspectors
        .iter_mut()
        .find(|inspector| inspector.leaves().frames.contains(&frame))
    {
        Some(inspector) => margin::margin(inspector, who.side(), frame),
        None => Ok(None),
    };
    confidence::with_margins(found, margin).map_err(|error| Error::new(error, ErrorKind::Mismatch))
}

/// The params of each variation: all of them, and those of one dimension, times each factor and within their ranges.
fn variations(rules: &Rules) -> Vec<Vec<(String, String)>> {
    let params = &rules.set().params;
    let mut kinds: BTreeMap<String, Vec<Dimension>> = BTreeMap::new();
    for param in params {
        kinds.entry(param.dimension.si_unit()).or_default().push(param.dimension);
    }
    let kinds: Vec<Option<String>> = std::iter::once(None).chain(kinds.into_keys().map(Some)).collect();
    let scaled = |kind: &Option<String>, factor: f64| {
        let of_kind = params.iter().filter(|param| kind.as_ref().is_none_or(|unit| param.dimension.si_unit() == *unit));
        let value = |param: &teachtree_language::rules::Param| {
            let wanted = param.value * factor;
            let value = param.range.map_or(wanted, |(low, high)| wanted.clamp(low, high));
            (param.name.clone(), format!("{value} {}", param.dimension.si_unit()))
        };
        of_kind.map(value).collect::<Vec<_>>()
    };
    kinds.iter().flat_map(|kind| FACTORS.map(|factor| scaled(kind, factor))).collect()
}

/// The analysis of a varied log; `None` where the rules cannot run, such as a duration that is shorter than a sample.
fn analysis_of(rules: &Rules, frames: &Frames) -> Option<Analysis> {
    let leaves = leaves(rules.set(), &lower(rules.set()), frames).ok()?;
    Some(analysis::analyze(rules.set(), frames, &leaves))
}

/// The analysis of a log with other params; `None` where the rules cannot run with them, such as a duration that is shorter than a sample.
fn varied_analysis(rules: &Rules, params: &[(String, String)], run: &Run, opened: &OpenedLog) -> Option<Analysis> {
    let varied = rules.with_params(params)?;
    let channels = channels(varied.set());
    // A default of a channel may read a param: then what is derived is derived again.
    let anew = if channels == run.frames.channels { None } else { Some(opened.frames(&channels).ok()?) };
    let frames = anew.as_ref().unwrap_or(&run.frames);
    analysis_of(&varied, frames)
}
