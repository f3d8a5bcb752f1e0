//! Forward kinematics, Jacobians and inverses.

use nalgebra::{Point3, Vector3};
use teachtree_base::hands::{Finger, Side};
use teachtree_robot::{self as robot, FingerModel, HandModel, MAX_DOFS, REACHED_M, Robot};

pub fn shipped(name: &str) -> Robot {
    robot::open(name, &|part| panic!("{part} is not shipped")).unwrap()
}

fn right(robot: &Robot) -> &HandModel {
    &robot.hands[&Side::Right]
}

/// Numbers between 0 and 1 that are spread evenly: the fractional parts of multiples of irrational numbers.
fn spread(index: usize, axis: usize) -> f64 {
    let step = [0.754_877_666_2, 0.569_840_290_9, 0.819_172_513_4, 0.671_043_606_7];
    ((index + 1) as f64 * step[axis % 4] + 0.37 * axis as f64).fract()
}

fn sample(finger: &FingerModel, index: usize) -> [f64; MAX_DOFS] {
    let mut angles = [0.0; MAX_DOFS];
    for (axis, ([low, high], angle)) in finger.ranges.iter().zip(&mut angles).enumerate() {
        // Not at the very ends, where a branch may change.
        *angle = low + (high - low) * (0.02 + 0.96 * spread(index, axis));
    }
    angles
}

#[test]
fn the_hand_has_twenty_joints_and_sixteen_degrees_of_freedom() {
    for name in ["gifu_hand_iii_right", "gifu_hand_iii_left"] {
        let robot = shipped(name);
        assert_eq!((robot.tree.n_joints(), robot.tree.dofs.len()), (20, 16), "{name}");
        let hand = robot.hands.values().next().unwrap();
        assert_eq!(hand.fingers.len(), 5);
        assert!(hand.fingers.iter().all(FingerModel::is_closed), "every finger has a closed form");
        let degrees: Vec<usize> = hand.fingers.iter().map(|finger| finger.dofs.len()).collect();
        assert_eq!(degrees, [4, 3, 3, 3, 3], "thumb first");
        let mass: f64 = robot.tree.links.iter().map(|link| link.mass).sum();
        assert!((mass - 1.4).abs() < 0.01, "{mass} kg");
    }
    let both = shipped("both_hands");
    assert_eq!((both.tree.n_joints(), both.tree.dofs.len()), (52, 44));
    assert_eq!(both.hands[&Side::Left].arm.len(), 6);
}

#[test]
fn a_straight_hand_is_as_long_as_its_links() {
    let robot = shipped("gifu_hand_iii_right");
    let middle = right(&robot).finger(Finger::Middle).unwrap();
    let tip = middle.posture(&[0.0; MAX_DOFS]).tip;
    // MCP at 115 mm and 57.5 + 36.8 + 32.2 mm of finger.
    assert!((tip - Point3::new(0.2415, -0.0127, 0.0)).norm() < 1e-12, "{tip}");
    // A right angle at every joint but the first: down, back, and up again.
    let mut bent = [0.0; MAX_DOFS];
    bent[1] = std::f64::consts::FRAC_PI_2;
    bent[2] = std::f64::consts::FRAC_PI_2;
    let tip = middle.posture(&bent).tip;
    assert!((tip - Point3::new(0.115 - 0.0368, -0.0127, 0.0575 - 0.0322)).norm() < 1e-12, "{tip}");
}

#[test]
fn hands_are_as_large_as_they_are_beside_a_persons() {
    // docs/sources.md, Hand: the shipped hand is 1.15 times the base set.
    assert!((shipped("both_hands").hands_scale() - 1.15).abs() < 1e-9);
    assert_eq!(shipped("parallel_jaw").hands_scale(), 1.0);
    assert_eq!(shipped("arm_6dof").hands_scale(), 1.0);
}

#[test]
fn the_left_hand_is_the_mirror_image_of_the_right_one() {
    let (one, other) = (shipped("gifu_hand_iii_right"), shipped("gifu_hand_iii_left"));
    let mirror = |point: Point3<f64>| Point3::new(point.x, -point.y, point.z);
    for (finger, twin) in right(&one).fingers.iter().zip(&other.hands[&Side::Left].fingers) {
        for index in 0..50 {
            let angles = sample(finger, index);
            let (here, there) = (finger.posture(&angles), twin.posture(&angles));
            assert!((mirror(here.tip) - there.tip).norm() < 1e-8, "{}", finger.finger);
            assert!((mirror(here.pad.into()) - Point3::from(there.pad)).norm() < 1e-8, "{}", finger.finger);
        }
    }
}

#[test]
fn jacobians_are_the_differences_of_positions() {
    /// Step of the central difference, rad, and what it may be off, m/rad.
    const STEP: f64 = 1e-5;
    const TOLERANCE: f64 = 1e-8;
    let robot = shipped("both_hands");
    for hand in robot.hands.values() {
        for finger in &hand.fingers {
            for index in 0..20 {
                let angles = sample(finger, index);
                let jacobian = finger.jacobian(&finger.posture(&angles));
                for column in 0..finger.dofs.len() {
                    let at = |step: f64| {
                        let mut moved = angles;
                        moved[column] += step;
                        finger.posture(&moved).tip
                    };
                    let slope: Vector3<f64> = (at(STEP) - at(-STEP)) / (2.0 * STEP);
                    assert!((slope - jacobian.column(column)).norm() < TOLERANCE, "{} {column}", finger.finger);
                }
            }
        }
    }
    // The whole robot, arm included: position and direction of a fingertip's link.
    let finger = right(&robot).finger(Finger::Ring).unwrap();
    let mut q: Vec<f64> = robot.tree.middle().iter().copied().collect();
    for (index, value) in q.iter_mut().enumerate() {
        *value += 0.3 * (spread(index, 1) - 0.5);
    }
    let tip = |q: &[f64]| robot.tree.forward_kinematics(q)[finger.tip_link] * finger.tip_in_link;
    let jacobian = robot.tree.jacobian(&robot.tree.forward_kinematics(&q), finger.tip_link, tip(&q));
    let mut moving = 0;
    for dof in 0..q.len() {
        let at = |step: f64| {
            let mut moved = q.clone();
            moved[dof] += step;
            (tip(&moved), robot.tree.forward_kinematics(&moved)[finger.tip_link].rotation)
        };
        let ((to, turned), (from, before)) = (at(STEP), at(-STEP));
        let slope = (to - from) / (2.0 * STEP);
        let turning = (turned * before.inverse()).scaled_axis() / (2.0 * STEP);
        let column = jacobian.column(dof);
        assert!((slope - column.fixed_rows::<3>(0)).norm() < 1e-7, "{}", robot.tree.dofs[dof].name);
        assert!((turning - column.fixed_rows::<3>(3)).norm() < 1e-7, "{}", robot.tree.dofs[dof].name);
        moving += usize::from(column.norm() > 0.0);
    }
    assert_eq!(moving, 6 + 3, "arm and ring finger");
}

#[test]
fn what_a_finger_reaches_it_finds_again() {
    let robot = shipped("gifu_hand_iii_right");
    for finger in &right(&robot).fingers {
        for index in 0..500 {
            let angles = sample(finger, index);
            let point = finger.posture(&angles).tip;
            let reached = finger.ik(point);
            assert!(reached.miss < REACHED_M, "{} {angles:?}: {} m off", finger.finger, reached.miss);
            let again = finger.posture(&reached.angles).tip;
            assert!((again - point).norm() < REACHED_M, "{} {angles:?}: {} and {}", finger.finger, again, point);
            for (angle, [low, high]) in reached.angles.iter().zip(&finger.ranges) {
                assert!((*low..=*high).contains(angle), "{} {angle}", finger.finger);
            }
            // Of several solutions it takes the best; a scan may miss the top of a free joint by little.
            let (found, known) = (finger.measure(&reached.angles), finger.measure(&angles));
            assert!(found > 0.97 * known, "{} {angles:?}: {found} and {known}", finger.finger);
        }
    }
}

/// The inverse kinematics of an arm computes the links up to its palm alone.
#[test]
fn a_chain_of_links_has_the_poses_and_the_jacobian_of_the_whole_robot() {
    let robot = shipped("both_hands");
    for hand in robot.hands.values() {
        let chain = robot.tree.chain(hand.palm);
        assert_eq!((chain.first(), chain.last()), (Some(&0), Some(&hand.palm)));
        let mut of_chain = Vec::new();
        for index in 0..10 {
            let spread = |dof: usize| 0.6 * (spread(index * 50 + dof, dof) - 0.5);
            let q: Vec<f64> = robot.tree.middle().iter().enumerate().map(|(dof, at)| at + spread(dof)).collect();
            let poses = robot.tree.forward_kinematics(&q);
            robot.tree.chain_poses(&chain, &q, &mut of_chain);
            assert!(chain.iter().zip(&of_chain).all(|(link, pose)| poses[*link] == *pose), "{of_chain:?}");
            let origin = Point3::from(poses[hand.palm].translation.vector);
            let whole = robot.tree.jacobian(&poses, hand.palm, origin).select_columns(&hand.arm);
            assert_eq!(robot.tree.chain_jacobian(&chain, &of_chain, &hand.arm), whole);
        }
    }
}

#[test]
fn the_closed_measure_is_that_of_the_jacobian() {
    let robot = shipped("gifu_hand_iii_right");
    let index = right(&robot).finger(Finger::Index).unwrap();
    // A finger bent by 30 degrees everywhere, by hand: planar columns, times the distance from the first axis.
    let bend = 30_f64.to_radians();
    let mut angles = [0.0; MAX_DOFS];
    (angles[1], angles[2]) = (bend, bend);
    let (l2, l3, l4) = (0.0575, 0.0368, 0.0322);
    let ray = |length: f64, turns: f64| (length * (turns * bend).cos(), length * (turns * bend).sin());
    let ((r2, z2), (r3, z3), (r4, z4)) = (ray(l2, 1.0), ray(l3, 2.0), ray(l4, 3.0));
    let (tip, coupled) = ((r2 + r3 + r4, z2 + z3 + z4), (r3 + 2.0 * r4, z3 + 2.0 * z4));
    let wanted = tip.0 * (tip.0 * coupled.1 - tip.1 * coupled.0).abs() / (l2 + l3 + l4).powi(3);
    let found = index.manipulability(&angles);
    assert!((found - wanted).abs() < 1e-9, "{found} and {wanted}");
    assert!((index.length - 0.1265).abs() < 1e-12);
}

#[test]
fn out_of_reach_is_reported_in_millimetres() {
    let robot = shipped("gifu_hand_iii_right");
    let index = right(&robot).finger(Finger::Index).unwrap();
    // Straight ahead of the stretched finger: 20 mm too far.
    let tip = index.posture(&[0.0; MAX_DOFS]).tip;
    let miss = index.ik_residual(tip + Vector3::new(0.020, 0.0, 0.0));
    assert!((miss - 0.020).abs() < 1e-4, "{miss}");
    // Beside the finger: the first joint goes to its limit of 20 degrees.
    let side = index.ik_residual(Point3::new(0.115, -0.038 - 0.1265, 0.0));
    let wanted = 0.1265 * 2.0 * (35_f64.to_radians()).sin();
    assert!(side < wanted + 1e-4 && side > 0.05, "{side} and at most {wanted}");
}
