//! What can be drawn over time: the curves of the figures, whatever the rules compare with a threshold, their signals and latches, and the
//! channels of the log.

use super::decimation::{DecimatedCurve, Decimation, DecimationMode, curve, toggles};
use crate::scale::{Scale, scale as scale_of};
use crate::signals::{Panel, Signals, of_both};
use serde_json::{Value, json};
use teachtree_analysis::explain::{Row, of_channel, of_expr, quantities, text};
use teachtree_base::channels::{Axis, HANDLING, Shape};
use teachtree_base::error::InputError;
use teachtree_base::hands::Side;
use teachtree_base::units::Dimension;
use teachtree_engine::inspect::Inspector;
use teachtree_frames::frames::Frames;
use teachtree_language::rules::{Comparison, Expr, ExprKind, Hand, LatchId, ParamId, Rules, SignalId, TreeScope, Type};

/// Knots of all curves together, about, for each [`FRAMES`] of the recording; a knot takes three to four bytes.
const KNOTS: usize = 200_000;
/// Frames for which there are that many knots.
const FRAMES: usize = 20_000;
/// How many times that many knots a page holds at most.
const TIMES: usize = 8;
/// With fewer knots it is not a curve.
const KNOTS_OF_ONE: usize = 600;
/// The quantities that are shown first get this many times as many knots.
const FIRST: usize = 2;
/// Conditions whose truth is shaded behind a curve.
const MAX_SHADES: usize = 3;

/// The groups of the list, in order.
pub(super) const GROUPS: [&str; 4] =
    ["figures of the paper", "compared in the rules", "signals and latches", "channels"];

/// Something to draw, not evaluated yet.
struct CurveRequest {
    group: usize,
    title: String,
    /// Its expression in the rules.
    note: String,
    side: Option<Side>,
    of: CurveSource,
    thresholds: Vec<Threshold>,
    /// Conditions on it, by name.
    shades: Vec<(String, Expr)>,
}

enum CurveSource {
    /// An expression of the rules.
    Expr(Expr),
    /// A channel of the frames, by its position.
    Channel(u32),
    /// Curves that are known, in their unit.
    Panel(Panel),
}

/// A threshold, SI, with its name.
struct Threshold {
    value: f64,
    name: String,
    /// The param whose value it is.
    param: Option<ParamId>,
}

/// Evaluates all that can be drawn, one list entry each.
///
/// # Errors
/// When the rate of the log cannot honour a duration of the rules.
pub(super) fn all<'a>(
    rules: &'a Rules,
    frames: &Frames,
    inspectors: &mut [Inspector<'a>],
) -> Result<Vec<Value>, InputError> {
    let mut wanted = panels(frames);
    wanted.extend(compared(rules, frames));
    wanted.extend(declared(rules, frames));
    wanted.extend(channels(frames));
    let curves = wanted.iter().map(|wanted| curves_of(wanted, frames)).sum();
    let mut room = KnotBudget { knots: KNOTS * frames.len.div_ceil(FRAMES).clamp(1, TIMES), curves };
    let mut entries = Vec::new();
    for wanted in wanted {
        entries.extend(evaluated(wanted, rules, frames, inspectors, &mut room)?);
    }
    Ok(entries)
}

/// What is left for the curves that are left: a curve that takes few knots leaves more to the others.
struct KnotBudget {
    knots: usize,
    curves: usize,
}

impl KnotBudget {
    fn most(&self, group: usize) -> usize {
        let share = self.knots / self.curves.max(1);
        (if group < 2 { FIRST * share } else { share }).max(KNOTS_OF_ONE)
    }

    fn take(&mut self, decimated: DecimatedCurve) -> Value {
        self.knots = self.knots.saturating_sub(decimated.knots);
        self.curves = self.curves.saturating_sub(1);
        decimated.json
    }
}

/// Returns the hands of the log, then `None`.
fn owners(frames: &Frames) -> Vec<Option<Side>> {
    frames.layout.hands.iter().map(|hand| Some(hand.side)).chain([None]).collect()
}

fn panels(frames: &Frames) -> Vec<CurveRequest> {
    let of_hands = frames.layout.hands.iter().flat_map(|hand| {
        let panels = Signals::new(frames, hand.side).panels();
        panels.into_iter().map(|panel| (Some(hand.side), panel)).collect::<Vec<_>>()
    });
    let both = if frames.layout.hands.len() > 1 { of_both(frames) } else { Vec::new() };
    let panels = of_hands.chain(both.into_iter().map(|panel| (None, panel)));
    panels
        .filter(|(_, panel)| panel.curves.is_ok())
        .map(|(side, panel)| CurveRequest {
            group: 0,
            title: panel.title.into(),
            note: String::new(),
            side,
            of: CurveSource::Panel(panel),
            thresholds: Vec::new(),
            shades: Vec::new(),
        })
        .collect()
}

/// Every number that the rules hold against a constant, with all constants that it is held against.
fn compared(rules: &Rules, frames: &Frames) -> Vec<CurveRequest> {
    let mut found: Vec<CurveRequest> = Vec::new();
    let signals = rules.signals.iter().map(|signal| (signal.per_hand, Some(signal.name.as_str()), &signal.expr));
    let latches =
        rules.latches.iter().flat_map(|latch| [&latch.set, &latch.clear].map(|expr| (latch.per_hand, None, expr)));
    let trees = rules.trees.iter().flat_map(|tree| {
        let asked = tree.root.paths().into_iter().flat_map(|way| way.asked);
        asked.map(|(_, condition, _)| (tree.scope == TreeScope::EachHand, None, condition))
    });
    let all: Vec<(bool, Option<&str>, &Expr)> = signals.chain(latches).chain(trees).collect();
    for side in owners(frames) {
        for (per_hand, name, expr) in &all {
            if *per_hand == side.is_some() {
                expr.walk(&mut |part| {
                    // What a signal is as a whole has its name.
                    let name = name.filter(|_| part.span == expr.span);
                    add_comparison(rules, side, name, part, &mut found);
                });
            }
        }
    }
    found
}

fn add_comparison(
    rules: &Rules,
    side: Option<Side>,
    name: Option<&str>,
    condition: &Expr,
    found: &mut Vec<CurveRequest>,
) {
    let (value, thresholds) = match &condition.kind {
        ExprKind::Hysteresis { value, on, off, .. } => {
            let of = |constant: &teachtree_language::rules::Constant| Threshold {
                value: constant.value,
                name: if constant.params.is_empty() { String::new() } else { text(rules, constant.span) },
                param: match constant.params.as_slice() {
                    [param] => Some(*param).filter(|param| is_value_of(rules, *param, constant.value)),
                    _ => None,
                },
            };
            (value.as_ref(), vec![of(on), of(off)])
        }
        ExprKind::Compare(comparison, a, b) if a.ty.shape == Shape::Scalar => {
            let (value, other) = if constant(rules, a).is_some() { (b, a) } else { (a, b) };
            let Some(threshold) = constant(rules, other) else { return };
            if constant(rules, value).is_some() {
                return;
            }
            let named = !matches!(other.kind, ExprKind::Number(_)) && *comparison != Comparison::Equal;
            let name = if named { text(rules, other.span) } else { String::new() };
            let param = match other.kind {
                ExprKind::Param(id) => Some(id),
                _ => None,
            };
            (value.as_ref(), vec![Threshold { value: threshold, name, param }])
        }
        _ => return,
    };
    let shown = text(rules, value.span);
    let at = found.iter().position(|wanted| wanted.side == side && wanted.note == shown).unwrap_or_else(|| {
        let title = match name {
            Some(name) => format!("{name}: {shown}"),
            None => shown.clone(),
        };
        let (of, shades) = (CurveSource::Expr(value.clone()), Vec::new());
        found.push(CurveRequest { group: 1, title, note: shown.clone(), side, of, thresholds: Vec::new(), shades });
        found.len() - 1
    });
    let Some(wanted) = found.get_mut(at) else { return };
    for threshold in thresholds {
        let known =
            |other: &Threshold| other.value.to_bits() == threshold.value.to_bits() && other.name == threshold.name;
        if !wanted.thresholds.iter().any(known) {
            wanted.thresholds.push(threshold);
        }
    }
    let said = name.map_or_else(|| text(rules, condition.span), str::to_string);
    if condition.ty.axis.is_none()
        && wanted.shades.len() < MAX_SHADES
        && !wanted.shades.iter().any(|(known, _)| *known == said)
    {
        wanted.shades.push((said, condition.clone()));
    }
}

/// Whether a constant that reads a param is the param itself.
fn is_value_of(rules: &Rules, param: ParamId, value: f64) -> bool {
    rules.params.get(param.index()).is_some_and(|param| param.value.to_bits() == value.to_bits())
}

/// The value of a scalar that no frame changes.
fn constant(rules: &Rules, expr: &Expr) -> Option<f64> {
    match &expr.kind {
        ExprKind::Number(number) => Some(*number),
        ExprKind::Param(id) => rules.params.get(id.index()).map(|param| param.value),
        ExprKind::Negate(inner) => constant(rules, inner).map(|number| -number),
        ExprKind::Arithmetic(operation, a, b) => Some(operation.apply(constant(rules, a)?, constant(rules, b)?)),
        _ => None,
    }
}

/// Every signal and latch by its name.
fn declared(rules: &Rules, frames: &Frames) -> Vec<CurveRequest> {
    let mut found = Vec::new();
    for side in owners(frames) {
        let hand = if side.is_some() { Hand::This } else { Hand::Shared };
        let mut add = |name: &str, note: String, kind: ExprKind, ty: Type, span| {
            let of = CurveSource::Expr(Expr { kind, ty, span });
            let (thresholds, shades) = (Vec::new(), Vec::new());
            found.push(CurveRequest { group: 2, title: name.into(), note, side, of, thresholds, shades });
        };
        for (at, signal) in (0..).zip(&rules.signals).filter(|(_, signal)| signal.per_hand == side.is_some()) {
            let kind = ExprKind::Signal(SignalId(at), hand);
            add(&signal.name, text(rules, signal.expr.span), kind, signal.ty, signal.expr.span);
        }
        for (at, latch) in (0..).zip(&rules.latches).filter(|(_, latch)| latch.per_hand == side.is_some()) {
            let note = format!("set {} clear {}", text(rules, latch.set.span), text(rules, latch.clear.span));
            add(&latch.name, note, ExprKind::Latch(LatchId(at), hand), Type::BOOL, latch.span);
        }
    }
    found
}

fn channels(frames: &Frames) -> Vec<CurveRequest> {
    let mut found = Vec::new();
    for side in owners(frames) {
        for (at, channel) in (0..).zip(&frames.channels) {
            let drawn =
                !matches!(channel.shape, Shape::Object | Shape::Rotation) && !HANDLING.contains(&channel.name.as_str());
            if drawn && channel.per_hand == side.is_some() {
                let (thresholds, shades, note) = (Vec::new(), Vec::new(), String::new());
                let of = CurveSource::Channel(at);
                found.push(CurveRequest { group: 3, title: channel.name.clone(), note, side, of, thresholds, shades });
            }
        }
    }
    found
}

/// How many curves something has, about.
fn curves_of(wanted: &CurveRequest, frames: &Frames) -> usize {
    let (shape, axis) = match &wanted.of {
        CurveSource::Expr(expr) => (expr.ty.shape, expr.ty.axis.map(|(axis, _)| axis)),
        CurveSource::Channel(at) => {
            frames.channels.get(*at as usize).map_or((Shape::Scalar, None), |spec| (spec.shape, spec.axis))
        }
        CurveSource::Panel(panel) => return panel.curves.as_ref().map_or(0, Vec::len),
    };
    let hand = wanted.side.and_then(|side| frames.layout.hand(side));
    let slots = axis.map_or(1, |axis| match axis {
        Axis::Fingers => hand.map_or(0, |hand| hand.fingers.len()),
        Axis::Contacts => hand.map_or(0, |hand| hand.contacts.len()),
    });
    if shape == Shape::Bool { 0 } else { slots * shape.components().len() }
}

/// Rows of values with their names; each as long as the log, not a number outside of its stretches.
type Rows = Vec<(String, Vec<f64>)>;

fn evaluated<'a>(
    wanted: CurveRequest,
    rules: &Rules,
    frames: &Frames,
    inspectors: &mut [Inspector<'a>],
    room: &mut KnotBudget,
) -> Result<Option<Value>, InputError> {
    let CurveRequest { group, title, note, side, of, thresholds, shades } = wanted;
    let (rows, ty, unit): (Rows, (Shape, Dimension), Option<&str>) = match of {
        CurveSource::Expr(expr) => {
            (named(of_expr(&expr, side, frames, inspectors)?), (expr.ty.shape, expr.ty.dimension), None)
        }
        CurveSource::Channel(at) => {
            let Some(spec) = frames.channels.get(at as usize) else { return Ok(None) };
            (named(of_channel(at, side, frames)), (spec.shape, spec.dimension), None)
        }
        CurveSource::Panel(panel) => {
            let rows = panel.curves.unwrap_or_default().into_iter().map(|curve| (curve.name.to_string(), curve.values));
            (rows.collect(), (Shape::Scalar, Dimension::NONE), Some(panel.unit))
        }
    };
    if !rows.iter().any(|(_, row)| row.iter().any(|value| value.is_finite())) {
        return Ok(None);
    }
    let mut entry = json!({ "group": group, "title": title, "side": side.map_or("", Side::name) });
    let Some(fields) = entry.as_object_mut() else { return Ok(None) };
    if !note.is_empty() && note != title {
        fields.insert("note".into(), note.into());
    }
    if ty.0 == Shape::Bool {
        let truth = |row: &[f64]| toggles(&row.iter().map(|value| *value > 0.5).collect::<Vec<bool>>());
        fields.insert("truths".into(), rows.iter().map(|(name, row)| json!([name, truth(row)])).collect());
        return Ok(Some(entry));
    }
    let limits = thresholds.iter().map(|threshold| threshold.value);
    let values = rows.iter().flat_map(|(_, row)| row).copied().chain(limits).filter(|value| value.is_finite());
    let largest = values.map(f64::abs).fold(0.0, f64::max);
    let (scale, unit) = match unit {
        Some(unit) => (1.0, unit.to_string()),
        None => shown_in(&ty.1.si_unit(), largest),
    };
    fields.insert("unit".into(), unit.into());
    if !thresholds.is_empty() {
        let lines = thresholds.iter().map(|Threshold { value, name, param }| {
            let [quantity] = quantities([*value], &ty.1.si_unit());
            let shown = if name.is_empty() { quantity } else { format!("{name} {quantity}") };
            match param.and_then(|id| rules.params.get(id.index())) {
                // What moves the line: the param, and how many of the unit shown are one of SI.
                Some(param) => json!([value * scale, shown, param.name, scale]),
                None => json!([value * scale, shown]),
            }
        });
        fields.insert("thresholds".into(), lines.collect());
    }
    let mut shaded = Vec::new();
    for (name, condition) in shades {
        let truth =
            of_expr(&condition, side, frames, inspectors)?.into_iter().next().map(|row| row.values).unwrap_or_default();
        shaded.push(json!([name, toggles(&truth.iter().map(|value| *value > 0.5).collect::<Vec<bool>>())]));
    }
    if !shaded.is_empty() {
        fields.insert("shades".into(), shaded.into());
    }
    let limits: Vec<f64> = thresholds.iter().map(|threshold| threshold.value).collect();
    let curves = rows.iter().map(|(_, row)| row.as_slice());
    let mut seen = None;
    if let Some(Scale { least, greatest, left: true }) = scale_of(curves, &limits, frames.layout.rate_hz) {
        seen = Some((greatest - least) * scale);
        fields.insert("scale".into(), json!([least * scale, greatest * scale]));
    }
    let drawn = rows.into_iter().map(|(name, mut row)| {
        row.iter_mut().for_each(|value| *value *= scale);
        let keep = DecimationMode::Knots(room.most(group));
        json!([name, room.take(curve(&row, &frames.stretches, Decimation { within: 0.0, drawn: seen, keep }))])
    });
    fields.insert("curves".into(), drawn.collect());
    Ok(Some(entry))
}

/// What people read numbers of a unit in, when the largest is this: the factor and the unit.
fn shown_in(unit: &str, largest: f64) -> (f64, String) {
    match unit {
        "m" | "m/s" | "s" if largest < 1.0 => (1e3, format!("m{unit}")),
        "N" if largest < 0.1 => (1e3, "mN".into()),
        _ => (1.0, unit.to_string()),
    }
}

/// Rows with their names, `thumb x`.
fn named(rows: Vec<Row>) -> Rows {
    rows.into_iter().map(|row| ([&row.slot, row.component].join(" ").trim().to_string(), row.values)).collect()
}
