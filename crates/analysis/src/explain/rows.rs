//! The value of an expression or channel on every frame of a log: for curves and for tables.

use super::slots;
use teachtree_base::channels::Axis;
use teachtree_base::error::InputError;
use teachtree_base::hands::Side;
use teachtree_engine::inspect::Inspector;
use teachtree_frames::frames::{ColumnKey, Frames};
use teachtree_language::rules::{Expr, ExprKind, Hand};

/// One number per frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// The finger or body that it is of; empty for other values than arrays.
    pub slot: String,
    /// The component of a vector or rotation, such as `x`; empty for a single number.
    pub component: &'static str,
    /// As many values as the log has frames, SI; not a number outside of its stretches. Truth is 1 and 0, an object its number.
    pub values: Vec<f64>,
}

/// The values of an expression, in a tree or declaration of hand `side` or of none, by slot and component. `inspectors` are those of all stretches.
///
/// # Errors
/// When the rate of the log cannot honor a duration in it.
pub fn of_expr<'a>(
    expr: &Expr,
    side: Option<Side>,
    frames: &Frames,
    inspectors: &mut [Inspector<'a>],
) -> Result<Vec<Row>, InputError> {
    let whose = |hand: Hand| hand.side(side);
    let axis = expr.ty.axis.and_then(|(axis, hand)| Some((axis, frames.layout.hand(whose(hand)?)?)));
    let names = axis.map_or_else(Vec::new, |(axis, hand)| match (&expr.kind, inspectors.first()) {
        // Which fingers a signal leaves out stands where it is declared.
        (ExprKind::Signal(id, _), Some(inspector)) => slots(&inspector.rules().signals[id.index()].expr, axis, hand),
        _ => slots(expr, axis, hand),
    });
    let mut rows: Vec<Row> = Vec::new();
    for inspector in inspectors {
        let column = inspector.column(expr, side)?;
        let width = column.at(0, 0).len();
        let stretch = inspector.leaves().frames.clone();
        for slot in 0..column.slots() {
            for component in 0..width {
                let at = slot * width + component;
                if rows.len() <= at {
                    let slot = names.get(slot).cloned().unwrap_or_default();
                    let (component, values) = (component_name(width, component), vec![f64::NAN; frames.len]);
                    rows.push(Row { slot, component, values });
                }
                let row = rows.get_mut(at).and_then(|row| row.values.get_mut(stretch.clone()));
                for (frame, value) in row.into_iter().flatten().enumerate() {
                    *value = column.at(slot, frame).get(component).copied().unwrap_or(f64::NAN);
                }
            }
        }
    }
    Ok(rows)
}

/// The values of a channel of the frames, by its position in them.
pub fn of_channel(at: u32, side: Option<Side>, frames: &Frames) -> Vec<Row> {
    let Some(spec) = frames.channels.get(at as usize) else { return Vec::new() };
    let hand = side.and_then(|side| frames.layout.hand(side));
    let names: Vec<String> = match (spec.axis, hand) {
        (Some(Axis::Fingers), Some(hand)) => hand.fingers.iter().map(ToString::to_string).collect(),
        (Some(Axis::Contacts), Some(hand)) => hand.contacts.clone(),
        _ => vec![String::new()],
    };
    let components = spec.shape.components();
    let mut rows = Vec::new();
    for (number, slot) in (0..).zip(&names) {
        for (place, component) in (0..).zip(components) {
            let key = ColumnKey { channel: at, side, slot: number, component: place };
            let values = frames.column(key).map(<[f64]>::to_vec);
            rows.extend(values.map(|values| Row { slot: slot.clone(), component, values }));
        }
    }
    rows
}

fn component_name(width: usize, component: usize) -> &'static str {
    let names: &[&str] = match width {
        3 => &["x", "y", "z"],
        4 => &["w", "x", "y", "z"],
        _ => &[],
    };
    names.get(component).copied().unwrap_or("")
}
