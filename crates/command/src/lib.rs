//! Commands for a robot, from an analyzed recording.
//!
//! Each task has its relevant segments with the trajectory of the object, the fingertips in the frame of the object, the forces on it and the contact points.
//! They are smoothed within a segment and never across a contact (the paper's sections 2.1, 2.5 and 3.2). Attempts without an effect and pauses are omitted.
//! This crate names no robot: `robot` adds the grasps of a robot's hands.

mod columns;
pub mod csv;
mod drops;
mod episodes;
mod free_fall;
mod grip_force;
mod insertion;
mod moved_objects;
mod pads;
mod placement;
mod schema;
mod series;
pub mod smoothing;
mod touch_detection;
mod validation;
mod wall_press;

pub use insertion::{HoleGeometry, hole_of};
pub use schema::{
    Commands, Contact, GraspCriterion, GraspSpec, HoleBody, MappedFinger, MappedGrasp, Omission, Precedence, Quality,
    SCHEMA, Segment, Task, Tip,
};
pub use series::{FORCE_HZ, into_cone};
pub use touch_detection::TouchForces;
pub use validation::in_file;

use drops::{without_brushes, without_drops};
use episodes::episodes;
use indexmap::IndexMap;
use insertion::HoleEntry;
use moved_objects::moved_objects;
use nalgebra::Isometry3;
use series::{Episode, Series};
use std::borrow::Cow;
use std::collections::BTreeMap;
use teachtree_analysis::json::printed;
use teachtree_analysis::{Analysis, TaskSpan, TrackId};
use teachtree_base::error::InputError;
use teachtree_base::hands::{Finger, Side};
use teachtree_base::log_channel::{FingerPart, LogChannel};
use teachtree_base::meaning::Meaning;
use teachtree_base::pose::pose_from_array;
use teachtree_base::quantity::Quantity;
use teachtree_base::recording::Recording;
use teachtree_base::scene::{Body, Hand, Role};

/// The rate of commands, samples per second.
pub const RATE_HZ: f64 = 100.0;
/// The default radius of a fingertip, m: that of scenes.
const TIP_RADIUS_M: f64 = 0.010;
/// Friction coefficient of a fingertip on an object (the paper, section 3.1): forces stay in its friction cone.
pub const FRICTION: f64 = 1.0;

/// Makes the commands of a recording, which is as the rules see it (`teachtree_frames::trusted`); `log` is its name. Where the
/// recording has no contact flags, fingertips touch by `touch`, as in the rules that analyzed it.
///
/// # Errors
/// A recording without a scene; a task with a primitive without a declared action of the hand.
pub fn commands(
    recording: &Recording,
    analysis: &Analysis,
    touch: TouchForces,
    log: &str,
) -> Result<Commands, InputError> {
    let scene = &recording.scene;
    if scene.bodies.is_empty() {
        return Err(InputError::new(log, "has no scene with bodies, expected one to command a robot")
            .help("give a scene with `--scene`, or declare the bodies in the binding"));
    }
    let hands = hands(recording);
    if hands.is_empty() {
        let message = "has no scene with hands and no position of a fingertip, expected one to command a robot";
        return Err(InputError::new(log, message));
    }
    let objects = scene.bodies.iter().filter(|(_, body)| body.role == Role::Object).map(|(name, _)| name);
    let falling: BTreeMap<&String, f64> =
        objects.filter_map(|name| Some((name, free_fall::falls_s(recording, name)?))).collect();
    let mut spans: Vec<(Side, &Hand, Cow<'_, TaskSpan>, Option<Omission>)> = Vec::new();
    for track in &analysis.tracks {
        let TrackId::Hand(side) = track.who else { continue };
        let Some(hand) = hands.get(&side) else { continue };
        for span in &track.tasks {
            check_meanings(span, log)?;
            let about = || about(recording, (side, hand), span, touch);
            let fell_s = if falling.is_empty() { None } else { about().and_then(|(object, ..)| falling.get(object)) };
            match fell_s.filter(|fell_s| **fell_s < span.end_s) {
                None => spans.push((side, hand, Cow::Borrowed(span), None)),
                Some(&fell_s) => {
                    let (ended, left_out) = free_fall::ended(span, fell_s);
                    spans.extend(ended.map(|ended| (side, hand, Cow::Owned(ended), Some(left_out))));
                }
            }
        }
    }
    let mut handled: Vec<HandledTask<'_>> = Vec::new();
    for (side, hand, span, fell) in &spans {
        let Some((object, series, others)) = about(recording, (*side, hand), span, touch) else { continue };
        // A hand that stands still while the other hand works waits for it.
        let others_of = analysis.tracks.iter().filter(|other| other.who != TrackId::Hand(*side));
        let waits = others_of.flat_map(|other| &other.tasks).any(|other| overlap(other, span));
        let mut this = HandledTask::new(span, *side, recording, object, series, waits);
        let by_another = |name: &str, body: &Body, times: [f64; 2]| {
            let others = hands.iter().filter(|(other, _)| *other != side);
            let series = |(other, hand): (&Side, &Hand)| Series::new(recording, *other, hand, name, times, touch);
            { others }.filter_map(series).any(|series| series.touched(body).is_some())
        };
        this.left_out.extend(moved_objects(span, &this.series, &others, by_another));
        this.left_out.extend(fell.clone());
        handled.push(this);
    }
    placement::note_brushes(&mut handled);
    placement::put_all_down(&mut handled, recording);
    let falls = handled.iter().filter(|handled| handled.episodes.last().is_some_and(|last| last.lets_fall));
    let falls: Vec<(Side, f64)> = falls.map(|handled| (handled.side, handled.span.end_s)).collect();
    let mut tasks: Vec<Task> = handled.into_iter().map(|handled| handled.task(recording)).collect();
    tasks.sort_by(|a, b| a.start_s.total_cmp(&b.start_s));
    let mut tasks = without_drops(without_brushes(tasks), &falls);
    tasks.iter_mut().for_each(drops::lead_to_the_touch);
    let (schema, log, scene) = (SCHEMA.into(), log.into(), scene.name.clone());
    Ok(Commands { schema, log, rate_hz: RATE_HZ, robot: None, scene, tasks })
}

/// An object with a hand's samples relative to it.
type TouchedObject<'a> = (&'a String, &'a Body, Series);

/// Returns the object that a hand's task handles, with its samples, and the other objects that the hand touches. The handled object is the one that
/// is touched longest.
fn about<'a>(
    recording: &'a Recording,
    (side, hand): (Side, &Hand),
    span: &TaskSpan,
    touch: TouchForces,
) -> Option<(&'a String, Series, Vec<TouchedObject<'a>>)> {
    let times = [span.start_s, span.end_s];
    let objects = recording.scene.bodies.iter().filter(|(_, body)| body.role == Role::Object);
    let mut touched: Vec<TouchedObject<'_>> = objects
        .filter_map(|(name, body)| Some((name, body, Series::new(recording, side, hand, name, times, touch)?)))
        .collect();
    touched.retain(|(_, body, series)| series.nearness(body) > 0);
    let nearness = |at: &usize| touched[*at].2.nearness(touched[*at].1);
    let longest = (0..touched.len()).max_by_key(nearness)?;
    let (object, _, series) = touched.remove(longest);
    Some((object, series, touched))
}

/// Returns the hands of the scene, or the hands with recorded fingertips if the scene names none.
fn hands(recording: &Recording) -> IndexMap<Side, Hand> {
    if !recording.scene.hands.is_empty() {
        return recording.scene.hands.clone();
    }
    let hand = |side: Side| {
        let is_recorded = |finger: &Finger| {
            let position = LogChannel::Finger(side, *finger, FingerPart::Position);
            *finger != Finger::Palm && recording.columns.contains_key(&format!("{position}.x"))
        };
        let fingers: Vec<Finger> = Finger::ALL.into_iter().filter(is_recorded).collect();
        (!fingers.is_empty()).then_some((side, Hand { fingers, tip_radius: Quantity(TIP_RADIUS_M) }))
    };
    Side::BOTH.into_iter().filter_map(hand).collect()
}

/// Refuses a task with a primitive without a declared action of the hand.
fn check_meanings(span: &TaskSpan, log: &str) -> Result<(), InputError> {
    let Some(unsaid) = span.segments.iter().find(|segment| segment.does.is_none()) else { return Ok(()) };
    let name = unsaid.primitive.split('(').next().unwrap_or_default();
    let message = format!(
        "no action is declared for `{name}`, at {:.3} s in the task `{}`: no robot can carry it out",
        unsaid.start_s, span.task
    );
    Err(InputError::new(log, message).help(format!(
        "declare in the rules a kind, such as `primitive {name} is …`, or an action, such as `primitive {name} does carry`"
    )))
}

/// Whether two tasks overlap in time.
fn overlap(one: &TaskSpan, other: &TaskSpan) -> bool {
    one.start_s < other.end_s && other.start_s < one.end_s
}

/// A task, and the samples of its object.
struct HandledTask<'a> {
    side: Side,
    span: &'a TaskSpan,
    object: &'a str,
    series: Series,
    episodes: Vec<Episode>,
    left_out: Vec<Omission>,
    entered: Option<HoleEntry>,
    /// Whether it is a brush: too short to be intended, just after the release of the object. A brush is omitted.
    is_brush: bool,
}

impl<'a> HandledTask<'a> {
    fn new(
        span: &'a TaskSpan,
        side: Side,
        recording: &Recording,
        object: &'a str,
        mut series: Series,
        waits: bool,
    ) -> Self {
        let (episodes, left_out) = episodes(span, &series, waits);
        let body = recording.scene.bodies.get(object);
        body.iter().for_each(|body| grip_force::with_forces(&mut series, recording, body, &episodes));
        let entered = insertion::align_with_hole(&mut series, recording, object, &episodes);
        wall_press::press_against_wall(&mut series, recording, object, &episodes);
        Self { side, span, object, series, episodes, left_out, entered, is_brush: false }
    }

    fn task(self, recording: &Recording) -> Task {
        let Self { side, span, object, mut series, episodes, left_out, entered, is_brush } = self;
        let body = recording.scene.bodies.get(object);
        let mut task = Task {
            track: side,
            task: span.task.clone(),
            object: object.into(),
            start_s: span.start_s,
            end_s: span.end_s,
            into: entered.and_then(|entered| entered.into),
            left_out,
            grasps: Vec::new(),
            segments: Vec::new(),
        };
        let mut clock = 0.0;
        for episode in &episodes {
            // One set of contact points from each touch to the next release.
            let grasp = body.map(|body| series.contacts(body, episode)).unwrap_or_default();
            let index = task.grasps.len();
            if !grasp.contacts.is_empty() && !is_brush {
                task.grasps.push(grasp);
            }
            let index = (!task.grasps.is_empty()).then(|| index.min(task.grasps.len() - 1));
            series.smooth_forces(episode);
            for piece in &episode.pieces {
                let mut segment = series.segment(piece, index.and_then(|index| task.grasps.get(index)));
                segment.grasp = index;
                segment.touching = piece.touching;
                segment.start_s = clock;
                clock += segment.duration_s;
                task.segments.push(segment);
            }
        }
        task
    }
}

impl Task {
    /// Returns the time at which the operator first moved the held object, s of the recording.
    pub fn first_moved_s(&self) -> Option<f64> {
        let moves = |segment: &&Segment| segment.touching && !matches!(segment.does, Meaning::Close | Meaning::Open);
        self.segments.iter().find(moves).map(|segment| segment.demonstrated_start_s + segment.duration_s)
    }

    /// Returns the pose of the object at its first touch, reference frame; the identity for a task without contact.
    pub fn grasp_pose(&self) -> Isometry3<f64> {
        let touched = self.segments.iter().find(|segment| segment.touching).or(self.segments.first());
        let first = touched.and_then(|segment| segment.object.first());
        first.map_or_else(Isometry3::identity, pose_from_array)
    }

    /// Returns the duration of its commands, s.
    pub fn duration_s(&self) -> f64 {
        self.segments.last().map_or(0.0, |segment| segment.start_s + segment.duration_s)
    }
}

impl Commands {
    /// Writes them as JSON.
    ///
    /// # Errors
    /// None: every field has a form in JSON.
    pub fn json(&self) -> Result<String, InputError> {
        let value = serde_json::to_value(self).map_err(|error| InputError::new("commands", error.to_string()))?;
        Ok(printed(&value))
    }
}
