//! "Not done" says why: each cause is provoked by what makes it, and is said of the hand that it happened to.

use crate::program::{all_said, demonstrate, said, teachtree};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use serde_json::Value;
use std::fs::{copy, read_to_string, write};
use std::path::Path;
use teachtree_command::Commands;
use tempfile::TempDir;

/// A demonstration retargeted to a robot, in a folder with copies of the robot's files and the scene that may be changed.
struct Bench {
    folder: TempDir,
    scene: String,
}

impl Bench {
    fn new(scene: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let root = Path::new(env!("CARGO_MANIFEST_DIR"));
        for entry in std::fs::read_dir(root.join("robots")).unwrap() {
            let path = entry.unwrap().path();
            copy(&path, folder.path().join(path.file_name().unwrap())).unwrap();
        }
        // The parts of a robot file of one's own are beside it.
        let both = read_to_string(root.join("robots/both_hands.yaml")).unwrap();
        let both = both.replace("robot: arm_6dof", "robot: arm_6dof.yaml");
        let both = both.replace("robot: gifu_hand_iii_left", "robot: gifu_hand_iii_left.yaml");
        let both = both.replace("robot: gifu_hand_iii_right", "robot: gifu_hand_iii_right.yaml");
        write(folder.path().join("both_hands.yaml"), both).unwrap();
        copy(root.join(format!("scenes/{scene}.yaml")), folder.path().join("scene.yaml")).unwrap();
        let bench = Self { folder, scene: scene.into() };
        demonstrate(scene, &[], bench.path("log.csv"));
        let retargeted = teachtree(&["retarget", &bench.path("log.csv"), "-o", &bench.path("commands.json")]);
        assert!(retargeted.status.success(), "{}", all_said(&retargeted));
        bench
    }

    fn path(&self, name: &str) -> String {
        self.folder.path().join(name).to_str().unwrap().to_string()
    }

    /// Replaces a part of a file that must be in it.
    fn change(&self, file: &str, from: &str, to: &str) {
        let text = read_to_string(self.path(file)).unwrap();
        assert!(text.contains(from), "{file} of {}: {text}", self.scene);
        write(self.path(file), text.replace(from, to)).unwrap();
    }

    /// The causes that are said of the first task, which is not done.
    fn causes(&self) -> Vec<Value> {
        let [commands, robot, scene, out] =
            ["commands.json", "both_hands.yaml", "scene.yaml", "robot.csv"].map(|name| self.path(name));
        let args = ["simulate", &commands, "--robot", &robot, "--scene", &scene, "-o", &out, "--format", "json"];
        let output = teachtree(&args);
        assert_eq!(output.status.code(), Some(4), "{}", all_said(&output));
        let document: Value = serde_json::from_str(&said(&output)).unwrap();
        let task = &document["tasks"][0];
        assert_eq!(task["done"], false);
        let causes = task["causes"].as_array().unwrap().clone();
        assert!(causes.is_sorted_by_key(|cause| cause["time_s"].as_f64().unwrap()), "{causes:?}");
        causes
    }
}

/// The one cause of a kind, of several the first.
fn of<'c>(causes: &'c [Value], kind: &str) -> &'c Value {
    let found = causes.iter().find(|cause| cause["cause"] == kind);
    found.unwrap_or_else(|| panic!("no {kind}: {causes:#?}"))
}

/// An object of eight times its weight slips out of the fingers.
#[test]
fn an_object_that_is_too_heavy_slips_and_is_lost() {
    let bench = Bench::new("pick_and_place");
    bench.change("scene.yaml", "mass: 40 g", "mass: 300 g");
    let causes = bench.causes();
    let slipped = of(&causes, "contact_slipped");
    assert!(slipped["off_m"].as_f64().unwrap() > 0.005, "{slipped}");
    let finger = slipped["finger"].as_str().unwrap();
    assert!(slipped["link"].as_str().unwrap().starts_with(&format!("right_hand/{finger}_")), "{slipped}");
    assert_eq!(slipped["contact"], "box", "{slipped}");
    assert!(slipped["text"].as_str().unwrap().ends_with(", contact with `box`"), "{slipped}");
    let left = of(&causes, "left_way");
    assert_eq!((&left["track"], &left["primitive"]), (&"right".into(), &"Translate".into()), "{causes:#?}");
    assert!(left["text"].as_str().unwrap().contains("right hand in Translate: the object left its path"), "{left}");
    let lost = of(&causes, "contact_lost");
    assert!(lost["time_s"].as_f64() >= slipped["time_s"].as_f64(), "{causes:#?}");
}

/// The object is lifted by 150 mm more; half way the fingers press with 0.12 N only, and it is heavier than that: it falls.
#[test]
fn an_object_that_is_dropped_on_its_way_is_said() {
    let bench = Bench::new("pick_and_place");
    bench.change("scene.yaml", "mass: 40 g", "mass: 120 g");
    let text = read_to_string(bench.path("commands.json")).unwrap();
    let mut commands = Commands::read(&text, "commands.json").unwrap();
    let carried = commands.tasks[0].segments.iter_mut().find(|segment| segment.primitive == "Translate").unwrap();
    let last = carried.object.len() as f64 - 1.0;
    for (at, pose) in carried.object.iter_mut().enumerate() {
        pose[2] += 0.15 * (std::f64::consts::PI * at as f64 / last).sin().powi(2);
    }
    for tip in &mut carried.tips {
        let half = tip.force.len() / 2;
        for force in &mut tip.force[half..] {
            let length = Vector3::from(*force).norm();
            *force = force.map(|part| if length > 0.0 { 0.12 * part / length } else { 0.0 });
        }
    }
    write(bench.path("commands.json"), commands.json().unwrap()).unwrap();
    let causes = bench.causes();
    let dropped = of(&causes, "dropped");
    assert_eq!((&dropped["track"], &dropped["primitive"]), (&"right".into(), &"Translate".into()), "{causes:#?}");
}

/// A shoulder that gives a tenth does not carry the arm.
#[test]
fn a_motor_that_is_too_weak_is_named() {
    let bench = Bench::new("pick_and_place");
    bench.change("arm_6dof.yaml", "torque: 150 N m", "torque: 12 N m");
    let causes = bench.causes();
    let missing = of(&causes, "torque_missing");
    assert_eq!(missing["joint"], "right_arm/joint_2", "{causes:#?}");
    assert!(missing["link"].as_str().unwrap().starts_with("right_arm/"), "{missing}");
    assert!(missing["missing_n_m"].as_f64().unwrap() > 1.0, "{missing}");
}

/// The hole is 8 mm from where it was.
#[test]
fn a_hole_that_is_missed_is_said() {
    let bench = Bench::new("peg_in_hole");
    bench.change("scene.yaml", "position: [90 mm, 20 mm, 20 mm]", "position: [84 mm, 25.5 mm, 20 mm]");
    let causes = bench.causes();
    let missed = of(&causes, "hole_missed");
    assert_eq!(missed["contact"], "holder", "{missed}");
    assert_eq!((&missed["within_m"], &missed["primitive"]), (&0.004.into(), &"Insert".into()), "{causes:#?}");
}

/// The palm stays 75 mm farther back than the grasp that was found: fingers are stretched and do not reach.
#[test]
fn a_joint_at_its_limit_is_named() {
    let bench = Bench::new("pick_and_place");
    let text = read_to_string(bench.path("commands.json")).unwrap();
    let mut commands = Commands::read(&text, "commands.json").unwrap();
    let mapped = commands.tasks[0].grasps[0].mapped.as_mut().unwrap();
    let [.., w, i, j, k] = mapped.object_from_palm;
    let back = UnitQuaternion::from_quaternion(Quaternion::new(w, i, j, k)) * Vector3::x() * -0.075;
    (0..3).for_each(|axis| mapped.object_from_palm[axis] += back[axis]);
    write(bench.path("commands.json"), commands.json().unwrap()).unwrap();
    let causes = bench.causes();
    let limit = of(&causes, "joint_at_limit");
    let [joint, finger] = ["joint", "finger"].map(|key| limit[key].as_str().unwrap());
    assert!(joint.starts_with(&format!("right_hand/{finger}_")), "{causes:#?}");
    assert!(limit["off_m"].as_f64().unwrap() > 0.005, "{limit}");
}
