//! A written rule file with other guards and numbers at some of its sites. Everything else stays as it is, comments included.

use super::super::quantities::{Declarations, definitions, renamed};
use super::super::rule_file::snake_case;
use super::columns::kept_columns;
use super::guard_text::{Part, TextChanges, changes, one_line, range};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::ops::Range;
use teachtree_base::diagnostic::Span;
use teachtree_language::evidence::EVIDENCE;
use teachtree_language::format::format;
use teachtree_language::guard_sites::{Conjunct, GuardSite, GuardSites, NumberSite, guard_sites, numbers_in};
use teachtree_language::parse_text;
use teachtree_language::rules::Rules;
use teachtree_language::syntax::ItemKind;

impl From<(usize, &Conjunct)> for Part {
    fn from((at, written): (usize, &Conjunct)) -> Self {
        let Conjunct { text, reads_memory, is_open, .. } = written.clone();
        Self { text, place: Some(at), is_fixed: reads_memory, is_open, is_learned: false }
    }
}

/// The edit of a site.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Edit {
    Number(String),
    Guard(Vec<Part>),
}

impl Edit {
    /// Whether another edit of the site differs at most in numbers.
    pub fn is_alike(&self, other: &Self) -> bool {
        let forms = |parts: &[Part]| {
            let mut forms: Vec<String> = parts.iter().map(|part| without_numbers(&part.text)).collect();
            forms.sort();
            forms
        };
        match (self, other) {
            (Self::Number(_), Self::Number(_)) => true,
            (Self::Guard(one), Self::Guard(two)) => forms(one) == forms(two),
            _ => false,
        }
    }
}

/// A condition with `#` instead of each number.
fn without_numbers(condition: &str) -> String {
    let mut spans: Vec<Range<usize>> = numbers_in(condition).iter().map(|site| range(site.span)).collect();
    spans.sort_by_key(|span| std::cmp::Reverse(span.start));
    let mut text = condition.to_string();
    spans.into_iter().for_each(|span| text.replace_range(span, "#"));
    text
}

/// The edits by site.
pub(super) type Edits = BTreeMap<usize, Edit>;

/// A file whose sites are numbered: first the guards, then the numbers.
pub(super) struct WrittenFile {
    text: String,
    pub sites: GuardSites,
    /// Quantities that the rules declare with the same definition.
    declared: BTreeSet<String>,
    /// Names that the rules use, and those that stand for quantities of such a name.
    used: BTreeSet<String>,
    renamed: BTreeMap<String, String>,
    is_formatted: bool,
}

impl WrittenFile {
    /// The file at a position of the sources of some rules.
    pub fn new(rules: &Rules, file: u32) -> Self {
        let text = rules.sources.files.get(file as usize).map_or_else(String::new, |source| source.text.clone());
        let signals = rules.signals.iter().map(|it| it.name.clone());
        let mut used: BTreeSet<String> = signals
            .chain(rules.latches.iter().map(|it| it.name.clone()))
            .chain(rules.params.iter().map(|it| it.name.clone()))
            .chain(rules.tasks.iter().map(|it| it.name.clone()))
            .chain(rules.composites.iter().map(|it| it.name.clone()))
            .collect();
        let mut declared: BTreeSet<String> = rules.sources.files.iter().flat_map(|it| channels(&it.text)).collect();
        let mut other_names = BTreeMap::new();
        for (name, definition) in definitions() {
            let known = rules.signals.iter().find(|signal| signal.name == name);
            let without_blanks = |text: &str| text.split_whitespace().collect::<String>();
            match known {
                Some(known) if without_blanks(rules.sources.text(known.expr.span)) == without_blanks(definition) => {
                    declared.insert(name.to_string());
                }
                _ if used.contains(name) => {
                    let free = (2..).map(|at| format!("{name}_{at}")).find(|free| !used.contains(free));
                    used.extend(free.clone());
                    other_names.extend(free.map(|free| (name.to_string(), free)));
                }
                _ => {}
            }
        }
        let is_formatted = format(&text).is_ok_and(|formatted| formatted == text);
        Self { sites: guard_sites(rules, file), text, declared, used, renamed: other_names, is_formatted }
    }

    /// The number of sites.
    pub fn count(&self) -> usize {
        self.sites.guards.len() + self.sites.numbers.len()
    }

    /// The guard of a site.
    pub fn guard(&self, site: usize) -> Option<&GuardSite> {
        self.sites.guards.get(site)
    }

    /// The number of a site.
    pub fn number(&self, site: usize) -> Option<&NumberSite> {
        self.sites.numbers.get(site.checked_sub(self.sites.guards.len())?)
    }

    fn span(&self, site: usize) -> Option<Span> {
        self.guard(site).map(|it| it.span).or_else(|| self.number(site).map(|it| it.span))
    }

    /// What is written at a site, on one line.
    pub fn written(&self, site: usize) -> String {
        one_line(self.span(site).and_then(|span| self.text.get(range(span))).unwrap_or(""))
    }

    /// The line of a site, from 1.
    pub fn line(&self, site: usize) -> usize {
        let head = self.span(site).and_then(|span| self.text.get(..span.start as usize));
        head.unwrap_or("").matches('\n').count() + 1
    }

    /// What some edits write at a site, on one line.
    pub fn shown(&self, site: usize, edits: &Edits) -> String {
        match edits.get(&site) {
            Some(Edit::Number(number)) => number.clone(),
            Some(Edit::Guard(_)) => {
                let (mut guards, _) = self.guards(edits);
                one_line(&guards.remove(&site).unwrap_or_default().join(" and "))
            }
            None => String::new(),
        }
    }

    /// The conditions of the edited guards by site, as they are written, and the signals that they read in trees over both hands.
    fn guards(&self, edits: &Edits) -> (BTreeMap<usize, Vec<String>>, Vec<String>) {
        let mut used = self.used.clone();
        let (mut guards, mut signals) = (BTreeMap::new(), Vec::new());
        for (site, edit) in edits {
            let Edit::Guard(parts) = edit else { continue };
            let is_of_both = self.guard(*site).is_some_and(|guard| guard.of_both);
            let text = |part: &Part| {
                let condition = self.condition(part, parts.len());
                if !(part.is_learned && is_of_both) {
                    return condition;
                }
                let name = self.free_name(*site, &mut used);
                signals.push(format!("signal {name} = {condition}"));
                format!("either.{name}")
            };
            guards.insert(*site, parts.iter().map(text).collect());
        }
        (guards, signals)
    }

    /// A condition as it stands in a guard of `count` conditions.
    fn condition(&self, part: &Part, count: usize) -> String {
        match (part.is_learned, part.is_open && count > 1) {
            (true, _) => renamed(&part.text, &self.renamed),
            (false, true) => format!("({})", part.text),
            (false, false) => part.text.clone(),
        }
    }

    /// The file with some edits and the evidence for them, by site.
    pub fn rendered(&self, edits: &Edits, evidence: &BTreeMap<usize, String>) -> String {
        let mut changed = TextChanges::new();
        let (guards, signals) = self.guards(edits);
        for (site, edit) in edits {
            match (edit, self.guard(*site), self.number(*site)) {
                (Edit::Guard(parts), Some(guard), _) => {
                    changed.extend(changes(&self.text, guard, parts, guards.get(site).map_or(&[], Vec::as_slice)));
                }
                (Edit::Number(number), _, Some(written)) => changed.push((range(written.span), number.clone())),
                _ => {}
            }
        }
        // In the order of `TextChanges`: evidence stands behind what is added to a guard.
        let mut all = self.evidence(evidence);
        if !self.is_formatted {
            all.extend(kept_columns(&self.text, &changed));
        }
        all.extend(changed);
        all.extend(self.declarations(edits, &signals));
        all.sort_by_key(|(range, _)| std::cmp::Reverse((range.start, range.end)));
        let mut text = self.text.clone();
        for (range, change) in all {
            text.replace_range(range, &change);
        }
        if self.is_formatted { format(&text).unwrap_or(text) } else { text }
    }

    /// The comments with the evidence for some sites; they replace earlier ones.
    fn evidence(&self, evidence: &BTreeMap<usize, String>) -> TextChanges {
        let mut changes = TextChanges::new();
        let mut of_lines: BTreeMap<usize, Vec<&str>> = BTreeMap::new();
        for (site, text) in evidence {
            let end = self.span(*site).map_or(0, |span| span.end as usize);
            of_lines.entry(self.end_of_line(end)).or_default().push(text);
        }
        for (end, texts) in of_lines {
            let line = self.text.get(..end).and_then(|head| head.rfind('\n')).map_or(0, |newline| newline + 1);
            let old = self.text.get(line..end).and_then(|line| line.find(EVIDENCE.trim_end()));
            let start = old.map_or(end, |old| line + old);
            let start = self.text.get(..start).map_or(start, |head| head.trim_end_matches(' ').len());
            changes.push((start..end, format!("    {EVIDENCE}{}", texts.join("; "))));
        }
        changes
    }

    /// The declarations of what learned conditions read, and of `signals`.
    fn declarations(&self, edits: &Edits, signals: &[String]) -> Option<(Range<usize>, String)> {
        let parts = edits.values().flat_map(|edit| match edit {
            Edit::Guard(parts) => parts.as_slice(),
            Edit::Number(_) => &[],
        });
        let read = Declarations::of(parts.filter(|part| part.is_learned).map(|part| part.text.as_str()));
        let is_new = |text: &&String| {
            let name = text.trim_start_matches("signal ").split([' ', ':']).next().unwrap_or("");
            !self.declared.contains(name)
        };
        let new = |texts: &[String]| -> Vec<String> {
            texts.iter().filter(is_new).map(|text| renamed(text, &self.renamed)).collect()
        };
        let (channels, shared, mut of_hand) = (new(&read.channels), new(&read.shared), new(&read.signals));
        of_hand.extend_from_slice(signals);
        let mut text = String::new();
        if !channels.is_empty() {
            let _ = writeln!(text, "stream {{ for each hand {{ {} }} }}", channels.join("\n"));
        }
        shared.iter().for_each(|signal| text.push_str(&format!("{signal}\n")));
        if !of_hand.is_empty() {
            let _ = writeln!(text, "for each hand {{\n  {}\n}}", of_hand.join("\n  "));
        }
        let at = self.sites.declarations_at.filter(|_| !text.is_empty())?;
        Some((at..at, format!("\n{text}")))
    }

    /// A name for a condition of one hand in a tree over both, which is used from now on.
    fn free_name(&self, site: usize, used: &mut BTreeSet<String>) -> String {
        let leaf = self.guard(site).and_then(|guard| guard.leaves.first()).map_or("guard", String::as_str);
        let names = (1..).map(|at| format!("{}_if_{at}", snake_case(leaf)));
        let name = names.into_iter().find(|name| !used.contains(name)).unwrap_or_default();
        used.insert(name.clone());
        name
    }

    fn end_of_line(&self, at: usize) -> usize {
        let rest = self.text.get(at..).unwrap_or("");
        let line = rest.split('\n').next().unwrap_or("");
        at + line.trim_end_matches('\r').len()
    }
}

/// The channels that a file declares.
fn channels(text: &str) -> Vec<String> {
    let items = parse_text(text).0.items;
    let of_item = |item| match item {
        ItemKind::Stream(channels) => channels.iter().map(|channel| channel.name.text()).collect(),
        _ => Vec::new(),
    };
    items.into_iter().flat_map(|item| of_item(item.kind)).collect()
}
