//! A binding and a scene for a log with unknown columns: each guess from names, units and values has its reason as a comment, and
//! where another one is likely, that as a comment too.

mod approaches;
mod arms;
mod bearings;
mod binding_text;
mod bodies;
mod body_shapes;
mod column_groups;
mod contact_levels;
mod contacts;
mod copies;
mod empty_grippers;
mod fingertip_pairs;
mod flanges;
mod grippers;
mod hand_markers;
mod hand_overs;
mod hands;
mod held_shapes;
mod hold_points;
mod holds;
mod images;
mod insertions;
mod low_closings;
mod marker_sets;
mod motion;
mod param_text;
mod parts;
mod planar_poses;
mod pushed_shapes;
mod quantiles;
mod recorded;
mod relative_positions;
mod rests;
mod rounded_yaml;
mod scene_text;
mod sockets;
mod strokes;
mod supports;
mod timing;
mod transforms;
mod turns;
mod unused_columns;
mod weights;
mod words;
mod wrist_forces;
mod yaml_scalar;

pub use column_groups::{Form, Group, groups};
pub use yaml_scalar::quoted;

use crate::bind::{BindingFile, bind};
use crate::inspect::{Inspection, ValueKind};
use arms::Arm;
use bearings::FoundBearing;
use bodies::Body;
use contact_levels::FoundLevel;
use contacts::Contacts;
use empty_grippers::Widths;
use grippers::Gripper;
use hands::Hand;
use held_shapes::HeldShape;
use hold_points::{HoldPoint, Kind};
use parts::Part;
use pushed_shapes::PushedShape;
use rests::Rest;
use sockets::{Evidence, FoundSocket};
use std::collections::BTreeMap;
use teachtree_base::error::InputError;
use teachtree_base::hands::Side;
use teachtree_base::recording::Recording;
use teachtree_base::yaml;
use teachtree_logs::read::table::Source;
use transforms::Transforms;

/// Answers to the questions of a proposal.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Answers {
    /// The rate of rows without stamps, Hz.
    pub rate_hz: Option<f64>,
    /// Hands whose gripper is closed at the other end than proposed.
    pub is_reversed: BTreeMap<Side, bool>,
    /// Hands whose gripper the bound log shows to be closed at the other end.
    turned: Vec<Side>,
}

/// What a person may know better than the log shows.
#[derive(Clone, Debug, PartialEq)]
pub enum Question {
    /// The rows have no stamps; the proposed rate, Hz.
    Rate(f64),
    /// A gripper may be closed at the other end; when it is closed as proposed, and otherwise.
    Closed(Side, String, String),
}

/// Values of params for the project file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ProjectParams {
    /// Names and values.
    pub values: Vec<(String, String)>,
    /// Why.
    pub reason: String,
}

/// A binding and a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Proposal {
    /// The text of the binding.
    pub binding: String,
    /// The text of the scene.
    pub scene: String,
    /// What stands in the project file beside both.
    pub params: ProjectParams,
    /// Whether a column was found for any channel.
    pub has_channels: bool,
    /// What the log does not show.
    pub questions: Vec<Question>,
    /// What an analysis needs and was not found, a sentence each.
    pub lacking: Vec<String>,
    /// The columns of a log without any channel, and why they have none, a line for each kind.
    pub refused: Vec<String>,
}

/// What was found in a log.
struct Survey<'a> {
    hands: BTreeMap<Side, Hand<'a>>,
    grippers: BTreeMap<Side, Gripper>,
    /// Arms by whose joints hands are known.
    arms: Vec<Arm>,
    bodies: Vec<Body<'a>>,
    contacts: Contacts,
    /// Bodies that a hand without a gripper has all the time.
    fixed: BTreeMap<String, Side>,
    /// The angle of a mechanism.
    mechanism: Option<Part<'a>>,
    /// Where bodies are first in the bound log, m.
    starts: BTreeMap<String, [f64; 3]>,
    /// Where bodies rest in the bound log.
    rests: Vec<Rest>,
    /// How far beside their origins bodies are held in the bound log, m.
    held_beside_m: BTreeMap<String, f64>,
    /// How long grippers approach objects without a position in the bound log, s.
    approach_s: Option<f64>,
    /// How long grippers stay near the places where they open in such a log, s.
    retreat_s: Option<f64>,
    /// How far grippers are open on objects and empty in the bound log.
    widths: BTreeMap<Side, Widths>,
    /// How far two grippers are apart at the nearest hand-over in the bound log, m.
    handed_over_m: Option<f64>,
    /// How far in front of flanges grippers hold objects in the bound log, m.
    flange_lengths_m: BTreeMap<Side, f64>,
    /// Where hands without fingertips and grippers hold objects in the bound log.
    hold_points: BTreeMap<Side, HoldPoint>,
    /// How far the vertical forces at wrists rise while objects are carried in the bound log, N.
    force_rises: BTreeMap<Side, f64>,
    /// The shapes of bodies that fingertips carry in the bound log.
    held_shapes: BTreeMap<String, HeldShape>,
    /// The faces of bodies that fingertips push in the bound log.
    pushed_shapes: BTreeMap<String, PushedShape>,
    /// How far fingertips are from the origins of bodies that move in the bound log, m.
    reached_m: BTreeMap<String, f64>,
    /// The forces at wrists from which on they are contact, where the bound log shows them.
    levels: BTreeMap<Side, FoundLevel>,
    /// Sockets that the bound log shows.
    sockets: Vec<FoundSocket>,
    /// Sockets that bodies at rest may be instead of supports.
    maybe_sockets: Vec<FoundSocket>,
    /// Bearings that the bound log shows.
    bearings: Vec<FoundBearing>,
    /// The column of labels, with its sheet.
    labels: Option<String>,
    /// Why y points up in the log; none where z does.
    y_up_reason: Option<&'static str>,
    /// Rotations that cannot be turned to z up, as a binding writes them.
    unturned: Vec<String>,
    /// The unit of positions without one; none if all have one.
    guessed_unit: Option<&'static str>,
    /// What nothing was found for.
    rest: Vec<Part<'a>>,
}

impl Survey<'_> {
    /// Whether there are two grippers and no body.
    fn is_pair(&self) -> bool {
        self.grippers.len() > 1 && self.bodies.is_empty()
    }
}

impl<'a> Survey<'a> {
    fn new(log: &'a Inspection, answers: &Answers) -> Self {
        let mut parts = parts::parts(log);
        planar_poses::join(&mut parts);
        parts::guess_unit(&mut parts);
        Transforms::of(log).mark(&mut parts);
        copies::leave_out_copies(&mut parts);
        relative_positions::mark(&mut parts);
        let guessed_unit = parts.iter().find(|part| part.is_unitless_position()).map(|part| part.guessed_unit);
        let subject = marker_sets::common_subject(&parts);
        let are_markers = marker_sets::are_markers(&parts);
        let (mut hands, rest) = hands::hands(parts);
        let (bodies, mut rest) = bodies::bodies(rest, subject.as_deref());
        let (bodies, markers) = marker_sets::without_markers_of_rigid_bodies(bodies);
        let (bodies, others) = marker_sets::without_second_sources(bodies);
        rest.extend(markers.into_iter().chain(others));
        let mut bodies = marker_sets::merged(bodies, are_markers);
        let (contacts, mut rest) = contacts::contacts(rest, &bodies, &hands);
        hands::wrists(&mut hands, &mut rest, contacts.lines.is_empty());
        hands.retain(|_, hand| hand.tool.is_some() || !hand.tips.is_empty() || hand.force.is_some());
        let tools: BTreeMap<Side, &Part> =
            hands.iter().filter_map(|(side, hand)| Some((*side, hand.tool.as_ref()?))).collect();
        // What never moves in its frame shows nothing before the transforms are composed.
        let tools: BTreeMap<Side, &Part> = tools.into_iter().filter(|(_, tool)| tool.carried_in.is_none()).collect();
        let (mut grippers, rest) = grippers::grippers(rest, &tools, &bodies, &answers.turned);
        // A weight shows a hold where nothing else does.
        if grippers.is_empty() && bodies.is_empty() && contacts.lines.is_empty() {
            grippers.extend(hands.iter().filter_map(|(side, hand)| Some((*side, weights::gripper(hand)?))));
        }
        for (side, hand) in hands.iter().filter(|(side, _)| !contacts.are_of(**side)) {
            if let (false, Some(gripper)) =
                (grippers.contains_key(side), fingertip_pairs::gripper(*side, hand, &bodies))
            {
                grippers.insert(*side, gripper);
            }
        }
        let fixed = bodies.iter().filter_map(|body| {
            let is_without = |side: &Side, hand: &Hand| !grippers.contains_key(side) && hand.tips.is_empty();
            let mut holds = hands.iter().filter(|(side, hand)| is_without(side, hand));
            let (side, _) = holds.find(|(_, hand)| hand.tool.as_ref().is_some_and(|tool| body.is_fixed_to(tool)))?;
            Some((body.name.clone(), *side))
        });
        let fixed: BTreeMap<String, Side> = fixed.collect();
        let is_measured =
            |side: Side| hands.get(&side).is_some_and(|hand| hand.tool.is_some() || !hand.tips.is_empty());
        let (arms, mut rest) = arms::arms(rest, &grippers, is_measured, log.lerobot_version.as_deref());
        // The geometry of a model is better than a usual stroke.
        for arm in arms.iter().filter(|arm| arm.has_gripper && !arm.is_incomplete) {
            if let Some(gripper) = grippers.get_mut(&arm.side) {
                (gripper.opening, gripper.held_m) = (None, None);
            }
        }
        let is_angle = |part: &Part| {
            let turns = ["latch", "door", "hinge", "handle", "valve", "drawer", "lever", "knob"];
            ["rad", "deg"].contains(&part.unit.as_str()) && words::has(&part.words, &turns) && !part.is_constant()
        };
        let mechanism = rest.iter().position(is_angle).map(|at| rest.remove(at));
        let y_up_reason = bodies::y_up_reason(&bodies, log);
        let mut unturned = vec![];
        if y_up_reason.is_some() {
            let of_hands = hands.values_mut().map(|hand| &mut hand.rotation);
            for rotation in of_hands.chain(bodies.iter_mut().map(|body| &mut body.rotation)) {
                // What three columns turn has no form in a binding with another axis up.
                if rotation.as_ref().is_some_and(|rotation| rotation.members.len() == 3) {
                    unturned.extend(rotation.take().map(|rotation| rotation.columns()));
                }
            }
        }
        let labels = labels(log);
        Self {
            hands,
            grippers,
            arms,
            bodies,
            contacts,
            fixed,
            mechanism,
            starts: BTreeMap::new(),
            rests: vec![],
            held_beside_m: BTreeMap::new(),
            approach_s: None,
            retreat_s: None,
            widths: BTreeMap::new(),
            handed_over_m: None,
            flange_lengths_m: BTreeMap::new(),
            hold_points: BTreeMap::new(),
            force_rises: BTreeMap::new(),
            held_shapes: BTreeMap::new(),
            pushed_shapes: BTreeMap::new(),
            reached_m: BTreeMap::new(),
            levels: BTreeMap::new(),
            sockets: vec![],
            maybe_sockets: vec![],
            bearings: vec![],
            labels,
            y_up_reason,
            unturned,
            guessed_unit,
            rest,
        }
    }

    /// Adds guesses from the bound log.
    fn place(&mut self, recording: &Recording) {
        for body in &self.bodies {
            let start = recorded::start(recording, &body.name);
            self.starts.extend(start.map(|start| (body.name.clone(), start)));
        }
        self.rests = rests::rests(recording);
        self.held_beside_m = rests::held_beside_m(recording);
        self.approach_s = approaches::approach_s(recording).filter(|_| self.bodies.is_empty());
        self.retreat_s = approaches::retreat_s(recording).filter(|_| self.bodies.is_empty());
        self.widths = empty_grippers::widths(recording);
        self.handed_over_m = hand_overs::distance_m(recording, &self.widths);
        self.flange_lengths_m = flanges::lengths_m(recording);
        self.flange_lengths_m.retain(|side, _| self.hands.get(side).is_some_and(flanges::is_flange));
        self.hold_points = hold_points::hold_points(recording);
        let is_bare = |hand: &Hand| hand.rotation.is_some() && hand.tips.is_empty();
        self.hold_points.retain(|side, _| self.hands.get(side).is_some_and(is_bare));
        self.force_rises = wrist_forces::rises(recording);
        // A tool point at the surface of what it moves touches it.
        if self.hold_points.is_empty() && self.contacts.lines.is_empty() {
            self.pushed_shapes = pushed_shapes::pushed_shapes(recording);
            self.reached_m = pushed_shapes::reached_m(recording);
        }
        self.held_shapes = held_shapes::held_shapes(recording);
        self.held_shapes.retain(|body, _| !self.pushed_shapes.contains_key(body));
        self.levels = contact_levels::levels(recording);
        self.bearings = if self.mechanism.is_none() { bearings::bearings(recording) } else { vec![] };
        let mut sockets = sockets::sockets(recording);
        // What turns in its place was not put there.
        sockets.retain(|socket| self.bearings.iter().all(|bearing| bearing.object != socket.object));
        (self.maybe_sockets, self.sockets) = sockets.into_iter().partition(|socket| socket.evidence == Evidence::Above);
        let is_fixed = |name: &str| {
            let mut fixed = self.sockets.iter().map(|it| &it.of).chain(self.bearings.iter().map(|it| &it.of)).flatten();
            fixed.any(|of| of == name)
        };
        // Fingers touch objects.
        self.contacts.lines.retain(|line| line.object().is_none_or(|object| !is_fixed(object)));
    }

    /// The grippers whose closed end nothing but the heights at which they close shows to be the other one.
    fn turned(&self, recording: &Recording, answers: &Answers) -> Vec<Side> {
        let is_open = |side: &Side| {
            let is_guess = |gripper: &Gripper| gripper.is_guess && gripper.opening.is_none();
            !answers.turned.contains(side)
                && !answers.is_reversed.contains_key(side)
                && self.grippers.get(side).is_some_and(is_guess)
        };
        let closings = low_closings::sets_flag(recording).into_iter();
        closings.filter(|(side, sets_flag)| !sets_flag && is_open(side)).map(|(side, _)| side).collect()
    }

    /// Where a body is first, m, z up.
    fn at(&self, name: &str) -> Option<[f64; 3]> {
        let first = || Some(self.upright(self.bodies.iter().find(|body| body.name == name)?.start()?));
        self.starts.get(name).copied().or_else(first)
    }

    /// A name that no body has.
    fn free_name(&self, name: &str) -> String {
        let mut name = name.to_string();
        while self.bodies.iter().any(|body| body.name == name) {
            name.push('_');
        }
        name
    }

    fn is_y_up(&self) -> bool {
        self.y_up_reason.is_some()
    }

    /// A point with z up.
    fn upright(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        if self.is_y_up() { [x, -z, y] } else { [x, y, z] }
    }

    /// Whether a point of a hand is known: measured, or by the joints of an arm.
    fn has_point(&self) -> bool {
        self.arms.iter().any(|arm| !arm.is_incomplete)
            || self.hands.values().any(|hand| hand.tool.is_some() || !hand.tips.is_empty())
    }

    /// Whether all hands and bodies move in a plane: they push, and nothing is held.
    fn is_planar(&self) -> bool {
        let mut tools = self.hands.values().filter_map(|hand| hand.tool.as_ref());
        let mut bodies = self.bodies.iter().flat_map(|body| &body.positions);
        !self.bodies.is_empty() && tools.all(Part::is_planar) && bodies.all(Part::is_planar)
    }

    /// Whether the hands have neither fingertips nor grippers, and nothing they handle is in the log: the tool is fixed.
    fn is_fixed_tool(&self) -> bool {
        self.bodies.is_empty()
            && self.grippers.is_empty()
            && self.hands.values().all(|hand| hand.tips.is_empty())
            && self.hands.values().any(|hand| hand.force.is_some() && hand.tool.is_some())
    }
}

/// The column of labels that a log has: texts, not all the same.
fn labels(log: &Inspection) -> Option<String> {
    let is_label =
        |name: &str| words::has(&words::words(name), &["label", "labels", "primitive", "surgeme", "phase", "subtask"]);
    log.sheets.iter().find_map(|sheet| {
        let column = sheet
            .columns
            .iter()
            .find(|column| column.kind == ValueKind::Text && column.texts.len() > 1 && is_label(&column.name))?;
        Some(if sheet.name.is_empty() { column.name.clone() } else { format!("{}.{}", sheet.name, column.name) })
    })
}

/// Proposes a binding and a scene for a log.
pub fn propose(log: &Inspection, answers: &Answers) -> Proposal {
    proposal(Survey::new(log, answers), log, answers)
}

/// The same proposal with what only the bound log shows, where positions are in one frame with z up: where bodies begin, sockets and bearings. `open` opens
/// the log anew. Where the log cannot be opened again, or the binding does not fit it, the proposal stays as it is.
#[must_use]
pub fn with_places(
    first: Proposal,
    log: &Inspection,
    answers: &Answers,
    open: &dyn Fn() -> Result<Source, InputError>,
) -> Proposal {
    let Some(recording) = open().ok().and_then(|source| bound(&first, source)) else { return first };
    let mut survey = Survey::new(log, answers);
    let turned = survey.turned(&recording, answers);
    if !turned.is_empty() {
        let turned = [answers.turned.clone(), turned].concat();
        let answers = Answers { turned, ..answers.clone() };
        let first = propose(log, &answers);
        return with_places(first, log, &answers, open);
    }
    survey.place(&recording);
    proposal(survey, log, answers)
}

/// The log under the names of channels.
fn bound(proposal: &Proposal, source: Source) -> Option<Recording> {
    let file = BindingFile::parse(proposal.binding.clone(), "binding".into()).ok()?;
    let scene = yaml::read(&proposal.scene, "scene").ok()?;
    Some(bind(source, &file, scene).ok()?.recording)
}

fn proposal(survey: Survey, log: &Inspection, answers: &Answers) -> Proposal {
    let timing = timing::timing(log, &survey, answers);
    let mut questions: Vec<Question> = timing.question.iter().cloned().collect();
    for (side, gripper) in survey.grippers.iter().filter(|(_, gripper)| gripper.is_guess) {
        if let Some(alternative) = &gripper.alternative {
            questions.push(Question::Closed(*side, gripper.closed.clone(), alternative.clone()));
        }
    }
    let has_channels = binding_text::has_channels(&survey, answers);
    let is_blank = !has_channels && survey.arms.is_empty();
    let refused = if is_blank { unused_columns::refused(&survey, log) } else { vec![] };
    Proposal {
        binding: binding_text::binding(&survey, &timing, answers, &refused),
        scene: if is_blank { unused_columns::BLANK_SCENE.into() } else { scene_text::scene(&survey) },
        params: param_text::project_params(&survey),
        has_channels,
        questions,
        lacking: lacking(&survey),
        refused,
    }
}

/// Whether something shows when a hand holds something.
fn shows_closing(survey: &Survey) -> bool {
    !survey.grippers.is_empty()
        || survey.hands.values().any(|hand| hand.tips.len() > 1 || hand.force.is_some())
        || survey.contacts.are_of_fingers()
        || !survey.fixed.is_empty()
        || survey.hold_points.values().any(|hold| hold.kind == Kind::Carried)
}

/// What an analysis needs and the log lacks.
fn lacking(survey: &Survey) -> Vec<String> {
    let mut lacking = vec![];
    if survey.arms.iter().any(|arm| arm.is_incomplete) {
        lacking.push("the joints are in ticks: copy the calibration file of the arm beside the binding, and take `#` from `robots` there".into());
    } else if !survey.has_point() {
        lacking.push(no_point(survey));
    }
    if !shows_closing(survey) && survey.mechanism.is_none() && !survey.is_planar() {
        lacking.push(format!(
            "no column shows when a hand holds something: neither an opening nor a flag, forces or several fingertips{}{}",
            late_grasps(survey),
            fingertips_of(survey)
        ));
    }
    if survey.bodies.is_empty() && !survey.is_fixed_tool() {
        lacking.push("no column is the position of an object: a held object moves with the hand, and its position is otherwise unknown".into());
    }
    lacking
}

/// What the rules find without a hold; empty where no hand or no object is tracked.
fn late_grasps(survey: &Survey) -> &'static str {
    let is_tracked = !survey.bodies.is_empty() && survey.has_point();
    if is_tracked {
        "; Grasp begins after 10 mm of lift (`raised_by`), Release after 40 mm of distance (`left_by`)"
    } else {
        ""
    }
}

/// The lines with which markers on a hand give the places of its fingertips; empty where the log lacks its rotation.
fn fingertips_of(survey: &Survey) -> String {
    let hand = survey.hands.iter().find(|(_, hand)| hand.tool.is_some() && hand.rotation.is_some());
    hand.map_or_else(String::new, |(side, _)| {
        format!(
            "; if markers on the hand are tracked, bind them as `{side}.palm.position` and `{side}.palm.rotation`, and thumb and index by their places beside \
             the markers, such as `{side}.thumb.position: {{at: [0 mm, 30 mm, 90 mm], of: {side}.palm}}`"
        )
    })
}

/// The message that no column is the position of a hand, and the lines to edit: a guessed body may be the hand.
fn no_point(survey: &Survey) -> String {
    let moving = survey.bodies.iter().filter(|body| body.moves());
    // The body with the most markers is the likeliest hand.
    let hand = moving
        .min_by_key(|body| std::cmp::Reverse(body.positions.len()))
        .and_then(|body| Some((body, body.positions.first()?)));
    let example = hand.map_or_else(
        || "write its columns after `right.tcp.position`".to_string(),
        |(body, part)| {
            let has_markers = body.positions.len() > 1;
            let channel = if has_markers { "right.thumb.position" } else { "right.tcp.position" };
            format!(
                "if it is one of these lines, replace it, such as by `{channel}: {}`, and delete the body `{}` in the scene",
                yaml_scalar::scalar(&part.columns()),
                body.name
            )
        },
    );
    format!(
        "no column is the position of a hand: {example}; or describe the robot whose joints the log has with `robots` (docs/bindings.md, Joints)"
    )
}
