//! Commands that a robot refuses.

use crate::demonstrated::commanded;
use serde_json::Value;
use teachtree_base::error::InputError;
use teachtree_command::Commands;
use teachtree_robot as robot;
use teachtree_robot::planning::trajectory::trajectory;
use teachtree_world as world;

/// Each of these changes makes sound commands unsound, and is reported with its place and what was wanted.
#[test]
fn commands_that_cannot_be_are_refused_at_their_place() {
    let sound = serde_json::to_value(mapped("pick_and_place", 3)).unwrap();
    let changed = |change: &dyn Fn(&mut Value)| {
        let mut value = sound.clone();
        change(&mut value["tasks"][0]);
        Commands::read(&value.to_string(), "commands.json").map(|_| ()).map_err(|error| error.to_string())
    };
    assert_eq!(changed(&|_| ()), Ok(()));
    // Stamps of a recording may count from 1970.
    let since_1970 = |task: &mut Value| {
        for stamp in ["start_s", "end_s"] {
            task[stamp] = (task[stamp].as_f64().unwrap() + 1.7e9).into();
        }
        for segment in task["segments"].as_array_mut().unwrap() {
            segment["demonstrated_start_s"] = (segment["demonstrated_start_s"].as_f64().unwrap() + 1.7e9).into();
        }
    };
    assert_eq!(changed(&since_1970), Ok(()));
    let check = |change: &dyn Fn(&mut Value), wanted: &[&str]| {
        let printed = changed(change).unwrap_err();
        assert!(wanted.iter().all(|wanted| printed.contains(wanted)), "{printed}, expected {wanted:?}");
    };
    check(&|task| task["track"] = "middle".into(), &["commands.json:", "`middle`", "`left` or `right`"]);
    check(&|task| task["end_s"] = (-1.0).into(), &["ends at -1 s, before it begins at 0 s"]);
    check(&|task| task["end_s"] = 1e300.into(), &["has the time 1e300 s, expected at most 1e11 s"]);
    check(&|task| task["end_s"] = 60.0.into(), &["ends at 60 s, but the last of it was demonstrated from"]);
    check(&|task| task["end_s"] = 1.0.into(), &["ends at 1 s, but the last of it was demonstrated from"]);
    check(&|task| task["start_s"] = 1.0.into(), &["segment 1", "s on, expected 1 s or later"]);
    check(
        &|task| task["segments"][2]["demonstrated_start_s"] = 0.1.into(),
        &["segment 3", "was demonstrated from 0.1 s on, expected", "s or later, when the preceding one began"],
    );
    check(
        &|task| task["segments"][1]["quality"]["jerk_after"] = 1e300.into(),
        &["segment 2", "has a `quality` that has the number 1e300, expected 0 to 1e9"],
    );
    check(
        &|task| task["grasps"][0]["mapped"]["measure"] = (-1.0).into(),
        &["has a measure", "the number -1, expected 0 to"],
    );
    let share = |task: &mut Value| task["grasps"][0]["mapped"]["fingers"][0]["freedom"] = 1e300.into();
    check(&share, &["a share of thumb", "the number 1e300"]);
    let backwards = serde_json::json!([{"primitives": ["Move"], "start_s": 2.0, "end_s": 1.0, "why": "pause"}]);
    check(&|task| task["left_out"] = backwards.clone(), &["omission 1 ends at 1 s, before it begins at 2 s"]);
    check(&|task| task["segments"][1]["duration_s"] = (-1.0).into(), &["segment 2", "takes -1 s"]);
    check(&|task| task["segments"][1]["start_s"] = 0.0.into(), &["segment 2", "before the preceding one ends"]);
    check(
        &|task| task["segments"][1]["duration_s"] = 400.0.into(),
        &["segment 2", "poses of the object, expected 40001"],
    );
    check(&|task| drop(task["segments"][1]["hand"].as_array_mut().unwrap().pop()), &["places of the hand, expected"]);
    check(&|task| task["segments"][1]["grasp"] = 7.into(), &["segment 2", "the grasp 7", "the task has 1"]);
    check(&|task| task["segments"][1]["tips"][0]["finger"] = "thunb".into(), &["`thunb`", "`thumb`, `index`"]);
    check(&|task| task["segments"][1]["tips"][1]["finger"] = "thumb".into(), &["the finger thumb twice"]);
    check(
        &|task| task["segments"][1]["object"][3][0] = 1e6.into(),
        &["segment 2", "the number 1000000, expected one of at most 100 m"],
    );
    check(&|task| task["segments"][1]["object"][3][3] = 0.3.into(), &["a quaternion of length", "expected 1"]);
    check(&|task| task["grasps"][0]["contacts"] = Value::Array(vec![]), &["grasp 1 has no contacts"]);
    let nowhere = || Value::from(vec![0.0; 3]);
    check(
        &|task| task["grasps"][0]["contacts"][0]["normal"] = nowhere(),
        &["a contact of thumb", "normal of length 0.000"],
    );
    let far = |task: &mut Value| task["grasps"][0]["contacts"][0]["point"][0] = (-1000.0).into();
    check(&far, &["grasp 1 has a contact of thumb", "-1000", "at most 10 m"]);
    let still = || Value::from(vec![0.0; 7]);
    check(&|task| task["grasps"][0]["mapped"]["opens"] = 0.5.into(), &["`opens` at 500 mm", "expected 0 to 100 mm"]);
    // A hand does not wait while it holds an object.
    check(&|task| task["segments"][3]["precedence"] = "first".into(), &["segment 4 (Translate)", "`precedence`"]);
    check(&|task| task["grasps"][0]["mapped"]["object_from_palm"] = still(), &["`object_from_palm`", "length 0.000"]);
}

/// Grasps are of one robot's hand: another robot, and joints beyond what that hand can do, are refused before anything moves.
#[test]
fn commands_of_another_robot_are_refused() {
    let commands = mapped("pick_and_place", 3);
    let robot = robot::open("both_hands", &|file| Err(InputError::new(file, "is not a shipped robot"))).unwrap();
    let scene = world::scene("pick_and_place").unwrap();
    let printed = |commands: &Commands| trajectory(commands, &robot, &scene, None).unwrap_err().to_string();
    let mut other = commands.clone();
    other.robot = Some("a robot of mine".into());
    assert!(
        printed(&other).contains("are for the robot `a robot of mine`, this one is `both hands`"),
        "{}",
        printed(&other)
    );
    let mut elsewhere = commands.clone();
    elsewhere.tasks[0].into =
        Some(teachtree_command::HoleBody { body: "moon".into(), pose: [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0] });
    assert!(
        printed(&elsewhere).contains("goes into `moon`, which is not a body of the scene"),
        "{}",
        printed(&elsewhere)
    );
    let mut bent = commands;
    let mapped = bent.tasks[0].grasps[0].mapped.as_mut().unwrap();
    mapped.joints.insert("right_hand/index_2".into(), 9.0);
    assert!(printed(&bent).contains("`right_hand/index_2` at 9, expected"), "{}", printed(&bent));
}

/// The commands of an operator's demonstration in a shipped scene, with the grasps of the robot with both hands.
pub fn mapped(scene: &str, seed: u64) -> Commands {
    let mut commands = commanded(scene, seed);
    let robot = robot::open("both_hands", &|file| Err(InputError::new(file, "is not a shipped robot"))).unwrap();
    robot::map(&mut commands, &robot, &world::scene(scene).unwrap()).unwrap();
    commands
}
