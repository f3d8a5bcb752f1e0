//! The scenarios on atom streams: what the chapter's trees must say when every condition is given by hand (docs/sources.md).
//!
//! A scenario is a list of phases; a phase sets conditions ("atoms"), and [`PhaseConditions::frames`] makes channels that fulfil them.
//! No physics, no thresholds near: this is a check of the logic of the shipped trees, tasks and relabeling.

use std::collections::BTreeMap;
use teachtree_analysis::{Analysis, TrackId, analyze};
use teachtree_base::channels::{Axis, ChannelSpec};
use teachtree_base::hands::{Finger, Side};
use teachtree_engine::evaluator::evaluate;
use teachtree_frames::frames::{ColumnKey, Frames, HandLayout, Layout};
use teachtree_language::graph::lower;
use teachtree_language::{Request, Rules, load};

/// The conditions of a phase.
#[derive(Clone, Copy, Default)]
struct PhaseConditions {
    near: bool,
    touch: bool,
    /// The grasp condition: thumb against two fingers.
    grasp: bool,
    /// The base carries the target.
    supported: bool,
    /// The target touches a wall.
    walled: bool,
    moving: bool,
    turning: bool,
    /// The target is inside another object.
    inside: bool,
    /// Speed into the hole, mm/s.
    sinking: f64,
    /// The fingers push the target down.
    down: bool,
    /// The fingers let go: one at once, the rest 150 ms later.
    leaving: bool,
    /// Above a hole, searching.
    over_socket: bool,
}

const FAR: PhaseConditions = PhaseConditions {
    near: false,
    touch: false,
    grasp: false,
    supported: false,
    walled: false,
    moving: false,
    turning: false,
    inside: false,
    sinking: 0.0,
    down: false,
    leaving: false,
    over_socket: false,
};
/// The hand is near the target, which rests.
const NEAR: PhaseConditions = PhaseConditions { near: true, supported: true, ..FAR };
/// A touch without a grasp.
const TOUCH: PhaseConditions = PhaseConditions { touch: true, ..NEAR };
/// A grasp of the target where it rests.
const HELD: PhaseConditions = PhaseConditions { grasp: true, ..TOUCH };
/// A grasp of the target in the air.
const AIR: PhaseConditions = PhaseConditions { supported: false, ..HELD };
const LEAVING: PhaseConditions = PhaseConditions { leaving: true, ..TOUCH };

/// Length of one unit of a phase, frames at 1 kHz; longer than every window of the shipped rules.
const UNIT: usize = 400;
/// Speed of a target that moves, m/s.
const SPEED: f64 = 0.05;
/// How long letting go takes, frames; shorter than the release window.
const LETTING_GO: usize = 150;

/// Channels that fulfil the phases (length in units, conditions), one right hand with three fingers.
fn frames(phases: &[(usize, PhaseConditions)], channels: &[ChannelSpec]) -> Frames {
    let mut atoms = Vec::new();
    for (units, phase) in phases {
        let len = if phase.leaving { 2 * LETTING_GO } else { units * UNIT };
        atoms.extend((0..len).map(|at| (*phase, at)));
    }
    let mut depth = 0.0;
    let depths: Vec<f64> = atoms
        .iter()
        .map(|(now, _)| {
            let start = if depth > 0.0 { depth } else { if now.sinking > 0.0 { 0.0005 } else { 0.030 } };
            depth = if now.inside { start + now.sinking * 1e-6 } else { 0.0 };
            depth
        })
        .collect();
    let fingers = vec![Finger::Thumb, Finger::Index, Finger::Middle];
    let contacts = vec!["base".to_string(), "wall".to_string()];
    let hand = HandLayout { side: Side::Right, fingers: fingers.clone(), contacts, knows_distance: false };
    let layout = Layout { rate_hz: 1000.0, hands: vec![hand] };
    let mut way = 0.0;
    let ways: Vec<f64> = atoms
        .iter()
        .map(|(now, _)| {
            way += if now.moving { SPEED / 1000.0 } else { 0.0 };
            way
        })
        .collect();
    let mut columns = BTreeMap::new();
    for (spec, channel) in channels.iter().zip(0..) {
        let slots = match spec.axis {
            None => 1,
            Some(Axis::Fingers) => 3,
            Some(Axis::Contacts) => 2,
        };
        for slot in 0..slots {
            for component in 0..spec.shape.components().len() {
                let side = spec.per_hand.then_some(Side::Right);
                let key = ColumnKey { channel, side, slot: slot as u32, component: component as u32 };
                let values = atoms.iter().zip(depths.iter().zip(&ways)).map(|((now, at), (depth, way))| {
                    value(&spec.name, slot, now, *at, (*depth, *way)).get(component).copied().unwrap_or(0.0)
                });
                columns.insert(key, values.collect());
            }
        }
    }
    let len = atoms.len();
    Frames {
        layout,
        channels: channels.to_vec(),
        columns,
        len,
        time: (0..len).map(|frame| frame as f64 / 1000.0).collect(),
        stretches: std::iter::once(0..len).collect(),
        objects: vec!["cube".into()],
        ..Frames::default()
    }
}

/// The components of a channel in a phase, `at` frames after its beginning.
fn value(channel: &str, slot: usize, now: &PhaseConditions, at: usize, (depth, way): (f64, f64)) -> Vec<f64> {
    let yes = |condition: bool| if condition { 1.0 } else { 0.0 };
    let force = force(slot, now, at);
    match channel {
        "fingers.force" => force.to_vec(),
        "fingers.contact" => vec![yes(force != [0.0; 3])],
        "fingers.position" => vec![0.0, way, if now.near { 0.10 } else { 1.0 }],
        "target.radius" => vec![0.08],
        "target.rotation" => vec![1.0, 0.0, 0.0, 0.0],
        "target.position" => vec![0.0, way, 0.0],
        "target.velocity" => vec![0.0, SPEED * yes(now.moving), 0.0],
        "target.spin" => vec![yes(now.turning)],
        "target.depth" => vec![depth],
        "target.over_socket" => vec![yes(now.over_socket)],
        "target.weight" => vec![0.49],
        "target.sinking" => vec![if now.inside { now.sinking / 1000.0 } else { 0.0 }],
        "push" => {
            let forces = [0, 1, 2].map(|finger| self::force(finger, now, at));
            (0..3).map(|component| forces.iter().map(|force| force[component]).sum()).collect()
        }
        "contacts.force" if slot == 0 => vec![0.0, 0.0, 0.5 * yes(now.supported)],
        "contacts.force" => vec![-yes(now.walled), 0.0, 0.0],
        "contacts.normal" if slot == 0 => vec![0.0, 0.0, yes(now.supported)],
        "contacts.normal" => vec![-yes(now.walled), 0.0, 0.0],
        "load" => vec![0.49],
        // The only object; everything else is zero.
        _ => vec![0.0; 4],
    }
}

fn force(finger: usize, now: &PhaseConditions, at: usize) -> [f64; 3] {
    let gone = now.leaving && (finger == 0 || at >= LETTING_GO);
    if !now.touch || gone {
        return [0.0; 3];
    }
    let down = if now.down { -1.0 } else { 0.0 };
    match (now.grasp, finger) {
        (true, 0) => [1.0, 0.0, down],
        (true, _) => [-0.5, 0.0, down],
        // Two fingers side by side: no internal force. The thumb hangs on so that one finger can leave first.
        (false, _) => [0.2, 0.0, 0.0],
    }
}

fn rules(file: &str) -> Rules {
    let path = std::path::Path::new(crate::ROOT).join("rules").join(file);
    let loaded = load(&Request { files: vec![path], ..Request::default() });
    loaded.rules.unwrap_or_else(|| panic!("{:?}", loaded.diagnostics))
}

fn analysis(rules: &Rules, phases: &[(usize, PhaseConditions)]) -> Analysis {
    let frames = frames(phases, &rules.channels);
    let leaves = evaluate(&lower(rules), &frames).unwrap();
    analyze(rules, &frames, &leaves)
}

/// Raw sequence, relabeled sequence and tasks of the right hand.
fn printed(rules: &Rules, phases: &[(usize, PhaseConditions)]) -> (String, String, String) {
    let analysis = analysis(rules, phases);
    let track = analysis.track(TrackId::Hand(Side::Right)).unwrap();
    let raw: Vec<&str> = track.segments.iter().map(|segment| segment.primitive.as_str()).collect();
    let relabeled: Vec<Vec<&str>> = track
        .tasks
        .iter()
        .map(|task| task.segments.iter().map(|segment| segment.primitive.as_str()).collect())
        .collect();
    let tasks: Vec<&str> = track.tasks.iter().map(|task| task.task.as_str()).collect();
    (raw.join(" "), relabeled.iter().map(|task| task.join(" ")).collect::<Vec<_>>().join(" | "), tasks.join(" "))
}

struct Scenario {
    name: &'static str,
    phases: Vec<(usize, PhaseConditions)>,
    raw: &'static str,
    relabeled: &'static str,
    task: &'static str,
}

fn reach() -> Vec<(usize, PhaseConditions)> {
    vec![(3, FAR), (3, NEAR)]
}

/// The target is in a socket from the beginning.
fn reach_inside() -> Vec<(usize, PhaseConditions)> {
    vec![(3, PhaseConditions { inside: true, ..FAR }), (3, PhaseConditions { inside: true, ..NEAR })]
}

fn leave() -> Vec<(usize, PhaseConditions)> {
    vec![(1, LEAVING), (1, NEAR), (3, FAR)]
}

fn scenario(
    name: &'static str,
    middle: Vec<(usize, PhaseConditions)>,
    raw: &'static str,
    relabeled: &'static str,
    task: &'static str,
) -> Scenario {
    Scenario { name, phases: [reach(), middle, leave()].concat(), raw, relabeled, task }
}

/// Both sequences are written without the Move that closes the recording.
fn single_hand() -> Vec<Scenario> {
    let inside = |atoms: PhaseConditions| PhaseConditions { inside: true, ..atoms };
    let moving = |atoms: PhaseConditions| PhaseConditions { moving: true, ..atoms };
    let turning = |atoms: PhaseConditions| PhaseConditions { turning: true, ..atoms };
    let sinking = |speed: f64, atoms: PhaseConditions| PhaseConditions { inside: true, sinking: speed, ..atoms };
    vec![
        scenario(
            "pick and place",
            vec![(2, HELD), (3, AIR), (2, HELD), (1, moving(HELD))],
            "Move Approach Grasp Translate Place Slide Release",
            "Move Approach Grasp Translate Place Release",
            "pick_and_place",
        ),
        scenario(
            "peg in hole",
            vec![(2, HELD), (3, AIR), (3, sinking(20.0, AIR)), (1, inside(HELD))],
            "Move Approach Grasp Translate Insert Release",
            "Move Approach Grasp Translate Insert Release",
            "peg_in_hole",
        ),
        scenario(
            "searching on the rim before the peg goes in",
            vec![
                (2, HELD),
                (3, AIR),
                (2, PhaseConditions { over_socket: true, ..HELD }),
                (3, PhaseConditions { over_socket: true, ..sinking(20.0, AIR) }),
                (1, inside(HELD)),
            ],
            "Move Approach Grasp Translate Insert Release",
            "Move Approach Grasp Translate Insert Release",
            "peg_in_hole",
        ),
        Scenario {
            name: "peg pullout from hole",
            phases: [reach_inside(), vec![(2, inside(HELD)), (3, sinking(-20.0, AIR)), (3, AIR), (2, HELD)], leave()]
                .concat(),
            raw: "Move Approach Grasp Pullout Translate Place Release",
            relabeled: "Move Approach Grasp Pullout Translate Place Release",
            task: "peg_pullout_from_hole",
        },
        Scenario {
            name: "turn screw, with axial play",
            phases: [
                reach_inside(),
                vec![
                    (2, inside(HELD)),
                    (3, inside(turning(HELD))),
                    (1, sinking(10.0, HELD)),
                    (3, inside(turning(HELD))),
                    (1, sinking(-10.0, HELD)),
                    (2, inside(turning(HELD))),
                    (1, inside(HELD)),
                ],
                leave(),
            ]
            .concat(),
            raw: "Move Approach Grasp Turn Insert Turn Pullout Turn Release",
            relabeled: "Move Approach Grasp Turn Release",
            task: "turn_screw",
        },
        scenario(
            "slide",
            vec![(2, HELD), (3, moving(HELD)), (1, HELD)],
            "Move Approach Grasp Slide Grasp Release",
            "Move Approach Grasp Slide Release",
            "slide",
        ),
        scenario(
            "turn a knob on the base",
            vec![(2, HELD), (3, turning(HELD)), (1, HELD)],
            "Move Approach Grasp Turn Grasp Release",
            "Move Approach Grasp Turn Grasp Release",
            "turn_screw",
        ),
    ]
}

/// The scenarios of the four primitives that need 3-D force.
fn contact() -> Vec<Scenario> {
    let moving = |atoms: PhaseConditions| PhaseConditions { moving: true, ..atoms };
    let walled = |atoms: PhaseConditions| PhaseConditions { walled: true, ..atoms };
    vec![
        scenario(
            "E1a: pick and follow (section 3.2)",
            vec![(1, moving(HELD)), (2, HELD), (3, AIR), (4, walled(moving(AIR))), (2, walled(HELD))],
            "Move Approach Slide Grasp Translate Follow Place Release",
            "Move Approach Grasp Translate Follow Place Release",
            "pick_and_follow",
        ),
        scenario(
            "E1b: push and trace (section 3.2)",
            vec![
                (1, TOUCH),
                (2, moving(TOUCH)),
                (2, walled(moving(TOUCH))),
                (2, moving(TOUCH)),
                (2, walled(moving(TOUCH))),
            ],
            "Move Approach Push Trace Push Trace Release",
            "Move Approach Push Trace Release",
            "push_and_trace",
        ),
        scenario(
            "pick and press against a wall",
            vec![(2, HELD), (2, AIR), (3, walled(AIR)), (2, AIR), (2, HELD)],
            "Move Approach Grasp Translate Press Translate Place Release",
            "Move Approach Grasp Translate Press Translate Place Release",
            "pick_and_press",
        ),
        scenario(
            "pick and press downwards (stamp)",
            vec![(2, HELD), (2, AIR), (4, PhaseConditions { down: true, ..HELD }), (2, HELD)],
            // The press is known only when it has lasted.
            "Move Approach Grasp Translate Press Place Release",
            "Move Approach Grasp Translate Press Place Release",
            "pick_and_press",
        ),
        scenario(
            "grasp next to a wall, then lift",
            vec![(2, walled(HELD)), (3, AIR), (2, HELD)],
            "Move Approach Grasp Translate Place Release",
            "Move Approach Grasp Translate Place Release",
            "pick_and_place",
        ),
        scenario(
            "push only",
            vec![(1, TOUCH), (3, moving(TOUCH)), (1, walled(TOUCH))],
            "Move Approach Push Release",
            "Move Approach Push Release",
            "push",
        ),
        scenario(
            "slide into a wall under grasp",
            vec![(2, HELD), (3, moving(HELD)), (2, walled(HELD)), (3, walled(moving(HELD)))],
            "Move Approach Grasp Slide Press Follow Release",
            "Move Approach Grasp Slide Press Follow Release",
            "pick_and_follow",
        ),
        Scenario {
            name: "aborted approach",
            phases: [reach(), vec![(2, FAR), (2, NEAR), (2, HELD), (2, AIR), (2, HELD)], leave()].concat(),
            raw: "Move Approach Move Approach Grasp Translate Place Release",
            relabeled: "Move Approach Move Approach Grasp Translate Place Release",
            task: "pick_and_place",
        },
    ]
}

fn check(rules: &Rules, scenarios: &[Scenario]) {
    let mut wrong = Vec::new();
    for Scenario { name, phases, raw, relabeled, task } in scenarios {
        let (found_raw, found_relabeled, found_task) = printed(rules, phases);
        let found_raw = found_raw.strip_suffix(" Move").unwrap_or(&found_raw).to_string();
        for (found, wanted) in [(&found_raw, raw), (&found_relabeled, relabeled), (&found_task, task)] {
            if found != wanted {
                wrong.push(format!("{name}:\n  found  {found}\n  expected {wanted}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn the_tree_says_what_the_chapter_says() {
    let rules = rules("contact.rules");
    check(&rules, &single_hand());
    check(&rules, &contact());
}

/// The first tasks need no 3-D force: the tree of ten primitives says the same about them.
#[test]
fn the_base_tree_alone_knows_the_first_tasks() {
    check(&rules("single_hand.rules"), &single_hand());
}
