//! The declaration and the occurrences of a name in all files.

use super::workspace::{RuleSet, Spot, Workspace};
use lsp_types::Location;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::rc::Rc;
use teachtree_base::diagnostic::Span;
use teachtree_language::index::{Kind, Mention, Symbol};

impl Spot {
    /// The name at this place.
    pub fn mention(&self) -> Option<Mention> {
        self.rule_set.survey.index.at(self.file, self.offset)
    }
}

impl RuleSet {
    /// The symbol that a name refers to.
    pub fn symbol(&self, mention: Mention) -> Option<&Symbol> {
        self.survey.index.symbols.get(mention.symbol)
    }
}

/// Where the name at a place is declared; of an abstract signal and its implementation, both.
pub fn definition(workspace: &Workspace, spot: &Spot) -> Vec<Location> {
    let symbol = spot.mention().and_then(|mention| spot.rule_set.symbol(mention));
    let declared = symbol.map_or(&[][..], |symbol| &symbol.declared);
    declared.iter().filter_map(|declared| workspace.location(&spot.rule_set, declared.name)).collect()
}

/// A symbol in one of the rule sets.
pub struct SymbolMatch {
    /// The rule set.
    pub rule_set: Rc<RuleSet>,
    /// Position in its index.
    pub symbol: usize,
}

/// The symbol at a place, in every rule set that has it: the one that is declared at the same place, or built in under the same name.
pub fn find_matches(workspace: &mut Workspace, spot: &Spot) -> Vec<SymbolMatch> {
    let Some(mention) = spot.mention() else { return Vec::new() };
    let Some(symbol) = spot.rule_set.symbol(mention) else { return Vec::new() };
    let declared: Vec<(PathBuf, u32)> =
        symbol.declared.iter().filter_map(|at| place(&spot.rule_set, at.name)).collect();
    let own = spot.rule_set.path(spot.file).map(PathBuf::from);
    let homes = declared.iter().map(|(path, _)| path.clone()).chain(own);
    let mut rule_sets: Vec<Rc<RuleSet>> = Vec::new();
    for home in homes {
        for rule_set in workspace.dependents(&home) {
            if !rule_sets.iter().any(|known| Rc::ptr_eq(known, &rule_set) || known.paths == rule_set.paths) {
                rule_sets.push(rule_set);
            }
        }
    }
    let same = |rule_set: &RuleSet| {
        let at = match symbol.kind {
            // A file is named by where it lies in each of them.
            Kind::File => rule_set.survey.index.symbols.iter().position(|other| {
                other.kind == Kind::File
                    && other.declared.iter().any(|at| place(rule_set, at.name).is_some_and(|at| declared.contains(&at)))
            })?,
            kind => rule_set.survey.index.find(kind, &symbol.tree, &symbol.name)?,
        };
        let theirs = rule_set.survey.index.symbols.get(at)?;
        let built_in = declared.is_empty() && theirs.declared.is_empty();
        let shared = theirs.declared.iter().filter_map(|at| place(rule_set, at.name)).any(|at| declared.contains(&at));
        (built_in || shared).then_some(at)
    };
    rule_sets
        .into_iter()
        .filter_map(|rule_set| same(&rule_set).map(|symbol| SymbolMatch { rule_set, symbol }))
        .collect()
}

/// All references to the symbol at a place, by file.
pub fn references(workspace: &mut Workspace, spot: &Spot, declarations: bool) -> Vec<Location> {
    let mut places: BTreeMap<(PathBuf, u32), Location> = BTreeMap::new();
    for found in find_matches(workspace, spot) {
        let index = &found.rule_set.survey.index;
        let declared = index.symbols.get(found.symbol).map_or(&[][..], |symbol| &symbol.declared);
        for span in index.places(found.symbol) {
            if !declarations && declared.iter().any(|at| at.name == span) {
                continue;
            }
            let key = place(&found.rule_set, span);
            places.extend(key.zip(workspace.location(&found.rule_set, span)));
        }
    }
    places.into_values().collect()
}

/// A place that is the same in every rule set.
fn place(rule_set: &RuleSet, span: Span) -> Option<(PathBuf, u32)> {
    Some((rule_set.path(span.file)?.to_path_buf(), span.start))
}
