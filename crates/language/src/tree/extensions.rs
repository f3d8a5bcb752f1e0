//! `extend tree.branch … { … }`: choices of one file spliced into a branch of another.

use super::{Draft, conditions};
use crate::codes;
use crate::resolve::{Resolver, nearest};
use crate::rules::{Branch, Choice, Consequent, TreeScope};
use crate::syntax::{self, Anchor, Extension};
use crate::types::Scope;
use std::collections::{BTreeMap, BTreeSet};
use teachtree_base::diagnostic::{Diagnostic, Span};

/// Pairs of choices that are compared when two files extend at one place.
const MAX_PAIRS: usize = 1024;

/// All extensions at one place, in order of evaluation.
struct Group<'a> {
    first: &'a Extension,
    parts: Vec<(&'a Extension, Vec<Choice>)>,
}

impl Resolver {
    /// Splices the extensions in. Those at one place stay together, in the order of their files where one is said (`use … before …`);
    /// places are filled in the order in which they are first named, so that an extension may build on an earlier one.
    pub(super) fn extend_trees(&mut self, drafts: &mut [Draft], extends: &[&Extension]) {
        let mut order: Vec<Group<'_>> = Vec::new();
        let mut at: BTreeMap<(String, u8, String), usize> = BTreeMap::new();
        for extend in extends {
            let choices = self.extension(drafts, extend);
            let (kind, name) = match &extend.anchor {
                Anchor::First => (0, ""),
                Anchor::Last => (1, ""),
                Anchor::Before(name) => (2, name.text.as_str()),
                Anchor::After(name) => (3, name.text.as_str()),
            };
            let place = *at.entry((extend.place.text(), kind, name.to_string())).or_insert(order.len());
            if place == order.len() {
                order.push(Group { first: extend, parts: Vec::new() });
            }
            if let Some(group) = order.get_mut(place) {
                group.parts.push((extend, choices));
            }
        }
        for mut group in order {
            self.put_in_order(&mut group);
            self.splice(drafts, group);
        }
    }

    /// Puts the parts of a group into the order of their files; those of files without an order stay as they were read.
    fn put_in_order(&self, group: &mut Group<'_>) {
        let file = |part: &(&Extension, Vec<Choice>)| part.0.anchor_span.file;
        let mut waiting: Vec<u32> = group.parts.iter().map(file).collect();
        waiting.dedup();
        let mut rank: BTreeMap<u32, usize> = BTreeMap::new();
        while !waiting.is_empty() {
            // The order has no circle, so that one file is always first.
            let is_first = |file: &u32| !waiting.iter().any(|other| self.comes_before(*other, *file));
            let next = waiting.iter().position(is_first).unwrap_or(0);
            rank.insert(waiting.remove(next), rank.len());
        }
        group.parts.sort_by_key(|part| rank.get(&file(part)).copied());
    }

    /// The choices of an extension.
    fn extension(&mut self, drafts: &mut [Draft], extend: &Extension) -> Vec<Choice> {
        let tree = extend.place.parts.first().map_or("", |tree| tree.text.as_str());
        let draft = drafts.iter_mut().find(|draft| draft.tree.name == tree);
        let hands = draft.as_ref().map(|draft| draft.tree.scope);
        let scope = if hands == Some(TreeScope::BothHands) { Scope::SHARED } else { Scope::HAND };
        let mut whole = true;
        let mut choices = self.tree_choices(&extend.choices, scope.with_memory(), &mut whole);
        if let Some(draft) = draft {
            draft.whole &= whole;
        }
        choices.retain(|choice| {
            if choice.condition.is_none() {
                self.report(
                    Diagnostic::error(codes::EXTENDED_ELSE, "an extension brings an `else`")
                        .at(choice.span, "it would take every frame from the branch")
                        .help("write a condition"),
                );
            }
            choice.condition.is_some()
        });
        choices
    }

    fn splice(&mut self, drafts: &mut [Draft], group: Group<'_>) {
        let [tree, rest @ ..] = group.first.place.parts.as_slice() else { return };
        let Some(draft) = drafts.iter_mut().find(|draft| draft.tree.name == tree.text) else {
            let owner = drafts.iter().find(|draft| {
                let mut found = false;
                name_choices(&draft.tree.root, &mut |choice, name| {
                    found |= name == tree.text && matches!(choice.then, Consequent::Branch(_));
                });
                found
            });
            if let (Some(owner), []) = (owner, rest) {
                let finding = Diagnostic::error(codes::UNKNOWN_NAME, format!("there is no tree `{}`", tree.text))
                    .at(tree.span, "this is a branch");
                let whole = format!("{}.{}", owner.tree.name, tree.text);
                self.report(finding.fix("name its tree too", tree.span, whole));
                return;
            }
            let known = drafts.iter().map(|draft| draft.tree.name.clone()).collect();
            self.unknown("tree", &tree.text, tree.span, |_| known);
            return;
        };
        let whole = draft.whole;
        let branch = match rest {
            [] => &mut draft.tree.root,
            [name] => match self.branch(draft, name) {
                Some(branch) => branch,
                None => return,
            },
            [_, more, ..] => {
                self.report(
                    Diagnostic::error(codes::NO_ANCHOR, "a branch is named by its tree and its own name")
                        .at(more.span, "this is too much")
                        .help("names are unique in a tree: leave the branches between out"),
                );
                return;
            }
        };
        let Some(position) = self.position(branch, &group.first.anchor, &group.first.place, whole) else { return };
        self.check_clash(&group);
        let added: Vec<Choice> = group.parts.into_iter().flat_map(|(_, choices)| choices).collect();
        let position = position.min(branch.choices.len());
        branch.choices.splice(position..position, added);
    }

    /// Returns the branch with this name, or reports its absence.
    fn branch<'d>(&mut self, draft: &'d mut Draft, name: &syntax::Name) -> Option<&'d mut Branch> {
        let mut branches = Vec::new();
        let mut leaf: Option<Span> = None;
        name_choices(&draft.tree.root, &mut |choice, named| match choice.then {
            Consequent::Branch(_) => branches.push(named.to_string()),
            _ if named == name.text => leaf = Some(choice.span),
            _ => {}
        });
        if !branches.contains(&name.text) {
            match leaf {
                Some(leaf) => self.report(
                    Diagnostic::error(codes::NO_ANCHOR, format!("`{}` is a leaf", name.text))
                        .at(name.span, "only branches are extended")
                        .at(leaf, "this is the leaf"),
                ),
                None if draft.whole => {
                    let kind = format!("branch in `{}` named", draft.tree.name);
                    self.unknown(&kind, &name.text, name.span, |_| branches);
                }
                // The branch may be one that could not be read.
                None => {}
            }
            return None;
        }
        find_branch(&mut draft.tree.root, &name.text)
    }

    /// Where in the branch the anchor is. When the tree is not `whole`, the anchor may be a choice that could not be read.
    fn position(&mut self, branch: &Branch, anchor: &Anchor, place: &syntax::Path, whole: bool) -> Option<usize> {
        let (name, behind) = match anchor {
            Anchor::First => return Some(0),
            Anchor::Last => {
                let ends = branch.choices.last().is_some_and(|last| last.condition.is_none());
                return Some(branch.choices.len() - usize::from(ends));
            }
            Anchor::Before(name) => (name, 0),
            Anchor::After(name) => (name, 1),
        };
        let found: Vec<usize> = branch
            .choices
            .iter()
            .enumerate()
            .filter(|(_, choice)| {
                let leads_there =
                    matches!(choice.then, Consequent::Primitive(label) if self.primitive_name(label.primitive) == name.text);
                choice.name.as_deref() == Some(name.text.as_str()) || leads_there
            })
            .map(|(at, _)| at)
            .collect();
        // The two choices of `(side)` are one.
        let same = |at: &usize| branch.choices.get(*at).map(|choice| choice.span);
        if let (Some(first), Some(last)) = (found.first(), found.last())
            && same(first) == same(last)
        {
            return Some(if behind == 0 { *first } else { last + behind });
        }
        let finding = if found.is_empty() {
            if !whole {
                return None;
            }
            let finding =
                Diagnostic::error(codes::NO_ANCHOR, format!("`{}` has no choice `{}`", place.text(), name.text))
                    .at(name.span, "neither the name of a choice there nor a primitive of one of its leaves");
            let anchors = self.anchors(branch);
            match nearest(&name.text, anchors.iter().map(String::as_str)) {
                Some(near) => finding.fix(format!("did you mean `{near}`?"), name.span, near),
                None if anchors.is_empty() => finding.help("there is `first` and `last`"),
                None => finding.help(format!("known there: {}", anchors.join(", "))),
            }
        } else {
            let mut finding =
                Diagnostic::error(codes::NO_ANCHOR, format!("`{}` has several choices `{}`", place.text(), name.text))
                    .at(name.span, "which one is meant?");
            let meant = || found.iter().filter_map(|at| branch.choices.get(*at));
            // `=> Primitive(side)` is two choices at one place.
            let spans: BTreeSet<Span> = meant().map(|choice| choice.span).collect();
            for span in spans {
                finding = finding.at(span, "one of them");
            }
            let names: Vec<String> =
                meant().filter_map(|choice| choice.name.as_ref()).map(|name| format!("`{name}`")).collect();
            match names.as_slice() {
                [] => finding.help("name another choice, give this one a name, or say `first` or `last`"),
                _ if names.len() < found.len() => finding.help(format!("only {} has a name to use", names.join(", "))),
                _ => finding.help(format!("use {}", names.join(" or "))),
            }
        };
        self.report(finding);
        None
    }

    /// What `before` and `after` may name in a branch: each name, and each primitive that one leaf gives, in order.
    fn anchors(&self, branch: &Branch) -> Vec<String> {
        let primitive = |choice: &Choice| match choice.then {
            Consequent::Primitive(label) => Some(self.primitive_name(label.primitive).to_string()),
            _ => None,
        };
        let leaves: Vec<String> = branch.choices.iter().filter_map(primitive).collect();
        let once = |leaf: &String| leaves.iter().filter(|other| *other == leaf).count() == 1;
        let words = |choice: &Choice| choice.name.clone().into_iter().chain(primitive(choice).filter(once));
        branch.choices.iter().flat_map(words).collect()
    }

    /// Two files at one place: their order would depend on the order of loading, unless no frame can meet the conditions of both.
    fn check_clash(&mut self, group: &Group<'_>) {
        for (place, (later, added)) in group.parts.iter().enumerate() {
            let file = later.anchor_span.file;
            let earlier = group.parts.iter().take(place).filter(|(other, _)| {
                other.anchor_span.file != file && !self.comes_before(other.anchor_span.file, file)
            });
            for (other, theirs) in earlier {
                let pairs = || added.iter().flat_map(|one| theirs.iter().map(move |two| (one, two)));
                let exclusive = added.len().saturating_mul(theirs.len()) <= MAX_PAIRS
                    && pairs().all(|(one, two)| match (&one.condition, &two.condition) {
                        (Some(one), Some(two)) => conditions::exclusive(one, two),
                        _ => false,
                    });
                if !exclusive {
                    let message = format!("two files extend `{}` at the same place", later.place.text());
                    let finding = Diagnostic::error(codes::EXTENSION_CLASH, message)
                        .at(later.anchor_span, "the order of both is undefined")
                        .at(other.anchor_span, "the other file");
                    let finding = match self.beside(&later.anchor, theirs) {
                        Some(anchor) => finding.fix("name a choice of the other file", later.anchor_span, anchor),
                        None => finding.help("name a choice of the other file with `before` or `after`"),
                    };
                    // The author of one of the two files can name a choice of the other; a file that uses both gives their order.
                    let by_author = self.named.contains(&file) && !self.named.contains(&other.anchor_span.file);
                    let names = self.rules.sources.files.get(file as usize);
                    let names = names.zip(self.rules.sources.files.get(other.anchor_span.file as usize));
                    let finding = match names.filter(|_| !by_author) {
                        Some((one, two)) => finding.help(format!(
                            "or give the order in the file that uses both: `use \"{}\" before \"{}\"`",
                            file_name(&one.name),
                            file_name(&two.name)
                        )),
                        None => finding,
                    };
                    self.report(finding);
                    return;
                }
            }
        }
    }

    /// An anchor that puts choices beside those of another file, on the side on which they were meant to be.
    fn beside(&self, anchor: &Anchor, theirs: &[Choice]) -> Option<String> {
        let (word, choice) = match anchor {
            Anchor::First | Anchor::Before(_) => ("before", theirs.first()?),
            Anchor::Last | Anchor::After(_) => ("after", theirs.last()?),
        };
        let name = match (&choice.name, &choice.then) {
            (Some(name), _) => name.as_str(),
            (None, Consequent::Primitive(label)) => self.primitive_name(label.primitive),
            _ => return None,
        };
        Some(format!("{word} {name}"))
    }
}

/// The last part of a path.
fn file_name(path: &str) -> &str {
    path.rsplit(['/', '\\']).next().unwrap_or(path)
}

/// Calls `visit` for every choice that has a name.
fn name_choices(branch: &Branch, visit: &mut dyn FnMut(&Choice, &str)) {
    for choice in &branch.choices {
        if let Some(name) = &choice.name {
            visit(choice, name);
        }
        if let Consequent::Branch(below) = &choice.then {
            name_choices(below, visit);
        }
    }
}

fn find_branch<'b>(branch: &'b mut Branch, name: &str) -> Option<&'b mut Branch> {
    branch.choices.iter_mut().find_map(|choice| {
        let Consequent::Branch(below) = &mut choice.then else { return None };
        if choice.name.as_deref() == Some(name) { Some(below) } else { find_branch(below, name) }
    })
}
