//! Where a name is declared, and where else it stands, over all files.

use super::workspace::{Spot, Whole, Workspace};
use lsp_types::Location;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::rc::Rc;
use teachtree_base::diagnostic::Span;
use teachtree_language::index::{Kind, Mention, Symbol};

impl Spot {
    /// The name at this place.
    pub fn mention(&self) -> Option<Mention> {
        self.whole.survey.index.at(self.file, self.offset)
    }
}

impl Whole {
    /// The thing that a name stands for.
    pub fn symbol(&self, mention: Mention) -> Option<&Symbol> {
        self.survey.index.symbols.get(mention.symbol)
    }
}

/// Where the name at a place is declared; of an abstract signal and its implementation, both.
pub fn definition(workspace: &Workspace, spot: &Spot) -> Vec<Location> {
    let symbol = spot.mention().and_then(|mention| spot.whole.symbol(mention));
    let declared = symbol.map_or(&[][..], |symbol| &symbol.declared);
    declared.iter().filter_map(|declared| workspace.location(&spot.whole, declared.name)).collect()
}

/// A thing as one of the wholes has it.
pub struct Found {
    /// The whole.
    pub whole: Rc<Whole>,
    /// Position in its index.
    pub symbol: usize,
}

/// The thing at a place, in every whole that has it: the one that is declared at the same place, or built in under the same name.
pub fn everywhere(workspace: &mut Workspace, spot: &Spot) -> Vec<Found> {
    let Some(mention) = spot.mention() else { return Vec::new() };
    let Some(symbol) = spot.whole.symbol(mention) else { return Vec::new() };
    let declared: Vec<(PathBuf, u32)> = symbol.declared.iter().filter_map(|at| place(&spot.whole, at.name)).collect();
    let own = spot.whole.path(spot.file).map(PathBuf::from);
    let homes = declared.iter().map(|(path, _)| path.clone()).chain(own);
    let mut wholes: Vec<Rc<Whole>> = Vec::new();
    for home in homes {
        for whole in workspace.all_that_use(&home) {
            if !wholes.iter().any(|known| Rc::ptr_eq(known, &whole) || known.paths == whole.paths) {
                wholes.push(whole);
            }
        }
    }
    let same = |whole: &Whole| {
        let at = match symbol.kind {
            // A file is named by where it lies in each of them.
            Kind::File => whole.survey.index.symbols.iter().position(|other| {
                other.kind == Kind::File
                    && other.declared.iter().any(|at| place(whole, at.name).is_some_and(|at| declared.contains(&at)))
            })?,
            kind => whole.survey.index.find(kind, &symbol.tree, &symbol.name)?,
        };
        let theirs = whole.survey.index.symbols.get(at)?;
        let built_in = declared.is_empty() && theirs.declared.is_empty();
        let shared = theirs.declared.iter().filter_map(|at| place(whole, at.name)).any(|at| declared.contains(&at));
        (built_in || shared).then_some(at)
    };
    wholes.into_iter().filter_map(|whole| same(&whole).map(|symbol| Found { whole, symbol })).collect()
}

/// All places that name the thing at a place, by file.
pub fn references(workspace: &mut Workspace, spot: &Spot, declarations: bool) -> Vec<Location> {
    let mut places: BTreeMap<(PathBuf, u32), Location> = BTreeMap::new();
    for found in everywhere(workspace, spot) {
        let index = &found.whole.survey.index;
        let declared = index.symbols.get(found.symbol).map_or(&[][..], |symbol| &symbol.declared);
        for span in index.places(found.symbol) {
            if !declarations && declared.iter().any(|at| at.name == span) {
                continue;
            }
            let key = place(&found.whole, span);
            places.extend(key.zip(workspace.location(&found.whole, span)));
        }
    }
    places.into_values().collect()
}

/// A place that is the same in every whole.
fn place(whole: &Whole, span: Span) -> Option<(PathBuf, u32)> {
    Some((whole.path(span.file)?.to_path_buf(), span.start))
}
