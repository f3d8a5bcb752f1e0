//! First look at a file, in one linear pass: words, numbers and symbols, comments, and which bracket closes which.
//!
//! Comes in: text of any kind. Goes out: tokens with bracket partners and the findings about brackets.
//! INVARIANT (bounded nesting): no more than [`MAX_NESTING`] brackets are open anywhere, and more than [`MAX_SIGNS`] signs or `not`s in
//! a row are marked as faulty. All later passes recurse on brackets, so they never see anything deeper.

use crate::codes;
use teachtree_base::diagnostic::{Diagnostic, Span};

/// Brackets that may be open at once.
pub const MAX_NESTING: usize = 48;
/// Signs and `not`s that may stand in a row.
pub const MAX_SIGNS: usize = 16;
/// Words, numbers and symbols that a file may have.
pub const MAX_TOKENS: usize = 50_000;

/// The kind of a token.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Letters, digits, underscores.
    Word,
    /// Digits.
    Number,
    /// `"…"`
    Text,
    /// `(`, `[`, `{`
    Open,
    /// `)`, `]`, `}`
    Close,
    /// Anything else.
    Symbol,
}

/// A token of the first look.
#[derive(Clone, Copy, Debug)]
pub struct Token {
    /// The kind of the token.
    pub kind: Kind,
    /// First byte.
    pub start: usize,
    /// One past the last byte.
    pub end: usize,
    /// Whether nothing but blanks stands before it on its line.
    pub leads: bool,
    /// The indentation of its line, in bytes.
    pub indent: usize,
    /// Whether brackets went wrong here, which was reported.
    pub faulty: bool,
    /// For an opening bracket: the token that closes it, or, when nothing does, the one at which the search was given up.
    pub partner: usize,
}

/// A file after the first look.
pub struct Scan<'a> {
    /// The text.
    pub text: &'a str,
    /// Which file it is.
    pub file: u32,
    /// The tokens.
    pub tokens: Vec<Token>,
    /// The comments.
    pub comments: Vec<Span>,
    /// Whether the rest of the file was not read.
    pub is_cut: bool,
}

/// Words that begin a declaration at the top of a file and stand nowhere else, save `task` after `extend`.
pub const ITEM_WORDS: &[&str] = &["use", "stream", "param", "primitive", "tree", "extend", "task", "relabel"];
/// Words that begin a declaration which may also stand in `for each hand`.
pub const HAND_WORDS: &[&str] = &["signal", "latch"];

impl<'a> Scan<'a> {
    /// Looks at a text.
    pub fn new(text: &'a str, file: u32, findings: &mut Vec<Diagnostic>) -> Self {
        let mut scan = Self { text, file, tokens: Vec::new(), comments: Vec::new(), is_cut: false };
        scan.split();
        let too_much = (scan.tokens.len() > MAX_TOKENS).then(|| scan.span(MAX_TOKENS, MAX_TOKENS + 1));
        if too_much.is_some() {
            scan.cut(&[], MAX_TOKENS);
        }
        scan.match_brackets(findings);
        // Unless something before ended the file already.
        if let Some(too_much) = too_much.filter(|_| scan.tokens.len() == MAX_TOKENS) {
            findings.push(
                Diagnostic::error(codes::TOO_LARGE, format!("a rule file has at most {MAX_TOKENS} words and symbols"))
                    .at(too_much, "the file is not read on from here"),
            );
        }
        scan.bound_signs(findings);
        scan
    }

    /// The text of a token; empty beyond the end.
    pub fn word(&self, at: usize) -> &'a str {
        self.tokens.get(at).and_then(|token| self.text.get(token.start..token.end)).unwrap_or("")
    }

    /// The place of the tokens `[from, to)`.
    pub fn span(&self, from: usize, to: usize) -> Span {
        let start = self.tokens.get(from).map_or(self.text.len(), |token| token.start);
        let end = to.checked_sub(1).and_then(|last| self.tokens.get(last)).map_or(start, |token| token.end);
        self.place(start, end.max(start))
    }

    /// A place in this file.
    pub fn place(&self, start: usize, end: usize) -> Span {
        let place = |at: usize| u32::try_from(at).unwrap_or(u32::MAX);
        Span { file: self.file, start: place(start), end: place(end) }
    }

    /// Whether the opening bracket at `at` is closed by its partner.
    pub fn is_closed(&self, at: usize) -> bool {
        self.tokens.get(at).is_some_and(|open| self.tokens.get(open.partner).is_some_and(|end| end.partner == at))
    }

    /// Where the tokens after the bracket at `at` go on.
    pub fn behind(&self, at: usize) -> usize {
        let partner = self.tokens.get(at).map_or(at, |open| open.partner);
        if self.is_closed(at) { partner + 1 } else { partner.max(at + 1) }
    }

    /// Whether a declaration begins here: one of [`ITEM_WORDS`], or `for each`.
    pub fn begins_item(&self, at: usize) -> bool {
        match self.word(at) {
            "task" => at.checked_sub(1).is_none_or(|before| self.word(before) != "extend"),
            "for" => {
                let in_tree_head = at.checked_sub(2).is_some_and(|tree| self.word(tree) == "tree");
                self.word(at + 1) == "each" && self.word(at + 2) == "hand" && !in_tree_head
            }
            word => ITEM_WORDS.contains(&word) || HAND_WORDS.contains(&word),
        }
    }

    /// Whether the token stands first on its line.
    pub fn leads(&self, at: usize) -> bool {
        self.tokens.get(at).is_some_and(|token| token.leads)
    }

    fn split(&mut self) {
        let text = self.text;
        let (mut leads, mut line, mut indent) = (true, 0, 0);
        let mut at = 0;
        while let Some(head) = text.get(at..).and_then(|rest| rest.chars().next()) {
            let rest = text.get(at..).unwrap_or("");
            if head.is_whitespace() || head == '\u{feff}' {
                at += head.len_utf8();
                if head == '\n' {
                    (leads, line) = (true, at);
                }
                continue;
            }
            let (kind, length) = if rest.starts_with("//") {
                let length = rest.find('\n').unwrap_or(rest.len());
                self.comments.push(self.place(at, at + length));
                at += length;
                continue;
            } else if head.is_ascii_alphabetic() || head == '_' {
                (Kind::Word, rest.find(|c: char| !c.is_ascii_alphanumeric() && c != '_').unwrap_or(rest.len()))
            } else if head.is_ascii_digit() {
                (Kind::Number, number_length(rest))
            } else if head == '"' {
                let body = rest.get(1..).unwrap_or("");
                let length = body.find(['"', '\n']).unwrap_or(body.len());
                let closed = body.get(length..).is_some_and(|rest| rest.starts_with('"'));
                (Kind::Text, 1 + length + usize::from(closed))
            } else if matches!(head, '(' | '[' | '{') {
                (Kind::Open, 1)
            } else if matches!(head, ')' | ']' | '}') {
                (Kind::Close, 1)
            } else {
                let pairs = ["=>", "..", "==", "<=", ">=", "!=", "->", "&&", "||"];
                (Kind::Symbol, if pairs.iter().any(|pair| rest.starts_with(pair)) { 2 } else { head.len_utf8() })
            };
            if leads {
                indent = at - line;
            }
            self.tokens.push(Token {
                kind,
                start: at,
                end: at + length,
                leads,
                indent,
                faulty: false,
                partner: usize::MAX,
            });
            leads = false;
            at += length;
        }
    }

    /// Pairs the brackets. A bracket that is still open where it cannot be any more is reported there and then given up, so that one
    /// missing bracket is one report and the rest of the file is read.
    fn match_brackets(&mut self, findings: &mut Vec<Diagnostic>) {
        let mut open: Vec<usize> = Vec::new();
        for at in 0..self.tokens.len() {
            let Some(token) = self.tokens.get(at).copied() else { break };
            let word = self.word(at);
            let text = self.text;
            let shown = |bracket: Token| text.get(bracket.start..bracket.end);
            let leads_item = token.leads && self.begins_item(at);
            // Before a number it is a mistyped `>=`.
            let arrow = word == "=>" && self.tokens.get(at + 1).is_none_or(|next| next.kind != Kind::Number);
            if arrow || matches!(word, "{" | "becomes") || leads_item {
                // None of these can stand inside parentheses.
                self.give_up(&mut open, at, |bracket| shown(bracket) != Some("{"), findings);
            }
            if leads_item && ITEM_WORDS.contains(&word) {
                // A declaration that is indented deeper than the line of the brace is meant to stand in it.
                self.give_up(&mut open, at, |bracket| bracket.indent >= token.indent, findings);
            }
            match token.kind {
                Kind::Open => {
                    if open.len() == MAX_NESTING {
                        findings.push(
                            Diagnostic::error(codes::TOO_DEEP, format!("more than {MAX_NESTING} brackets are open"))
                                .at(self.span(at, at + 1), "this one is too deep; the file is not read on")
                                .help("split the expression into signals, or the branch into smaller ones"),
                        );
                        self.cut(&open, at);
                        return;
                    }
                    open.push(at);
                }
                Kind::Close => {
                    let wanted = match word {
                        ")" => "(",
                        "]" => "[",
                        _ => "{",
                    };
                    if open.iter().any(|open| self.word(*open) == wanted) && (wanted == "{" || self.tops(&open, wanted))
                    {
                        self.give_up(&mut open, at, |bracket| shown(bracket) != Some(wanted), findings);
                    }
                    if open.last().is_some_and(|last| self.word(*last) == wanted) {
                        if let Some(last) = open.pop() {
                            self.pair(last, at, true);
                        }
                    } else {
                        self.mark(at);
                        findings.push(
                            Diagnostic::error(codes::NEVER_OPENED, format!("`{word}` closes nothing"))
                                .at(self.span(at, at + 1), format!("there is no open `{wanted}`"))
                                .fix("remove it", self.span(at, at + 1), ""),
                        );
                    }
                }
                _ => {}
            }
        }
        let end = self.tokens.len();
        if self.is_cut {
            self.cut(&open, end);
        } else {
            self.give_up(&mut open, end, |_| true, findings);
        }
    }

    /// Ends the file before the token `at`, with these brackets open.
    fn cut(&mut self, open: &[usize], at: usize) {
        self.tokens.truncate(at);
        self.is_cut = true;
        for bracket in open {
            self.pair(*bracket, at, false);
            self.mark(*bracket);
        }
    }

    /// Whether `wanted` is open with no brace opened after it.
    fn tops(&self, open: &[usize], wanted: &str) -> bool {
        open.iter()
            .rev()
            .map(|open| self.word(*open))
            .take_while(|bracket| *bracket != "{")
            .any(|bracket| bracket == wanted)
    }

    /// Gives up the innermost open brackets as long as `which` holds, with one report for all of them.
    fn give_up(
        &mut self,
        open: &mut Vec<usize>,
        at: usize,
        which: impl Fn(Token) -> bool,
        findings: &mut Vec<Diagnostic>,
    ) {
        let mut reported = false;
        while let Some((last, token)) = open.last().and_then(|last| Some((*last, *self.tokens.get(*last)?))) {
            if !which(token) {
                return;
            }
            open.pop();
            self.pair(last, at, false);
            self.mark(last);
            if reported {
                continue;
            }
            reported = true;
            let bracket = self.word(last);
            let mut finding = Diagnostic::error(codes::NEVER_CLOSED, format!("`{bracket}` is never closed"))
                .at(self.span(last, last + 1), "opened here");
            if at < self.tokens.len() {
                let close = match bracket {
                    "{" => "}",
                    "(" => ")",
                    _ => "]",
                };
                finding = finding.at(self.span(at, at + 1), format!("a `{close}` is missing before this"));
            }
            findings.push(finding);
        }
    }

    fn pair(&mut self, open: usize, close: usize, closed: bool) {
        if let Some(token) = self.tokens.get_mut(open) {
            token.partner = close;
        }
        if let Some(token) = self.tokens.get_mut(close).filter(|_| closed) {
            token.partner = open;
        }
    }

    fn mark(&mut self, at: usize) {
        if let Some(token) = self.tokens.get_mut(at) {
            token.faulty = true;
        }
    }

    fn bound_signs(&mut self, findings: &mut Vec<Diagnostic>) {
        let mut row = 0;
        for at in 0..self.tokens.len() {
            row = if matches!(self.word(at), "not" | "-") { row + 1 } else { 0 };
            if row > MAX_SIGNS {
                self.mark(at);
            }
            if row == MAX_SIGNS + 1 {
                findings.push(
                    Diagnostic::error(codes::TOO_DEEP, format!("found more than {MAX_SIGNS} signs or `not`s in a row"))
                        .at(self.span(at, at + 1), "this one is too much"),
                );
            }
        }
    }
}

/// The length of the digits at the beginning, with one dot among them when digits follow it.
fn number_length(text: &str) -> usize {
    let digits = |text: &str| text.find(|c: char| !c.is_ascii_digit()).unwrap_or(text.len());
    let whole = digits(text);
    match text.get(whole..).and_then(|rest| rest.strip_prefix('.')).map(digits) {
        Some(more) if more > 0 => whole + 1 + more,
        _ => whole,
    }
}
