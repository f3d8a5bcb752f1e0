//! `cargo bench -p teachtree-measure --bench grasp`: grasp mapping compared with `scipy.optimize.differential_evolution` on the same hand and problems,
//! in the same run.
//!
//! The Python script receives the links of the robot, computes the same cost from them, and searches ten times with different seeds
//! (`-- 3`: three times). First both compute the cost of the same poses and the margin of friction; unless they agree, the bench stops.
#![allow(missing_docs, reason = "a program")]
#![allow(clippy::print_stdout, clippy::expect_used, reason = "a program that stops when something is wrong")]

#[path = "../../examples/grasps/list.rs"]
#[allow(dead_code, reason = "the example needs more of it")]
mod list;

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use serde_json::{Value, json};
use std::io::Write;
use std::process::{Command, Stdio};
use std::time::Instant;
use teachtree_base::geometry::unit;
use teachtree_base::hands::{Finger, Side};
use teachtree_base::scene::{Body, Shape};
use teachtree_command::FRICTION;
use teachtree_robot::grasp::{Contact, GraspCandidate, GraspPlanner, GraspRequest, LARGEST_PAD_ANGLE, SearchEffort};
use teachtree_robot::{self as robot, CollisionShape, HandModel, MAX_DOFS, Robot};

/// Default number of searches of the peer for each problem.
const SEEDS: usize = 10;
/// Duration of the timing of our search, s.
const LONG_S: f64 = 1.0;
/// Number of compared poses, and their largest distance from our solution, m and rad; the first is at a fifth of it.
const LOOKS: usize = 40;
const FAR: f64 = 1.0;
/// Relative tolerance of costs and measures of the same pose.
const AGREED: f64 = 1e-6;
/// Tolerance of the margin of friction, which each finds by another method.
const AGREED_FRICTION: f64 = 0.01;

fn main() {
    // Paths of rules, logs and robots are those of the repository.
    std::env::set_current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/..")).expect("the folder of the repository");
    let robot = robot::open("gifu_hand_iii_right", &|_| unreachable!("it is shipped")).expect("it is shipped");
    let hand = &robot.hands[&Side::Right];
    let planner = GraspPlanner::new(hand);
    let seeds = std::env::args().find_map(|word| word.parse().ok()).unwrap_or(SEEDS);
    let problems = problems();
    let ours: Vec<PlannerResult> =
        problems.iter().map(|(_, object, contacts)| map(&planner, object, contacts)).collect();
    let described =
        problems.iter().zip(&ours).map(|((_, object, contacts), ours)| problem(object, contacts, &ours.looks));
    let given =
        json!({"hand": described_hand(&robot, hand), "problems": described.collect::<Vec<_>>(), "seeds": seeds});
    let Some(answers) = evolution(&given) else {
        println!("differential evolution was not measured: python3 has no package `scipy`");
        return;
    };
    println!("grasp mapping beside scipy's differential evolution, best of {seeds} seeds");
    println!("| grasp | measures | ratio | wall times | ratio | evaluations | share | with slopes by differences |");
    println!("|---|---|---|---|---|---|---|---|");
    let mut worst = [f64::INFINITY, f64::INFINITY, 0.0, 0.0];
    for (((name, object, contacts), ours), theirs) in problems.iter().zip(&ours).zip(&answers) {
        let theirs = PeerResult::of(
            theirs,
            ours,
            &planner,
            &GraspRequest { contacts: contacts.clone(), object, obstacles: vec![] },
        );
        let ratio = ours.grasp.measure / theirs.measure;
        let faster = theirs.seconds / ours.seconds;
        let [looks, differences] = counted(&ours.effort).map(|count| count as f64 / theirs.evaluations);
        println!(
            "| {name} | {:.4}, {:.4} | {ratio:.3} | {:.2} ms, {:.2} s | {faster:.0} | {}, {:.0} | {looks:.3} | {differences:.3} |",
            ours.grasp.measure,
            theirs.measure,
            ours.seconds * 1e3,
            theirs.seconds,
            counted(&ours.effort)[0],
            theirs.evaluations
        );
        worst = [worst[0].min(ratio), worst[1].min(faster), worst[2].max(looks), worst[3].max(differences)];
    }
    let [ratio, faster, looks, differences] = worst;
    println!(
        "worst of all: measure {ratio:.3} (expected 0.98), {faster:.0} times as fast (expected 100), evaluations {looks:.3} (expected 0.1)"
    );
    println!(
        "Every look at a pose is an evaluation: at its cost, at its cost and slope, or only at what its fingers miss. Were a slope taken by differences, it"
    );
    println!("would be six more: {differences:.3}.");
}

/// The cube of Kawasaki et al. (2014), and the first grasps of the list with two, three, four and five fingers.
fn problems() -> Vec<(String, Body, Vec<Contact>)> {
    let at = |finger, x: f64, side: f64| Contact {
        finger,
        point: Point3::new(x, side * 0.06, 0.03),
        normal: Vector3::y() * side,
    };
    let contacts = vec![at(Finger::Thumb, 0.0, -1.0), at(Finger::Index, -0.011, 1.0), at(Finger::Middle, 0.011, 1.0)];
    let mut problems =
        vec![("cube of 120 mm, 3 fingers".into(), list::body("box: [120 mm, 120 mm, 120 mm]"), contacts)];
    let list = list::listed();
    for fingers in 2..=5 {
        let grasp = list.iter().find(|grasp| grasp["contacts"].as_array().map(Vec::len) == Some(fingers));
        let grasp = grasp.expect("the list has grasps of two to five fingers");
        let (body, contacts) = list::read(grasp);
        problems.push((format!("{}, {fingers} fingers", grasp["shape"].as_str().unwrap_or("")), body, contacts));
    }
    problems
}

/// Our result, its mean time, and the poses of the comparison.
struct PlannerResult {
    grasp: GraspCandidate,
    effort: SearchEffort,
    seconds: f64,
    looks: Vec<Isometry3<f64>>,
}

fn map(planner: &GraspPlanner<'_>, object: &Body, contacts: &[Contact]) -> PlannerResult {
    let wanted = GraspRequest { contacts: contacts.to_vec(), object, obstacles: vec![] };
    let (grasp, effort) = planner.map_counted(&wanted).expect("the hand has the fingers");
    let grasp = grasp.expect("it is known to be feasible");
    let (begun, mut rounds) = (Instant::now(), 0.0);
    while begun.elapsed().as_secs_f64() < LONG_S {
        assert_eq!(planner.map(&wanted).as_ref(), Ok(&grasp), "the same problem has the same solution");
        rounds += 1.0;
    }
    let seconds = begun.elapsed().as_secs_f64() / rounds;
    // At increasing distances from the solution, in different directions.
    let share = |index: usize, row: usize| 2.0 * (((6 * index + row) as f64) * 0.618_033_988_749_895).fract() - 1.0;
    let look = |index: usize| {
        let far = FAR * (index as f64 / LOOKS as f64).powi(2) + 0.001;
        let [x, y, z, a, b, c] = [0, 1, 2, 3, 4, 5].map(|row| share(index, row) * far);
        Translation3::new(0.1 * x, 0.1 * y, 0.1 * z)
            * grasp.object_from_palm
            * UnitQuaternion::from_scaled_axis(Vector3::new(a, b, c))
    };
    PlannerResult { effort, seconds, looks: (0..LOOKS).map(look).collect(), grasp }
}

/// The number of evaluations; and with six more for each gradient.
fn counted(effort: &SearchEffort) -> [u64; 2] {
    let looks = effort.costs + effort.fits + effort.slopes;
    [looks, looks + 6 * effort.slopes]
}

/// The peer's result: the measure of the cheapest pose over all seeds (edges of shapes may lie between its spheres), and mean time and evaluations.
struct PeerResult {
    measure: f64,
    seconds: f64,
    evaluations: f64,
}

impl PeerResult {
    /// For comparison with ours: costs of poses, and the measure of the result.
    fn of(answer: &Value, ours: &PlannerResult, planner: &GraspPlanner<'_>, wanted: &GraspRequest<'_>) -> Self {
        for (look, theirs) in ours.looks.iter().zip(list::numbers(&answer["costs"])) {
            let (cost, _) = planner.cost(wanted, look).expect("the hand has the fingers");
            assert!(
                (cost - theirs).abs() <= AGREED * cost.abs().max(1.0),
                "a pose costs {cost} here and {theirs} there: {look}"
            );
        }
        let (here, there) = (ours.grasp.friction_margin, answer["friction_margin"].as_f64().expect("a number"));
        assert!((here - there).abs() <= AGREED_FRICTION, "the margin of friction is {here} here and {there} there");
        let runs = answer["runs"].as_array().expect("a list");
        let mean = |key: &str| runs.iter().filter_map(|run| run[key].as_f64()).sum::<f64>() / runs.len() as f64;
        let number = |run: &Value, key: &str| run[key].as_f64().expect("a number");
        for run in runs.iter().filter(|run| number(run, "measure") > 0.0) {
            let at = pose(&list::numbers(&run["x"]), &middle(planner, wanted));
            let (here, there) = (planner.measure(wanted, &at).unwrap_or(0.0), number(run, "measure") * here);
            assert!((here - there).abs() <= AGREED, "a pose measures {here} here and {there} there");
        }
        let best = runs.iter().min_by(|a, b| number(a, "cost").total_cmp(&number(b, "cost"))).expect("there are seeds");
        let best = number(best, "measure") * ours.grasp.friction_margin;
        Self { measure: best, seconds: mean("seconds"), evaluations: mean("evaluations") }
    }
}

/// Returns the pose given by six coordinates about a point.
fn pose(x: &[f64], middle: &Point3<f64>) -> Isometry3<f64> {
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(x[3], x[4], x[5]));
    Isometry3::from_parts((middle.coords + Vector3::new(x[0], x[1], x[2])).into(), turn)
}

/// Returns the center of the fingertips on their contacts.
fn middle(planner: &GraspPlanner<'_>, wanted: &GraspRequest<'_>) -> Point3<f64> {
    let radius = |finger| planner.hand().finger(finger).map_or(0.0, |model| model.radius);
    let tips = wanted.contacts.iter().map(|it| it.point.coords + it.normal * radius(it.finger));
    Point3::from(tips.sum::<Vector3<f64>>() / wanted.contacts.len() as f64)
}

/// Runs the script and returns its result, if it can run.
fn evolution(given: &Value) -> Option<Vec<Value>> {
    let has = Command::new("python3").args(["-c", "import scipy.optimize"]).stderr(Stdio::null()).status();
    has.ok().filter(std::process::ExitStatus::success)?;
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/grasp/evolution.py");
    let threads = ["OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"].map(|name| (name, "1"));
    let mut run = Command::new("python3")
        .arg(script)
        .envs(threads)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("the script can be run");
    run.stdin.take().expect("it reads").write_all(given.to_string().as_bytes()).expect("it reads");
    let said = run.wait_with_output().expect("it ends");
    assert!(said.status.success(), "the script failed");
    Some(serde_json::from_slice(&said.stdout).expect("it answers in JSON"))
}

fn problem(object: &Body, contacts: &[Contact], looks: &[Isometry3<f64>]) -> Value {
    let contacts = contacts.iter().map(|contact| {
        json!({"finger": contact.finger.name(), "point": three(&contact.point.coords), "normal": three(&contact.normal)})
    });
    let parts = object.parts.iter().map(|part| {
        let (kind, size) = match part.shape {
            Shape::Box(size) => ("box", size.map(|it| it.0).to_vec()),
            Shape::Cylinder(size) => ("cylinder", size.map(|it| it.0).to_vec()),
            Shape::Ball(radius) => ("ball", vec![radius.0]),
        };
        json!({"at": part.at.map(|at| at.0), "turned": four(&unit(part.turned)), "kind": kind, "size": size})
    });
    let tips = looks.iter().map(|pose| (pose.translation.vector, pose.rotation.scaled_axis()));
    let looks = tips.map(|(at, turn)| [at.x, at.y, at.z, turn.x, turn.y, turn.z]);
    json!({
        "contacts": contacts.collect::<Vec<_>>(),
        "parts": parts.collect::<Vec<_>>(),
        "looks": looks.collect::<Vec<_>>(),
        "largest_pad_angle": LARGEST_PAD_ANGLE,
        "friction": FRICTION,
    })
}

/// Returns the links of the robot and the fingertips of its hand.
fn described_hand(robot: &Robot, hand: &HandModel) -> Value {
    let links = robot.tree.links.iter().map(|link| {
        let at = &link.parent_from_joint;
        let joint = link
            .joint
            .as_ref()
            .map(|joint| json!({"axis": three(&joint.axis), "dof": joint.dof, "ratio": joint.ratio}));
        let capsules = link.solids.iter().filter_map(|solid| match solid {
            CollisionShape::Capsule(from, to, radius) => Some(json!([three(&from.coords), three(&to.coords), radius])),
            CollisionShape::Box(..) | CollisionShape::Piece(..) => None,
        });
        json!({
            "parent": link.parent,
            "at": three(&at.translation.vector),
            "turned": four(&at.rotation),
            "joint": joint,
            "capsules": capsules.collect::<Vec<_>>(),
        })
    });
    let at_rest = robot.tree.forward_kinematics(&vec![0.0; robot.tree.dofs.len()]);
    let fingers = hand.fingers.iter().map(|finger| {
        let pad = at_rest[hand.palm] * finger.posture(&[0.0; MAX_DOFS]).pad;
        json!({
            "name": finger.finger.name(),
            "link": finger.tip_link,
            "tip": three(&finger.tip_in_link.coords),
            "radius": finger.radius,
            "pad": three(&at_rest[finger.tip_link].inverse_transform_vector(&pad)),
        })
    });
    let boxes = hand.palm_solids.iter().filter_map(|solid| match solid {
        CollisionShape::Box(pose, half) => {
            Some(json!({"at": three(&pose.translation.vector), "turned": four(&pose.rotation), "half": three(half)}))
        }
        CollisionShape::Capsule(..) | CollisionShape::Piece(..) => None,
    });
    json!({
        "links": links.collect::<Vec<_>>(),
        "ranges": robot.tree.dofs.iter().map(|dof| dof.range).collect::<Vec<_>>(),
        "palm": hand.palm,
        "palm_boxes": boxes.collect::<Vec<_>>(),
        "fingers": fingers.collect::<Vec<_>>(),
    })
}

fn three(vector: &Vector3<f64>) -> [f64; 3] {
    [vector.x, vector.y, vector.z]
}

fn four(turn: &UnitQuaternion<f64>) -> [f64; 4] {
    [turn.w, turn.i, turn.j, turn.k]
}
