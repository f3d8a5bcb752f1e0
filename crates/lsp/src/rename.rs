//! A new name for what is declared in files of the user, wherever it stands. The new name is tried before it is proposed: a name that is
//! taken, no name, or one with which the files no longer compile is refused.

use super::navigation::{SymbolMatch, find_matches};
use super::workspace::{Spot, Workspace};
use super::{Answer, RequestError};
use lsp_types::{PrepareRenamePlaceholder, TextEdit};
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use teachtree_base::channels::DERIVED;
use teachtree_base::diagnostic::{Severity, Span};
use teachtree_base::hands::Side;
use teachtree_base::units;
use teachtree_language::index::{Kind, Symbol};
use teachtree_language::{CheckedSource, is_name, is_primitive, ops};

/// The name at a place, when it may be changed.
pub fn prepare(workspace: &Workspace, spot: &Spot) -> Answer<PrepareRenamePlaceholder> {
    let mention = spot.mention().ok_or_else(|| RequestError::failed("nothing here has a name that can be changed"))?;
    let symbol = spot.rule_set.symbol(mention).ok_or_else(|| RequestError::failed("nothing here has a name"))?;
    renameable(workspace, spot, symbol)?;
    Ok(PrepareRenamePlaceholder { range: spot.rule_set.range(mention.span), placeholder: symbol.name.clone() })
}

/// The edits that give the thing at a place a new name, by file.
pub fn rename(workspace: &mut Workspace, spot: &Spot, name: &str) -> Answer<BTreeMap<String, Vec<TextEdit>>> {
    prepare(workspace, spot)?;
    let found = find_matches(workspace, spot);
    let symbol = spot.mention().and_then(|mention| spot.rule_set.symbol(mention));
    let symbol = symbol.ok_or_else(|| RequestError::failed("nothing here has a name"))?;
    well_formed(symbol, name)?;
    if name == symbol.name {
        return Ok(BTreeMap::new());
    }
    for found in &found {
        readable(&found.rule_set.survey)?;
        free(&found.rule_set.survey, symbol, name)?;
    }
    let places = places(workspace, &found)?;
    check_compiles(workspace, &found, &places, symbol, name)?;
    let mut edits: BTreeMap<String, Vec<TextEdit>> = BTreeMap::new();
    for (path, spans) in &places {
        let rule_set = found.iter().find_map(|found| found.rule_set.file(path).map(|file| (&found.rule_set, file)));
        let Some((rule_set, file)) = rule_set else { continue };
        let edit = |(start, end): &(u32, u32)| {
            let range = rule_set.range(Span { file, start: *start, end: *end });
            TextEdit { range, new_text: name.to_string() }
        };
        edits.insert(workspace.uri(path).0, spans.iter().map(edit).collect());
    }
    Ok(edits)
}

fn renameable(workspace: &Workspace, spot: &Spot, symbol: &Symbol) -> Answer<()> {
    let (word, name) = (symbol.kind.word(), &symbol.name);
    let shipped = symbol.declared.iter().find_map(|at| {
        let path = spot.rule_set.path(at.name.file);
        path.is_none_or(|path| workspace.library.holds(path)).then(|| spot.rule_set.survey.sources.place(at.name))
    });
    Err(RequestError::failed(match symbol.kind {
        Kind::File => "rename the file itself, then change the `use` lines".to_string(),
        Kind::Function => format!("`{name}` is a function of the language"),
        Kind::Channel if symbol.declared.is_empty() => format!("`{name}` is derived by the program"),
        Kind::Channel => format!("`{name}` is the name of this channel in logs; a binding maps other columns to it"),
        _ => match shipped {
            Some(place) => format!("the {word} `{name}` comes with the program ({place}) and keeps its name"),
            None => return Ok(()),
        },
    }))
}

fn well_formed(symbol: &Symbol, name: &str) -> Answer<()> {
    let is_one = if symbol.kind == Kind::Primitive { is_primitive(name) } else { is_name(name) };
    if is_one {
        return Ok(());
    }
    Err(RequestError::failed(if symbol.kind == Kind::Primitive {
        format!(
            "`{name}` is not a name of a primitive: a capital letter, then letters, digits and `_`, such as `Grasp`"
        )
    } else if !name.is_empty() && is_name(&format!("{name}_")) {
        format!("`{name}` is a word of the language")
    } else {
        format!("`{name}` is not a name: a small letter or `_`, then letters, digits and `_`, such as `touching`")
    }))
}

/// Whether all names of the files are known: what cannot be read names nothing.
fn readable(survey: &CheckedSource) -> Answer<()> {
    let unread = survey.diagnostics.iter().find(|finding| finding.code.starts_with("E1"));
    unread.map_or(Ok(()), |finding| {
        let place = finding.place().map_or(String::new(), |span| format!(", {}", survey.sources.place(span)));
        Err(RequestError::failed(format!("files with errors are not changed: {}{place}", finding.message)))
    })
}

/// Whether a name is free where a thing is to have it.
fn free(survey: &CheckedSource, symbol: &Symbol, name: &str) -> Answer<()> {
    let taken = |what: String| Err(RequestError::failed(format!("`{name}` is {what} already")));
    if symbol.kind.space() == Kind::Param {
        if units::unit(name).is_some() {
            return taken("a unit".into());
        }
        if Side::from_name(name).is_some() {
            return taken("a hand".into());
        }
        if ops::function(name).is_some() {
            return taken("a function".into());
        }
        let heads = survey
            .index
            .symbols
            .iter()
            .filter(|symbol| symbol.kind == Kind::Channel)
            .map(|symbol| symbol.name.as_str());
        let mut heads = heads.chain(DERIVED.iter().map(|channel| channel.name));
        if heads.any(|channel| channel.split('.').next() == Some(name)) {
            return taken("a channel".into());
        }
    }
    match survey.index.find(symbol.kind, &symbol.tree, name).and_then(|at| survey.index.symbols.get(at)) {
        Some(other) => {
            let place = other.declared.first().map_or(String::new(), |at| survey.sources.place(at.name));
            Err(RequestError::failed(format!("`{name}` is a {} already: {place}", other.kind.word())))
        }
        None => Ok(()),
    }
}

/// Where the name stands, by file, from its beginning to its end.
type Places = BTreeMap<PathBuf, BTreeSet<(u32, u32)>>;

fn places(workspace: &Workspace, found: &[SymbolMatch]) -> Answer<Places> {
    let mut places = Places::new();
    for found in found {
        for span in found.rule_set.survey.index.places(found.symbol) {
            let path = found.rule_set.path(span.file).filter(|path| !workspace.library.holds(path));
            let path = path.ok_or_else(|| RequestError::failed("a file that comes with the program names it too"))?;
            places.entry(path.to_path_buf()).or_default().insert((span.start, span.end));
        }
    }
    Ok(places)
}

/// Compiles the files with the new name: nothing may be wrong with them that was right before.
fn check_compiles(
    workspace: &Workspace,
    found: &[SymbolMatch],
    places: &Places,
    symbol: &Symbol,
    name: &str,
) -> Answer<()> {
    let mut texts = BTreeMap::new();
    for (path, spans) in places {
        let unchanged = found.iter().find_map(|found| found.rule_set.file(path).map(|file| found.rule_set.text(file)));
        let mut text = unchanged.unwrap_or_default().to_string();
        for (start, end) in spans.iter().rev() {
            text.replace_range(*start as usize..*end as usize, name);
        }
        texts.insert(path.clone(), text);
    }
    let errors = |survey: &CheckedSource| {
        let errors = survey.diagnostics.iter().filter(|finding| finding.severity == Severity::Error);
        errors.map(|finding| finding.message.clone()).collect::<Vec<_>>()
    };
    for found in found {
        let before = errors(&found.rule_set.survey);
        let after = errors(&workspace.compile(&found.rule_set.root, &texts).survey);
        if after.len() > before.len() {
            let new = after.iter().find(|message| !before.contains(message)).map_or("", String::as_str);
            let message = format!("with `{name}` for `{}` the files would no longer compile: {new}", symbol.name);
            return Err(RequestError::failed(message));
        }
    }
    Ok(())
}
