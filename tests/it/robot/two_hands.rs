//! Two arms: an operator's hand-over becomes the robot's.

use super::kinematics::shipped;
use crate::command::{commanded, mapped, pictures_hold_hands_and_objects, within_the_limits_of_the_robot};
use crate::program::{complained, demonstrate, teachtree};
use nalgebra::{Isometry3, Point3, Quaternion, Translation3, UnitQuaternion, Vector3};
use serde_json::Value;
use teachtree_base::hands::Side;
use teachtree_command::{Commands, MappedGrasp, Precedence, Task};
use teachtree_robot::planning::late_start::begun_late;
use teachtree_robot::planning::trajectory::trajectory;
use teachtree_robot::simulation::{Verdict, simulate};
use teachtree_robot::{CollisionShape, MAX_DOFS, Robot};
use teachtree_world as world;

#[test]
fn a_hand_over_is_carried_out_by_two_arms() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_string();
    let (log, commanded, out) = (path("log.csv"), path("commands.json"), path("robot.csv"));
    let scene = "hand_over_right_to_left";
    demonstrate(scene, &["--seed", "3"], &log);
    let made = teachtree(&["command", &log, "-o", &commanded]);
    assert!(made.status.success(), "{}{}", String::from_utf8_lossy(&made.stdout), complained(&made));

    // This person tried to take it twice: the try is left out, the way to it is not.
    let commands = Commands::read(&std::fs::read_to_string(&commanded).unwrap(), "commands.json").unwrap();
    let receiver = commands.tasks.iter().find(|task| task.track == Side::Left).unwrap();
    let primitives: Vec<&str> = receiver.segments.iter().map(|segment| segment.primitive.as_str()).collect();
    assert_eq!(primitives, ["Move", "Approach", "Pass", "Translate", "Place", "Release"]);
    assert_eq!(receiver.left_out[0].primitives, ["EqualGrasp", "Release"]);

    // While both hold the box there is room for both.
    let robot = shipped("both_hands");
    let mapped = |side: Side| {
        let task = commands.tasks.iter().find(|task| task.track == side).unwrap();
        task.grasps.last().unwrap().mapped.clone().unwrap()
    };
    let gap = gap(&robot, [(Side::Left, &mapped(Side::Left)), (Side::Right, &mapped(Side::Right))]);
    assert!(gap > -0.5e-3, "the hands are in each other by {} mm", -gap * 1e3);

    let (page, joints) = (path("robot.html"), path("joints.json"));
    let more = ["-o", &out, "--report", &page, "--trajectory", &joints];
    let done = teachtree(&[&["simulate", &commanded, "--scene", scene], &more[..]].concat());
    let printed = String::from_utf8(done.stdout.clone()).unwrap();
    assert!(done.status.success(), "{printed}{}", complained(&done));
    assert!(
        printed.contains("left pick_and_place: `box` is") && printed.contains("right pick_and_place: `box` is"),
        "{printed}"
    );
    assert!(printed.contains("mm apart at least") && !printed.contains("go through each other"), "{printed}");
    let page = std::fs::read_to_string(page).unwrap();
    pictures_hold_hands_and_objects(&page);
    assert!(page.contains("left hand, pick_and_place") && page.contains("right hand, pick_and_place"));

    // The robot's recording has the same tasks by the same rules, and the Pass.
    let tracks = |log: &str| -> Vec<(String, Vec<String>, bool)> {
        let said = teachtree(&["analyze", log, "--format", "json"]);
        let said: Value = serde_json::from_slice(&said.stdout).unwrap();
        let track = |track: &Value| {
            let tasks =
                track["tasks"].as_array().unwrap().iter().map(|task| task["task"].as_str().unwrap().to_string());
            (track["track"].as_str().unwrap().to_string(), tasks.collect(), track.to_string().contains("\"Pass\""))
        };
        said["tracks"].as_array().unwrap().iter().map(track).collect()
    };
    assert_eq!(tracks(&log), tracks(&out));
    assert!(tracks(&out).iter().all(|(.., pass)| *pass));

    // The joints of both arms and hands are in one trajectory.
    let joints: Value = serde_json::from_str(&std::fs::read_to_string(joints).unwrap()).unwrap();
    let names: Vec<&str> =
        joints["joint_names"].as_array().unwrap().iter().map(|name| name.as_str().unwrap()).collect();
    let of = |side: &str| names.iter().filter(|name| name.starts_with(side)).count();
    assert_eq!([of("left_"), of("right_"), names.len()], [22, 22, 44], "{names:?}");
    let points = joints["points"].as_array().unwrap();
    for (joint, name) in names.iter().enumerate().filter(|(_, name)| name.contains("arm")) {
        let at = |point: usize| points[point]["positions"][joint].as_f64().unwrap();
        let all = || (0..points.len()).map(at);
        let moved = all().fold(f64::NEG_INFINITY, f64::max) - all().fold(f64::INFINITY, f64::min);
        assert!(moved > 0.02, "`{name}` moves by {moved} rad");
    }
    // In the end every palm is where the robot had it when it was done.
    let robots = std::fs::read_to_string(&out).unwrap();
    let (header, last) = (robots.lines().next().unwrap(), robots.lines().last().unwrap());
    let recorded = |name: &str| -> f64 {
        let column = header.split(',').position(|title| title.split(' ').next() == Some(name)).unwrap();
        last.split(',').nth(column).unwrap().parse().unwrap()
    };
    for side in [Side::Left, Side::Right] {
        let limb = robot.limb(side).unwrap();
        let value = |dof: &str| {
            let joint = names.iter().position(|name| *name == dof).unwrap();
            points.last().unwrap()["positions"][joint].as_f64().unwrap()
        };
        let q: Vec<f64> = limb.tree.dofs.iter().map(|dof| value(&dof.name)).collect();
        let palm = limb.tree.forward_kinematics(&q)[limb.hands[&side].palm].translation.vector;
        let there = ["x", "y", "z"].map(|axis| recorded(&format!("{side}.palm.position.{axis}")));
        let off = (palm - Vector3::from(there)).norm();
        assert!(off < 0.02, "the {side} palm ends {} mm from where it did", off * 1e3);
    }
    within_the_limits_of_the_robot(&commands, scene);
}

/// Both hands bring what they hold to each other, with the taught contacts one above the other: the ring comes turned about the pole, so that the fingers of one
/// hand are beside those of the other one.
#[test]
fn hands_that_fit_a_ring_on_a_pole_stay_apart() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_string();
    let (log, commanded, out) = (path("log.csv"), path("commands.json"), path("robot.csv"));
    let scene = "ring_and_pole";
    demonstrate(scene, &["--seed", "7"], &log);
    let made = teachtree(&["retarget", &log, "-o", &commanded]);
    assert!(made.status.success(), "{}", complained(&made));
    let done = teachtree(&["simulate", &commanded, "--scene", scene, "-o", &out, "--format", "json"]);
    assert!(done.status.success(), "{}", complained(&done));
    let outcome: Value = serde_json::from_slice(&done.stdout).unwrap();
    assert_eq!(outcome["nearest"]["pass_through"], false, "{outcome}");

    // By how far it is turned in the end is free in the hole, where its contacts are is taught.
    let commands = Commands::read(&std::fs::read_to_string(&commanded).unwrap(), "commands.json").unwrap();
    let ring = commands.tasks.iter().find(|task| task.object == "ring").unwrap();
    let rotation =
        |pose: &[f64; 7]| UnitQuaternion::from_quaternion(Quaternion::new(pose[3], pose[4], pose[5], pose[6]));
    let [first, last] = [ring.segments.first(), ring.segments.last()].map(|it| it.unwrap().object.last().unwrap());
    let turned = rotation(last).angle_to(&rotation(first)).to_degrees();
    assert!(turned > 20.0, "turned by {turned} degrees");
    for contact in &ring.grasps[0].contacts {
        let [x, y, z] = contact.point;
        let beside = x.hypot(y);
        assert!((0.0285..0.0345).contains(&beside) && z.abs() < 0.012, "{contact:?}");
    }
}

/// A way that is gone first, or last, is gone while the other hand stands; what both hands do with their objects they still do at the same time.
#[test]
fn one_hand_waits_while_the_other_one_goes_its_way() {
    let commands = mapped("independent", 1);
    let of_left = |precedence: Precedence| {
        let mut commands = commands.clone();
        let left = commands.tasks.iter_mut().find(|task| task.track == Side::Left).unwrap();
        let free = left.segments.iter_mut().take_while(|segment| !segment.touching);
        free.for_each(|segment| segment.precedence = Some(precedence));
        commands
    };
    let left = commands.tasks.iter().find(|task| task.track == Side::Left).unwrap();
    let way_s: f64 = left.segments.iter().take_while(|segment| !segment.touching).map(|it| it.duration_s).sum();
    let [plain, lasts] = waits(&commands);
    for precedence in [Precedence::First, Precedence::Last] {
        let [waited, longer] = waits(&of_left(precedence));
        assert!(waited > plain + 0.4 * way_s, "{precedence:?}: {waited} s of {way_s} s, before {plain} s");
        assert!(longer > lasts + 0.4 * way_s, "{precedence:?}: {longer} s, before {lasts} s");
    }
}

/// This person's right hand pushes the box by 30 mm before the left one comes to it. The left one may begin its way later, but only at a place from which it comes to
/// the box where that stands as the robot begins.
#[test]
fn a_way_is_begun_late_only_while_the_object_stands() {
    let commands = commanded("push_together", 12);
    let shown = commands.tasks.iter().find(|task| task.track == Side::Left).unwrap();
    let late = begun_late(shown, 1.0).unwrap();
    let way = |task: &Task| -> Vec<([f64; 3], [f64; 7])> {
        let way = task.segments.iter().take_while(|segment| !segment.touching);
        way.flat_map(|segment| segment.hand.iter().copied().zip(segment.object.iter().copied())).collect()
    };
    let (shown, late) = (way(shown), way(&late));
    assert!(shown.iter().zip(&late).all(|(shown, late)| shown.1 == late.1), "the object is as it was");
    let moved = |at: usize| {
        (Vector3::from_column_slice(&shown[at].1[..3]) - Vector3::from_column_slice(&shown[0].1[..3])).norm()
    };
    assert!(moved(shown.len() - 1) > 0.02, "the other hand moves it");
    let goes_on = late.iter().take_while(|place| place.0 == late[0].0).count();
    assert!(goes_on > 50 && moved(goes_on - 1) < 1e-3, "it stands for {goes_on} samples");
    assert_eq!(shown[goes_on..], late[goes_on..]);
}

/// This person's right hand begins to push the box to the wall before the left one touches it, and the left one follows it along the wall when it has let go. Ways are
/// planned with the box where it stands as the robot begins, so that the arms begin as planned; and the left hand does not go into the wall that the box leans on.
#[test]
fn hands_that_push_together_begin_as_planned_and_stay_out_of_the_wall() {
    let (robot, scene) = (shipped("both_hands"), world::scene("push_together").unwrap());
    let mut commands = commanded("push_together", 49);
    let crossings = teachtree_robot::map(&mut commands, &robot, &scene).unwrap();
    let first = |side: Side| commands.tasks.iter().find(|task| task.track == side).unwrap();
    let touched_s = |side: Side| first(side).segments.iter().find(|it| it.touching).unwrap().demonstrated_start_s;
    assert!(commands.tasks[0].track == Side::Left && touched_s(Side::Left) > touched_s(Side::Right) + 1.0);

    let made = trajectory(&commands, &robot, &scene, None).unwrap();
    for side in [Side::Left, Side::Right] {
        let arm = &first(side).grasps[0].mapped.as_ref().unwrap().arm;
        assert_eq!(arm.len(), 6);
        for (joint, planned) in arm {
            let at = made.joint_names.iter().position(|name| name == joint).unwrap();
            let begins = made.points[0].positions[at];
            assert!((begins - planned).abs() < 0.02, "`{joint}` begins at {begins} rad, planned at {planned}");
        }
    }
    let done = simulate(&commands, &robot, &scene, &mut |_| {}).unwrap();
    assert!(done.outcomes.iter().all(|outcome| outcome.done), "{:?}", done.outcomes);
    let deep: Vec<_> = done.collisions.iter().filter(|it| it.with == "left_wall" && it.depth_m > 2e-3).collect();
    assert!(deep.is_empty(), "{deep:?}");

    // Where the hands go through each other all the same, that is said before the robot does it.
    let [crossing] = &crossings[..] else { panic!("{crossings:?}") };
    let depth_m = done.nearest.unwrap().depth_m();
    assert_eq!(crossing.tasks, [0, 1]);
    assert!((crossing.depth_m - depth_m).abs() < 0.005, "{crossing:?}, in the simulation {depth_m} m");
    for outcome in &done.outcomes[..2] {
        assert!(outcome.collision_m >= depth_m, "{outcome:?}, in the simulation {depth_m} m");
        assert_eq!(outcome.verdict(), Verdict::DoneWithCollisions);
    }
}

/// For how long the left arm moves while the right one stands, and how long all of it takes, s.
fn waits(commands: &Commands) -> [f64; 2] {
    let made = trajectory(commands, &shipped("both_hands"), &world::scene("independent").unwrap(), None).unwrap();
    let speed = |point: usize, arm: &str| {
        let own = made.joint_names.iter().zip(&made.points[point].velocities).filter(|(name, _)| name.starts_with(arm));
        own.map(|(_, velocity)| velocity.abs()).fold(0.0, f64::max)
    };
    let time = |point: usize| made.points[point].time_from_start.seconds();
    let waited = (1..made.points.len()).filter(|at| speed(*at, "left_arm") > 0.01 && speed(*at, "right_arm") < 1e-3);
    [waited.map(|at| time(at) - time(at - 1)).sum(), time(made.points.len() - 1)]
}

/// The smallest gap between two hands in their grasps of one object, m, between points on bars and in boxes of their links.
fn gap(robot: &Robot, hands: [(Side, &MappedGrasp); 2]) -> f64 {
    let [one, other] = hands.map(|(side, mapped)| {
        let hand = &robot.hands[&side];
        let [x, y, z, w, i, j, k] = mapped.object_from_palm;
        let turn = UnitQuaternion::from_quaternion(Quaternion::new(w, i, j, k));
        let object_from_palm = Isometry3::from_parts(Translation3::new(x, y, z), turn);
        let mut balls: Vec<(Point3<f64>, f64)> = Vec::new();
        let mut add = |solid: &CollisionShape| match *solid {
            CollisionShape::Capsule(from, to, radius) => {
                balls.extend((0..=20).map(|at| (from + (to - from) * (f64::from(at) / 20.0), radius)));
            }
            CollisionShape::Box(at, half) => {
                for place in 0..9 * 9 * 9 {
                    let share = |by: i32| f64::from(place / by % 9) / 4.0 - 1.0;
                    balls.push((at * Point3::new(half.x * share(1), half.y * share(9), half.z * share(81)), 0.0));
                }
            }
            CollisionShape::Piece(..) => unreachable!("shipped hands have no meshes"),
        };
        hand.palm_solids.iter().for_each(&mut add);
        for finger in &hand.fingers {
            let mut angles = [0.0; MAX_DOFS];
            for (angle, dof) in angles.iter_mut().zip(&finger.dofs) {
                *angle = mapped.joints[&robot.tree.dofs[*dof].name];
            }
            finger.solids(&finger.posture(&angles)).for_each(|(_, solid)| add(&solid));
        }
        balls.into_iter().map(|(at, radius)| (object_from_palm * at, radius)).collect::<Vec<_>>()
    });
    let gaps = one.iter().flat_map(|(a, ra)| other.iter().map(move |(b, rb)| (a - b).norm() - ra - rb));
    gaps.fold(f64::INFINITY, f64::min)
}
