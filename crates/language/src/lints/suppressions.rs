//! `// allow W404`: warnings that an author has seen and wants to keep, at the end of their line or on lines of their own above it.

use crate::codes;
use std::collections::BTreeMap;
use teachtree_base::diagnostic::{Diagnostic, Severity, Sources, Span};

/// The warnings that comments of a file allow, by line, counted from 0, and code: the places of the comments, and whether one was needed.
type Suppressions<'a> = BTreeMap<(usize, &'a str), (Vec<Span>, bool)>;

/// Removes the warnings that comments allow. Comments that allow nothing are reported in files for which `checked` holds.
pub fn suppress(
    mut findings: Vec<Diagnostic>,
    comments: &[&[Span]],
    sources: &Sources,
    checked: Option<&dyn Fn(u32) -> bool>,
) -> Vec<Diagnostic> {
    let mut all: BTreeMap<u32, (Lines, Suppressions)> = BTreeMap::new();
    for comments in comments {
        let Some(file) = comments.first().map(|first| first.file) else { continue };
        let Some(text) = sources.files.get(file as usize).map(|source| source.text.as_str()) else { continue };
        let codes: Vec<(Span, &str)> = comments.iter().flat_map(|comment| codes_of(*comment, text)).collect();
        if codes.is_empty() {
            continue;
        }
        let lines = Lines::of(text);
        let mut allowed = Suppressions::new();
        for (place, code) in codes {
            allowed.entry((lines.about(place), code)).or_default().0.push(place);
        }
        all.insert(file, (lines, allowed));
    }
    findings.retain(|finding| {
        let Some(place) = finding.place().filter(|_| finding.severity == Severity::Warning) else { return true };
        let Some((lines, allowed)) = all.get_mut(&place.file) else { return true };
        let Some((_, used)) = allowed.get_mut(&(lines.at(place.start), finding.code)) else { return true };
        *used = true;
        false
    });
    let reported = |file: &u32| checked.is_some_and(|checked| checked(*file));
    let unused = all.iter().filter(|(file, _)| reported(file)).flat_map(|(_, (_, allowed))| allowed);
    let unused = unused.filter(|(_, (_, used))| !used);
    findings.extend(unused.flat_map(|((_, code), (places, _))| places.iter().map(|place| idle(code, *place))));
    findings
}

fn idle(code: &str, place: Span) -> Diagnostic {
    let finding = Diagnostic::warning(codes::IDLE_ALLOW, format!("`allow {code}` allows nothing"));
    if !codes::ALL.iter().any(|(known, _)| *known == code) {
        return finding
            .at(place, "there is no such code")
            .help("`teachtree check` shows the code of a warning in brackets");
    }
    if !code.starts_with('W') {
        return finding.at(place, "this is the code of an error").help("only warnings can be allowed");
    }
    finding
        .at(place, format!("the line to which this applies has no {code}"))
        .help("remove it; it applies to its own line, or to the next one if it is alone on its line")
}

/// The lines of a file.
struct Lines {
    /// Where each begins.
    starts: Vec<usize>,
    /// For a line with nothing but a comment the next one with more, else the line itself.
    about: Vec<usize>,
}

impl Lines {
    fn of(text: &str) -> Self {
        let starts: Vec<usize> = std::iter::once(0).chain(text.match_indices('\n').map(|(at, _)| at + 1)).collect();
        let mut about: Vec<usize> = (0..starts.len()).collect();
        let mut next = None;
        for (at, line) in text.split('\n').enumerate().collect::<Vec<_>>().into_iter().rev() {
            if !line.trim().is_empty() && !line.trim().starts_with("//") {
                next = Some(at);
            }
            if let Some((about, next)) = about.get_mut(at).zip(next) {
                *about = next;
            }
        }
        Self { starts, about }
    }

    fn at(&self, offset: u32) -> usize {
        self.starts.partition_point(|start| *start <= offset as usize).saturating_sub(1)
    }

    /// The line that a comment is about.
    fn about(&self, comment: Span) -> usize {
        let own = self.at(comment.start);
        self.about.get(own).copied().unwrap_or(own)
    }
}

/// The codes of a comment that begins with `allow` and a code; what follows a colon is for people.
fn codes_of(comment: Span, text: &str) -> Vec<(Span, &str)> {
    let words = text.get(comment.start as usize..comment.end as usize).and_then(|words| words.strip_prefix("//"));
    let Some(list) = words.and_then(|words| words.trim_start().strip_prefix("allow ")) else { return Vec::new() };
    let list = list.split(':').next().unwrap_or("");
    let is_code = |word: &&str| {
        let (letter, digits) = word.split_at(word.len().min(word.chars().next().map_or(0, char::len_utf8)));
        letter.chars().all(|c| c.is_ascii_uppercase())
            && digits.len() == 3
            && digits.chars().all(|c| c.is_ascii_digit())
    };
    let codes: Vec<&str> = list.split([',', ' ']).map(str::trim).filter(|word| !word.is_empty()).collect();
    if codes.iter().all(is_code) { codes.into_iter().map(|code| (comment, code)).collect() } else { Vec::new() }
}
