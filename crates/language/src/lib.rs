//! The rule language: text in, a checked rule set and diagnostics out. It knows no log and no robot.
//!
//! The passes in their order: `source` reads files, `parse` makes syntax trees, `resolve` gives names their meaning and drives
//! `types`, `tree`, `tasks`, `relabels` and `lints`. Each pass returns its result and its diagnostics, and continues after a mistake.

pub mod codes;
mod composites;
pub mod evidence;
pub mod format;
pub mod formula;
pub mod graph;
pub mod guard_sites;
pub mod index;
pub mod lints;
pub mod mutation;
pub mod ops;
pub mod param_sites;
mod parse;
mod relabels;
mod resolve;
pub mod rules;
mod source;
pub mod syntax;
mod tasks;
pub mod tree;
mod types;

pub use index::Index;
pub use parse::{Candidate, candidates, is_name, is_primitive};
pub use rules::Rules;
pub use source::{MAX_BYTES, SHIPPED, shipped};
pub use types::describe;

use source::Loader;
use std::collections::BTreeMap;
use std::path::PathBuf;
use teachtree_base::diagnostic::{Diagnostic, Severity, Sources};

/// The rules that are loaded when none are named.
const DEFAULT_RULES: &str = "contact.rules";
/// Like the above, for a log of two hands.
const DEFAULT_RULES_OF_TWO_HANDS: &str = "bimanual.rules";
/// The failures that are detected beside them.
const DEFAULT_FAILURES: &str = "failures.rules";
/// The hand model that implements the abstract signals when none is named.
pub const DEFAULT_HAND: &str = "hand_force.rules";
/// Reports that are listed; the rest is counted.
const MAX_REPORTS: usize = 200;

/// The options for loading.
#[derive(Clone, Debug, Default)]
pub struct Request {
    /// Rule files: paths, or names of shipped files. Without files and texts the shipped `contact.rules` and `failures.rules` are loaded,
    /// whatever lies in the working directory.
    pub files: Vec<PathBuf>,
    /// Whether the shipped `bimanual.rules` is loaded instead of `contact.rules`.
    pub two_hands: bool,
    /// Whether the default rules are loaded without `failures.rules`: a robot program contains what was intended.
    pub without_failures: bool,
    /// Texts with their names, which are read after the files; what they use is looked up among the shipped files.
    pub texts: Vec<(String, String)>,
    /// The hand model that implements abstract signals; none for the shipped `hand_force.rules`. Loaded only when an abstract signal has no implementation.
    pub hand_file: Option<String>,
    /// Params to override, as `(name, value with unit)`.
    pub overrides: Vec<(String, String)>,
    /// The places of overrides in files, by name: `teachtree.yaml:3:14`. Messages about an override state it. Such an override has no effect if only shipped
    /// rules that are not loaded declare the param.
    pub override_places: BTreeMap<String, String>,
    /// Whether rules without a tree are an error, since something is to be labeled; else they are only worth a warning.
    pub needs_tree: bool,
    /// Texts that stand for files on disk, by canonical path: what an editor has not saved yet.
    pub buffers: BTreeMap<PathBuf, String>,
}

/// The result of loading.
#[derive(Clone, Debug)]
pub struct LoadedRules {
    /// The rule set, when there is no error.
    pub rules: Option<Rules>,
    /// The texts that were read.
    pub sources: Sources,
    /// What was found, by file and place.
    pub diagnostics: Vec<Diagnostic>,
    /// Whether a file that was asked for, not one that another uses, could not be read at all.
    pub root_unreadable: bool,
}

/// The results of rule files, even of files with errors: the input of an editor.
#[derive(Clone, Debug)]
pub struct CheckedSource {
    /// The texts that were read.
    pub sources: Sources,
    /// Which name stands where.
    pub index: Index,
    /// What could be made of the rules; complete only when they are `sound`.
    pub rules: Rules,
    /// Whether there is no error.
    pub sound: bool,
    /// What was found, by file and place.
    pub diagnostics: Vec<Diagnostic>,
}

/// Loads rule files with all that they use.
pub fn load(request: &Request) -> LoadedRules {
    finish(loader(request), request).0
}

/// Looks at rule files with all that they use.
pub fn survey(request: &Request) -> CheckedSource {
    let (LoadedRules { rules, sources, diagnostics, .. }, files, partial) = finish(loader(request), request);
    let index = Index::new(&files, &sources);
    CheckedSource { sources, index, sound: rules.is_some(), rules: rules.unwrap_or(partial), diagnostics }
}

fn loader(request: &Request) -> Loader {
    let mut loader = Loader::default();
    loader.buffers.clone_from(&request.buffers);
    if request.files.is_empty() && request.texts.is_empty() {
        loader.load_shipped(if request.two_hands { DEFAULT_RULES_OF_TWO_HANDS } else { DEFAULT_RULES });
        if !request.without_failures {
            loader.load_shipped(DEFAULT_FAILURES);
        }
    }
    for file in &request.files {
        loader.load_named(file);
    }
    for (name, text) in &request.texts {
        loader.load_text(name, text);
    }
    loader
}

/// Whether a shipped file declares a param of this name.
pub(crate) fn is_shipped_param(name: &str) -> bool {
    let mut items = SHIPPED.iter().flat_map(|(_, text)| parse::parse(text, 0).0.items);
    items.any(|item| matches!(&item.kind, syntax::ItemKind::Param(param) if param.name.text == name))
}

/// Loads a text; what it uses is looked up among the shipped files.
pub fn load_text(name: &str, text: &str) -> LoadedRules {
    let mut loader = Loader::default();
    loader.load_text(name, text);
    finish(loader, &Request::default()).0
}

/// Parses a text alone: its syntax tree, and what is wrong with its syntax.
pub fn parse_text(text: &str) -> (syntax::File, Vec<Diagnostic>) {
    let (file, findings) = parse::parse(text, 0);
    (file, sorted(findings))
}

/// The loaded files, their syntax trees, and the rule set, as far as it could be built.
fn finish(mut loader: Loader, request: &Request) -> (LoadedRules, Vec<syntax::File>, Rules) {
    if !loader.unimplemented().is_empty() {
        loader.load_hand(request.hand_file.as_deref().unwrap_or(DEFAULT_HAND));
    }
    let Loader { sources, files, mut findings, incomplete, named, root_unreadable, .. } = loader;
    let is_error = |finding: &Diagnostic| finding.severity == Severity::Error;
    let input = resolve::Input {
        files: files.iter().collect(),
        sources: &sources,
        overrides: &request.overrides,
        override_places: &request.override_places,
        incomplete,
        sound: !findings.iter().any(is_error),
        named,
    };
    let (sound, whole) = (input.sound, input.sound && !incomplete);
    let named = input.named.clone();
    let (rules, more) = resolve::resolve(&input);
    // Other errors of rules without a tree, such as an override of a missing param, are consequences.
    let message = if request.needs_tree { sound } else { sound && !more.iter().any(is_error) };
    findings.extend((rules.trees.is_empty() && message).then(|| no_tree(request.needs_tree)));
    findings.extend(more);
    // Further warnings need rules without errors.
    let wrong = findings.iter().any(is_error);
    let checked = |file: u32| named.contains(&file);
    let checked: Option<&dyn Fn(u32) -> bool> = if whole && !wrong { Some(&checked) } else { None };
    let comments: Vec<&[_]> = files.iter().map(|file| file.comments.as_slice()).collect();
    let diagnostics = sorted(lints::suppressions::suppress(findings, &comments, &sources, checked));
    (LoadedRules { rules: (!wrong).then(|| rules.clone()), sources, diagnostics, root_unreadable }, files, rules)
}

/// The report for rules that label nothing, which is fine only for a part that other files use.
fn no_tree(needed: bool) -> Diagnostic {
    let message = "there is no tree: nothing will be labeled";
    let finding = if needed {
        Diagnostic::error(codes::TREE_NEEDED, message)
    } else {
        Diagnostic::warning(codes::NO_TREE, message).note("a part for other files needs none")
    };
    finding.help("`use \"contact.rules\"` brings the shipped one in")
}

/// The findings by file and place; those beyond the bound are only counted. (Warnings are looked for only when there is no error.)
fn sorted(mut findings: Vec<Diagnostic>) -> Vec<Diagnostic> {
    findings.sort_by_key(Diagnostic::place);
    if findings.len() > MAX_REPORTS {
        let rest = findings.split_off(MAX_REPORTS);
        let message = format!("there are {} more findings", rest.len());
        let is_error = |finding: &Diagnostic| finding.severity == Severity::Error;
        findings.push(if rest.iter().any(is_error) {
            Diagnostic::error(codes::TOO_MANY_ERRORS, message)
        } else {
            Diagnostic::warning(codes::TOO_MANY_WARNINGS, message)
        });
    }
    findings
}
