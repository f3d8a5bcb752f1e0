//! The text of a guard with other conditions: only the conditions that change are written again, so comments between them stay.

use std::ops::Range;
use teachtree_base::diagnostic::Span;
use teachtree_language::guard_sites::GuardSite;

/// A condition of a guard.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Part {
    pub text: String,
    /// The number of the condition in whose place it is written; `None` behind all of them.
    pub place: Option<usize>,
    /// Whether it stays.
    pub is_fixed: bool,
    pub is_open: bool,
    /// Whether it is a condition of one hand that was learned.
    pub is_learned: bool,
}

impl Part {
    /// A condition that was learned, as it is written in a declaration of a hand.
    pub const fn learned(text: String) -> Self {
        Self { text, place: None, is_fixed: false, is_open: false, is_learned: true }
    }

    /// A condition as it is written in the file.
    pub const fn written(text: String) -> Self {
        Self { text, place: None, is_fixed: false, is_open: false, is_learned: false }
    }

    /// It in the place of another one.
    pub fn in_place_of(&self, other: &Self) -> Self {
        Self { place: other.place, ..self.clone() }
    }

    /// Whether another one asks for the same.
    pub fn is_same(&self, other: &Self) -> bool {
        (&self.text, self.is_learned) == (&other.text, other.is_learned)
    }
}

/// The bytes of a span.
pub(super) fn range(span: Span) -> Range<usize> {
    span.start as usize..span.end as usize
}

/// What changes in a text, as bytes and what stands there then. At one byte, later entries stand before earlier ones.
pub(super) type TextChanges = Vec<(Range<usize>, String)>;

/// Changes of the text of a file that give a guard some conditions; `texts` are those of `parts`.
pub(super) fn changes(file: &str, guard: &GuardSite, parts: &[Part], texts: &[String]) -> TextChanges {
    let Some(last) = guard.conjuncts.len().checked_sub(1) else { return Vec::new() };
    let mut places: Vec<Option<usize>> = parts.iter().map(|part| part.place).collect();
    if places.iter().all(Option::is_none) {
        // One of the new conditions takes the place of the last one that was written.
        places.iter_mut().take(1).for_each(|place| *place = Some(last));
    }
    let spans: Vec<Range<usize>> = guard.conjuncts.iter().map(|it| range(it.span)).collect();
    let more = places.iter().zip(texts).filter(|(place, _)| place.is_none()).map(|(_, text)| format!(" and {text}"));
    let mut changes = vec![(spans[last].end..spans[last].end, more.collect::<String>())];
    let mut is_first = true;
    for (at, (written, span)) in guard.conjuncts.iter().zip(&spans).enumerate() {
        let Some(part) = places.iter().position(|place| *place == Some(at)) else {
            let gap = if is_first { at..at + 1 } else { at - 1..at };
            changes.extend(without(file, &spans, at, gap));
            continue;
        };
        is_first = false;
        let text = &texts[part];
        if *text == format!("({})", written.text) {
            changes.push((span.end..span.end, ")".into()));
            changes.push((span.start..span.start, "(".into()));
        } else if *text != written.text {
            changes.push((span.clone(), text.clone()));
        }
    }
    changes
}

/// Removes a condition and the `and` between two others, but no comment there.
fn without(file: &str, spans: &[Range<usize>], at: usize, gap: Range<usize>) -> TextChanges {
    let (Some(before), Some(after)) = (spans.get(gap.start), spans.get(gap.end)) else {
        return vec![(spans[at].clone(), String::new())];
    };
    let between = before.end..after.start;
    let is_blank = |text: &str| text.trim() == "and";
    if file.get(between.clone()).is_some_and(is_blank) {
        let whole = if gap.start == at { spans[at].start..between.end } else { between.start..spans[at].end };
        return vec![(whole, String::new())];
    }
    let and = between.start + and_at(file.get(between).unwrap_or(""));
    vec![(spans[at].clone(), String::new()), (and..and + "and".len(), String::new())]
}

/// The byte of `and` behind blanks and comments.
fn and_at(text: &str) -> usize {
    let mut rest = text.trim_start();
    while let Some(comment) = rest.strip_prefix("//") {
        rest = comment.find('\n').map_or("", |end| comment[end..].trim_start());
    }
    text.len() - rest.len()
}

/// A guard on one line, without its comments.
pub(super) fn one_line(text: &str) -> String {
    let words = text.lines().flat_map(|line| line.split("//").next().unwrap_or("").split_whitespace());
    words.collect::<Vec<_>>().join(" ")
}
