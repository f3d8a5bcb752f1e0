//! Derives the frames that the rules read from a recording: raw channels by name, and derived ones from motion, touch and the scene.
//!
//! Every derived channel is documented in `base::channels::DERIVED`; here is how each is computed. All work is linear in the number of frames.

mod assumed_insertions;
mod balance;
mod carrying;
mod contacts;
mod contradictions;
pub mod convex_gap;
pub(super) mod fingertip_bias;
mod frame_tally;
mod hands;
mod held_forces;
mod motion;
mod partner;
mod plausibility;
pub(super) mod pose_noise;
mod quaternion_order;
mod raw_channels;
mod role_support;
mod setup;
mod sockets;
mod source;
mod targets;
mod touch;
mod unplaced;

use crate::clean::preprocess::{CleanLog, Touches};
use crate::frames::{ColumnKey, Frames, HandLayout, Layout};
pub(super) use balance::balanced;
use motion::Motion;
pub(super) use motion::{ANCHOR, ahead as averaged, padding};
use raw_channels::Slots;
pub use setup::placement::{Misplacement, misplacements};
use std::collections::{BTreeMap, BTreeSet};
use targets::Derivation;
use teachtree_base::channels::{Axis, ChannelSpec, Fallback, Shape, derived};
use teachtree_base::contact_threshold;
use teachtree_base::error::InputError;
use teachtree_base::field_names;
use teachtree_base::hands::{Finger, Side};
use teachtree_base::recording::Recording;
use teachtree_base::scene::{Role, Scene};
use teachtree_base::units::Dimension;
use teachtree_logs::issue::{Issue, IssueKind};

/// Computes the channels that the rules read, in this order, from a recording.
///
/// # Errors
/// When the log lacks a channel that is needed, has one in another dimension, or has no usable time base.
pub fn frames(recording: &Recording, channels: &[ChannelSpec]) -> Result<Frames, InputError> {
    frames_trusting(recording, channels, &[])
}

/// Like the above, with constant forces that are trusted.
///
/// # Errors
/// As [`frames`].
pub fn frames_trusting(
    recording: &Recording,
    channels: &[ChannelSpec],
    trust: &[String],
) -> Result<Frames, InputError> {
    let mut measured = CleanLog::new(recording, trust, |column| asks(channels, column))?;
    let mut issues = measured.issues.clone();
    issues.extend(fingertip_bias::tare(&mut measured, fingertip_bias::Fingertips::of(channels)));
    let mut findings = Findings::default();
    let mut frames = derived_frames(&measured, channels, &mut findings)?;
    issues.extend(findings.issues(&measured, &frames.layout));
    frames.time.clone_from(&measured.time);
    frames.stretches.clone_from(&measured.stretches);
    frames.unseen.clone_from(&measured.unseen);
    issues.sort_by(|a, b| a.start_s.total_cmp(&b.start_s));
    frames.issues = issues;
    Ok(frames)
}

/// The findings about a log that may come in windows: those that the last window replaces, and those that add up.
#[derive(Default)]
pub struct Findings {
    /// Whether they are left out: only channels are wanted.
    unasked: bool,
    unseen: Vec<Issue>,
    carried: Vec<Issue>,
    assumed: Vec<Issue>,
    read: Vec<Issue>,
    /// The issues of quaternion orders on the first frame, once it was seen.
    orders: Option<Vec<Issue>>,
    findings: plausibility::Findings,
    held_forces: held_forces::HeldForces,
    velocities: contradictions::Velocities,
    survey: setup::Survey,
    /// Whether flags of hands were off, and on, so far.
    flags: BTreeMap<String, [bool; 2]>,
    /// The learned data of contacts that are computed from shapes, by object.
    pub touches: BTreeMap<usize, Touches>,
}

impl Findings {
    /// None of them: only channels are wanted.
    pub fn unasked() -> Self {
        Self { unasked: true, ..Self::default() }
    }

    /// All of it, once the whole log was seen.
    pub fn issues(&self, measured: &CleanLog, layout: &Layout) -> Vec<Issue> {
        let far = layout.hands.iter().flat_map(|hand| plausibility::far_issues(measured, hand, &self.findings));
        let setup = setup::issues(measured.scene, &self.survey);
        // A wrong unit explains positions that are far from everything.
        let units_are_right = !setup.iter().any(|issue| issue.kind == IssueKind::IMPLAUSIBLE_UNIT);
        let mut issues: Vec<Issue> = self.unseen.to_vec();
        issues.extend(far.filter(|_| units_are_right));
        issues.extend(self.carried.iter().chain(&self.assumed).cloned());
        issues.extend(self.orders.iter().flatten().cloned());
        issues.extend(self.held_forces.issues(measured));
        issues.extend(plausibility::sign_issues(measured, &self.findings));
        issues.extend(contradictions::issues(&self.velocities));
        issues.extend(setup);
        issues.extend(self.read.iter().cloned());
        issues.extend(self.flags.iter().filter_map(|(channel, was)| never_changes(measured, channel, *was)));
        issues
    }

    /// Takes note of the flags of a hand: its contacts, measured or computed, and whether its gripper is closed.
    fn look_at_flags(&mut self, measured: &CleanLog, hand: &HandLayout, touches: &[Vec<f64>]) {
        // A hand may touch an object that it always holds at all frames.
        if measured.scene.bodies.values().any(|body| body.fixed_to == Some(hand.side)) {
            return;
        }
        let closed = format!("{}.gripper.closed", hand.side);
        let fingers = hand.fingers.iter().zip(touches);
        let contacts = fingers.map(|(finger, flags)| (format!("{}.{finger}.contact", hand.side), flags.as_slice()));
        let closed = measured.scalar(&closed).map(|flags| (closed, flags));
        for (channel, flags) in contacts.chain(closed) {
            let was = self.flags.entry(channel).or_default();
            for flag in flags.get(measured.core()).unwrap_or_default() {
                let [off, on] = was;
                *(if *flag > 0.5 { on } else { off }) = true;
            }
        }
    }
}

/// Returns an issue for a contact that lasts as long as the log, and for a gripper that never opens or closes.
fn never_changes(measured: &CleanLog, channel: &str, [off, on]: [bool; 2]) -> Option<Issue> {
    /// In a shorter log nothing has to change, s.
    const LONG_SECS: f64 = 2.0;
    let [start_s, end_s] = measured.span;
    let message = match (off, on, channel.ends_with(".closed")) {
        (false, true, false) => {
            "the contact lasts as long as the log: a sensor with a bias, or a threshold that is too low"
        }
        (false, true, true) => {
            "the gripper is closed throughout: check the threshold and the column; if it is to push while it is closed, bind `= 1`"
        }
        (true, false, true) => "the gripper is never closed: check the threshold and the column",
        _ => return None,
    };
    (end_s - start_s >= LONG_SECS).then(|| measured.over_all(IssueKind::CONSTANT_FLAG, channel, message.to_string()))
}

/// The columns that the rules read, of a log or of a window of it; without its times.
pub fn derived_frames(
    measured: &CleanLog,
    channels: &[ChannelSpec],
    findings: &mut Findings,
) -> Result<Frames, InputError> {
    let objects = objects(measured.scene);
    let motions: Vec<Motion> =
        measured.scene.bodies.iter().map(|(name, body)| Motion::new(measured, name, body)).collect();
    let asked = !findings.unasked;
    if asked {
        findings.orders.get_or_insert_with(|| quaternion_order::swapped(measured));
        for (name, body) in &measured.scene.bodies {
            contradictions::compare(measured, name, body, &mut findings.velocities);
        }
        findings.unseen = objects.iter().filter_map(|body| unseen(measured, *body)).collect();
    }
    let mut hands: Vec<HandLayout> = sides(measured.scene, measured.channels().into_iter())
        .into_iter()
        .map(|side| HandLayout {
            side,
            fingers: hands::fingers(measured, side),
            contacts: vec![],
            knows_distance: hands::knows_distance(measured, side),
        })
        .collect();

    // Targets need the very `fingers.contact` that the rules see, and have a default of their own when no rule reads it.
    let default_touch = touch_channel();
    let touch = channels.iter().find(|channel| channel.name == default_touch.name).unwrap_or(&default_touch);
    let (mut tracks, mut felt) = (vec![], vec![]);
    // A cache, so that each channel is read once.
    let mut touched: BTreeMap<Side, raw_channels::Array> = BTreeMap::new();
    for hand in &hands {
        let mut found = vec![];
        let slots = raw_channels::read(measured, touch, Some(hand.side), &hand.fingers, &mut found);
        let read = slots.is_ok() && found.is_empty();
        let touches: raw_channels::Array = match slots {
            Ok(slots) => slots.into_iter().filter_map(|slot| slot.into_iter().next()).collect(),
            // Refused below if a rule reads it.
            Err(_) => closed(measured, hand.side, &hand.fingers),
        };
        let is_read = !matches!(touch.absent, Fallback::NormAbove { needed: false, .. });
        let holds = unplaced::is_held_by_flag(measured, hand.side, &objects)
            .then(|| closed(measured, hand.side, &hand.fingers));
        let holds = holds.as_ref().unwrap_or(&touches);
        tracks.push(hands::track(measured, &motions, hand.side, &hand.fingers, holds));
        felt.push((touches, is_read, read));
    }
    let held = unplaced::held_paths(measured, &objects, &tracks);
    let moving = motions.into_iter().enumerate();
    let motions: Vec<Motion> = moving
        .map(|(index, motion)| match held.get(&index) {
            Some(path) => motion.along(path),
            None => motion,
        })
        .collect();
    let mut grips = vec![];
    for ((hand, track), (touches, is_read, read)) in hands.iter().zip(&tracks).zip(felt) {
        if asked {
            grips.push(setup::grips(measured, hand.side, &touches));
            findings.look_at_flags(measured, hand, if is_read { &touches } else { &[] });
            plausibility::far_touches(measured, &motions, hand, &touches, &mut findings.findings);
            plausibility::pushes(measured, &motions, &hand.fingers, track, &mut findings.findings);
        }
        if read {
            touched.insert(hand.side, touches);
        }
    }
    let contacts = contacts::contacts(measured, &motions, &tracks, &objects, &mut findings.touches);
    let judges_contacts = asked && channels.iter().any(|channel| channel.name.starts_with("contacts."));
    if judges_contacts {
        findings.carried = contacts::never_carried(measured, &objects, &contacts);
    }
    let partners: BTreeSet<usize> = contacts.keys().map(|(_, partner)| *partner).collect();
    let partners: Vec<usize> = partners.into_iter().collect();
    for hand in &mut hands {
        hand.contacts = partners.iter().filter_map(|body| body_name(measured, *body)).collect();
    }
    let derivation = Derivation::new(measured, &motions, &objects, &partners, &tracks, contacts);
    if asked {
        findings.survey.look(&derivation, &grips);
        findings.assumed = assumed_insertions::issues(&derivation, &objects);
    }
    if judges_contacts {
        findings.held_forces.add(&derivation, &objects);
        plausibility::wrong_signs(&derivation, &objects, &mut findings.findings);
    }

    let mut issues = vec![];
    let mut frames = Frames {
        layout: Layout { rate_hz: measured.rate_hz, hands },
        channels: channels.to_vec(),
        len: measured.len(),
        ..Frames::default()
    };
    for (index, spec) in (0..).zip(channels) {
        let owners: Vec<Option<Side>> =
            if spec.per_hand { frames.layout.hands.iter().map(|hand| Some(hand.side)).collect() } else { vec![None] };
        for side in owners {
            let fingers = side.and_then(|side| frames.layout.hand(side)).map_or(vec![], |hand| hand.fingers.clone());
            let known = side.filter(|_| spec.name == touch.name).and_then(|side| touched.remove(&side));
            let slots: Slots = match spec.absent {
                _ if known.is_some() => known.into_iter().flatten().map(|column| vec![column]).collect(),
                Fallback::Derived => derivation.channel(&spec.name, side).ok_or_else(|| not_derived(&spec.name))?,
                _ => match (raw_channels::read(measured, spec, side, &fingers, &mut issues), &spec.absent, side) {
                    (Err(_), Fallback::NormAbove { needed: false, .. }, Some(side)) => {
                        closed(measured, side, &fingers).into_iter().map(|column| vec![column]).collect()
                    }
                    (read, ..) => read?,
                },
            };
            for (slot, columns) in (0..).zip(slots) {
                for (component, column) in (0..).zip(columns) {
                    frames.columns.insert(ColumnKey { channel: index, side, slot, component }, column);
                }
            }
        }
    }
    (frames.objects, frames.bodies, frames.attached) = names(measured.scene);
    findings.read = issues;
    Ok(frames)
}

/// A recording as the rules see it: bridged, on an even time base, without what is dead, forces without the bias of their sensors.
///
/// # Errors
/// As [`frames`].
pub fn trusted(recording: &Recording, trust: &[String]) -> Result<Recording, InputError> {
    let mut measured = CleanLog::new(recording, trust, |_| false)?;
    fingertip_bias::tare(&mut measured, fingertip_bias::Fingertips::of(&[]));
    Ok(measured.recording())
}

/// Whether no contact of an object has to be computed from shapes or from flags and poses, which takes the whole log.
pub(super) fn contacts_are_logged(scene: &Scene, has: impl Fn(&str) -> bool) -> bool {
    let name = |body: usize| scene.bodies.get_index(body).map_or("", |(name, _)| name.as_str());
    let logged = |a: usize, b: usize, part: &str| {
        let [a, b] = [name(a), name(b)];
        has(&format!("contact.{a}.{b}{part}")) || has(&format!("contact.{b}.{a}{part}"))
    };
    objects(scene).into_iter().all(|object| {
        if unplaced::is_unseen(scene, &has, object) {
            return false;
        }
        let others = || (0..scene.bodies.len()).filter(move |other| *other != object);
        let is_logged = others().any(|other| logged(object, other, "") || logged(object, other, ".force.x"));
        let is_directed = |other| logged(object, other, ".force.x") || logged(object, other, ".normal.x");
        let by_role = |other| {
            contacts::is_support_by_role(scene, (object, other)) && logged(object, other, "") && !is_directed(other)
        };
        is_logged && !others().any(by_role)
    })
}

/// Whether a window of a log depends on where objects were before it. `has` says whether the log has a column.
pub(super) fn continues_paths(scene: &Scene, has: impl Fn(&str) -> bool) -> bool {
    objects(scene).into_iter().any(|object| unplaced::continues_path(scene, &has, object))
}

/// Returns an issue for an object whose position the log lacks.
fn unseen(measured: &CleanLog, body: usize) -> Option<Issue> {
    let channel = format!("{}.position", body_name(measured, body)?);
    let is_unseen = unplaced::is_unseen(measured.scene, |column| measured.scalar(column).is_some(), body);
    let message = match (is_unseen, unplaced::is_unplaced(measured, body)) {
        (false, _) => "the log lacks it; the object is assumed to stay where the scene puts it",
        (true, false) => {
            "the log lacks it; the object is assumed to start where the scene puts it, and to move with the gripper that holds it"
        }
        (true, true) => {
            "the log lacks it, and the scene has no place for it; the object moves with the gripper that holds it, and rests on nothing"
        }
    };
    measured.vec3(&channel).is_none().then(|| measured.over_all(IssueKind::MISSING_CHANNEL, &channel, message.into()))
}

/// Returns the maximum number of later frames on which one of these channels depends: 0, unless one of them is an average.
pub fn averaging_lag(channels: &[ChannelSpec], rate_hz: f64) -> usize {
    let averaged = |channel: &ChannelSpec| derived(&channel.name).is_some_and(|it| it.is_averaged);
    if channels.iter().any(averaged) { motion::ahead(rate_hz) } else { 0 }
}

/// Whether a target depends on the velocities of hands and objects: where no channel shows a touch and there are several objects.
pub fn targets_move<'a>(scene: &Scene, columns: impl Iterator<Item = &'a str> + Clone) -> bool {
    objects(scene).len() > 1
        && sides(scene, columns.clone()).into_iter().any(|side| !hands::feels(side, columns.clone()))
}

/// Whether rules with these channels read this raw channel.
pub fn reads(channels: &[ChannelSpec], channel: &str) -> bool {
    ["", ".x", ".w"].iter().any(|component| asks(channels, &format!("{channel}{component}")))
}

/// Whether one of the raw channels is read from this column.
pub(super) fn asks(channels: &[ChannelSpec], column: &str) -> bool {
    let raw = channels.iter().filter(|channel| channel.absent != Fallback::Derived && derived(&channel.name).is_none());
    raw.into_iter().any(|channel| {
        let whose = if channel.per_hand {
            column.split_once('.').filter(|(side, _)| Side::from_name(side).is_some()).map(|(_, rest)| rest)
        } else {
            Some(column)
        };
        whose.is_some_and(|name| {
            channel.shape.components().iter().any(|component| {
                let name = if component.is_empty() {
                    Some(name)
                } else {
                    name.strip_suffix(component).and_then(|name| name.strip_suffix('.'))
                };
                let own = field_names::of_hand(&channel.name);
                name.is_some_and(|name| match (channel.axis, channel.name.strip_prefix("fingers.")) {
                    (Some(Axis::Fingers), Some(quantity)) => name
                        .split_once('.')
                        .is_some_and(|(finger, rest)| Finger::from_name(finger).is_some() && rest == quantity),
                    _ => name == own,
                })
            })
        })
    })
}

/// `fingers.contact` when no rule reads it: the default, with its thresholds (docs/sources.md, Contacts).
fn touch_channel() -> ChannelSpec {
    ChannelSpec {
        name: "fingers.contact".into(),
        per_hand: true,
        axis: Some(Axis::Fingers),
        shape: Shape::Bool,
        dimension: Dimension::NONE,
        absent: Fallback::NormAbove {
            channel: "fingers.force".into(),
            on: contact_threshold::ON_N,
            off: contact_threshold::OFF_N,
            needed: false,
        },
    }
}

/// Touch of a hand whose fingers feel nothing: all of them touch while the gripper is closed, if the log says so.
fn closed(measured: &CleanLog, side: Side, fingers: &[Finger]) -> raw_channels::Array {
    let closed =
        measured.scalar(&format!("{side}.gripper.closed")).map_or_else(|| vec![0.0; measured.len()], <[f64]>::to_vec);
    vec![closed; fingers.len()]
}

fn not_derived(name: &str) -> InputError {
    InputError::new(format!("channel {name}"), "no derived channel has this name".to_string())
}

/// The hands of a log: those that its columns measure, of the scene's hands when the scene lists any. Where they measure none of them, all of them,
/// so that missing channels are reported.
pub fn sides<'a>(scene: &Scene, columns: impl Iterator<Item = &'a str> + Clone) -> Vec<Side> {
    let listed = |side: &Side| scene.hands.is_empty() || scene.hands.contains_key(side);
    let seen = |side: &Side| columns.clone().any(|column| column.split('.').next() == Some(side.name()));
    let found: Vec<Side> = Side::BOTH.into_iter().filter(|side| listed(side) && seen(side)).collect();
    if found.is_empty() { scene.hands.keys().copied().collect() } else { found }
}

/// The names of the objects that `target` may be, of all bodies, and of the bodies that are fixed to a hand.
pub(super) fn names(scene: &Scene) -> (Vec<String>, Vec<String>, Vec<String>) {
    let bodies: Vec<String> = scene.bodies.keys().cloned().collect();
    let objects = objects(scene).into_iter().filter_map(|body| bodies.get(body).cloned()).collect();
    let attached = scene.bodies.iter().filter(|(_, body)| body.fixed_to.is_some()).map(|(name, _)| name.clone());
    (objects, bodies, attached.collect())
}

/// The bodies that may be a target, as indices in the scene.
fn objects(scene: &Scene) -> Vec<usize> {
    scene.bodies.values().enumerate().filter(|(_, body)| body.role == Role::Object).map(|(index, _)| index).collect()
}

fn body_name(measured: &CleanLog, body: usize) -> Option<String> {
    measured.scene.bodies.get_index(body).map(|(name, _)| name.clone())
}
