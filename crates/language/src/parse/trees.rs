//! Trees, their choices, and extensions.

use super::Parser;
use super::expressions::{Builder, RulePair};
use super::grammar::Rule;
use super::mistakes::is_leaf;
use super::scan::Kind;

use crate::syntax::{Anchor, Choice, Consequent, Extension, Label, Tree};
use std::ops::Range;

impl Builder<'_, '_, '_> {
    /// The head of a tree; its choices follow.
    pub fn tree(&mut self, pair: RulePair<'_>) -> Option<Tree> {
        let head = self.piece.span(&pair);
        let (mut name, mut each_hand, mut settle) = (None, true, None);
        for part in pair.into_inner() {
            match part.as_rule() {
                Rule::name => name = Some(self.name(&part)),
                Rule::tree_scope => each_hand = part.into_inner().next()?.as_rule() == Rule::each_hand,
                Rule::settling => {
                    let sum = part.into_inner().find(|part| part.as_rule() == Rule::sum)?;
                    settle = Some(self.expression(sum)?);
                }
                _ => {}
            }
        }
        Some(Tree { name: name?, each_hand, settle, choices: Vec::new(), head })
    }

    /// The head of an extension; its choices follow.
    pub fn extend(&mut self, pair: RulePair<'_>) -> Option<Extension> {
        let mut parts = pair.into_inner().skip(1);
        let place = self.path(&parts.next()?);
        let anchor = parts.next()?;
        let anchor_span = self.piece.span(&anchor);
        let mut words = anchor.into_inner();
        let relation = words.next()?.as_rule();
        let name = words.next().map(|name| self.name(&name));
        let anchor = match (relation, name) {
            (Rule::kw_before, Some(name)) => Anchor::Before(name),
            (Rule::kw_after, Some(name)) => Anchor::After(name),
            (Rule::kw_last, _) => Anchor::Last,
            _ => Anchor::First,
        };
        Some(Extension { place, anchor, anchor_span, choices: Vec::new() })
    }

    /// A leaf, or the head of a branch whose choices follow.
    fn choice(&mut self, pair: RulePair<'_>) -> Option<Choice> {
        let span = self.piece.span(&pair);
        let (mut name, mut condition, mut then) = (None, None, Consequent::Branch(Vec::new()));
        for part in pair.into_inner() {
            match part.as_rule() {
                Rule::choice_name => name = Some(self.name(&part.into_inner().next()?)),
                Rule::guard => {
                    let guard = part.into_inner().next()?;
                    if guard.as_rule() == Rule::expression {
                        condition = Some(self.expression(guard)?);
                    }
                }
                Rule::leaf => {
                    let leaf = part.into_inner().next()?;
                    then = match leaf.as_rule() {
                        Rule::kw_stay => Consequent::Stay,
                        Rule::kw_separate => Consequent::Separate,
                        Rule::each_side => {
                            let span = self.piece.span(&leaf);
                            let name = self.name(&leaf.into_inner().next()?);
                            Consequent::EachSide(Label { name, side: None, span })
                        }
                        _ => Consequent::Primitive(self.label(leaf)?),
                    };
                }
                _ => {}
            }
        }
        Some(Choice { name, condition, then, span })
    }
}

impl Parser<'_> {
    /// The choices after the brace at `open`; when it is never closed, some may be missing.
    pub(super) fn branch_choices(&mut self, open: usize, body: Range<usize>) -> Vec<Choice> {
        let mut choices = self.choices(body);
        if !self.scan.is_closed(open) {
            let span = self.scan.span(open, open + 1);
            choices.push(Choice { name: None, condition: None, then: Consequent::Broken, span });
        }
        choices
    }

    /// The choices among these tokens. A choice ends with the leaf after `=>` or with the brace that closes its branch.
    fn choices(&mut self, tokens: Range<usize>) -> Vec<Choice> {
        let mut choices = Vec::new();
        let mut at = tokens.start;
        while at < tokens.end {
            let (head, body, next) = self.choice_extent(at, tokens.end);
            let choice = self.head(head.clone(), Rule::only_choice, |builder, pair| builder.choice(pair));
            let below = body.map(|body| self.branch_choices(head.end - 1, body));
            match choice {
                Some(mut choice) => {
                    if let Some(below) = below {
                        choice.then = Consequent::Branch(below);
                    }
                    choices.push(choice);
                }
                None => {
                    if self.scan.word(at + 1) == ":" {
                        self.broken.push(self.scan.word(at).to_string());
                    }
                    // Kept, so that the branch is not reported as incomplete.
                    let span = self.scan.span(head.start, head.end);
                    choices.push(Choice { name: None, condition: None, then: Consequent::Broken, span });
                }
            }
            at = next.max(at + 1);
        }
        choices
    }

    /// The head of the choice that begins at `at`, the body of its branch if it has one, and where the next choice begins.
    fn choice_extent(&self, at: usize, end: usize) -> (Range<usize>, Option<Range<usize>>, usize) {
        // A sign between choices, as other languages have it, is a mistake of its own.
        if matches!(self.scan.word(at), "," | ";") {
            return (at..at + 1, None, at + 1);
        }
        let mut to = at;
        while to < end {
            match self.scan.word(to) {
                "{" => {
                    let partner = self.scan.tokens.get(to).map_or(end, |open| open.partner.min(end));
                    return (at..to + 1, Some(to + 1..partner), self.scan.behind(to).min(end));
                }
                // Before a number it is a mistyped `>=`.
                "=>" if self.scan.tokens.get(to + 1).is_none_or(|next| next.kind != Kind::Number) => {
                    // The leaf stands after the arrow; a word on the next line belongs to the next choice, unless it can only be a leaf.
                    let leaf = self.scan.word(to + 1);
                    let next = self.scan.tokens.get(to + 1);
                    let taken = to + 1 < end
                        && next.is_some_and(|next| is_leaf(leaf) || !next.leads && next.kind != Kind::Close);
                    let mut behind = if taken { to + 2 } else { to + 1 };
                    // A side touches its primitive; one that does not is a mistake of this choice.
                    let is_side = matches!(self.scan.word(behind + 1), "left" | "right" | "side")
                        && self.scan.word(behind + 2) == ")";
                    if taken && self.scan.word(behind) == "(" && (is_side || self.touches(behind)) {
                        behind = self.scan.behind(behind).min(end);
                    }
                    return (at..behind, None, behind);
                }
                _ => {}
            }
            let is_open = self.scan.tokens.get(to).is_some_and(|token| token.kind == Kind::Open);
            to = if is_open { self.scan.behind(to) } else { to + 1 };
        }
        (at..end, None, end)
    }

    /// Whether nothing stands between this token and the one before it.
    pub(super) fn touches(&self, at: usize) -> bool {
        let before = at.checked_sub(1).and_then(|before| self.scan.tokens.get(before));
        before.zip(self.scan.tokens.get(at)).is_some_and(|(before, token)| before.end == token.start)
    }
}
