//! Strict validation of commands: changes by users or programs are either valid or refused with their place.

use super::schema::{
    Commands, Contact, GraspSpec, MappedFinger, MappedGrasp, Omission, Quality, SCHEMA, Segment, Task,
};
use std::collections::BTreeSet;
use teachtree_base::error::InputError;
use teachtree_base::hands::Finger;
use teachtree_base::json;
use teachtree_base::meaning::Meaning;
use teachtree_base::short_number::ShortNumber;

/// Maximum absolute value of a commanded number: rad, N or s.
const LARGEST: f64 = 1e4;
/// Maximum absolute value of a number that is only reported: jerks are hundreds and thousands of m/s^3.
const LARGEST_REPORTED: f64 = 1e9;
/// Maximum time stamp, s: 3000 years.
const LATEST_S: f64 = 1e11;
/// Maximum distance from the origin of the reference frame, and from the origin of an object, m.
const FARTHEST_M: f64 = 100.0;
const BESIDE_M: f64 = 10.0;
/// Maximum opening of a finger, m.
const MOST_OPENED_M: f64 = 0.1;
/// Tolerance of the unit length of vectors and quaternions that were written with six decimals.
const ROUNDED: f64 = 1e-3;
/// Times closer than this are equal, s; the number of samples of a list may differ by this many from its duration.
const SAME_S: f64 = 2e-3;
const SPARE_SAMPLES: f64 = 2.0;
/// Maximum time between the last segment of a task and its end, s.
const LINGERS_S: f64 = 1.0;

impl Commands {
    /// Reads them; `file` is the name in errors.
    ///
    /// # Errors
    /// A violation of the schema, at its line; an invalid command, at its task, segment or grasp: a number out of range, a finger twice, a list that does not
    /// fit its duration.
    pub fn read(text: &str, file: &str) -> Result<Self, InputError> {
        let wanted = "commands are the JSON file that `teachtree retarget` writes";
        let commands: Self = json::read(text, file).map_err(|error| error.help(wanted))?;
        if commands.schema != SCHEMA {
            let message = format!("has the schema `{}`, expected `{SCHEMA}`", commands.schema);
            return Err(InputError::new(file, message));
        }
        commands.check().map_err(|error| in_file(file, error))?;
        Ok(commands)
    }

    /// Rejects invalid commands like [`Self::read`]; the error names the task.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn check(&self) -> Result<(), InputError> {
        if !(1.0..=10_000.0).contains(&self.rate_hz) {
            let message = format!("has {} samples a second, expected 1 to 10000", ShortNumber(self.rate_hz));
            return Err(InputError::new(COMMANDS, message));
        }
        for (number, task) in self.tasks.iter().enumerate() {
            let place = format!("task {} ({})", number + 1, task.task);
            task.check(self.rate_hz).map_err(|message| InputError::new(place, message))?;
        }
        Ok(())
    }
}

/// Name of the commands in errors without a file name.
const COMMANDS: &str = "commands";

/// Adds the file name to an error of [`Commands::check`], whose place is `task 2 (push)` or `commands`.
pub fn in_file(file: &str, error: InputError) -> InputError {
    let place = match error.place.as_str() {
        COMMANDS => file.to_string(),
        task if task.starts_with("task ") => format!("{file}, {task}"),
        _ => return error,
    };
    InputError { place, ..error }
}

/// Maximum distance (m) from the origin of a frame, and the name of the frame.
type FrameBound = (f64, &'static str);
const REFERENCE: FrameBound = (FARTHEST_M, "the reference frame");
const OF_OBJECT: FrameBound = (BESIDE_M, "the frame of the object");

/// What is wrong, in words that follow the name of what has it.
type Check = Result<(), String>;

impl Task {
    fn check(&self, rate_hz: f64) -> Check {
        stamps(&[self.start_s, self.end_s])?;
        if self.end_s < self.start_s {
            return Err(format!(
                "ends at {} s, before it begins at {} s",
                ShortNumber(self.end_s),
                ShortNumber(self.start_s)
            ));
        }
        if let Some(into) = &self.into {
            pose(&into.pose, REFERENCE).map_err(|message| format!("goes into `{}`, which {message}", into.body))?;
        }
        for (number, grasp) in self.grasps.iter().enumerate() {
            grasp.check().map_err(|message| format!("grasp {} {message}", number + 1))?;
        }
        let (mut ended_s, mut demonstrated_s) = (0.0, self.start_s);
        for (number, segment) in self.segments.iter().enumerate() {
            let named = |message| format!("segment {} ({}) {message}", number + 1, segment.primitive);
            segment.check(rate_hz, self.grasps.len()).map_err(named)?;
            if segment.start_s < ended_s - SAME_S {
                let begins = format!("begins at {} s, before", ShortNumber(segment.start_s));
                return Err(named(format!("{begins} the preceding one ends, at {:.3} s", ShortNumber(ended_s))));
            }
            ended_s = segment.start_s + segment.duration_s;
            if segment.demonstrated_start_s < demonstrated_s - SAME_S {
                let found =
                    format!("was demonstrated from {} s on, expected", ShortNumber(segment.demonstrated_start_s));
                return Err(named(format!(
                    "{found} {} s or later, when the preceding one began",
                    ShortNumber(demonstrated_s)
                )));
            }
            demonstrated_s = segment.demonstrated_start_s;
        }
        let left_out = |(number, left): (usize, &Omission)| {
            left.check().map_err(|message| format!("omission {} {message}", number + 1))
        };
        self.left_out.iter().enumerate().try_for_each(left_out)?;
        self.check_end()
    }

    /// Whether it ends when its last segment does, or what is left out after that: by these times tasks of two hands are done at the same time or one
    /// after the other.
    fn check_end(&self) -> Check {
        let Some(last) = self.segments.last() else { return Ok(()) };
        let left_out = self.left_out.iter().map(|left| left.end_s);
        let (from, to) =
            (last.demonstrated_start_s, left_out.fold(last.demonstrated_start_s + last.duration_s, f64::max));
        if (from - SAME_S..=to + LINGERS_S).contains(&self.end_s) {
            return Ok(());
        }
        let (found, from, to) = (ShortNumber(self.end_s), ShortNumber(from), ShortNumber(to));
        Err(format!("ends at {found} s, but the last of it was demonstrated from {from:.3} s to {to:.3} s"))
    }
}

impl Omission {
    fn check(&self) -> Check {
        stamps(&[self.start_s, self.end_s])?;
        if self.end_s < self.start_s {
            return Err(format!(
                "ends at {} s, before it begins at {} s",
                ShortNumber(self.end_s),
                ShortNumber(self.start_s)
            ));
        }
        Ok(())
    }
}

impl GraspSpec {
    fn check(&self) -> Check {
        if self.contacts.is_empty() {
            return Err("has no contacts".into());
        }
        check_fingers(self.contacts.iter().map(|contact| contact.finger))?;
        for Contact { finger, point, normal } in &self.contacts {
            let named = |message| format!("has a contact of {finger} that {message}");
            within(point, OF_OBJECT).and_then(|()| unit("normal", normal)).map_err(named)?;
        }
        self.mapped.as_ref().map_or(Ok(()), MappedGrasp::check)
    }
}

impl MappedGrasp {
    fn check(&self) -> Check {
        let (_, of_object) = OF_OBJECT;
        pose(&self.object_from_palm, (FARTHEST_M, of_object))
            .map_err(|message| format!("has an `object_from_palm` that {message}"))?;
        check_fingers(self.fingers.iter().map(|finger| finger.finger))?;
        let measures = [self.measure, self.copied_measure.unwrap_or_default()];
        reported(&measures).map_err(|message| format!("has a measure that {message}"))?;
        reported(self.friction_margin.as_slice())
            .map_err(|message| format!("has a `friction_margin` that {message}"))?;
        for MappedFinger { finger, manipulability, freedom, pad_angle_deg, alignment } in &self.fingers {
            reported(&[*manipulability, *freedom, *pad_angle_deg, alignment.unwrap_or_default()])
                .map_err(|message| format!("has a share of {finger} that {message}"))?;
        }
        for (joint, value) in self.joints.iter().chain(&self.arm) {
            finite(&[*value]).map_err(|message| format!("has a joint `{joint}` that {message}"))?;
        }
        if let Some(opens) = self.opens.filter(|opens| !(0.0..=MOST_OPENED_M).contains(opens)) {
            let found = ShortNumber(opens * 1e3);
            return Err(format!("has `opens` at {found} mm, expected 0 to {:.0} mm", MOST_OPENED_M * 1e3));
        }
        finite(self.opening.as_slice()).map_err(|message| format!("has an `opening` that {message}"))
    }
}

impl Segment {
    fn check(&self, rate_hz: f64, grasps: usize) -> Check {
        finite(&[self.start_s, self.duration_s])?;
        if self.precedence.is_some() && self.touching && self.does != Meaning::Open {
            return Err("has a `precedence`, expected one only where the hand is free or lets go".into());
        }
        stamps(&[self.demonstrated_start_s])?;
        if self.duration_s < 0.0 {
            return Err(format!("takes {} s, expected none or more", ShortNumber(self.duration_s)));
        }
        if let Some(grasp) = self.grasp.filter(|grasp| *grasp >= grasps) {
            return Err(format!("has the grasp {grasp}, but the task has {grasps}, counted from 0"));
        }
        let count = self.object.len();
        let wanted = self.duration_s * rate_hz;
        if count == 0 || (count as f64 - 1.0 - wanted).abs() > SPARE_SAMPLES {
            let much = format!("{} s at {rate_hz} samples a second", ShortNumber(self.duration_s));
            return Err(format!("has {count} poses of the object, expected {:.0}: {much}", wanted + 1.0));
        }
        let same = |what: String, found: usize| {
            if found == count {
                Ok(())
            } else {
                Err(format!("has {found} {what}, expected {count}, one for each pose of the object"))
            }
        };
        same("places of the hand".into(), self.hand.len())?;
        check_fingers(self.tips.iter().map(|tip| tip.finger))?;
        for tip in &self.tips {
            same(format!("positions of {}", tip.finger), tip.position.len())?;
            same(format!("forces of {}", tip.finger), tip.force.len())?;
            if !tip.demonstrated_force.is_empty() {
                same(format!("demonstrated forces of {}", tip.finger), tip.demonstrated_force.len())?;
            }
            let places = tip.position.iter().map(|place| within(place, OF_OBJECT));
            let forces = tip.force.iter().chain(&tip.demonstrated_force).map(|force| finite(force));
            for checked in places.chain(forces) {
                checked.map_err(|message| format!("has a sample of {} that {message}", tip.finger))?;
            }
        }
        self.object
            .iter()
            .try_for_each(|it| pose(it, REFERENCE))
            .map_err(|message| format!("has a pose of the object that {message}"))?;
        self.hand
            .iter()
            .try_for_each(|place| within(place, OF_OBJECT))
            .map_err(|message| format!("has a place of the hand that {message}"))?;
        self.quality.check().map_err(|message| format!("has a `quality` that {message}"))
    }
}

impl Quality {
    fn check(&self) -> Check {
        let Self { jerk_before, jerk_after, position_deviation, contact_deviation, force_deviation, into_cone: _ } =
            self;
        reported(&[*jerk_before, *jerk_after, *position_deviation, *contact_deviation, *force_deviation])
    }
}

/// Times of the recording, which may count from 1970.
fn stamps(values: &[f64]) -> Check {
    match values.iter().find(|value| value.is_nan() || value.abs() > LATEST_S) {
        Some(value) => Err(format!("has the time {} s, expected at most {LATEST_S:e} s", ShortNumber(*value))),
        None => Ok(()),
    }
}

/// Numbers that are only reported and never below zero.
fn reported(values: &[f64]) -> Check {
    match values.iter().find(|value| !(0.0..=LARGEST_REPORTED).contains(*value)) {
        Some(value) => Err(format!("has the number {}, expected 0 to {LARGEST_REPORTED:e}", ShortNumber(*value))),
        None => Ok(()),
    }
}

/// Numbers of the size that things have.
fn finite(values: &[f64]) -> Check {
    match values.iter().find(|value| value.is_nan() || value.abs() > LARGEST) {
        Some(value) => {
            Err(format!("has the number {}, expected one of at most {LARGEST} in rad, N or s", ShortNumber(*value)))
        }
        None => Ok(()),
    }
}

/// Requires a position within the maximum distance from the origin of a frame.
fn within(place: &[f64], (most, frame): FrameBound) -> Check {
    match place.iter().find(|value| value.is_nan() || value.abs() > most) {
        Some(value) => {
            Err(format!("has the number {}, expected one of at most {most} m in {frame}", ShortNumber(*value)))
        }
        None => Ok(()),
    }
}

/// A direction.
fn unit(what: &str, values: &[f64]) -> Check {
    finite(values)?;
    let length = values.iter().map(|value| value * value).sum::<f64>().sqrt();
    if (length - 1.0).abs() > ROUNDED {
        return Err(format!("has a {what} of length {length:.3}, expected 1"));
    }
    Ok(())
}

/// x y z in m and a quaternion.
fn pose(values: &[f64; 7], frame: FrameBound) -> Check {
    within(&values[..3], frame)?;
    unit("quaternion", &values[3..])
}

/// Fingers, each at most once.
fn check_fingers(mut fingers: impl Iterator<Item = Finger>) -> Check {
    let mut seen = BTreeSet::new();
    match fingers.find(|finger| !seen.insert(*finger)) {
        Some(twice) => Err(format!("has the finger {twice} twice")),
        None => Ok(()),
    }
}
