//! What is true of recordings without labels, by the contacts that the solver found and by the angles that were measured: not by what the rules make
//! of them.

use teachtree_analysis::TrackId;
use teachtree_base::hands::Side;
use teachtree_base::recording::Recording;

/// Times that differ by less are the same, s.
const ROUNDING_S: f64 = 1e-9;
/// A hold that is lost for less, s, goes on; what is carried for less was not lifted; a hold that lasts less is none.
const LOST_S: f64 = 0.3;
const CARRIED_S: f64 = 0.3;
/// A nut is on its peg from this far below the rim on, m, whose middle is within `ON_PEG_M`; the rim is where a nut rests on it.
const BELOW_RIM_M: f64 = 0.002;
const ON_PEG_M: f64 = 0.020;

/// A stretch of time, s.
#[derive(Clone, Copy, Debug)]
pub struct TimeSpan {
    pub from_s: f64,
    pub to_s: f64,
}

/// A primitive that begins: whose, under which names, when.
pub struct PrimitiveStart {
    pub who: TrackId,
    pub names: &'static [&'static str],
    pub at_s: f64,
}

/// A column of flags.
fn flags(recording: &Recording, name: &str) -> Option<Vec<bool>> {
    recording.columns.get(name).map(|column| column.values.iter().map(|value| *value > 0.5).collect())
}

fn values<'a>(recording: &'a Recording, name: &str) -> Option<&'a [f64]> {
    recording.columns.get(name).map(|column| column.values.as_slice())
}

/// The stretches in which a condition holds, those that are less than `apart_s` apart joined, and those that are shorter than `least_s` left out.
fn stretches(recording: &Recording, holds: &[bool], apart_s: f64, least_s: f64) -> Vec<TimeSpan> {
    let mut found: Vec<TimeSpan> = Vec::new();
    for ((&at_s, &next_s), _) in
        recording.time.iter().zip(recording.time.iter().skip(1)).zip(holds).filter(|(_, holds)| **holds)
    {
        match found.last_mut().filter(|last| at_s - last.to_s <= apart_s + ROUNDING_S) {
            Some(last) => last.to_s = next_s,
            None => found.push(TimeSpan { from_s: at_s, to_s: next_s }),
        }
    }
    found.retain(|it| it.to_s - it.from_s >= least_s);
    found
}

/// The contacts of an object with what may carry it, at each row.
fn carried(recording: &Recording, object: &str) -> Vec<bool> {
    let mut carried = vec![false; recording.time.len()];
    for (name, column) in &recording.columns {
        let mut parts = name.split('.');
        let of_object = parts.next() == Some("contact")
            && [parts.next(), parts.next()].contains(&Some(object))
            && parts.next().is_none();
        if of_object {
            carried.iter_mut().zip(&column.values).for_each(|(carried, value)| *carried |= *value > 0.5);
        }
    }
    carried
}

fn objects(recording: &Recording) -> Vec<String> {
    recording
        .scene
        .bodies
        .keys()
        .filter(|name| recording.columns.contains_key(&format!("right.thumb.contact.{name}")))
        .cloned()
        .collect()
}

fn rows(recording: &Recording, gold: TimeSpan) -> impl Iterator<Item = (usize, f64)> {
    recording.time.iter().copied().enumerate().filter(move |(_, at_s)| (gold.from_s..gold.to_s).contains(at_s))
}

/// Grasp when both fingers are on, Translate when nothing carries the object any more, Insert when a nut is below the rim of its peg, Release when the
/// first finger goes, of every object that is lifted.
pub fn one_arm(recording: &Recording) -> Vec<PrimitiveStart> {
    let right = TrackId::Hand(Side::Right);
    let mut starts = Vec::new();
    for object in objects(recording) {
        let finger = |finger: &str| flags(recording, &format!("right.{finger}.contact.{object}")).unwrap_or_default();
        let (thumb, index) = (finger("thumb"), finger("index"));
        let both: Vec<bool> = thumb.iter().zip(&index).map(|(one, other)| *one && *other).collect();
        let borne = carried(recording, &object);
        for hold in stretches(recording, &both, LOST_S, LOST_S) {
            let free: Vec<bool> = (0..borne.len())
                .map(|row| !borne[row] && (hold.from_s..hold.to_s).contains(&recording.time[row]))
                .collect();
            let Some(lifted) = stretches(recording, &free, 0.13, CARRIED_S).first().copied() else { continue };
            starts.push(PrimitiveStart { who: right, names: &["Grasp"], at_s: hold.from_s });
            starts.push(PrimitiveStart { who: right, names: &["Translate"], at_s: lifted.from_s });
            if let Some(at_s) = inserted(recording, &object, hold) {
                starts.push(PrimitiveStart { who: right, names: &["Insert"], at_s });
            }
            if recording.time.last().is_some_and(|end| hold.to_s + 0.05 < *end) {
                starts.push(PrimitiveStart { who: right, names: &["Release"], at_s: hold.to_s });
            }
        }
    }
    starts
}

/// When the origin of an object is below the rim of a peg in the scene, the last time before it is let go.
fn inserted(recording: &Recording, object: &str, hold: TimeSpan) -> Option<f64> {
    let [x, y, z] = ["x", "y", "z"].map(|axis| values(recording, &format!("{object}.position.{axis}")));
    let (x, y, z) = (x?, y?, z?);
    let pegs: Vec<[f64; 3]> = recording
        .scene
        .bodies
        .values()
        .filter(|body| !body.sockets.is_empty())
        .map(|body| body.position.map(|length| length.0))
        .collect();
    let below = |row: usize| {
        pegs.iter().any(|[px, py, pz]| (x[row] - px).hypot(y[row] - py) < ON_PEG_M && z[row] < pz - BELOW_RIM_M)
    };
    let mut since = None;
    for (row, at_s) in rows(recording, hold) {
        since = if below(row) { since.or(Some(at_s)) } else { None };
    }
    since
}

/// From the touch of the receiver that was not lost again to the last one of the giver.
pub fn hand_overs(recording: &Recording) -> Vec<TimeSpan> {
    let touch = |side: &str, fingers: &[&str]| -> Vec<Vec<bool>> {
        fingers.iter().filter_map(|finger| flags(recording, &format!("{side}.{finger}.contact.hammer"))).collect()
    };
    let any = |side: &str| -> Vec<bool> {
        let fingers = touch(side, &["thumb", "index", "palm"]);
        (0..recording.time.len()).map(|row| fingers.iter().any(|it| it[row])).collect()
    };
    let held = |side: &str| -> Vec<bool> {
        let fingers = touch(side, &["thumb", "index"]);
        (0..recording.time.len()).map(|row| fingers.iter().all(|it| it[row])).collect()
    };
    let mut found = Vec::new();
    for (giver, receiver) in [("right", "left"), ("left", "right")] {
        // The giver's last touch in a stretch that was a hold, while the receiver holds and goes on holding.
        for hold in stretches(recording, &held(giver), LOST_S, 1.0) {
            let touches = stretches(recording, &any(giver), 0.0, 0.0);
            let Some(last) = touches.iter().find(|it| it.from_s < hold.to_s && hold.to_s <= it.to_s + 1e-6) else {
                continue;
            };
            let of_receiver = stretches(recording, &any(receiver), 0.0, 0.0);
            let Some(taken) = of_receiver.iter().find(|it| it.from_s < last.to_s && last.to_s < it.to_s) else {
                continue;
            };
            let holds = stretches(recording, &held(receiver), LOST_S, 0.1);
            if holds.iter().any(|it| it.from_s < last.to_s && last.to_s < it.to_s) {
                found.push(TimeSpan { from_s: taken.from_s, to_s: last.to_s });
            }
        }
    }
    found
}

/// When the pot leaves the table for good.
pub fn lifted_together(recording: &Recording) -> Vec<PrimitiveStart> {
    let free: Vec<bool> = carried(recording, "pot").iter().map(|borne| !borne).collect();
    let lifts = stretches(recording, &free, 0.13, 1.0);
    let names: &[&str] = &["EqualGrasp", "MainGrasp(left)", "MainGrasp(right)"];
    lifts.iter().map(|lift| PrimitiveStart { who: TrackId::Both, names, at_s: lift.from_s }).collect()
}

/// The last stretch in which peg and plate touch, which lasts to the end; shorter losses than 0.3 s belong to it.
pub fn mated(recording: &Recording) -> Vec<TimeSpan> {
    let touching = flags(recording, "contact.cylinder.hole").unwrap_or_default();
    stretches(recording, &touching, LOST_S, 0.0).last().copied().into_iter().collect()
}

/// While a finger or the palm is on the lever and it turns from its rest: the stretches of touch in which its angle changes by more than 0.1 rad.
pub fn pressed(recording: &Recording) -> Vec<TimeSpan> {
    let touches: Vec<Vec<bool>> = ["thumb", "index", "palm"]
        .iter()
        .filter_map(|finger| flags(recording, &format!("right.{finger}.contact.latch")))
        .collect();
    let any: Vec<bool> = (0..recording.time.len()).map(|row| touches.iter().any(|it| it[row])).collect();
    let [w, y] = ["w", "y"].map(|part| values(recording, &format!("latch.rotation.{part}")).unwrap_or_default());
    let angle = |row: usize| 2.0 * w.get(row).zip(y.get(row)).map_or(0.0, |(w, y)| y.atan2(*w));
    let turned = |it: &TimeSpan| {
        let angles: Vec<f64> = rows(recording, *it).map(|(row, _)| angle(row)).collect();
        let most = angles.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let least = angles.iter().copied().fold(f64::INFINITY, f64::min);
        most - least > 0.1
    };
    stretches(recording, &any, 0.5, 1.0).into_iter().filter(turned).collect()
}

/// While the table bears on the tool.
pub fn wiped(recording: &Recording) -> Vec<TimeSpan> {
    let z = values(recording, "right.palm.force.z").unwrap_or_default();
    let pressed: Vec<bool> = z.iter().map(|force| force.abs() > 1e-3).collect();
    stretches(recording, &pressed, 0.2, 0.2)
}

/// While the angle of the latch goes from below 0.1 rad to above 1.5 rad for the first time.
pub fn latch(recording: &Recording) -> Vec<TimeSpan> {
    let angle = values(recording, "latch.angle.bearing").unwrap_or_default();
    let first = |above: f64| angle.iter().position(|value| *value > above).and_then(|row| recording.time.get(row));
    first(0.1).zip(first(1.5)).map(|(from_s, to_s)| TimeSpan { from_s: *from_s, to_s: *to_s }).into_iter().collect()
}
