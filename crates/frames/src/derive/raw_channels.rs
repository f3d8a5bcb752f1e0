//! Raw channels: columns of the log as the rules name them, and what stands for one that the log lacks.

use super::motion::{moving_average, vector};
use crate::clean::contact_level::{ContactLevel, LearnedLevel};
use crate::clean::fingertip_level::{ENDS_AT, FingertipLevel};
use crate::clean::preprocess::{CleanLog, State};
use std::fmt::Write as _;
use teachtree_base::channels::{Axis, ChannelSpec, Fallback, Shape};
use teachtree_base::error::InputError;
use teachtree_base::field_names::inside;
use teachtree_base::hands::{Finger, Side};
use teachtree_base::log_channel::LogChannel;
use teachtree_base::scene::Role;
use teachtree_base::short_number::ShortNumber;
use teachtree_logs::issue::{Issue, IssueKind};

/// The elements of an array over fingers, one column each.
pub type Array = Vec<Vec<f64>>;

/// The columns of a channel: for each slot one column a component.
pub type Slots = Vec<Vec<Vec<f64>>>;

/// Reads a raw channel of a hand, or one without a hand.
///
/// # Errors
/// When the log lacks a channel that is needed, or has it in another dimension.
pub fn read(
    measured: &CleanLog,
    spec: &ChannelSpec,
    side: Option<Side>,
    fingers: &[Finger],
    issues: &mut Vec<Issue>,
) -> Result<Slots, InputError> {
    let slots = slot_names(spec, side, fingers);
    let found: Vec<Option<Vec<Vec<f64>>>> =
        slots.iter().map(|slot| columns(measured, spec, slot)).collect::<Result<_, _>>()?;
    let any = found.iter().any(Option::is_some);
    let constant = |value: f64| -> Vec<Vec<f64>> {
        // The identity rotation is 1, 0, 0, 0.
        let of = |component: &&str| if *component == "w" { 1.0 } else { value };
        spec.shape.components().iter().map(|component| vec![of(component); measured.len()]).collect()
    };
    let instead = match &spec.absent {
        Fallback::NormAbove { .. } if any && found.iter().all(Option::is_some) => vec![None; slots.len()],
        Fallback::NormAbove { channel, on, off, .. } => {
            let forces = slot_names(&ChannelSpec { name: channel.clone(), ..spec.clone() }, side, fingers);
            let norms: Vec<_> = forces
                .iter()
                .map(|slot| measured.vec3(slot).map(|force| vec![norm_above(measured, slot, force, *on, *off)]))
                .collect();
            if !any && norms.iter().all(Option::is_none) {
                return Err(lacking(measured, spec, side, Some(&shown(channel, side))));
            }
            let computed = forces.iter().zip(&found).filter(|(_, found)| found.is_none());
            issues.extend(computed.filter_map(|(force, _)| unclear_fingertip(measured, force, [*on, *off])));
            norms
        }
        // Where one finger is says nothing of where another one is.
        Fallback::Constant(_) if any && spec.name == POSITION => vec![None; slots.len()],
        Fallback::Constant(value) => slots
            .iter()
            .zip(&found)
            .map(|(slot, found)| {
                let learned = slot.strip_suffix(LEVEL).filter(|_| found.is_none());
                Some(constant(learned.map_or(*value, |finger| level(measured, finger, *value, issues))))
            })
            .collect(),
        Fallback::Refused | Fallback::Derived if !any && slots.iter().any(|slot| !is_palm(slot)) => {
            return Err(lacking(measured, spec, side, None));
        }
        Fallback::Refused | Fallback::Derived => vec![None; slots.len()],
    };
    if let (false, POSITION, Some(slot)) = (any, spec.name.as_str(), slots.first()) {
        let message =
            "the log lacks the fingers' positions; no distance and no motion of the hand is known".to_string();
        issues.push(measured.over_all(IssueKind::MISSING_CHANNEL, slot, message));
    }
    if spec.shape == Shape::Rotation {
        let message = "the log lacks it; it counts as the rotation of the reference frame".to_string();
        let lacking = slots.iter().zip(&found).filter(|(_, found)| found.is_none());
        issues.extend(lacking.map(|(slot, _)| measured.over_all(IssueKind::MISSING_CHANNEL, slot, message.clone())));
    }
    let placed: Vec<&str> =
        fingers.iter().zip(&found).filter(|(_, found)| found.is_some()).map(|(finger, _)| finger.name()).collect();
    let is_tool = is_tool(fingers);
    let is_measured =
        |at: usize| found.get(at).is_some_and(Option::is_some) || instead.get(at).is_some_and(Option::is_some);
    let of_wrist = (0..).zip(fingers).all(|(at, finger)| is_measured(at) == (*finger == Finger::Palm));
    let mut columns = Vec::with_capacity(slots.len());
    for ((slot, found), instead) in slots.iter().zip(found).zip(instead) {
        columns.push(match found.or(instead) {
            Some(columns) => columns,
            // A force or a flag that one finger lacks while others have it: that finger feels nothing. A position cannot be made up.
            None if spec.shape == Shape::Bool || spec.dimension == teachtree_base::units::Dimension::FORCE => {
                let message = "other fingers have it, this one does not; it counts as zero".to_string();
                // A sensor at the wrist feels for all fingers.
                issues.extend((!of_wrist).then(|| measured.over_all(IssueKind::MISSING_CHANNEL, slot, message)));
                constant(0.0)
            }
            None if is_palm(slot) => {
                let message =
                    "the log lacks it; conditions on the position of the hand cannot be evaluated".to_string();
                // A wrist is where its tool point is.
                let is_known = is_tool && any;
                issues.extend((!is_known).then(|| measured.over_all(IssueKind::MISSING_CHANNEL, slot, message)));
                constant(0.0)
            }
            None => {
                let error = lacking(measured, &ChannelSpec { name: slot.clone(), ..spec.clone() }, None, None);
                let only = format!(
                    "bind it, or name only the fingers that have one in the scene: `fingers: [{}]`",
                    placed.join(", ")
                );
                return Err(if spec.name == POSITION && any { error.help(only) } else { error });
            }
        });
    }
    Ok(columns)
}

/// A force that differs from a weight by less than this share of it is this weight: the object hangs still most of the time.
const SAME_WEIGHT: f64 = 0.2;
/// The share of the readings of a weight that a closed gripper explains, and of a reading that is vertical.
const NEARLY_ALL: f64 = 0.9;
/// Where fingers are, in the rules.
const POSITION: &str = "fingers.position";
/// The channel of the force from which a finger is in contact, after the finger's name.
const LEVEL: &str = ".level";
/// Readings without contact, a tenth of which exceed this multiple of the least force of the rules, may contain contacts.
const BROAD: f64 = 2.0;
/// A contact below this share of the least force that the rules take for one is not mentioned.
const SMALL: f64 = 0.2;

/// The least force of a finger in contact: learned from the log, else the value of the rules. A level is believed where the contact usually is more than what
/// the rules say: a log without contact has two groups of forces too, if it rests and moves.
fn level(measured: &CleanLog, finger: &str, otherwise: f64, issues: &mut Vec<Issue>) -> f64 {
    let force = format!("{finger}.force");
    match measured.levels.get(&force) {
        Some(LearnedLevel::Level(level)) if level.usual > otherwise => {
            issues.extend(
                doubt(finger, level, otherwise)
                    .map(|message| measured.over_all(IssueKind::AMBIGUOUS_CONTACT_LEVEL, &force, message)),
            );
            level.begins
        }
        Some(LearnedLevel::Mixed { weakest, strongest }) if *strongest > otherwise => {
            let mut message = format!(
                "the readings do not form groups with and without contact; contact is above {} N, the threshold of the rules",
                ShortNumber(otherwise)
            );
            if *weakest > otherwise {
                let _ = write!(
                    message,
                    ", and 99 % of the readings are above {weakest:.1} N, so it never ends; subtract the bias of the sensor with `tare`"
                );
            }
            issues.push(measured.over_all(IssueKind::NO_CONTACT_LEVEL, &force, message));
            otherwise
        }
        // A log without contact has two groups too, of rest and of motion: only the user can tell which of both it is.
        Some(LearnedLevel::Level(level))
            if level.usual > SMALL * otherwise && !is_weight(measured, finger, level.usual) =>
        {
            let message = format!(
                "the readings form two groups, but the second one, {:.2} N, is below the threshold of contact of the rules, {} N; if it is contact, bind \
                 `{finger}.level: = {:.2} N`",
                level.usual,
                ShortNumber(otherwise),
                level.begins
            );
            issues.push(measured.over_all(IssueKind::NO_CONTACT_LEVEL, &force, message));
            otherwise
        }
        _ => otherwise,
    }
}

/// Whether a force at a wrist is the weight of an object that the hand carries: that of an object of the scene, or a force that points up and is there while
/// the gripper is closed.
fn is_weight(measured: &CleanLog, finger: &str, force: f64) -> bool {
    let Some(side) = finger.strip_suffix(".palm") else { return false };
    let gravity = measured.scene.gravity().norm();
    let objects = measured.scene.bodies.values().filter(|body| body.role == Role::Object);
    let mut weights = objects.filter_map(|body| body.mass.map(|mass| mass.0 * gravity));
    weights.any(|weight| (force - weight).abs() < SAME_WEIGHT * weight) || is_held(measured, side, finger, force)
}

/// Whether nearly all readings of a wrist that are about a force point up and are taken while the gripper is closed.
fn is_held(measured: &CleanLog, side: &str, finger: &str, force: f64) -> bool {
    let closed = measured.scalar(&format!("{side}.gripper.closed"));
    let (Some(closed), Some(columns)) = (closed, measured.vec3(&format!("{finger}.force"))) else { return false };
    let up = measured.scene.up();
    let (mut near, mut held) = (0_usize, 0_usize);
    for (frame, closed) in closed.iter().enumerate() {
        let reading = vector(&columns, frame);
        if (reading.norm() - force).abs() < SAME_WEIGHT * force {
            near += 1;
            held += usize::from(*closed > 0.5 && reading.dot(&up) > NEARLY_ALL * reading.norm());
        }
    }
    near > 0 && held as f64 > NEARLY_ALL * near as f64
}

/// Returns an issue for a fingertip whose readings show no level without contact, and nearly all of which are above the force at which contact ends.
fn unclear_fingertip(measured: &CleanLog, force: &str, [on, off]: [f64; 2]) -> Option<Issue> {
    let Some(FingertipLevel::Unclear(weakest)) = measured.fingertips.get(force) else { return None };
    let finger = force.trim_end_matches(".force");
    let message = format!(
        "the readings show no group without contact; contact is above {} N, the threshold of the rules, and ends below {} N, but 90 % of the readings are above \
         {weakest:.3} N; subtract the bias of the sensor with `tare`, or bind `{finger}.level`",
        ShortNumber(on),
        ShortNumber(off)
    );
    (*weakest > off).then(|| measured.over_all(IssueKind::NO_CONTACT_LEVEL, force, message))
}

/// Why a level may not be the one of the weakest contact, if there is a reason; `least` is the least force of the rules.
fn doubt(finger: &str, level: &ContactLevel, least: f64) -> Option<String> {
    let ContactLevel { begins, scatter, usual, other, .. } = level;
    if let Some(other) = other {
        let (weaker, stronger) = (usual.min(other.usual), usual.max(other.usual));
        let doubt = if other.usual < *usual { "contact too" } else { "not contact" };
        return Some(format!(
            "the readings form three groups: without contact, about {weaker:.1} N and about {stronger:.1} N; contact is above {begins:.1} N; if \
             {weaker:.1} N are {doubt}, bind `{finger}.level: = {:.1} N`",
            other.begins
        ));
    }
    (*scatter > BROAD * least).then(|| {
        let least = ShortNumber(least);
        format!(
            "contact is above {begins:.1} N, and a tenth of the readings below that are above {scatter:.1} N; if these are contact too, bind \
             `{finger}.level: = {least} N`"
        )
    })
}

/// The names of the channel's slots in the log.
fn slot_names(spec: &ChannelSpec, side: Option<Side>, fingers: &[Finger]) -> Vec<String> {
    match (side, spec.axis, spec.name.split_once('.')) {
        (Some(side), Some(Axis::Fingers), Some(("fingers", quantity))) => {
            fingers.iter().map(|finger| format!("{side}.{finger}.{quantity}")).collect()
        }
        (Some(side), _, _) => vec![inside(&format!("{side}.{}", spec.name)).into_owned()],
        (None, _, _) => vec![spec.name.clone()],
    }
}

/// Whether a hand is a tool point and a force sensor at the wrist.
fn is_tool(fingers: &[Finger]) -> bool {
    fingers.len() == 2 && [Finger::Thumb, Finger::Palm].iter().all(|finger| fingers.contains(finger))
}

/// Whether this is where a palm is. It is not a fingertip: rules about fingertips do without it.
fn is_palm(slot: &str) -> bool {
    slot.ends_with(".palm.position")
}

fn shown(channel: &str, side: Option<Side>) -> String {
    side.map_or_else(|| format!("`{channel}`"), |side| format!("`{channel}` of the {side} hand"))
}

fn columns(measured: &CleanLog, spec: &ChannelSpec, slot: &str) -> Result<Option<Vec<Vec<f64>>>, InputError> {
    let names: Vec<String> = spec
        .shape
        .components()
        .iter()
        .map(|component| if component.is_empty() { slot.to_string() } else { format!("{slot}.{component}") })
        .collect();
    for name in &names {
        if let Some(found) = measured.dimension(name).filter(|found| *found != spec.dimension) {
            return Err(InputError::new(
                format!("channel {slot}"),
                format!("the log has {found}, the rules read {}", spec.dimension),
            ));
        }
    }
    let columns: Option<Vec<Vec<f64>>> = names.iter().map(|name| measured.scalar(name).map(<[f64]>::to_vec)).collect();
    Ok(if slot.ends_with(".contact") { columns.or_else(|| touches_any(measured, slot)) } else { columns })
}

/// A finger touches when it touches any object: for logs that have only the flags by object.
fn touches_any(measured: &CleanLog, slot: &str) -> Option<Vec<Vec<f64>>> {
    let flags: Vec<&[f64]> =
        measured.scene.bodies.keys().filter_map(|body| measured.scalar(&format!("{slot}.{body}"))).collect();
    let any = |frame: usize| flags.iter().any(|flag| flag.get(frame).is_some_and(|value| *value > 0.5));
    (!flags.is_empty()).then(|| vec![(0..measured.len()).map(|frame| f64::from(u8::from(any(frame)))).collect()])
}

fn lacking(measured: &CleanLog, spec: &ChannelSpec, side: Option<Side>, instead: Option<&str>) -> InputError {
    let mut has = measured.channels();
    let all = has.len();
    has.truncate(24);
    // The missing channel may be in the log under an unknown name.
    let ignored = measured.issues.iter().find(|issue| issue.kind == IssueKind::UNKNOWN_CHANNEL);
    let more = if all > has.len() { format!(" and {} more", all - has.len()) } else { String::new() };
    // The beginning of a live log may show one opening only.
    let has_opening = |side: &Side| measured.scalar(&LogChannel::GripperOpening(*side).to_string()).is_some();
    let limit =
        side.filter(|side| spec.name == "gripper.closed" && has_opening(side)).map_or_else(String::new, |side| {
            format!(
                "bind it by a limit of the opening, such as `{side}.gripper.closed: COLUMN [mm] < 30 mm`, or learn the limit from a recording in which the \
                 gripper opens and closes, by `live --calibration RECORDING`; "
            )
        });
    InputError::new(
        format!("channel {}", side.map_or_else(|| spec.name.clone(), |side| format!("{side}.{}", spec.name))),
        match instead {
            None => format!("the rules need {}, which the log lacks", shown(&spec.name, side)),
            Some(instead) => format!(
                "the rules need {}; the log has neither that nor {instead} to derive it from",
                shown(&spec.name, side)
            ),
        },
    )
    .help(format!(
        "{limit}the log has {}{more}{}; a binding can name another hand model, whose signals need other channels",
        has.join(", "),
        ignored.map_or_else(String::new, |issue| format!(", and `{}`, but {}", issue.channel, issue.message))
    ))
}

/// Half the time over which a force is averaged before it is compared with noise, s.
const CALMED_SECS: f64 = 0.010;
/// How many standard deviations of noise a force must have to begin, and to go on.
const BEGINS_ABOVE: f64 = 4.0;
const GOES_ON_ABOVE: f64 = 2.0;

/// The level of a finger's force that the log has, N.
fn bound_level(measured: &CleanLog, force: &str) -> Option<f64> {
    let level = measured.scalar(&format!("{}{LEVEL}", force.strip_suffix(".force")?))?;
    level.first().copied().filter(|level| *level > 0.0)
}

/// True while the norm is above `on` until it is below `off`; off at the start of each stretch. The force of a sensor with noise is averaged
/// first, and must be more than what is left of the noise.
fn norm_above(measured: &CleanLog, channel: &str, force: [&[f64]; 3], on: f64, off: f64) -> Vec<f64> {
    let deviation = measured.noise.get(channel).map_or(0.0, |noise| noise.variance.sqrt());
    let noisy = GOES_ON_ABOVE * deviation > off;
    let reach = if noisy { (CALMED_SECS * measured.rate_hz).round() as usize } else { 0 };
    let left = if noisy { deviation / ((2 * reach + 1) as f64).sqrt() } else { 0.0 };
    let (on, off) = (on.max(BEGINS_ABOVE * left), off.max(GOES_ON_ABOVE * left));
    // A sensor whose readings without contact would be one: the contact level of the log applies.
    let (on, off) = match measured.levels.get(channel) {
        Some(LearnedLevel::Level(level)) if level.scatter >= off && !measured.noise.contains_key(channel) => {
            (on.max(level.begins), off.max(level.ends))
        }
        _ => (on, off),
    };
    let (on, off) = match (bound_level(measured, channel), measured.fingertips.get(channel)) {
        (Some(level), _) => (level, ENDS_AT * level),
        (None, Some(FingertipLevel::Level(level))) => (on.max(level.begins), off.max(level.ends)),
        (None, _) => (on, off),
    };
    let calmed = force.map(|column| moving_average(measured, column, reach));
    let mut flags = vec![0.0; measured.len()];
    measured.follow(&format!("{channel} above {on} until below {off}"), |frame, was| {
        let norm = vector(&calmed, frame).norm();
        let above = if was.on { norm >= off } else { norm > on };
        if let (true, Some(flag)) = (above, flags.get_mut(frame)) {
            *flag = 1.0;
        }
        State { on: above, ..was }
    });
    flags
}
