//! Resolves syntax trees to a checked rule set. The passes run in this order: names, channels, params, signals, latches, trees, tasks,
//! relabeling rules, warnings. Each continues after a mistake and records the undefined names, so that one mistake is
//! one report.

mod channels;
mod file_orders;
mod kinds;
mod missing_use;
mod names;
mod params;
mod signals;

pub use kinds::named;
pub use names::{Names, State, Value, ValueKind};
pub use teachtree_base::spelling::nearest;

use super::codes;
use super::rules::{Label, PrimitiveId, Rules, SignalId};
use super::syntax;
use missing_use::missing_use;
use names::Declarations;
use std::collections::{BTreeMap, BTreeSet};
use teachtree_base::diagnostic::{Diagnostic, Sources, Span};
use teachtree_base::hands::FingerPick;
use teachtree_base::meaning::Meaning;

/// The inputs of a rule set.
pub struct Input<'a> {
    /// The files in order of evaluation: a used file before the one that uses it.
    pub files: Vec<&'a syntax::File>,
    /// All texts.
    pub sources: &'a Sources,
    /// `--set name=value`
    pub overrides: &'a [(String, String)],
    /// The places of overrides in files, by name.
    pub override_places: &'a BTreeMap<String, String>,
    /// The files that were named, not used: only in them an unused declaration is worth a word.
    pub named: BTreeSet<u32>,
    /// Whether a file is missing: then unknown names are not reported, they may be in it.
    pub incomplete: bool,
    /// Whether nothing was wrong so far; else nothing is warned of, since what could not be read may be the reason.
    pub sound: bool,
}

/// Builds the rule set; it is complete only when no finding is an error.
pub fn resolve(input: &Input<'_>) -> (Rules, Vec<Diagnostic>) {
    let mut resolver = Resolver {
        rules: Rules { sources: input.sources.clone(), ..Rules::default() },
        names: Names::default(),
        findings: Vec::new(),
        used: BTreeSet::new(),
        signal_picks: Vec::new(),
        exact_signals: BTreeSet::new(),
        kinds: BTreeMap::new(),
        composites: BTreeMap::new(),
        file_order: BTreeSet::new(),
        named: input.named.clone(),
        override_places: input.override_places.clone(),
    };
    resolver.names.incomplete = input.incomplete;
    let declared = Declarations::collect(&input.files);
    resolver.names.broken.extend(input.files.iter().flat_map(|file| file.broken.iter().cloned()));
    resolver.declare_channels(&declared);
    resolver.declare_names(&declared);
    resolver.params(&declared, input.overrides);
    resolver.channel_defaults(&declared);
    resolver.signals(&declared);
    resolver.latches(&declared);
    resolver.file_orders(&declared.orders);
    resolver.trees(&declared.trees, &declared.extends);
    resolver.composite_names(&declared.composites);
    resolver.tasks(&declared.tasks, &declared.task_extensions);
    resolver.composites(&declared.composites);
    resolver.relabels(&declared.relabels);
    resolver.keep_channels_for_analysis();
    if input.sound {
        resolver.lints(&input.named);
    }
    (resolver.rules, resolver.findings)
}

/// The shared state of the passes.
pub struct Resolver {
    /// The rule set so far.
    pub rules: Rules,
    /// The meanings of names.
    pub names: Names,
    /// The diagnostics.
    pub findings: Vec<Diagnostic>,
    /// Values and primitives that something reads.
    pub used: BTreeSet<String>,
    /// For each signal that is an array over picked fingers, which ones.
    pub signal_picks: Vec<Option<FingerPick>>,
    /// The signals that are computed from constants and counts alone.
    pub exact_signals: BTreeSet<SignalId>,
    /// The kinds of each primitive that has any, directly.
    pub kinds: BTreeMap<PrimitiveId, Vec<PrimitiveId>>,
    /// The tasks that are made of tasks, with their places.
    pub composites: BTreeMap<String, Span>,
    /// Pairs of files: the extensions of the first come before those of the second.
    pub file_order: BTreeSet<(u32, u32)>,
    /// The files that were named, not used.
    pub named: BTreeSet<u32>,
    /// The places of overrides in files, by name.
    pub override_places: BTreeMap<String, String>,
}

impl Resolver {
    /// Reports.
    pub fn report(&mut self, finding: Diagnostic) {
        self.findings.push(finding);
    }

    /// Reports a name that means nothing, with the nearest of the `known` ones.
    pub fn unknown(&mut self, kind: &str, word: &str, place: Span, known: impl FnOnce(&Self) -> Vec<String>) {
        let head = word.split('.').find(|part| *part != "left" && *part != "right").unwrap_or(word);
        if self.names.incomplete || self.names.broken.contains(word) || self.names.broken.contains(head) {
            return;
        }
        if let Some(declared) = self.composites.get(word).filter(|_| kind == "task") {
            let finding = Diagnostic::error(codes::COMPOSITE, format!("`{word}` is made of tasks"))
                .at(place, "a task of primitives belongs here")
                .at(*declared, "declared here");
            self.report(finding.help("name one of its tasks"));
            return;
        }
        let finding = Diagnostic::error(codes::UNKNOWN_NAME, format!("there is no {kind} `{word}`"))
            .at(place, "nothing has this name");
        // Looking for near names takes time; reports beyond the bound are only counted.
        let known = if self.findings.len() < super::MAX_REPORTS { known(self) } else { Vec::new() };
        if let Some(file) = missing_use(head, &self.rules.sources) {
            self.report(finding.help(format!("did you forget `use \"{file}\"`?")));
            return;
        }
        let does = Meaning::ALL.into_iter().map(Meaning::name).find(|does| does.eq_ignore_ascii_case(word));
        if let Some(does) = does.filter(|_| kind == "primitive") {
            self.report(finding.help(format!("an action is declared by `does`: `primitive … does {does}`")));
            return;
        }
        // A name whose declaration could not be read may be the one that is meant.
        let names = known.iter().chain(&self.names.broken).map(String::as_str);
        let finding = match nearest(word, names) {
            Some(near) => finding.fix(format!("did you mean `{near}`?"), place, near),
            None if (1..=12).contains(&known.len()) => finding.help(format!("known here: {}", known.join(", "))),
            None => finding,
        };
        self.report(finding);
    }

    /// The primitive that a label names. In a leaf and after `becomes` (`exact`) a sided primitive needs its side.
    pub fn label(&mut self, label: &syntax::Label, exact: bool) -> Option<Label> {
        let Some(primitive) = self.rules.primitive(&label.name.text) else {
            self.unknown("primitive", &label.name.text, label.name.span, |resolver| {
                resolver.rules.primitives.iter().map(|primitive| primitive.name.clone()).collect()
            });
            return None;
        };
        self.used.insert(label.name.text.clone());
        let declared = self.rules.primitives.get(primitive.index())?;
        let (sided, declaration) = (declared.sided, declared.span);
        let name = &label.name.text;
        let finding = match (sided, label.side) {
            (true, None) if exact => Diagnostic::error(codes::WRONG_SIDE, format!("`{name}` needs a side"))
                .at(label.span, "which hand?")
                .at(declaration, "declared with a side")
                .help(format!("write `{name}(left)` or `{name}(right)`")),
            (false, Some(_)) => Diagnostic::error(codes::WRONG_SIDE, format!("`{name}` has no side"))
                .at(label.span, "a side is given")
                .at(declaration, "declared without a side")
                .fix(format!("declare `{name}(side)`, or leave the side out"), label.span, name.clone()),
            _ => return Some(Label { primitive, side: label.side }),
        };
        self.report(finding);
        None
    }

    /// Alternatives of a pattern, without the kinds that count for them.
    pub fn labels(&mut self, labels: &[syntax::Label]) -> Option<Vec<Label>> {
        let read: Vec<Option<Label>> = labels.iter().map(|label| self.label(label, false)).collect();
        read.into_iter().collect()
    }

    /// The name of a primitive.
    pub fn primitive_name(&self, primitive: PrimitiveId) -> &str {
        self.rules.primitives.get(primitive.index()).map_or("", |primitive| primitive.name.as_str())
    }
}
