//! The opening of a gripper whose log has counts, a percentage or a share of it: by the stroke of a known gripper, else by a usual one.

use super::parts::Part;
use super::words;
use crate::inspect::ColumnReport;

/// Grippers by words in names, with their strokes and another one, mm, and what both are.
const STROKES: [(&[&str], [f64; 2], [&str; 2]); 2] = [
    (&["robotiq", "rq"], [85.0, 140.0], ["that of a Robotiq 2F-85", "that of a 2F-140"]),
    (&["panda", "franka", "fr3"], [80.0, 100.0], ["that of a Franka hand", "another one"]),
];
/// Other grippers.
const USUAL: ([f64; 2], [&str; 2]) = ([80.0, 100.0], ["a usual one", "another one"]);
/// A gripper that would be less open while it holds something has another scale, mm: at 2 mm the rules take it for empty. The second number is for a log that
/// does not show that the gripper holds something there.
const LEAST_MM: [f64; 2] = [4.0, 12.0];

/// The whole of a percentage, and the most counts.
const PERCENT: f64 = 100.0;
const COUNTS: f64 = 255.0;

/// How a column counts the opening.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// The value at one end; that at the other one is 0.
    most: f64,
    /// What it is called.
    name: &'static str,
}

/// An opening by a stroke.
pub struct Stroke {
    /// The columns, as a binding writes them.
    pub columns: String,
    /// Why, and what else it may be.
    pub reason: String,
    /// The opening at the closed end, m.
    pub closed_m: f64,
}

impl Scale {
    /// How a column counts, if it has counts up to 255, a percentage or a share.
    pub fn of(part: &Part, is_counted: bool) -> Option<Self> {
        let [column] = part.members[..] else { return None };
        let is_within = |most: f64| column.min >= -0.02 * most && column.max <= 1.02 * most;
        let is_other =
            words::has(&part.words, &["rad", "deg", "angle", "joint", "ticks", "qpos", "output", "outputs", "finger"]);
        let says_percent = words::has(&part.words, &["pct", "percent", "percentage"]);
        match () {
            () if says_percent && column.unit.is_empty() && is_within(PERCENT) => {
                Some(Self { most: PERCENT, name: "percent" })
            }
            () if is_counted => Some(Self { most: COUNTS, name: "counts up to 255" }),
            () if !part.unit.is_empty() || is_other => None,
            () if is_within(1.0) && column.max > 0.5 => Some(Self { most: 1.0, name: "a share, by its range," }),
            () if is_within(PERCENT) && column.max > 20.0 => {
                Some(Self { most: PERCENT, name: "percent, by its range," })
            }
            () => None,
        }
    }

    /// The opening of a gripper that is closed at a value, and is 0 at the same end of the scale; `is_held` if an object moves with it there. `None` if that would
    /// be shut.
    pub fn stroke(self, part: &Part, closed: f64, is_low_closed: bool, is_held: bool) -> Option<Stroke> {
        let of_ur = || (self.most > PERCENT && is_beside_ur(part)).then(|| &STROKES[0]);
        let known = STROKES.iter().find(|(known, ..)| words::has(&part.words, known)).or_else(of_ur);
        let ([stroke_mm, other_mm], [of, of_other]) = known.map_or(USUAL, |(_, strokes, of)| (*strokes, *of));
        let columns = |stroke_mm: f64| {
            let factor: f64 = format!("{:.3e}", stroke_mm / self.most).parse().unwrap_or_default();
            let sign = if is_low_closed { "" } else { "-" };
            let offset = if is_low_closed { String::new() } else { format!(" + {stroke_mm}") };
            format!("{} * {sign}{factor}{offset} [mm]", part.pattern)
        };
        let share = if is_low_closed { closed / self.most } else { 1.0 - closed / self.most };
        let [least_mm, unsure_mm] = LEAST_MM;
        (share * stroke_mm > if is_held { least_mm } else { unsure_mm }).then(|| Stroke {
            columns: columns(stroke_mm),
            reason: format!(
                "{} of the stroke, which is not in the log: {stroke_mm} mm is {of}; for {other_mm} mm, {of_other}, `{}`",
                self.name,
                columns(other_mm)
            ),
            closed_m: share * stroke_mm * 1e-3,
        })
    }
}

/// Whether it is the `gripper_position` beside the columns that a controller of Universal Robots sends: the driver of a Robotiq counts so.
pub fn is_beside_ur(part: &Part) -> bool {
    let is_of_ur =
        |column: &ColumnReport| ["actual_TCP_pose", "actual_q"].iter().any(|name| column.name.starts_with(name));
    ["gripper", "position"].iter().all(|word| words::has(&part.words, &[word]))
        && part.sheet.columns.iter().any(is_of_ur)
}
