//! Two arms: an operator's hand-over becomes the robot's.

use super::shipped;
use crate::browser::Browser;
use crate::command::{pictures_hold_hands_and_objects, within_the_limits_of_the_robot};
use crate::program::{complained, demonstrate, teachtree};
use nalgebra::{Isometry3, Point3, Quaternion, Translation3, UnitQuaternion, Vector3};
use serde_json::Value;
use std::path::Path;
use teachtree_base::hands::Side;
use teachtree_command::{Commands, MappedGrasp};
use teachtree_robot::{CollisionShape, MAX_DOFS, Robot};

/// The first picture has all links of both hands and their names, and the first plots are of both hands.
fn begins_with_whole_hands(page: &Path) {
    let Some(mut browser) = Browser::start() else { return };
    browser.open(page);
    let sides = browser.eval(
        "[...document.querySelectorAll('.panel select')].map((one) => one.selectedOptions[0].textContent.split(' ')[0]).join(' ')",
    );
    assert_eq!(sides, "left left right right");
    let scripts = teachtree_report::page::SCRIPTS.concat();
    let within = browser.eval(&format!(
        "(() => {{ {scripts}
           load(JSON.parse(byId('data').textContent));
           const {{ right, up, back }} = replay.axes(), eye = add(replay.about, scale(back, replay.away));
           const high = replay.canvas.clientHeight, wide = replay.canvas.clientWidth;
           const isShown = (link) => {{
             const from = add(link.pose.slice(0, 3).map((curve) => valueAt(curve, data.start)), scale(eye, -1)), far = -dot(from, back);
             return Math.abs(1.5 * high * dot(from, right) / far) < wide / 2 && Math.abs(1.5 * high * dot(from, up) / far) < high / 2;
           }};
           return replay.scene.hands.map((hand) => hand.links.length > 10 && hand.links.every(isShown)); }})()"
    ));
    assert_eq!(within, serde_json::json!([true, true]));
    // The time cursor ends with the plots, where the picture beside them is higher.
    let ends = browser.eval(
        "document.querySelector('#signals').getBoundingClientRect().bottom - document.querySelector('#more').getBoundingClientRect().bottom",
    );
    assert!(ends.as_f64().unwrap().abs() < 12.0, "{ends}");
}

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
    assert!(printed.contains("smallest gap of the arms: ") && !printed.contains("go through each other"), "{printed}");
    begins_with_whole_hands(Path::new(&page));
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
