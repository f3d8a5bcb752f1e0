//! Names in expressions: params, signals, latches, channels and their components, with or without a hand.

use super::{Scope, describe, scalar};
use crate::codes;
use crate::resolve::{Resolver, State, Value, ValueKind};
use crate::rules::{Expr, ExprKind, Hand, LatchId, ParamId, SignalId, Type};
use crate::syntax::{HandPrefix, Name, Path, join};
use teachtree_base::channels::{ChannelSpec, Shape};
use teachtree_base::diagnostic::{Diagnostic, Span};
use teachtree_base::hands::{Finger, Side};

impl Resolver {
    /// `left.target.velocity.z`, `touching`, `moves`, `either.touching`
    pub(super) fn path(&mut self, path: &Path, scope: Scope) -> Option<Expr> {
        let (whose, parts) = path.whose();
        let asked = match whose {
            None => None,
            Some(HandPrefix::Side(side)) => Some(Hand::Named(side)),
            Some(HandPrefix::Other) => match scope.hand {
                Hand::This => Some(Hand::Other),
                Hand::Named(side) => Some(Hand::Named(side.other())),
                Hand::Other | Hand::Shared => {
                    self.report(
                        Diagnostic::error(codes::WHOSE_HAND, "`other` is the other hand of a hand")
                            .at(path.span, "and here there is none")
                            .help("`either` reads one hand or the other, `left` and `right` one hand"),
                    );
                    return None;
                }
            },
            Some(HandPrefix::Either) => return self.of_hands(path, parts, false, scope),
            Some(HandPrefix::Both) => return self.of_hands(path, parts, true, scope),
        };
        self.path_of(path, parts, asked, scope)
    }

    /// `either.touching`, `both.touching`: what the author would write as `left.touching or right.touching`, or with `and`.
    fn of_hands(&mut self, path: &Path, parts: &[Name], all: bool, scope: Scope) -> Option<Expr> {
        let left = self.path_of(path, parts, Some(Hand::Named(Side::Left)), scope)?;
        if left.ty != Type::BOOL {
            let word = if all { "both" } else { "either" };
            let finding =
                Diagnostic::error(codes::WRONG_TYPE, format!("`{word}` takes a single condition of the hands"))
                    .at(path.span, format!("this is {}", describe(left.ty)));
            self.report(finding.help("declare the condition as a signal in `for each hand { … }`"));
            return None;
        }
        let right = self.path_of(path, parts, Some(Hand::Named(Side::Right)), scope)?;
        let hands = vec![left, right];
        let kind = if all { ExprKind::And(hands) } else { ExprKind::Or(hands) };
        Some(Expr { kind, ty: Type::BOOL, span: path.span })
    }

    /// A path after its hand, if one is written.
    fn path_of(&mut self, path: &Path, parts: &[Name], side: Option<Hand>, scope: Scope) -> Option<Expr> {
        let Some(head) = parts.first() else {
            self.report(
                Diagnostic::error(codes::NO_HAND, format!("`{}` is a hand, not a value", path.text()))
                    .at(path.span, "a value of this hand belongs here")
                    .help(format!("write `{}.touching`", path.text())),
            );
            return None;
        };
        let whole = |length: usize| {
            let last = parts.get(length.saturating_sub(1)).unwrap_or(head);
            Span { end: last.span.end, ..path.span }
        };
        if let Some(value) = self.names.values.get(&head.text).copied() {
            let expr = self.value_of(head, value, side, whole(1), scope)?;
            return self.components(expr, parts.get(1..).unwrap_or_default());
        }
        // The longest channel name that the path begins with.
        for length in (1..=parts.len()).rev() {
            let name = join(parts.get(..length).unwrap_or_default());
            // An object has channels of its own, but no components.
            let is_object = |channel: &ChannelSpec| channel.shape == Shape::Object && length < parts.len();
            if self.names.channel(&name).is_some_and(|channel| !is_object(channel)) {
                let expr = self.channel_of(&name, side, whole(length), scope)?;
                return self.components(expr, parts.get(length..).unwrap_or_default());
            }
        }
        let word = path.parts.first().filter(|_| side.is_some());
        self.unknown_path(path, word.map(|word| word.text.as_str()), parts);
        None
    }

    fn components(&mut self, expr: Expr, components: &[Name]) -> Option<Expr> {
        components.iter().try_fold(expr, |expr, component| {
            let span = expr.span.to(component.span);
            self.component(expr, component, span)
        })
    }

    fn unknown_path(&mut self, path: &Path, side: Option<&str>, parts: &[Name]) {
        if let Some(picked) = self.finger_first(side, parts) {
            let finding = Diagnostic::error(codes::UNKNOWN_NAME, format!("there is no channel `{}`", path.text()))
                .at(path.span, "a finger is picked from an array over fingers");
            self.report(finding.fix(format!("did you mean `{picked}`?"), path.span, picked));
            return;
        }
        let kind = if parts.len() > 1 { "channel" } else { "value" };
        self.unknown(kind, &path.text(), path.span, |resolver| {
            let prefix = side.map_or(String::new(), |side| format!("{side}."));
            let values = resolver.names.values.iter().map(|(name, value)| (name, value.per_hand));
            let channels = resolver.names.channels.iter().map(|(name, channel)| (name, channel.per_hand));
            let reachable = values.chain(channels).filter(|(_, per_hand)| side.is_none() || *per_hand);
            reachable.map(|(name, _)| format!("{prefix}{name}")).collect()
        });
    }

    /// `fingers.force[thumb].z` for `thumb.force.z`, when there is such a channel.
    fn finger_first(&self, side: Option<&str>, parts: &[Name]) -> Option<String> {
        let [finger, rest @ ..] = parts else { return None };
        Finger::from_name(&finger.text)?;
        (1..=rest.len()).rev().find_map(|length| {
            let (channel, components) = rest.split_at_checked(length)?;
            let channel = format!("fingers.{}", join(channel));
            self.names.channel(&channel)?;
            let hand = side.map_or(String::new(), |side| format!("{side}."));
            let components: String = components.iter().map(|part| format!(".{}", part.text)).collect();
            Some(format!("{hand}{channel}[{}]{components}", finger.text))
        })
    }

    fn value_of(&mut self, name: &Name, value: Value, side: Option<Hand>, span: Span, scope: Scope) -> Option<Expr> {
        self.used.insert(name.text.clone());
        let text = &name.text;
        let hand = self.whose(text, value.per_hand, side, span, scope, Some(value.span))?;
        if value.what == ValueKind::Latch {
            self.memory_allowed(&format!("the latch `{text}`"), span, Some(value.span), scope)?;
        }
        let id = match value.state {
            State::Known(id) => id,
            State::Broken => return None,
            State::Waiting => {
                let finding =
                    Diagnostic::error(codes::READ_TOO_EARLY, format!("`{text}` is read before it is declared"))
                        .at(span, "read here")
                        .at(value.span, "declared here");
                // Once is enough: its declaration is found later.
                self.names.set_state(text, State::Broken);
                self.report(match value.what {
                    ValueKind::Latch => finding.help("latches are updated in order: a latch reads only those above it"),
                    ValueKind::Param | ValueKind::Signal => finding.help("move its declaration up"),
                });
                return None;
            }
        };
        let (kind, ty) = match value.what {
            ValueKind::Param => {
                let id = ParamId(id);
                (ExprKind::Param(id), scalar(self.param_value(id)?.dimension))
            }
            ValueKind::Signal => {
                let id = SignalId(id);
                let ty = self.rules.signals.get(id.index())?.ty;
                (ExprKind::Signal(id, hand), of_hand(ty, hand))
            }
            ValueKind::Latch => (ExprKind::Latch(LatchId(id), hand), Type::BOOL),
        };
        Some(Expr { kind, ty, span })
    }

    pub(super) fn channel_of(&mut self, name: &str, side: Option<Hand>, span: Span, scope: Scope) -> Option<Expr> {
        let spec = self.names.channel(name)?.clone();
        let hand = self.whose(name, spec.per_hand, side, span, scope, None)?;
        let id = self.read_channel(name)?;
        let ty = Type { shape: spec.shape, dimension: spec.dimension, axis: spec.axis.map(|axis| (axis, hand)) };
        Some(Expr { kind: ExprKind::Channel(id, hand), ty, span })
    }

    /// Whose value is meant: a side that is written, else the hand at hand. Reports a side too little or too much.
    fn whose(
        &mut self,
        name: &str,
        per_hand: bool,
        side: Option<Hand>,
        span: Span,
        scope: Scope,
        declared: Option<Span>,
    ) -> Option<Hand> {
        let finding = match (per_hand, side) {
            (true, Some(side)) => return Some(side),
            (true, None) if scope.hand != Hand::Shared => return Some(scope.hand),
            (false, None) => return Some(Hand::Shared),
            (true, None) => Diagnostic::error(codes::WHOSE_HAND, format!("each hand has its own `{name}`"))
                .at(span, "it is ambiguous which hand is meant")
                .help(format!("write `left.{name}` or `right.{name}`")),
            (false, Some(side)) => Diagnostic::error(codes::NO_HAND, format!("`{name}` belongs to no hand"))
                .at(
                    span,
                    match side {
                        Hand::Named(side) => format!("read from the {side} hand"),
                        _ => "read from the other hand".to_string(),
                    },
                )
                .fix("leave the hand out", span, name),
        };
        self.report(match declared {
            Some(declared) => finding.at(declared, "declared here"),
            None => finding,
        });
        None
    }
}

/// The type of a hand's value seen through whose it is: an array over this hand's fingers is one over the left hand's when it is `left.…`.
fn of_hand(ty: Type, hand: Hand) -> Type {
    let axis = ty.axis.map(|(axis, own)| (axis, own.seen_from(hand)));
    Type { axis, ..ty }
}
