//! One style for rule files: two blanks a brace, one blank between words, none inside parentheses, no two empty lines.
//!
//! Lines stay as the author broke them, comments stay where they are, and columns that stand below each other on
//! lines nearby stay so.
//! INVARIANT: words, signs and comments of the result are those of the text, in the same order; so the meaning is the same.

use super::parse;
use super::syntax::{Choice, Consequent, File, Item, ItemKind};
use std::collections::BTreeSet;
use teachtree_base::diagnostic::Diagnostic;

/// Blanks a brace.
const INDENT: usize = 2;
/// Maximum number of passes. Passes after the first one only remove blanks, so they end earlier.
const MAX_PASSES: usize = 100;
/// Lines above and below among which columns may stand below each other.
const NEAR: usize = 20;

/// A word, sign or comment of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Token<'a> {
    text: &'a str,
    /// Its start, in characters.
    column: usize,
    /// Blanks before it.
    gap: usize,
}

/// Formats a rule file.
///
/// # Errors
/// The findings, if the text is not a rule file: text that cannot be parsed is not moved.
pub fn format(text: &str) -> Result<String, Vec<Diagnostic>> {
    let mut now = text.to_string();
    for _ in 0..MAX_PASSES {
        let (file, findings) = parse::parse(&now, 0);
        if !findings.is_empty() {
            return Err(findings);
        }
        let next = pass(&now, &heads(&file));
        if next == now {
            break;
        }
        now = next;
    }
    Ok(now)
}

/// The starts of declarations, choices, channels and rules, in bytes.
fn heads(file: &File) -> BTreeSet<u32> {
    let mut heads = BTreeSet::new();
    items(&file.items, &mut heads);
    heads
}

fn items(list: &[Item], heads: &mut BTreeSet<u32>) {
    for item in list {
        heads.insert(item.span.start);
        match &item.kind {
            ItemKind::Stream(channels) => heads.extend(channels.iter().map(|channel| channel.span.start)),
            ItemKind::ForEachHand(inner) => items(inner, heads),
            ItemKind::Tree(tree) => choices(&tree.choices, heads),
            ItemKind::Extension(extend) => choices(&extend.choices, heads),
            ItemKind::Relabel(block) => heads.extend(block.rules.iter().map(|rule| rule.span.start)),
            _ => {}
        }
    }
}

fn choices(list: &[Choice], heads: &mut BTreeSet<u32>) {
    for choice in list {
        heads.insert(choice.span.start);
        if let Consequent::Branch(below) = &choice.then {
            choices(below, heads);
        }
    }
}

fn pass(text: &str, heads: &BTreeSet<u32>) -> String {
    let lines: Vec<&str> = text.lines().collect();
    let tokens: Vec<Vec<Token>> = lines.iter().map(|line| tokens(line)).collect();
    let mut out = String::with_capacity(text.len());
    let mut depth = 0_usize;
    let mut offset = 0;
    // The shift of the declaration's head; its other lines move with it.
    let mut moved = 0_i64;
    let mut empty = true;
    for (at, line) in lines.iter().enumerate() {
        let own = tokens.get(at).map_or(&[][..], Vec::as_slice);
        let Some(first) = own.first() else {
            // Empty lines at the beginning and repeated ones are removed.
            if !empty {
                out.push('\n');
            }
            empty = true;
            offset = after(text, offset, line);
            continue;
        };
        let closing = own.iter().take_while(|token| token.text == "}").count();
        let wanted = INDENT * depth.saturating_sub(closing);
        let place = u32::try_from(offset + line.len() - line.trim_start().len()).unwrap_or(u32::MAX);
        let is_head = heads.contains(&place) || matches!(first.text, "}" | "{") || first.text.starts_with("//");
        let indent = if is_head {
            if !first.text.starts_with("//") {
                moved = as_i64(wanted) - as_i64(first.column);
            }
            wanted
        } else {
            usize::try_from(as_i64(first.column) + moved).unwrap_or(0).max(wanted)
        };
        out.push_str(&" ".repeat(indent));
        let near = tokens.get(at.saturating_sub(NEAR)..(at + NEAR + 1).min(tokens.len())).unwrap_or(&[]);
        let stands_below = |token: &Token| {
            let same = |other: &Token| other.column == token.column && (other.text == token.text || other.gap >= 2);
            let others = near.iter().filter(|line| !std::ptr::eq(line.as_slice(), own));
            others.flat_map(|line| line.iter().skip(1)).any(same)
        };
        for (place, token) in own.iter().enumerate() {
            if let Some(before) = place.checked_sub(1).and_then(|before| own.get(before)) {
                let aligned = stands_below(token);
                out.push_str(&" ".repeat(gap(before.text, token, aligned)));
            }
            out.push_str(token.text);
        }
        out.push('\n');
        empty = false;
        for token in own {
            match token.text {
                "{" => depth += 1,
                "}" => depth = depth.saturating_sub(1),
                _ => {}
            }
        }
        offset = after(text, offset, line);
    }
    out.truncate(out.trim_end().len());
    if !out.is_empty() {
        out.push('\n');
    }
    out
}

/// Where the line after one begins, in bytes.
fn after(text: &str, offset: usize, line: &str) -> usize {
    let end = offset + line.len();
    let rest = text.get(end..).unwrap_or("");
    end + if rest.starts_with("\r\n") { 2 } else { usize::from(rest.starts_with('\n')) }
}

fn as_i64(number: usize) -> i64 {
    i64::try_from(number).unwrap_or(i64::MAX)
}

/// Blanks between two tokens of a line.
fn gap(before: &str, token: &Token, aligned: bool) -> usize {
    let spaced = |text: &str| matches!(text, "=>" | "=" | "==" | "!=" | "<" | "<=" | ">" | ">=" | ".." | "{" | "}");
    if matches!(before, "(" | "[") || matches!(token.text, "," | ")" | "]") {
        0
    } else if token.text.starts_with("//") {
        token.gap.max(1)
    } else if token.gap == 2 || token.gap > 2 && aligned {
        // Two blanks set apart what belongs together on either side.
        token.gap
    } else if token.gap > 0 || spaced(before) || spaced(token.text) || matches!(before, "," | ":") {
        1
    } else {
        0
    }
}

/// The words, signs and the comment of a line.
fn tokens(line: &str) -> Vec<Token<'_>> {
    let mut found = Vec::new();
    let mut rest = line;
    let mut column = 0;
    loop {
        let code = rest.trim_start();
        let gap = rest.chars().count() - code.chars().count();
        column += gap;
        let Some(first) = code.chars().next() else { return found };
        let len = length(code, first);
        let (text, behind) = code.split_at_checked(len).unwrap_or((code, ""));
        let text = if text.starts_with("//") { text.trim_end() } else { text };
        found.push(Token { text, column, gap });
        column += text.chars().count();
        rest = behind;
    }
}

/// Returns the length of the first token, in bytes.
fn length(code: &str, first: char) -> usize {
    if code.starts_with("//") {
        return code.len();
    }
    if first == '"' {
        return code.get(1..).and_then(|inner| inner.find('"')).map_or(code.len(), |end| end + 2);
    }
    if let Some(sign) = ["=>", "==", "!=", "<=", ">=", ".."].into_iter().find(|sign| code.starts_with(sign)) {
        return sign.len();
    }
    let is_word = |c: char| c.is_alphanumeric() || matches!(c, '_' | '.');
    if !is_word(first) {
        return first.len_utf8();
    }
    let end = code.find(|c: char| !is_word(c)).unwrap_or(code.len());
    // A range ends a number: `1..2`.
    code.find("..").map_or(end, |range| if range > 0 { range.min(end) } else { end })
}
