//! Channels: the raw ones of `stream`, the derived ones that are built in, and the list of those that the rules read.

use super::Resolver;
use super::names::Declarations;
use crate::codes;
use crate::rules::{ChannelId, Constant};
use crate::syntax::{Channel, Expr, ExprKind, HandPrefix};
use crate::types::Scope;
use std::collections::{BTreeMap, BTreeSet};
use teachtree_base::channels::{Axis, ChannelSpec, DERIVED, Fallback, Shape};
use teachtree_base::diagnostic::{Diagnostic, Span};
use teachtree_base::units::Dimension;

/// The channels that the analysis always needs.
const FOR_ANALYSIS: &[&str] =
    &["fingers.position", "fingers.force", "fingers.contact", "target", "target.position", "target.rotation"];

impl Resolver {
    /// Declares the channels with their types; defaults follow when the params are known.
    ///
    /// A channel may be declared in several files with one type: it is needed when one of them needs it.
    pub(super) fn declare_channels(&mut self, declared: &Declarations<'_>) {
        for derived in DERIVED {
            self.add_channel(ChannelSpec {
                name: derived.name.to_string(),
                per_hand: derived.per_hand,
                axis: derived.axis,
                shape: derived.shape,
                dimension: derived.dimension,
                absent: Fallback::Derived,
            });
        }
        let mut first: BTreeMap<String, (&Channel, Span)> = BTreeMap::new();
        for channel in &declared.channels {
            let name = channel.name.text();
            if DERIVED.iter().any(|derived| derived.name == name) {
                self.report(
                    Diagnostic::error(codes::NAME_TAKEN, format!("`{name}` is derived from other channels"))
                        .at(channel.name.span, "no log carries it")
                        .help("remove this line; derived channels need no declaration"),
                );
                continue;
            }
            if let Some(hand) = channel.name.parts.first().filter(|first| HandPrefix::from_name(&first.text).is_some())
            {
                self.report(
                    Diagnostic::error(codes::NAME_TAKEN, format!("`{}` is a hand already", hand.text))
                        .at(hand.span, "no channel begins with a hand")
                        .help("declare it in `for each hand { … }`, without the hand"),
                );
                self.names.broken.insert(name);
                continue;
            }
            if channel.ty.axis.is_some() && !channel.per_hand {
                self.report(
                    Diagnostic::error(
                        codes::WHOSE_HAND,
                        format!("`{name}` runs over the fingers or contacts of a hand"),
                    )
                    .at(channel.span, "declared for no hand")
                    .help("move it into `for each hand { … }`"),
                );
                self.names.broken.insert(name);
                continue;
            }
            if let Some((known, span)) = first.get(&name) {
                let same = known.per_hand == channel.per_hand
                    && (known.ty.shape, known.ty.dimension, known.ty.axis)
                        == (channel.ty.shape, channel.ty.dimension, channel.ty.axis);
                let finding = Diagnostic::error(codes::DECLARED_TWICE, format!("there is a channel `{name}` already"))
                    .at(channel.name.span, "declared again here")
                    .at(*span, "first declared here");
                if !same {
                    self.report(finding.help("give both the same type"));
                }
                continue;
            }
            first.insert(name.clone(), (channel, channel.name.span));
            self.add_channel(ChannelSpec {
                name,
                per_hand: channel.per_hand,
                axis: channel.ty.axis,
                shape: channel.ty.shape,
                dimension: channel.ty.dimension,
                absent: Fallback::Refused,
            });
        }
    }

    fn add_channel(&mut self, channel: ChannelSpec) {
        let head = channel.name.split('.').next().unwrap_or("").to_string();
        self.names.channel_heads.insert(head);
        self.names.channels.insert(channel.name.clone(), channel);
    }

    /// Works out what stands for the optional channels that a log lacks.
    pub(super) fn channel_defaults(&mut self, declared: &Declarations<'_>) {
        let needed: BTreeSet<String> = declared
            .channels
            .iter()
            .filter(|channel| channel.default.is_none())
            .map(|channel| channel.name.text())
            .collect();
        let mut first: BTreeMap<String, (Fallback, Span)> = BTreeMap::new();
        for channel in &declared.channels {
            let name = channel.name.text();
            let Some(default) = &channel.default else { continue };
            let Some(absent) = self.default_of(channel, default) else { continue };
            if let Some((known, span)) = first.get(&name) {
                if *known != absent {
                    self.report(
                        Diagnostic::error(codes::DECLARED_TWICE, format!("`{name}` has another default already"))
                            .at(default.span, "another default here")
                            .at(*span, "first default here")
                            .help("give both the same default, or leave one declaration out"),
                    );
                }
                continue;
            }
            first.insert(name.clone(), (absent.clone(), default.span));
            if needed.contains(&name) {
                continue;
            }
            if let Some(known) = self.names.channels.get_mut(&name) {
                known.absent = absent;
            }
        }
    }

    fn default_of(&mut self, channel: &Channel, default: &Expr) -> Option<Fallback> {
        match &default.bare().kind {
            ExprKind::Bool(value) if channel.ty.shape == Shape::Bool => {
                Some(Fallback::Constant(f64::from(u8::from(*value))))
            }
            ExprKind::Hysteresis { value, on, off, rising: true } if channel.ty.shape == Shape::Bool => {
                self.norm_above(channel, value, on, off)
            }
            _ if matches!(channel.ty.shape, Shape::Scalar | Shape::Vec3) => {
                let Constant { value, .. } = self.constant(default, Some(channel.ty.dimension), Scope::SHARED)?;
                Some(Fallback::Constant(value))
            }
            // An angle other than 0 would need an axis.
            _ if channel.ty.shape == Shape::Rotation => {
                let angle = self.constant(default, Some(Dimension::ANGLE), Scope::SHARED)?;
                if angle.value != 0.0 {
                    self.report(
                        Diagnostic::error(codes::NOT_CONSTANT, "invalid default of a rotation")
                            .at(default.span, "an angle without an axis")
                            .help("write `0 deg`, the rotation of the reference frame"),
                    );
                    return None;
                }
                Some(Fallback::Constant(0.0))
            }
            _ => {
                self.report(
                    Diagnostic::error(codes::NOT_CONSTANT, "this cannot replace a channel that a log lacks")
                        .at(default.span, "neither a constant nor `norm(channel) above … until below …`"),
                );
                None
            }
        }
    }

    /// `norm(fingers.force) above touch_on until below touch_off`
    fn norm_above(&mut self, channel: &Channel, value: &Expr, on: &Expr, off: &Expr) -> Option<Fallback> {
        let source = match &value.bare().kind {
            ExprKind::Call(function, arguments) if function.text() == "norm" => match arguments.as_slice() {
                [Expr { kind: ExprKind::Path(path), .. }] => Some((path.text(), path.span)),
                _ => None,
            },
            _ => None,
        };
        let Some((source, place)) = source else {
            self.report(
                Diagnostic::error(codes::NOT_CONSTANT, "this cannot replace a channel that a log lacks")
                    .at(value.span, "only `norm(channel)` may be tested here"),
            );
            return None;
        };
        let Some(spec) = self.names.channel(&source).cloned() else {
            self.unknown("channel", &source, place, |resolver| resolver.names.channels.keys().cloned().collect());
            return None;
        };
        let fits = spec.shape == Shape::Vec3 && spec.axis == channel.ty.axis && spec.per_hand == channel.per_hand;
        if !fits || spec.absent == Fallback::Derived {
            let over = if channel.ty.axis == Some(Axis::Fingers) { "a raw vec3 per finger" } else { "a raw vec3" };
            self.report(
                Diagnostic::error(codes::WRONG_TYPE, format!("`{source}` cannot replace `{}`", channel.name.text()))
                    .at(place, format!("{over} is expected here"))
                    .at(channel.name.span, "for this channel"),
            );
            return None;
        }
        let on_value = self.constant(on, Some(spec.dimension), Scope::SHARED)?;
        let off_value = self.constant(off, Some(spec.dimension), Scope::SHARED)?;
        self.threshold_order(&on_value, &off_value, true)?;
        Some(Fallback::NormAbove { channel: source, on: on_value.value, off: off_value.value, needed: true })
    }

    /// The position of a channel in the list of those that are read; it is added when it is new.
    pub fn read_channel(&mut self, name: &str) -> Option<ChannelId> {
        let at = match self.rules.channels.iter().position(|channel| channel.name == name) {
            Some(at) => at,
            None => {
                let spec = self.names.channel(name)?.clone();
                self.rules.channels.push(spec);
                self.rules.channels.len() - 1
            }
        };
        u32::try_from(at).ok().map(ChannelId)
    }

    /// Adds what analysis needs, and what the defaults of the channels read.
    pub(super) fn keep_channels_for_analysis(&mut self) {
        for name in FOR_ANALYSIS {
            let read = self.rules.channels.len();
            self.read_channel(name);
            if let Some(ChannelSpec { absent: Fallback::NormAbove { needed, .. }, .. }) =
                self.rules.channels.get_mut(read)
            {
                *needed = false;
            }
        }
        let mut at = 0;
        while let Some(channel) = self.rules.channels.get(at) {
            if let Fallback::NormAbove { channel, needed: true, .. } = channel.absent.clone() {
                self.read_channel(&channel);
            }
            at += 1;
        }
    }
}
