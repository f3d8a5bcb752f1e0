//! Describes the value of an expression on one frame: the number with its unit, or the truth with the deciding fact.

use super::fact::quantities;
use super::reason::{EvalPoint, Reasons};
use teachtree_base::channels::Shape;
use teachtree_base::error::InputError;
use teachtree_base::hands::Side;
use teachtree_engine::inspect::Inspector;
use teachtree_engine::runs::Leaves;
use teachtree_frames::frames::Frames;
use teachtree_language::rules::Expr;

/// Parts of a condition that are reported.
const MAX_PARTS: usize = 4;

/// The stretch and the frame that begins nearest to a time, s; `None` where the recording says nothing.
pub fn frame_at<'a>(frames: &Frames, leaves: &'a [Leaves], time_s: f64) -> Option<(&'a Leaves, usize)> {
    let half = 0.5 / frames.layout.rate_hz;
    let frame = frames.time.partition_point(|time| *time < time_s - half);
    let near = frames.time.get(frame).is_some_and(|time| *time - time_s <= half);
    leaves.iter().find(|leaves| near && leaves.frames.contains(&frame)).map(|leaves| (leaves, frame))
}

/// The value of an expression on a frame of the log, in a tree or declaration of hand `this` or of none: first the value, then, of a single
/// condition, what was measured and how much lies between.
///
/// # Errors
/// When the rate of the log cannot honour a duration in it.
pub fn value<'a>(
    inspector: &mut Inspector<'a>,
    expr: &'a Expr,
    this: Option<Side>,
    frame: usize,
) -> Result<Vec<String>, InputError> {
    let column = inspector.column(expr, this)?;
    let at = frame.saturating_sub(inspector.leaves().frames.start);
    if !column.is_array() {
        let mut lines = vec![element(inspector, expr, column.at(0, at))];
        if expr.ty.shape == Shape::Bool {
            let reason = Reasons { inspector, opens_counts: false }.reason(expr, EvalPoint::new(this, frame))?;
            lines.extend(reason.fact.map(|fact| fact.words(reason.holds)));
            let parts = reason.because.into_iter().take(MAX_PARTS);
            lines.extend(parts.map(|part| match &part.fact {
                Some(fact) => format!("{}: {}", part.condition, fact.words(part.holds)),
                None => format!("{} is {}", part.condition, part.holds),
            }));
        }
        return Ok(lines);
    }
    let spot = EvalPoint::new(this, frame);
    let slots: Vec<String> = (0..column.slots())
        .map(|slot| {
            let name = Reasons { inspector, opens_counts: false }.slot_name(expr, slot, spot);
            format!("{name} {}", element(inspector, expr, column.at(slot, at)))
        })
        .collect();
    Ok(vec![if slots.is_empty() { "nothing to run over".to_string() } else { slots.join(", ") }])
}

/// One element as people read it.
fn element(inspector: &Inspector, expr: &Expr, numbers: &[f64]) -> String {
    let unit = expr.ty.dimension.si_unit();
    match (expr.ty.shape, numbers) {
        (Shape::Bool, [truth]) => (*truth > 0.5).to_string(),
        (Shape::Object, [number]) => {
            let name = (*number >= 0.0).then(|| inspector.frames().objects.get(*number as usize)).flatten();
            name.map_or("none", String::as_str).to_string()
        }
        (Shape::Scalar, [number]) => {
            let [text] = quantities([*number], &unit);
            text
        }
        (Shape::Vec3, [x, y, z]) => format!("({})", quantities([*x, *y, *z], &unit).join(", ")),
        (Shape::Rotation, [w, x, y, z]) => format!("w x y z {}", quantities([*w, *x, *y, *z], "").join(" ")),
        _ => "not known".to_string(),
    }
}
