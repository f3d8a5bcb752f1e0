//! Grasp mapping: the reference case of docs/sources.md, and part of the list of grasps that are known to be feasible.

use super::kinematics::shipped;
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use serde_json::Value;
use teachtree_base::hands::{Finger, Side};
use teachtree_base::scene::Body;
use teachtree_base::yaml;
use teachtree_command::GraspCriterion;
use teachtree_robot::grasp::{Contact, GraspCandidate, GraspPlanner, GraspRequest, NoGrasp};
use teachtree_robot::{HandModel, REACHED_M, Robot};

fn body(shape: &str) -> Body {
    yaml::read(&format!("{{role: object, mass: 50 g, parts: [{{{shape}}}]}}"), "shape").unwrap()
}

/// Thumb on one face of a box of this width, index and middle finger on the opposite one, 30 mm above the middle; mm.
fn perpendiculars(width: f64) -> (Body, Vec<Contact>) {
    let body = body(&format!("box: [120 mm, {width} mm, 120 mm]"));
    let at = |finger, x: f64, side: f64| Contact {
        finger,
        point: Point3::new(x * 1e-3, side * width * 0.5e-3, 0.030),
        normal: Vector3::y() * side,
    };
    let contacts = vec![at(Finger::Thumb, 0.0, -1.0), at(Finger::Index, -11.0, 1.0), at(Finger::Middle, 11.0, 1.0)];
    (body, contacts)
}

#[test]
fn the_measure_is_best_near_80_mm_and_ends_near_160_mm() {
    let robot = shipped("gifu_hand_iii_right");
    let mapper = GraspPlanner::with_criterion(&robot.hands[&Side::Right], GraspCriterion::Manipulability);
    let measure = |width: f64| {
        let (object, contacts) = perpendiculars(width);
        mapper.map(&GraspRequest { contacts, object: &object, obstacles: Vec::new() })
    };
    let [narrow, best, wide, cube] = [30.0, 85.0, 155.0, 120.0].map(|width| measure(width).unwrap().measure);
    assert!(best > 1.1 * narrow && best > 1.1 * wide, "{narrow} {best} {wide}");
    // An earlier global search found 0.167 for this hand on the cube of Kawasaki et al. (2014) (docs/sources.md, Grasp mapping).
    assert!((0.155..0.18).contains(&cube), "{cube}");
    assert!(measure(190.0).is_err(), "wider than the hand opens");
}

/// How far each fingertip ball is from touching its contact, m: by the kinematics of the whole robot, not those of the search.
pub fn tips_off_contacts(
    robot: &Robot,
    hand: &HandModel,
    grasp: &GraspCandidate,
    q: &[f64],
    contacts: &[Contact],
) -> Vec<(Finger, f64)> {
    let poses = robot.tree.forward_kinematics(q);
    let object_from_root = grasp.object_from_palm * poses[hand.palm].inverse();
    let off = |contact: &Contact| {
        let finger = hand.finger(contact.finger).unwrap();
        let tip = object_from_root * poses[finger.tip_link] * finger.tip_in_link;
        (contact.finger, (tip - contact.point - contact.normal * finger.radius).norm())
    };
    contacts.iter().map(off).collect()
}

#[test]
fn every_condition_of_a_grasp_holds() {
    let robot = shipped("gifu_hand_iii_right");
    let hand = &robot.hands[&Side::Right];
    let (object, contacts) = perpendiculars(100.0);
    let wanted = GraspRequest { contacts: contacts.clone(), object: &object, obstacles: Vec::new() };
    let mapper = GraspPlanner::new(hand);
    let grasp = mapper.map(&wanted).unwrap();
    let mut q = vec![0.0; robot.tree.dofs.len()];
    grasp.set(hand, &mut q);
    for (finger, off) in tips_off_contacts(&robot, hand, &grasp, &q, &contacts) {
        assert!(off < 2.0 * REACHED_M, "{finger} is {off} m off its contact");
    }
    for (value, dof) in q.iter().zip(&robot.tree.dofs) {
        assert!((dof.range[0]..=dof.range[1]).contains(value), "{} {value}", dof.name);
    }
    assert!(grasp.fingers.iter().all(|held| held.pad_angle.to_degrees() < 80.1));
    assert!(grasp.clearance.object > -1e-4 && grasp.clearance.fingers > -1e-4, "{:?}", grasp.clearance);
    // What is found is better than the pose that copies the person's, and nothing near it is better.
    let copied = mapper.copied(&wanted).unwrap_or(0.0);
    assert!(grasp.measure > copied, "{} and {copied}", grasp.measure);
    let polished = mapper.polish(&wanted, &grasp.object_from_palm).map_or(0.0, |grasp| grasp.measure);
    assert!(polished < 1.02 * grasp.measure, "{polished} and {}", grasp.measure);
}

/// Searches go by this slope: a wrong one makes them slow and worse, which nothing else would tell.
#[test]
fn the_slope_of_the_cost_is_what_differences_say() {
    let robot = shipped("gifu_hand_iii_right");
    let mapper = GraspPlanner::new(&robot.hands[&Side::Right]);
    let (object, contacts) = perpendiculars(90.0);
    let wanted = GraspRequest { contacts, object: &object, obstacles: Vec::new() };
    let best = mapper.map(&wanted).unwrap().object_from_palm;
    let cost = |pose: &Isometry3<f64>| mapper.cost(&wanted, pose).unwrap();
    let moved = |pose: &Isometry3<f64>, row: usize, by: f64| {
        let (mut shift, mut turn) = (Vector3::zeros(), Vector3::zeros());
        if row < 3 {
            shift[row] = by
        } else {
            turn[row - 3] = by
        }
        Isometry3::from_parts(shift.into(), UnitQuaternion::from_scaled_axis(turn)) * pose
    };
    let (mut right, mut overlapping, mut far, mut all) = (0, 0, 0, 0);
    for index in 0..60 {
        // Up to 30 mm and 0.3 rad away, where fingers overlap, cannot reach and look away.
        let share = |row: usize| 2.0 * ((6 * index + row) as f64 * 0.618_033_988_749_895).fract() - 1.0;
        let away = Vector3::new(share(0), share(1), share(2)) * 0.0005 * index as f64;
        let turn = Vector3::new(share(3), share(4), share(5)) * 0.005 * index as f64;
        let pose = best * Isometry3::from_parts(away.into(), UnitQuaternion::from_scaled_axis(turn));
        let (value, slope) = cost(&pose);
        overlapping += usize::from(value > 3.0);
        far += usize::from(mapper.at(&wanted, &pose).is_err());
        for row in 0..6 {
            let by = 1e-6;
            let differences = (cost(&moved(&pose, row, by)).0 - cost(&moved(&pose, row, -by)).0) / (2.0 * by);
            all += 1;
            right += usize::from((slope[row] - differences).abs() < 1e-2 * slope.norm().max(1.0));
        }
    }
    assert!(far > 10 && overlapping > 5, "{far} {overlapping}");
    // Not on kinks.
    assert!(right * 100 >= all * 95, "{right} of {all}");
}

#[test]
fn a_finger_that_cannot_reach_is_named_with_what_is_missing() {
    let robot = shipped("gifu_hand_iii_right");
    let mapper = GraspPlanner::new(&robot.hands[&Side::Right]);
    let object = body("box: [400 mm, 60 mm, 60 mm]");
    let at = |finger, x: f64, side: f64| Contact {
        finger,
        point: Point3::new(x, side * 0.03, 0.0),
        normal: Vector3::y() * side,
    };
    // The middle finger 180 mm beside the index finger.
    let contacts = vec![at(Finger::Thumb, 0.0, -1.0), at(Finger::Index, 0.0, 1.0), at(Finger::Middle, 0.18, 1.0)];
    match mapper.map(&GraspRequest { contacts, object: &object, obstacles: Vec::new() }) {
        Err(NoGrasp::OutOfReach(_, miss)) => assert!((0.01..0.18).contains(&miss), "{miss}"),
        other => panic!("{other:?}"),
    }
    let thumb = vec![at(Finger::Palm, 0.0, -1.0)];
    let found = mapper.map(&GraspRequest { contacts: thumb, object: &object, obstacles: Vec::new() });
    assert_eq!(found.unwrap_err().to_string(), "the hand has no palm finger");
}

/// Part of the list; the whole of it is measured by the example `grasps`. References are by manipulability.
#[test]
fn known_grasps_are_found_with_nearly_the_best_measure() {
    let robot = shipped("gifu_hand_iii_right");
    let mapper = GraspPlanner::with_criterion(&robot.hands[&Side::Right], GraspCriterion::Manipulability);
    let path = std::path::Path::new(crate::ROOT).join("tests/fixtures/grasps.json");
    let list: Vec<Value> = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    assert_eq!(list.len(), 300);
    let numbers =
        |value: &Value| -> Vec<f64> { value.as_array().unwrap().iter().map(|n| n.as_f64().unwrap()).collect() };
    let (mut ratios, mut tried) = (Vec::new(), 0);
    for grasp in list.iter().step_by(10) {
        let contact = |contact: &Value| Contact {
            finger: Finger::from_name(contact["finger"].as_str().unwrap()).unwrap(),
            point: Point3::from_slice(&numbers(&contact["point"])),
            normal: Vector3::from_column_slice(&numbers(&contact["normal"])),
        };
        let object = body(grasp["shape"].as_str().unwrap());
        let contacts = grasp["contacts"].as_array().unwrap().iter().map(contact).collect();
        tried += 1;
        if let Ok(found) = mapper.map(&GraspRequest { contacts, object: &object, obstacles: Vec::new() }) {
            ratios.push(found.measure / grasp["reference"].as_f64().unwrap());
        }
    }
    assert_eq!(ratios.len(), tried, "all are found");
    let good = ratios.iter().filter(|ratio| **ratio >= 0.98).count();
    assert!(good + 1 >= tried, "{good} of {tried} nearly the best: {ratios:?}");
    assert!(ratios.iter().all(|ratio| *ratio >= 0.90), "{ratios:?}");
}
