//! The least gaps between links and bodies, against points on the links.

use super::kinematics::shipped;
use crate::command::mapped;
use crate::demonstrated::commanded;
use nalgebra::{Isometry3, Point3, Vector3};
use std::ops::RangeInclusive;
use teachtree_base::scene::Shape;
use teachtree_robot::CollisionShape;
use teachtree_robot::simulation::arm_clearance::MinDistance;
use teachtree_robot::simulation::simulate;
use teachtree_robot::simulation::trace::{Trace, TraceSample};
use teachtree_world as world;

/// Points on a shape of a link lie at most this far apart, m.
const APART_M: f64 = 0.002;

#[test]
fn least_gaps_to_bodies_are_those_of_points_on_links() {
    let (robot, scene) = (shipped("both_hands"), world::scene("pick_and_place").unwrap());
    let performed = simulate(&mapped("pick_and_place", 3), &robot, &scene, &mut |_| {}).unwrap();
    let (trace, nearest) = (&performed.trace, &performed.nearest);
    assert_eq!(nearest.arms, None, "one arm moves");
    for (nearest, handled) in [(&nearest.scene, false), (&nearest.handled, true)] {
        let MinDistance { gap, time_s, links: [link, body] } = nearest.as_ref().unwrap();
        assert_eq!(body == "box", handled, "the box is what the hand handles");
        assert!((-0.003..0.05).contains(gap), "{nearest:?}");
        let there = trace.moments.iter().find(|moment| (moment.time_s - time_s).abs() < 1e-9).unwrap();
        let sampled = between(trace, there, link, body);
        assert!((-1e-6..APART_M).contains(&(sampled - gap)), "points {sampled} m, {nearest:?}");
        for moment in trace.moments.iter().step_by(40) {
            for link in trace.limbs[0].robot.tree.links.iter().filter(|it| it.name.starts_with("right_hand/")) {
                let tip = link.name.ends_with("_distal");
                for body in scene.bodies.keys().filter(|body| (*body == "box") == handled && !tip) {
                    let sampled = between(trace, moment, &link.name, body);
                    assert!(sampled > gap - 1e-6, "{}: points of {body} {sampled} m, {nearest:?}", link.name);
                }
            }
        }
    }
}

/// The least gap between a body of boxes and points on the shapes of a link, m; of a link with a fingertip the center of its ball counts alone.
fn between(trace: &Trace, moment: &TraceSample, link: &str, body: &str) -> f64 {
    let limb = &trace.limbs[0];
    let (tree, stance) = (&limb.robot.tree, &moment.stances[0]);
    let index = tree.link(link).unwrap();
    let pose = stance.root * tree.forward_kinematics(&stance.q)[index];
    let tip = limb.robot.hands[&limb.side].fingers.iter().find(|finger| finger.tip_link == index);
    let points = match tip {
        Some(finger) => vec![(finger.tip_in_link, 0.0)],
        None => tree.links[index].solids.iter().flat_map(points).collect(),
    };
    let at = moment.bodies[trace.scene.bodies.get_index_of(body).unwrap()];
    let mut least = f64::INFINITY;
    for part in &trace.scene.bodies[body].parts {
        let Shape::Box(edges) = &part.shape else { panic!("{body} has a part that is not a box") };
        let half = Vector3::from(edges.map(|edge| edge.0 / 2.0));
        let body_from_part = Isometry3::translation(part.at[0].0, part.at[1].0, part.at[2].0);
        for (point, radius) in &points {
            let own = (at * body_from_part).inverse_transform_point(&(pose * point));
            let out = (own.coords.abs() - half).map(|over| over.max(0.0)).norm();
            let deep = (own.coords.abs() - half).max().min(0.0);
            least = least.min(out + deep - radius);
        }
    }
    least
}

/// Points on a shape, each with a radius about it, m.
fn points(shape: &CollisionShape) -> Vec<(Point3<f64>, f64)> {
    match shape {
        CollisionShape::Capsule(from, to, radius) => {
            let parts = ((to - from).norm() / APART_M).ceil() as i32;
            (0..=parts).map(|at| (from + (to - from) * (f64::from(at) / f64::from(parts.max(1))), *radius)).collect()
        }
        CollisionShape::Box(at, half) => {
            let parts = half.map(|half| (half / APART_M).ceil() as i32);
            let along = |axis: usize| -> RangeInclusive<i32> { -parts[axis]..=parts[axis] };
            let mut points = Vec::new();
            for (i, j, k) in along(0).flat_map(|i| along(1).flat_map(move |j| along(2).map(move |k| (i, j, k)))) {
                if i.abs() == parts.x || j.abs() == parts.y || k.abs() == parts.z {
                    let share = Vector3::new(i, j, k).zip_map(&parts, |at, parts| f64::from(at) / f64::from(parts));
                    points.push((at * Point3::from(half.component_mul(&share)), 0.0));
                }
            }
            points
        }
        CollisionShape::Piece(..) => panic!("shipped hands have no meshes"),
    }
}

/// In each of these demonstrations a link was more than 4 mm in something: an opened finger in the object, an idle finger in the wall against which the object is
/// pressed, the wrist in a wall with a pair of grasps that leave room for each other, and in the table with grasps for a hand-over.
#[test]
fn grasps_keep_links_out_of_objects_walls_and_tables() {
    let demonstrations =
        [("pick_and_follow", 9), ("pick_and_press", 37), ("follow_together", 1), ("hand_over_left_to_right", 6)];
    for (name, seed) in demonstrations {
        let (robot, scene) = (shipped("both_hands"), world::scene(name).unwrap());
        let mut commands = commanded(name, seed);
        teachtree_robot::map(&mut commands, &robot, &scene).unwrap();
        let performed = simulate(&commands, &robot, &scene, &mut |_| {}).unwrap();
        for collision in &performed.collisions {
            assert!(collision.depth_m < 0.003, "{name} {seed}: {collision:?}");
        }
        assert!(performed.outcomes.iter().all(|outcome| outcome.done), "{name} {seed}: {:?}", performed.outcomes);
    }
}
