//! Signals, latches, params, primitives and the channels of `stream`.

use super::Parser;
use super::expressions::{Builder, RulePair};
use super::grammar::Rule;
use crate::syntax::{Channel, ItemKind, Latch, Name, Param, Primitive, Signal, Use, ValueType};
use std::ops::Range;
use teachtree_base::channels::{Axis, Shape};
use teachtree_base::units::Dimension;

impl Builder<'_, '_, '_> {
    /// A declaration without braces.
    pub fn item(&mut self, pair: RulePair<'_>) -> Option<ItemKind> {
        match pair.as_rule() {
            Rule::use_file => {
                let (before, own): (Vec<RulePair<'_>>, Vec<RulePair<'_>>) =
                    pair.into_inner().partition(|part| part.as_rule() == Rule::before_file);
                let file = own.into_iter().find_map(|part| self.quoted(part))?;
                let before = before.into_iter().flat_map(RulePair::into_inner).find_map(|part| self.quoted(part));
                Some(ItemKind::Use(Use { file, before }))
            }
            Rule::param => self.param(pair).map(ItemKind::Param),
            Rule::signal => self.signal(pair).map(ItemKind::Signal),
            Rule::latch => self.latch(pair).map(ItemKind::Latch),
            Rule::primitives => {
                let declared = pair.into_inner().filter(|part| part.as_rule() == Rule::declared_primitive);
                let primitives = declared.map(|declared| self.primitive(declared));
                primitives.collect::<Option<_>>().map(ItemKind::Primitives)
            }
            Rule::task => self.task_item(pair),
            Rule::extend_task => self.extend_task(pair).map(ItemKind::TaskExtension),
            _ => None,
        }
    }

    /// `Lift is Translate`, `Push does push`, `Join(side) does insert while other does hold`
    fn primitive(&mut self, pair: RulePair<'_>) -> Option<Primitive> {
        let (mut name, mut sided, mut is, mut does, mut other) = (None, false, None, None, None);
        for part in pair.into_inner() {
            match part.as_rule() {
                Rule::declared_name => {
                    let mut words = part.into_inner();
                    (name, sided) = (Some(self.name(&words.next()?)), words.next().is_some());
                }
                Rule::kind_of => is = self.word_in(part, Rule::primitive_name),
                _ => {
                    let (own, more): (Vec<RulePair<'_>>, Vec<RulePair<'_>>) =
                        part.into_inner().partition(|word| word.as_rule() != Rule::other_does);
                    does = own.iter().find(|word| word.as_rule() == Rule::meaning_name).map(|word| self.name(word));
                    other = more.into_iter().next().and_then(|more| self.word_in(more, Rule::meaning_name));
                }
            }
        }
        Some(Primitive { name: name?, sided, is, does, other })
    }

    /// The name in quotes, if the pair is one.
    fn quoted(&mut self, pair: RulePair<'_>) -> Option<Name> {
        (pair.as_rule() == Rule::text).then(|| {
            let mut name = self.name(&pair);
            name.text = name.text.trim_matches('"').to_string();
            name
        })
    }

    fn word_in(&mut self, pair: RulePair<'_>, rule: Rule) -> Option<Name> {
        pair.into_inner().find(|word| word.as_rule() == rule).map(|word| self.name(&word))
    }

    fn param(&mut self, pair: RulePair<'_>) -> Option<Param> {
        let mut name = None;
        let mut values = Vec::new();
        for part in pair.into_inner() {
            match part.as_rule() {
                Rule::name => name = Some(self.name(&part)),
                Rule::sum => values.push(self.expression(part)),
                _ => {}
            }
        }
        let mut values = values.into_iter();
        let value = values.next()??;
        let range = match (values.next(), values.next()) {
            (Some(low), Some(high)) => Some((low?, high?)),
            _ => None,
        };
        Some(Param { name: name?, value, range })
    }

    fn signal(&mut self, pair: RulePair<'_>) -> Option<Signal> {
        let (mut name, mut ty, mut value) = (None, None, None);
        for part in pair.into_inner() {
            match part.as_rule() {
                Rule::name => name = Some(self.name(&part)),
                Rule::declared_type => {
                    let written = part.into_inner().find(|part| part.as_rule() == Rule::value_type)?;
                    ty = Some(self.value_type(written)?);
                }
                Rule::expression => value = Some(self.expression(part)?),
                _ => {}
            }
        }
        Some(Signal { name: name?, ty, value })
    }

    fn latch(&mut self, pair: RulePair<'_>) -> Option<Latch> {
        let mut name = None;
        let mut conditions = Vec::new();
        for part in pair.into_inner() {
            match part.as_rule() {
                Rule::name => name = Some(self.name(&part)),
                Rule::expression => conditions.push(self.expression(part)),
                _ => {}
            }
        }
        let mut conditions = conditions.into_iter();
        Some(Latch { name: name?, set: conditions.next()??, clear: conditions.next()?? })
    }

    fn channel(&mut self, pair: RulePair<'_>, per_hand: bool) -> Option<Channel> {
        let span = self.piece.span(&pair);
        let (mut name, mut ty, mut default) = (None, None, None);
        for part in pair.into_inner() {
            match part.as_rule() {
                Rule::path => name = Some(self.path(&part)),
                Rule::value_type => ty = Some(self.value_type(part)?),
                Rule::expression => default = Some(self.expression(part)?),
                _ => {}
            }
        }
        Some(Channel { per_hand, name: name?, ty: ty?, default, span })
    }

    /// `vec3 m/s per finger`
    fn value_type(&mut self, pair: RulePair<'_>) -> Option<ValueType> {
        let span = self.piece.span(&pair);
        let (mut shape, mut dimension, mut axis) = (Shape::Scalar, Dimension::NONE, None);
        for part in pair.into_inner() {
            match part.as_rule() {
                Rule::kind => {
                    shape = match part.as_str() {
                        "bool" => Shape::Bool,
                        "vec3" => Shape::Vec3,
                        "rotation" => Shape::Rotation,
                        "object" => Shape::Object,
                        _ => Shape::Scalar,
                    };
                }
                Rule::unit | Rule::unknown_unit => dimension = self.unit(&part)?.1,
                Rule::axis => axis = Some(if part.as_str() == "finger" { Axis::Fingers } else { Axis::Contacts }),
                _ => {}
            }
        }
        Some(ValueType { shape, dimension, axis, span })
    }
}

impl Parser<'_> {
    /// The body of `stream { … }`: a channel begins with `optional`, or with a name and a colon.
    pub(super) fn channels(&mut self, tokens: Range<usize>, per_hand: bool) -> Vec<Channel> {
        let mut channels = Vec::new();
        let mut at = tokens.start;
        while at < tokens.end {
            if self.scan.word(at) == "for" && self.scan.word(at + 1) == "each" && !per_hand {
                let open = (at..tokens.end).find(|at| self.scan.word(*at) == "{");
                let head = at..open.map_or(tokens.end, |open| open + 1);
                let partner = open.and_then(|open| self.scan.tokens.get(open)).map_or(tokens.end, |open| open.partner);
                at = open.map_or(tokens.end, |open| self.scan.behind(open));
                self.head(head.clone(), Rule::only_hands_head, |_, _| Some(()));
                channels.extend(self.channels(head.end..partner.min(tokens.end), true));
                continue;
            }
            let next = (at + 1..tokens.end).find(|next| self.begins_channel(*next)).unwrap_or(tokens.end);
            let channel = self.piece(at..next, Rule::only_channel, |builder, pair| builder.channel(pair, per_hand));
            if channel.is_none() {
                let name_at = if self.scan.word(at) == "optional" { at + 1 } else { at };
                self.broken.push(self.scan.word(name_at).to_string());
            }
            channels.extend(channel);
            at = next;
        }
        channels
    }

    /// Whether a channel, or the block of the hands, begins here: `optional`, or a name with a colon, or with a type when the colon was
    /// forgotten.
    fn begins_channel(&self, at: usize) -> bool {
        let before = at.checked_sub(1).map_or("", |before| self.scan.word(before));
        let mut behind = at + 1;
        while self.scan.word(behind) == "." {
            behind += 2;
        }
        let named = match self.scan.word(behind) {
            ":" => !matches!(before, "." | "optional"),
            "bool" | "scalar" | "vec3" | "rotation" | "object" => self.scan.leads(at) && before != "optional",
            _ => false,
        };
        let head = self.scan.word(at);
        head == "optional" || named || head == "for" && self.scan.word(at + 1) == "each"
    }
}
