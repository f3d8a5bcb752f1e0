//! Colors of printed text: labels and headings look alike in all commands.

use std::borrow::Cow;
use std::fmt::Write;

/// The labels at the beginning of lines, with the codes of their colors.
const LABELS: [(&str, &str); 4] = [("error:", "1;31"), ("warning:", "1;33"), ("help:", "1;36"), ("note:", "1;32")];
/// The code of headings.
const BOLD: &str = "1";

/// Colors the labels and headings of a text. A text with colors of its own, such as an analysis or the findings in rules, is returned unchanged.
pub fn colored(text: &str) -> Cow<'_, str> {
    if text.contains('\u{1b}') {
        return Cow::Borrowed(text);
    }
    let mut colored = String::with_capacity(text.len());
    let mut lines = text.split_inclusive('\n').peekable();
    while let Some(line) = lines.next() {
        let (head, end) = line.strip_suffix('\n').map_or((line, ""), |head| (head, "\n"));
        let indent = head.len() - head.trim_start().len();
        let (blank, words) = head.split_at(indent);
        let label = LABELS.iter().find_map(|(label, code)| words.strip_prefix(label).map(|rest| (*label, *code, rest)));
        let _ = match label {
            Some((label, code, rest)) => write!(colored, "{blank}\u{1b}[{code}m{label}\u{1b}[0m{rest}{end}"),
            None if is_heading(head, lines.peek().copied()) => write!(colored, "\u{1b}[{BOLD}m{head}\u{1b}[0m{end}"),
            None => write!(colored, "{line}"),
        };
    }
    Cow::Owned(colored)
}

/// Whether a line is a heading: lines that are indented by two spaces follow it.
fn is_heading(line: &str, next: Option<&str>) -> bool {
    let is_below = |next: &str| next.strip_prefix("  ").is_some_and(|rest| !rest.starts_with([' ', '\n']));
    !line.is_empty() && !line.starts_with(' ') && next.is_some_and(is_below)
}
