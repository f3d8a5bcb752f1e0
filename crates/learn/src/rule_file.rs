//! The rule file of a model: each rule a signal with its conditions and a choice of the tree, with the evidence for it after it.

use super::bank::Bank;
use super::model::{Model, Rule};
use super::objective::LabelId;
use super::quantities::Declarations;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use teachtree_base::error::{ErrorKind, InputError};
use teachtree_engine::runs::Run;
use teachtree_language::evidence::EVIDENCE;
use teachtree_language::format::format;
use teachtree_language::{Request, load};

/// What speaks for a rule.
#[derive(Clone, Debug, Default, PartialEq)]
struct Evidence {
    /// Boundaries of the labels that it stands for, and how many groups they are of.
    boundaries: usize,
    groups: BTreeSet<usize>,
    /// How much later those boundaries are that were found while their group was held out, s. What becomes of the segment later is up to other rules.
    late_s: Vec<f64>,
}

impl Evidence {
    fn new(bank: &Bank, rule: &Rule, late: &[Vec<Option<i64>>]) -> Self {
        let mut evidence = Self::default();
        for (track, late) in bank.tracks.iter().zip(late) {
            for (_, _, at) in track.truth.boundaries().filter(|(from, to, _)| rule.follows(*from) && rule.to == *to) {
                evidence.boundaries += 1;
                evidence.groups.insert(track.group);
                let late_s = late.get(at).copied().flatten().map(|frames| frames as f64 / track.rate_hz);
                evidence.late_s.extend(late_s);
            }
        }
        evidence.late_s.sort_by(f64::total_cmp);
        evidence
    }

    fn comment(&self) -> String {
        let Self { boundaries, groups, late_s } = self;
        let plural = |count: usize, one: &str, many: &str| format!("{count} {}", if count == 1 { one } else { many });
        let mut text = format!("{EVIDENCE}{}", plural(*boundaries, "boundary", "boundaries"));
        if *boundaries > 0 {
            let found = late_s.len();
            let _ = write!(text, " of {}, held out {found} of {boundaries}", plural(groups.len(), "group", "groups"));
        }
        if let Some(median) = late_s.get(late_s.len() / 2) {
            let (size, way) = (median.abs(), if *median < 0.0 { "early" } else { "late" });
            let _ = write!(text, ", median {size:.1} s {way}");
        }
        text
    }
}

/// Writes a model as a rule file. `held_out` are the labels of each track while its group was held out; `about` is the first line.
///
/// # Errors
/// When the file is none: a bug.
pub(crate) fn rule_file(
    bank: &Bank,
    model: &Model,
    held_out: &[Vec<Run>],
    labels: &[String],
    about: &str,
) -> Result<String, InputError> {
    let both = bank.slots > 1;
    let late: Vec<Vec<Option<i64>>> =
        bank.tracks.iter().zip(held_out).map(|(track, runs)| track.truth.lateness(runs)).collect();
    let name = |label: LabelId| labels.get(label).map_or("", String::as_str);
    let atoms = model.rules.iter().flat_map(|rule| &rule.atoms).map(|atom| bank.atoms[*atom].text.as_str());
    let declared = Declarations::of(atoms);
    let mut text = format!("/// {about}\nuse \"stream.rules\"\n\n");
    if !declared.channels.is_empty() {
        let _ = writeln!(text, "stream {{ for each hand {{ {} }} }}", declared.channels.join("\n"));
    }
    declared.shared.iter().for_each(|signal| text.push_str(&format!("{signal}\n")));
    text.push_str("for each hand {\n");
    declared.signals.iter().for_each(|signal| text.push_str(&format!("  {signal}\n")));
    let mut counts: BTreeMap<LabelId, usize> = BTreeMap::new();
    let mut choices = vec![("from(none)".to_string(), model.start, String::new())];
    for rule in &model.rules {
        let count = counts.entry(rule.to).or_default();
        *count += 1;
        let number = if *count > 1 { format!("_{count}") } else { String::new() };
        let signal = format!("{}_begins{number}", snake_case(name(rule.to)));
        let conditions: Vec<&str> = rule.atoms.iter().map(|atom| bank.atoms[*atom].text.as_str()).collect();
        let _ = writeln!(text, "  signal {signal} = {}", conditions.join(" and "));
        let from: Vec<&str> = (0..bank.labels).filter(|label| rule.follows(*label)).map(name).collect();
        let after = match from.len() + 1 == bank.labels {
            true => format!("not from({})", name(rule.to)),
            false => format!("from({})", from.join(", ")),
        };
        let whose = if both { "either." } else { "" };
        let evidence = Evidence::new(bank, rule, &late).comment();
        choices.push((format!("{after} and {whose}{signal}"), rule.to, format!("    {evidence}")));
    }
    let width = choices.iter().map(|(condition, ..)| condition.chars().count()).max().unwrap_or(0);
    let name_width = labels.iter().map(|label| label.chars().count()).max().unwrap_or(0);
    let settle = if model.settle_ms > 0 { format!(", settle {} ms", model.settle_ms) } else { String::new() };
    let scope = if both { "left, right" } else { "each hand" };
    let _ = writeln!(text, "}}\n\nprimitive {}\n\ntree skills for {scope}{settle} {{", labels.join(", "));
    for (condition, to, evidence) in choices {
        let line = format!("  {condition:<width$} => {:<name_width$}{evidence}", name(to));
        let _ = writeln!(text, "{}", line.trim_end());
    }
    let _ = writeln!(text, "  {:<width$} => stay\n}}", "else");
    checked(&text)
}

/// The text in the style of rule files.
fn checked(text: &str) -> Result<String, InputError> {
    let internal = |why: &str| {
        InputError::new("teachtree learn", format!("the learned rules do not compile: {why}"))
            .or_kind(ErrorKind::Internal)
    };
    let text = format(text).map_err(|found| internal(found.first().map_or("", |found| &found.message)))?;
    let request = Request { texts: vec![("learned".into(), text.clone())], needs_tree: true, ..Request::default() };
    let loaded = load(&request);
    match loaded.rules {
        Some(_) => Ok(text),
        None => Err(internal(loaded.diagnostics.first().map_or("", |found| &found.message))),
    }
}

/// `PickUp` as `pick_up`.
pub(crate) fn snake_case(name: &str) -> String {
    let mut text = String::new();
    for letter in name.chars() {
        if letter.is_uppercase() && !text.is_empty() && !text.ends_with('_') {
            text.push('_');
        }
        text.extend(letter.to_lowercase());
    }
    text
}
