//! Grippers: what they are, how far they open, what they take hold of, and what is refused.

use super::grasping::tips_off_contacts;
use super::kinematics::shipped;
use nalgebra::{Point3, Vector3};
use teachtree_base::hands::{Finger, Side};
use teachtree_base::scene::Body;
use teachtree_base::yaml;
use teachtree_robot::grasp::{Contact, GraspCandidate, GraspPlanner, GraspRequest, Obstacle};
use teachtree_robot::{self as robot, Robot};

const GRIPPER: &str = include_str!("../../../../../robots/parallel_jaw.yaml");
const URDF: &str = include_str!("../../../../../tests/fixtures/gripper_of_urdf.urdf");
const OWN_MOTOR: &str = "travel: [0 mm, 50 mm], force: 20 N, slide_speed: 150 mm/s, source: ours}";

/// The shipped gripper with some words in place of others.
fn changed(changes: &[(&str, &str)]) -> Result<Robot, String> {
    let mut text = GRIPPER.to_string();
    for (from, to) in changes {
        assert!(text.contains(from), "{from}");
        text = text.replace(from, to);
    }
    robot::read(&text, "gripper.yaml").map_err(|error| error.to_string())
}

/// The shipped gripper with a motor for each jaw.
fn two_motors() -> Robot {
    changed(&[("coupled: {to: opening, ratio: 1}, source: ours}", OWN_MOTOR)]).unwrap()
}

/// A gripper in URDF, which a short file names.
const OF_URDF: &str = include_str!("../../../../../tests/fixtures/gripper_of_urdf.yaml");

fn of_urdf(urdf: &str) -> Result<Robot, String> {
    let text_of = |file: &str| Ok(if file == "gripper.yaml" { OF_URDF.to_string() } else { urdf.to_string() });
    robot::open("gripper.yaml", &text_of).map_err(|error| error.to_string())
}

fn body(text: &str) -> Body {
    yaml::read(&format!("{{role: object, mass: 50 g, {text}}}"), "body").unwrap()
}

/// Thumb and other jaw on the faces of a box of this width, mm, some way above its middle.
fn perpendiculars(width: f64) -> (Body, Vec<Contact>) {
    let at = |finger, side: f64| Contact {
        finger,
        point: Point3::new(0.0, side * width * 0.5e-3, 0.010),
        normal: Vector3::y() * side,
    };
    let body = body(&format!("parts: [{{box: [60 mm, {width} mm, 60 mm]}}]"));
    (body, vec![at(Finger::Thumb, -1.0), at(Finger::Index, 1.0)])
}

fn mapped(
    robot: &Robot,
    object: &Body,
    contacts: Vec<Contact>,
    obstacles: Vec<Obstacle<'_>>,
) -> Result<GraspCandidate, String> {
    let wanted = GraspRequest { contacts, object, obstacles };
    GraspPlanner::new(&robot.hands[&Side::Right]).map(&wanted).map_err(|failure| failure.to_string())
}

#[test]
fn the_opening_has_a_closed_form_with_one_motor_and_with_two() {
    for (robot, dofs) in [(shipped("parallel_jaw"), 1), (two_motors(), 2), (of_urdf(URDF).unwrap(), 1)] {
        assert_eq!(robot.tree.dofs.len(), dofs, "{}", robot.name);
        let hand = &robot.hands[&Side::Right];
        let jaws = hand.jaws.as_ref().unwrap();
        let [closed, open] = jaws.range();
        assert!(closed.abs() < 1e-9, "{closed}");
        let most = if robot.name == "gripper" { 0.080 } else { 0.100 };
        assert!((open - most).abs() < 1e-9, "{open}");
        for at in 0..=10 {
            let share = f64::from(at) / 10.0;
            let opening = jaws.opening(share);
            assert!((jaws.share(opening) - share).abs() < 1e-12);
            // By the kinematics of the whole robot.
            let mut q = vec![0.0; dofs];
            for finger in &hand.fingers {
                q[finger.dofs[0]] = jaws.jaw(finger.finger).unwrap().angles(share)[0];
            }
            let poses = robot.tree.forward_kinematics(&q);
            let tips = [0, 1].map(|index| {
                let jaw = &jaws.pair[index];
                let finger = hand.finger(jaw.finger).unwrap();
                poses[finger.tip_link] * finger.tip_in_link
            });
            let gap = (tips[1] - tips[0]).norm() - 0.016;
            assert!((gap - opening).abs() < 1e-12 && (opening - share * most).abs() < 1e-12, "{gap} and {opening}");
        }
    }
    // Its one motor gives 12 N for both jaws.
    let robot = of_urdf(URDF).unwrap();
    let forces: Vec<f64> = robot.hands[&Side::Right].fingers.iter().map(|finger| finger.force).collect();
    assert_eq!(forces, [5.0, 6.0]);
}

#[test]
fn what_slides_but_is_not_a_gripper_is_refused() {
    let beside = changed(&[("at: [97 mm, 8 mm, 0 mm]", "at: [97 mm, 8 mm, 3 mm]")]).unwrap_err();
    assert!(beside.contains("gripper.yaml:20: `index` slides 3.0 mm beside the line of the thumb"), "{beside}");
    let against = changed(&[("ratio: 1}", "ratio: -1}")]).unwrap_err();
    assert!(against.contains("`index` opens while the thumb closes, and both are driven by one joint"), "{against}");
    let askew = changed(&[("pad: [0, -1, 0]", "pad: [1, -1, 0]")]).unwrap_err();
    assert!(askew.contains("`index` has a pad that faces 45 degrees off the line to the other jaw"), "{askew}");
    let thumbless = changed(&[("    thumb: {", "    middle: {")]).unwrap_err();
    assert!(thumbless.contains("`middle` is a jaw without an opponent"), "{thumbless}");
    let third = "    index: {link: index_jaw";
    let third = changed(&[(
        third,
        &format!(
            "    ring: {{link: index_jaw, tip: [50 mm, 0 mm, 0 mm], radius: 8 mm, pad: [0, -1, 0], force: 5 N, source: ours}}\n{third}"
        ),
    )]);
    assert!(third.unwrap_err().contains("is a third finger that slides"));
    // Both turn about the line between them, so that their pads pass each other.
    let turning = of_urdf(&URDF.replace("prismatic", "revolute")).unwrap_err();
    assert!(turning.contains("`thumb` closes 90 degrees off the direction in which its pad faces"), "{turning}");
}

#[test]
fn jaws_stand_on_their_contacts_with_the_palm_where_there_is_room() {
    let table = body("parts: [{box: [1 m, 1 m, 20 mm]}]");
    for robot in [shipped("parallel_jaw"), two_motors(), of_urdf(URDF).unwrap()] {
        let hand = &robot.hands[&Side::Right];
        let (object, contacts) = perpendiculars(50.0);
        let below = Obstacle { object_from_obstacle: nalgebra::Isometry3::translation(0.0, 0.0, -0.041), body: &table };
        let grasp = mapped(&robot, &object, contacts.clone(), vec![below]).unwrap();
        assert!((grasp.opening.unwrap() - 0.050).abs() < 1e-9);
        let mut q = vec![0.0; robot.tree.dofs.len()];
        grasp.set(hand, &mut q);
        for (finger, off) in tips_off_contacts(&robot, hand, &grasp, &q, &contacts) {
            assert!(off < 1e-9, "{finger} is {off} m off its contact");
        }
        // Upright above the table.
        let up = -(grasp.object_from_palm.rotation * hand.jaws.as_ref().unwrap().stance(0.5).middle.coords).normalize();
        assert!(up.z > 0.99, "{up}");
        assert!(grasp.clearance.object > 0.0 && grasp.clearance.obstacles > 0.0, "{:?}", grasp.clearance);
        let half_open = if robot.name == "gripper" { 4.0 * 50.0 * 30.0 / 6400.0 } else { 1.0 };
        assert!(grasp.measure < half_open && grasp.measure > 0.4 * half_open, "{}", grasp.measure);
    }
}

#[test]
fn what_jaws_cannot_hold_is_reported_with_what_is_missing() {
    let gripper = shipped("parallel_jaw");
    let (object, contacts) = perpendiculars(120.0);
    let wide = mapped(&gripper, &object, contacts, Vec::new()).unwrap_err();
    assert_eq!(wide, "the jaws open to 100.0 mm, and 120.0 mm are needed: 20.0 mm are missing");
    let narrow = changed(&[("travel: [0 mm, 50 mm]", "travel: [10 mm, 50 mm]")]).unwrap();
    let (object, contacts) = perpendiculars(12.0);
    let narrow = mapped(&narrow, &object, contacts, Vec::new()).unwrap_err();
    assert_eq!(narrow, "the jaws close to 20.0 mm, and 12.0 mm are needed: 8.0 mm remain open");
    // Thumb on one side, the fingers on top.
    let (object, mut contacts) = perpendiculars(60.0);
    contacts[1] = Contact { finger: Finger::Index, point: Point3::new(0.0, 0.025, 0.030), normal: Vector3::z() };
    let slips = mapped(&gripper, &object, contacts.clone(), Vec::new()).unwrap_err();
    assert_eq!(
        slips,
        "the index jaw slips off: the line between the jaws leans by 66 degrees there, and friction holds up to 45"
    );
    contacts.remove(0);
    let pushes = mapped(&gripper, &object, contacts, Vec::new()).unwrap_err();
    assert_eq!(
        pushes,
        "a gripper holds an object between thumb and fingers, and only one side touches it here: grippers do not push"
    );
}

/// A gripper of one of the fixtures.
fn fixture(name: &str) -> Result<Robot, String> {
    let folder = std::path::Path::new(crate::ROOT).join("tests/fixtures");
    let text_of = |file: &str| Ok(std::fs::read_to_string(folder.join(file)).unwrap());
    robot::open(&format!("{name}.yaml"), &text_of).map_err(|error| error.to_string())
}

/// Pads of linkages stay parallel; a jaw that turns toward a fixed one does not. Both open steadily, and stand on the same contacts as jaws that slide.
#[test]
fn turning_jaws_are_mapped_as_sliding_ones_are() {
    // The motor of the linkage ends before its fingertips meet.
    for (name, least, most, askew_deg) in [("turning_jaws", 0.00023, 0.085, 0.1), ("one_jaw", 0.0, 0.0818, 46.5)] {
        let robot = fixture(name).unwrap();
        let hand = &robot.hands[&Side::Right];
        let jaws = hand.jaws.as_ref().unwrap();
        assert!(jaws.geared && robot.tree.dofs.len() == 1, "{name} has one motor");
        let [closed, open] = jaws.range();
        assert!((closed - least).abs() < 1e-6, "{name} closes to {closed} m");
        assert!((open - most).abs() < 1e-4, "{name} opens to {open} m");
        for at in 0..=10 {
            let share = f64::from(at) / 10.0;
            assert!((jaws.share(jaws.opening(share)) - share).abs() < 1e-9, "{name} at {share}");
            let stance = jaws.stance(share);
            assert!(stance.askew.iter().all(|askew| askew.to_degrees() < askew_deg), "{name}: {stance:?}");
        }
        let (object, contacts) = perpendiculars(50.0);
        let grasp = mapped(&robot, &object, contacts.clone(), Vec::new()).unwrap();
        assert!((grasp.opening.unwrap() - 0.050).abs() < 1e-9, "{name}");
        let mut q = vec![0.0; 1];
        grasp.set(hand, &mut q);
        for (finger, off) in tips_off_contacts(&robot, hand, &grasp, &q, &contacts) {
            assert!(off < 1e-8, "{name}: {finger} is {off} m off its contact");
        }
        assert!(grasp.clearance.object > 0.0 && grasp.measure > 0.1, "{name}: {grasp:?}");
        assert!((grasp.friction_margin - 1.0).abs() < 1e-9, "the contacts are opposite");
        let facing: f64 = grasp.fingers.iter().map(|held| held.alignment).product();
        let pads: f64 = jaws.stance(jaws.share(0.050)).askew.iter().map(|askew| askew.cos()).product();
        assert!((facing - pads).abs() < 1e-9, "{name}: {facing} and {pads}");
    }
    // The motor of 1.5 N m presses at the end of a lever of 74 mm.
    let force = fixture("one_jaw").unwrap().hands[&Side::Right].fingers[1].force;
    assert!((force - 5.0).abs() < 1e-9, "{force} N: as much as the file says");
}

#[test]
fn turning_jaws_that_face_elsewhere_are_refused() {
    let folder = std::path::Path::new(crate::ROOT).join("tests/fixtures");
    let text_of = |file: &str| {
        let text = std::fs::read_to_string(folder.join(file)).unwrap();
        Ok(text.replace("pad: [0, -1, 0]", "pad: [1, 0, 0]"))
    };
    let askew = robot::open("one_jaw.yaml", &text_of).map(|robot| robot.name).unwrap_err().to_string();
    assert!(
        askew.contains("`index` has a pad that faces") && askew.contains("off the line to the other jaw"),
        "{askew}"
    );
}
