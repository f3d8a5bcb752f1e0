//! Parsing of one piece of a file by one rule of the grammar.

use super::grammar::{Grammar, MAX_TOKENS, Rule};
use super::mistakes;
use super::scan::Scan;
use crate::codes;
use pest::Parser as _;
use pest::iterators::{Pair, Pairs};
use std::ops::Range;
use teachtree_base::diagnostic::{Diagnostic, Span};

/// A piece of a file that pest parses alone.
#[derive(Clone, Copy)]
pub struct Piece<'s, 'a> {
    scan: &'s Scan<'a>,
    start: usize,
}

impl<'s, 'a> Piece<'s, 'a> {
    /// Parses the tokens `[from, to)` by `rule` (one of the `only_…` rules).
    ///
    /// Returns nothing when brackets went wrong in it, which was reported already, or after reporting what was expected.
    pub fn parse(
        scan: &'s Scan<'a>,
        tokens: Range<usize>,
        rule: Rule,
        findings: &mut Vec<Diagnostic>,
    ) -> Option<(Self, Pairs<'a, Rule>)> {
        let span = scan.span(tokens.start, tokens.end);
        let piece = Self { scan, start: span.start as usize };
        let part = scan.tokens.get(tokens.clone())?;
        if part.iter().any(|token| token.faulty) {
            return None;
        }
        if part.len() > MAX_TOKENS {
            findings.push(
                Diagnostic::error(
                    codes::TOO_LONG,
                    format!("a declaration has more than {MAX_TOKENS} words and symbols"),
                )
                .at(scan.span(tokens.start, tokens.start + 1), "it begins here")
                .help("split it into several"),
            );
            return None;
        }
        match Grammar::parse(rule, scan.text.get(span.start as usize..span.end as usize)?) {
            Ok(pairs) => Some((piece, pairs)),
            Err(error) => {
                findings.push(mistakes::finding(scan, piece.start, tokens, &error));
                None
            }
        }
    }

    /// The place in the file of what pest parsed, without the blanks and comments that pest counts in after an optional part.
    pub fn span(self, pair: &Pair<'_, Rule>) -> Span {
        let span = pair.as_span();
        let (start, end) = (self.start + span.start(), self.start + span.end());
        let behind = self.scan.tokens.partition_point(|token| token.start < end);
        let last = behind.checked_sub(1).and_then(|last| self.scan.tokens.get(last));
        self.scan.place(start, last.map_or(end, |last| last.end.min(end)).max(start))
    }

    /// A place in the file.
    pub fn place(self, start: u32, end: u32) -> Span {
        self.scan.place(start as usize, end as usize)
    }
}
