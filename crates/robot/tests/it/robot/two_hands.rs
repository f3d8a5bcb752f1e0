//! Two arms: precedence, late starts, and pushes by both hands.

use super::kinematics::shipped;
use crate::command::mapped;
use crate::demonstrated::commanded;
use nalgebra::Vector3;
use teachtree_base::hands::Side;
use teachtree_command::{Commands, Precedence, Task};
use teachtree_robot::planning::delayed_start::begun_late;
use teachtree_robot::planning::trajectory::trajectory;
use teachtree_robot::simulation::{Verdict, simulate};
use teachtree_world as world;

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
    let conflicts = teachtree_robot::map(&mut commands, &robot, &scene).unwrap();
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

    // A collision of the hands that is left is reported before the robot moves.
    let [crossing] = &conflicts.crossings[..] else { panic!("{conflicts:?}") };
    let depth_m = done.nearest.arms.unwrap().depth_m();
    assert_eq!(crossing.tasks, [0, 1]);
    assert!((crossing.depth_m - depth_m).abs() < 0.005, "{crossing:?}, in the simulation {depth_m} m");
    for outcome in &done.outcomes[..2] {
        assert!(outcome.collision_m >= depth_m, "{outcome:?}, in the simulation {depth_m} m");
        assert_eq!(outcome.verdict(), Verdict::DoneWithCollisions);
    }
}

/// This person's left hand withdraws over the box, farther than the arm reaches. The hands are kept apart nevertheless: the arm may stay behind after the release.
#[test]
fn a_retreat_out_of_reach_does_not_prevent_that_hands_are_kept_apart() {
    let (robot, scene) = (shipped("both_hands"), world::scene("push_together").unwrap());
    let mut commands = commanded("push_together", 4);
    let conflicts = teachtree_robot::map(&mut commands, &robot, &scene).unwrap();
    assert!(conflicts.unreachable.is_empty(), "{conflicts:?}");
    assert!(conflicts.crossings.is_empty(), "arms that are not kept apart cross by 0.11 m: {conflicts:?}");

    // The left hand changes its fingers on the way from the first push to the next one, away from the wall beside the box.
    let done = simulate(&commands, &robot, &scene, &mut |_| {}).unwrap();
    for outcome in &done.outcomes {
        assert!(outcome.done && outcome.collision_m < 0.004, "{outcome:?}");
    }
}

/// This person nudges the cube by 22 mm on the way to it. The robot's hands reach the cube where it is, without a nudge and not through it.
#[test]
fn paths_lead_to_an_object_that_is_not_nudged() {
    let (robot, scene) = (shipped("both_hands"), world::scene("follow_together").unwrap());
    let mut commands = commanded("follow_together", 9);
    let [first, .., touch] = &commands.tasks[0].segments[..3] else { unreachable!("three segments") };
    let way = touch.object[0][1] - first.object[0][1];
    assert!(touch.touching && way > 0.02, "the cube is nudged by {way} m before the touch");
    teachtree_robot::map(&mut commands, &robot, &scene).unwrap();
    let done = simulate(&commands, &robot, &scene, &mut |_| {}).unwrap();
    for outcome in &done.outcomes {
        assert!(outcome.done && outcome.collision_m < 0.003, "{outcome:?}");
    }
}

/// In `push_together` 15 the arms reach few of the pairs of grasps that leave most room for the hands. In `hand_over_right_to_left` 10 a wrist would go through
/// the body `base`, and in `hand_over_left_to_right` 17 a finger through the box on a path that is led past the other hand.
#[test]
fn hands_that_are_kept_apart_reach_their_objects_and_penetrate_nothing() {
    for (name, person) in [("push_together", 15), ("hand_over_right_to_left", 10), ("hand_over_left_to_right", 17)] {
        let (robot, scene) = (shipped("both_hands"), world::scene(name).unwrap());
        let mut commands = commanded(name, person);
        let conflicts = teachtree_robot::map(&mut commands, &robot, &scene).unwrap();
        assert!(conflicts.crossings.is_empty() && conflicts.unreachable.is_empty(), "{name} {person}: {conflicts:?}");
        let done = simulate(&commands, &robot, &scene, &mut |_| {}).unwrap();
        for outcome in &done.outcomes {
            assert!(outcome.done && outcome.collision_m < 0.004, "{name} {person}: {outcome:?}");
        }
    }
}

#[test]
fn a_later_task_that_an_arm_cannot_follow_is_named() {
    let (robot, scene) = (shipped("both_hands"), world::scene("push_together").unwrap());
    let mut commands = commanded("push_together", 4);
    let last = commands.tasks.iter().rposition(|task| task.track == Side::Left).unwrap();
    assert!(
        commands.tasks[..last].iter().any(|task| task.track == Side::Left),
        "the start does not depend on the last task"
    );
    for segment in commands.tasks[last].segments.iter_mut().filter(|segment| segment.touching) {
        segment.object.iter_mut().for_each(|pose| pose[2] += 2.0);
    }
    let conflicts = teachtree_robot::map(&mut commands, &robot, &scene).unwrap();
    let [unreachable] = &conflicts.unreachable[..] else { panic!("{conflicts:?}") };
    assert_eq!((unreachable.side, unreachable.why.as_str()), (Side::Left, "the arm cannot bring the palm there"));
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
