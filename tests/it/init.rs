//! `teachtree init`: the binding, the scene and the project file of logs in the layouts of other programs.

use crate::plugs::{GOOD, Outcome::Inserted, log};
use crate::program::{all_said, complained, said, teachtree_in};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).to_path_buf()
}

/// A folder with copies of files or folders of the repository.
fn folder(sources: &[&str]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for source in sources {
        copy(&root().join(source), &folder.path().join(Path::new(source).file_name().unwrap()));
    }
    folder
}

fn copy(from: &Path, to: &Path) {
    if from.is_file() {
        fs::copy(from, to).unwrap();
        return;
    }
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        copy(&entry.path(), &to.join(entry.file_name()));
    }
}

/// The channels of the binding that `init` writes for a log, without comments, and its scene.
fn proposed(folder: &Path, log: &str) -> (String, String) {
    let output = teachtree_in(folder, &["init", log, "--yes", "-o", "out"]);
    assert_ne!(output.status.code(), Some(2), "{}", all_said(&output));
    let out = folder.join("out");
    let named = |ending: &str| {
        let mut entries = fs::read_dir(&out).unwrap().flatten().map(|entry| entry.path());
        fs::read_to_string(entries.find(|path| path.to_string_lossy().ends_with(ending)).unwrap()).unwrap()
    };
    let (binding, scene) = (named(".binding.yaml"), named(".scene.yaml"));
    let _ = fs::remove_dir_all(&out);
    let channels = binding.lines().filter(|line| line.starts_with("  ") && !line.trim_start().starts_with('#'));
    let channels = channels.map(|line| line.split("    #").next().unwrap().trim_start().to_string() + "\n").collect();
    (channels, scene)
}

/// The tasks and the segments of the right hand in an analysis without options.
fn found(folder: &Path, log: &str) -> (Vec<String>, Vec<(String, f64, f64)>) {
    let output = teachtree_in(folder, &["analyze", log, "--format", "json"]);
    assert!(output.status.success(), "{}", all_said(&output));
    let analysis: Value = serde_json::from_str(&said(&output)).unwrap();
    let tracks = analysis["tracks"].as_array().unwrap();
    let track = tracks.iter().find(|track| track["track"] == "right").unwrap();
    let text = |value: &Value| value.as_str().unwrap().to_string();
    let tasks = track["tasks"].as_array().unwrap().iter().map(|task| text(&task["task"])).collect();
    let segment =
        |one: &Value| (text(&one["primitive"]), one["start_s"].as_f64().unwrap(), one["end_s"].as_f64().unwrap());
    (tasks, track["segments"].as_array().unwrap().iter().map(segment).collect())
}

#[test]
fn an_analysis_needs_no_option_afterwards() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("plug.csv"), log(Inserted, 1, GOOD)).unwrap();
    let output = teachtree_in(folder.path(), &["init", "plug.csv", "--yes"]);
    assert!(output.status.success(), "{}", all_said(&output));
    let written = said(&output);
    for name in ["plug.binding.yaml", "plug.scene.yaml", "teachtree.yaml", "plug.analysis.json", "plug.report.html"] {
        assert!(written.contains(name) && folder.path().join(name).is_file(), "{name}: {written}");
    }
    for command in ["teachtree analyze plug.csv", "teachtree studio plug.csv", "teachtree check plug.binding.yaml"] {
        assert!(written.contains(command), "{written}");
        let mut words = command.split_whitespace().skip(1).filter(|word| *word != "studio");
        if command.contains("studio") {
            continue;
        }
        let args: Vec<&str> = words.by_ref().collect();
        let output = teachtree_in(folder.path(), &args);
        assert!(output.status.success(), "{command}: {}", all_said(&output));
    }
    let (tasks, segments) = found(folder.path(), "plug.csv");
    assert_eq!(tasks, ["peg_in_hole"], "{segments:?}");
    insta::assert_snapshot!("binding_of_a_plug", fs::read_to_string(folder.path().join("plug.binding.yaml")).unwrap());
    insta::assert_snapshot!("scene_of_a_plug", fs::read_to_string(folder.path().join("plug.scene.yaml")).unwrap());
    insta::assert_snapshot!("project_of_a_plug", fs::read_to_string(folder.path().join("teachtree.yaml")).unwrap());
}

/// A recording that ends within a task is not an example to expect.
#[test]
fn tasks_are_expected_after_a_success_only() {
    let whole = log(Inserted, 1, GOOD);
    let cut: String = whole.split_inclusive('\n').take(700).collect();
    for (text, wanted) in [(whole, "success"), (cut, "unknown")] {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("plug.csv"), text).unwrap();
        let output = teachtree_in(folder.path(), &["init", "plug.csv", "--yes"]);
        assert!(output.status.success(), "{}", all_said(&output));
        let read = |name: &str| fs::read_to_string(folder.path().join(name)).unwrap();
        let analysis: Value = serde_json::from_str(&read("plug.analysis.json")).unwrap();
        assert_eq!(analysis["outcome"]["result"], wanted);
        assert!(!analysis["tracks"][0]["tasks"].as_array().unwrap().is_empty());
        assert_eq!(read("teachtree.yaml").contains("# expect: "), wanted == "success");
    }
}

#[test]
fn files_that_are_there_stay() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("plug.csv"), log(Inserted, 1, GOOD)).unwrap();
    let edited = folder.path().join("plug.binding.yaml");
    fs::write(&edited, "channels: {}    # mine\n").unwrap();
    let refused = teachtree_in(folder.path(), &["init", "plug.csv", "--yes"]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(complained(&refused).contains("plug.binding.yaml: exists already"), "{}", complained(&refused));
    assert_eq!(fs::read_to_string(&edited).unwrap(), "channels: {}    # mine\n");
    assert!(!folder.path().join("teachtree.yaml").exists());
    let forced = teachtree_in(folder.path(), &["init", "plug.csv", "--yes", "--force"]);
    assert!(forced.status.success(), "{}", all_said(&forced));
    assert!(fs::read_to_string(&edited).unwrap().contains("right.tcp.position"));
    // The same bytes again.
    let first = fs::read(folder.path().join("plug.analysis.json")).unwrap();
    assert!(teachtree_in(folder.path(), &["init", "plug.csv", "--yes", "--force"]).status.success());
    assert_eq!(fs::read(folder.path().join("plug.analysis.json")).unwrap(), first);
}

/// A table of a tool that moves, in a row for each of 60 samples.
fn table(names: &[&str]) -> String {
    let mut text = format!("time,{}\n", names.join(","));
    for row in 0..60 {
        let values: Vec<String> =
            (0..names.len()).map(|at| format!("{:.4}", 0.3 + 0.1 * (f64::from(row) * 0.1 + at as f64).sin())).collect();
        text.push_str(&format!("{:.2},{}\n", f64::from(row) * 0.02, values.join(",")));
    }
    text
}

const TOOL: [&str; 4] = ["tcp_x", "tcp_y", "tcp_z", "gripper_width"];
const OTHER: [&str; 4] = ["ee_x", "ee_y", "ee_z", "opening"];

#[test]
fn equal_tables_are_one_entry() {
    let folder = tempfile::tempdir().unwrap();
    for number in 0..120 {
        fs::write(folder.path().join(format!("run_{number:03}.csv")), table(&TOOL)).unwrap();
    }
    let output = teachtree_in(folder.path(), &["init", ".", "--yes"]);
    assert_ne!(output.status.code(), Some(2), "{}", all_said(&output));
    let project = fs::read_to_string(folder.path().join("teachtree.yaml")).unwrap();
    assert_eq!(project.matches("binding:").count(), 1, "{project}");
    assert!(project.contains("  \"/*.csv\":\n    binding: \"run_000.binding.yaml\"\n"), "{project}");
}

#[test]
fn logs_with_other_columns_are_left_out() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("more")).unwrap();
    for name in ["a.csv", "b.csv", "c.csv", "more/d.csv"] {
        fs::write(folder.path().join(name), table(&TOOL)).unwrap();
    }
    fs::write(folder.path().join("z.csv"), table(&OTHER)).unwrap();
    let output = teachtree_in(folder.path(), &["init", ".", "--yes"]);
    assert_ne!(output.status.code(), Some(2), "{}", all_said(&output));
    let project = fs::read_to_string(folder.path().join("teachtree.yaml")).unwrap();
    for pattern in ["/a.csv", "/b.csv", "/c.csv", "/more/*.csv"] {
        assert!(project.contains(&format!("  \"{pattern}\":\n")), "{project}");
    }
    assert!(!project.contains("z.csv"), "{project}");
    assert!(said(&output).contains("left out: ./z.csv: their columns differ from those of "), "{}", said(&output));
}

#[test]
fn another_log_gets_an_entry_of_its_own() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("a.csv"), table(&TOOL)).unwrap();
    fs::write(folder.path().join("b.csv"), table(&OTHER)).unwrap();
    let project = folder.path().join("teachtree.yaml");
    fs::write(&project, "# mine\nlogs:    # all\n   '/other.csv':    # first\n      params: {touch_on: 2 N}").unwrap();
    for log in ["a.csv", "b.csv"] {
        let output = teachtree_in(folder.path(), &["init", log, "--yes"]);
        assert_ne!(output.status.code(), Some(2), "{}", all_said(&output));
        let found = fs::read_to_string(&project).unwrap();
        assert!(
            found.starts_with("# mine\nlogs:    # all\n   '/other.csv':    # first\n      params: {touch_on: 2 N}\n"),
            "{found}"
        );
    }
    let config = said(&teachtree_in(folder.path(), &["config", "b.csv"]));
    assert!(config.contains("binding       b.binding.yaml"), "{config}");
    // The same once more changes nothing, and what this run wrote is listed.
    let before = fs::read_to_string(&project).unwrap();
    let again = teachtree_in(folder.path(), &["init", "b.csv", "--yes", "--force"]);
    assert_eq!(fs::read_to_string(&project).unwrap(), before);
    let written = said(&again).lines().find(|line| line.starts_with("written: ")).unwrap().to_string();
    assert!(written.contains("b.binding.yaml") && !written.contains("teachtree.yaml"), "{written}");
    // A text of another form stays.
    fs::write(&project, "logs: {'*.tsv': {}}\n").unwrap();
    let refused = teachtree_in(folder.path(), &["init", "b.csv", "--yes", "--force"]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(complained(&refused).contains("\"/b.csv\":"), "{}", complained(&refused));
    assert_eq!(fs::read_to_string(&project).unwrap(), "logs: {'*.tsv': {}}\n");
}

/// The motion of the fixtures: closed from 3.5 s to 9 s, in the air from 3.8 s to 8.5 s.
fn assert_pick_and_place(folder: &Path, log: &str, of_20_hz_s: f64) {
    let initialized = teachtree_in(folder, &["init", log, "--yes"]);
    assert!(initialized.status.success(), "{}", all_said(&initialized));
    let (tasks, segments) = found(folder, log);
    assert_eq!(tasks, ["pick_and_place"], "{segments:?}\n{}", all_said(&initialized));
    let of = |name: &str| {
        segments.iter().find(|(primitive, ..)| primitive == name).unwrap_or_else(|| panic!("{name}: {segments:?}"))
    };
    let near = |value: f64, wanted: f64| (value - wanted * of_20_hz_s).abs() < 0.4 * of_20_hz_s;
    assert!(near(of("Grasp").1, 3.35), "{segments:?}");
    assert!(near(of("Translate").1, 3.85), "{segments:?}");
}

#[test]
fn robomimic_and_mimicgen() {
    let folder = folder(&["tests/fixtures/init/robomimic.hdf5"]);
    let (channels, scene) = proposed(folder.path(), "robomimic.hdf5");
    insta::assert_snapshot!("robomimic", format!("{channels}{scene}"));
    let initialized = teachtree_in(folder.path(), &["init", "robomimic.hdf5", "--yes"]);
    assert!(initialized.status.success(), "{}", all_said(&initialized));
    let (tasks, _) = found(folder.path(), "robomimic.hdf5#demo_1");
    assert_eq!(tasks, ["pick_and_place"]);
}

/// States of MuJoCo have names such as `bodies/cube_main.position.x`, which are none of ours.
#[test]
fn states_of_robosuite() {
    let folder = folder(&["demos/robosuite/lift.hdf5"]);
    let (channels, _) = proposed(folder.path(), "lift.hdf5#1");
    assert!(channels.contains("cube.position: bodies/cube_main.position.<xyz>\n"), "{channels}");
    let initialized = teachtree_in(folder.path(), &["init", "lift.hdf5#1", "--yes"]);
    assert!(initialized.status.success(), "{}", all_said(&initialized));
    // The first moments of the recording belong to no task, with the shipped binding as well.
    assert_eq!(found(folder.path(), "lift.hdf5#3").0, ["unknown", "pick_and_place"]);
}

/// A log with our names and no scene gets both files.
#[test]
fn our_names_without_a_scene() {
    let folder = tempfile::tempdir().unwrap();
    let names = ["right.tcp.position.x", "right.tcp.position.y", "right.tcp.position.z", "right.gripper.opening"];
    fs::write(folder.path().join("own.csv"), table(&names)).unwrap();
    let (channels, _) = proposed(folder.path(), "own.csv");
    assert!(channels.contains("right.tcp.position: right.tcp.position.<xyz>\n"), "{channels}");
}

/// The contacts of a simulation, and no socket in the log: the nuts show where the pegs are.
#[test]
fn nuts_on_pegs() {
    let folder = folder(&["demos/robosuite/SawyerNutAssembly_demo_1.csv"]);
    let log = "SawyerNutAssembly_demo_1.csv";
    let (_, scene) = proposed(folder.path(), log);
    let sockets: Vec<&str> = scene.lines().filter(|line| line.trim_start().starts_with("position: [7")).collect();
    // robosuite has them at 730, 100 and 730, -100 mm; a loose nut rests a little beside.
    assert_eq!(sockets.len(), 2, "{scene}");
    let initialized = teachtree_in(folder.path(), &["init", log, "--yes"]);
    assert!(initialized.status.success(), "{}", all_said(&initialized));
    assert_eq!(found(folder.path(), log).0, ["peg_in_hole", "peg_in_hole"]);
}

#[test]
fn switches_in_pads() {
    let folder = folder(&["examples/contact_flags/box.csv"]);
    let initialized = teachtree_in(folder.path(), &["init", "box.csv", "--yes"]);
    assert!(initialized.status.success(), "{}", all_said(&initialized));
    assert_eq!(found(folder.path(), "box.csv").0, ["dropped", "pick_and_place"]);
}

/// The lever of a door turns in its place, and the palm alone touches it.
#[test]
fn a_lever_in_a_door() {
    let folder = folder(&["demos/robosuite/door_panda_demo_1.csv"]);
    let initialized = teachtree_in(folder.path(), &["init", "door_panda_demo_1.csv", "--yes"]);
    assert!(initialized.status.success(), "{}", all_said(&initialized));
    assert_eq!(found(folder.path(), "door_panda_demo_1.csv").0, ["turn_screw"]);
}

/// Each hand has one body all the time.
#[test]
fn bodies_that_are_fixed_to_hands() {
    let folder = folder(&["demos/robosuite/BaxterPegInHole_demo_1.csv"]);
    let initialized = teachtree_in(folder.path(), &["init", "BaxterPegInHole_demo_1.csv", "--yes"]);
    assert!(initialized.status.success(), "{}", all_said(&initialized));
    assert_eq!(found(folder.path(), "BaxterPegInHole_demo_1.csv").0, ["fit"]);
}

#[test]
fn libero() {
    let folder = folder(&["tests/fixtures/init/libero.hdf5"]);
    let (channels, scene) = proposed(folder.path(), "libero.hdf5");
    insta::assert_snapshot!("libero", format!("{channels}{scene}"));
}

#[test]
fn aloha() {
    let folder = folder(&["tests/fixtures/init/aloha.hdf5"]);
    let (channels, scene) = proposed(folder.path(), "aloha.hdf5");
    insta::assert_snapshot!("aloha", format!("{channels}{scene}"));
    let initialized = teachtree_in(folder.path(), &["init", "aloha.hdf5", "--yes"]);
    assert!(initialized.status.success(), "{}", all_said(&initialized));
    let (tasks, segments) = found(folder.path(), "aloha.hdf5");
    assert_eq!(tasks, ["pick_and_place"], "{segments:?}");
}

#[test]
fn lerobot_with_joints_only() {
    for set in ["lerobot_v21", "lerobot_v30"] {
        let folder = folder(&[&format!("tests/fixtures/init/{set}")]);
        let (channels, scene) = proposed(folder.path(), set);
        // Version 2 ended before LeRobot wrote degrees by default.
        assert_eq!(channels.contains(", norm: percent"), set == "lerobot_v21", "{channels}");
        insta::assert_snapshot!("lerobot_joints", format!("{}{scene}", channels.replace(", norm: percent", "")));
    }
}

#[test]
fn joints_of_lerobot_are_in_degrees_beyond_100_and_in_percent_where_they_stop_at_100() {
    let names = ["shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll", "gripper"];
    let log = |most: f64| {
        robots(&names, move |at, time| match at {
            2 => (1.2 * most * time.sin()).clamp(-most, most),
            5 => 50.0 + 40.0 * time.cos(),
            _ => 30.0 * (time + at as f64).sin(),
        })
    };
    assert!(log(100.0).contains("norm: percent") && log(100.0).contains("stops at exactly 100"), "{}", log(100.0));
    assert!(!log(104.0).contains("norm:") && log(104.0).contains("a joint is beyond 100"), "{}", log(104.0));
    assert!(log(90.0).contains("since version 0.4.4; with `norm: percent`"), "{}", log(90.0));
}

#[test]
fn a_bag_with_joints_wrench_and_poses() {
    let folder = folder(&["tests/fixtures/init/bag.mcap"]);
    let (channels, scene) = proposed(folder.path(), "bag.mcap");
    insta::assert_snapshot!("bag", format!("{channels}{scene}"));
    assert_pick_and_place(folder.path(), "bag.mcap", 1.0);
}

#[test]
fn ur_and_franka_tables() {
    let folder = folder(&["tests/fixtures/init/ur_rtde.csv", "tests/fixtures/init/franka.csv"]);
    for log in ["ur_rtde", "franka"] {
        let (channels, scene) = proposed(folder.path(), &format!("{log}.csv"));
        insta::assert_snapshot!(log, format!("{channels}{scene}"));
        let initialized = teachtree_in(folder.path(), &["init", &format!("{log}.csv"), "--yes"]);
        assert!(initialized.status.success(), "{}", all_said(&initialized));
        assert_eq!(found(folder.path(), &format!("{log}.csv")).0, ["pick_and_place"], "{log}");
    }
}

#[test]
fn motion_capture_with_y_up() {
    let folder = folder(&["tests/fixtures/init/optitrack.csv"]);
    let (channels, scene) = proposed(folder.path(), "optitrack.csv");
    insta::assert_snapshot!("optitrack", format!("{channels}{scene}"));
}

#[test]
fn qualisys_markers_of_a_hand() {
    let folder = folder(&["demos/dfki_hand/recording_excerpt.tsv"]);
    let (channels, scene) = proposed(folder.path(), "recording_excerpt.tsv");
    insta::assert_snapshot!("qualisys", format!("{channels}{scene}"));
}

#[test]
fn diffusion_policy() {
    let folder = folder(&["tests/fixtures/init/replay.zarr"]);
    let (channels, scene) = proposed(folder.path(), "replay.zarr");
    insta::assert_snapshot!("diffusion_policy", format!("{channels}{scene}"));
}

/// A pusher comes from 0.3 m behind a block, pushes it by 0.12 m from 3 s to 5 s, and goes back.
#[test]
fn a_block_that_is_pushed_in_a_plane_gets_a_push() {
    let block = |time: f64| 0.3 + 0.06 * (time - 3.0).clamp(0.0, 2.0);
    let away = |time: f64| 0.1 * (3.0 - time).max(0.0) + 0.1 * (time - 5.0).max(0.0);
    let mut text = String::from("time,pusher_x,pusher_y,block_x,block_y,block_theta\n");
    for row in 0..=400 {
        let time = f64::from(row) * 0.02;
        let at = block(time);
        text.push_str(&format!("{time:.2},{:.5},0.2,{at:.5},0.2,{:.4}\n", at - 0.06 - away(time), 0.4 + at));
    }
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("push.csv"), text).unwrap();
    let output = teachtree_in(folder.path(), &["init", "push.csv", "--yes"]);
    assert!(output.status.success(), "{}", all_said(&output));
    let (tasks, segments) = found(folder.path(), "push.csv");
    assert_eq!(tasks, ["push"], "{segments:?}");
    let (_, start_s, end_s) = segments.iter().find(|(name, ..)| name == "Push").unwrap();
    assert!((start_s - 3.0).abs() < 0.15 && (end_s - 5.0).abs() < 0.15, "{segments:?}");
}

/// The robots of the binding that `init` writes for a table of joints, and the comments behind them.
fn robots(names: &[&str], joint: impl Fn(usize, f64) -> f64) -> String {
    let folder = tempfile::tempdir().unwrap();
    let mut text = format!("time,{}\n", names.join(","));
    for row in 0..200 {
        let time = f64::from(row) / 50.0;
        let values: Vec<String> = (0..names.len()).map(|at| format!("{:.5}", joint(at, time))).collect();
        text.push_str(&format!("{time},{}\n", values.join(",")));
    }
    fs::write(folder.path().join("arm.csv"), text).unwrap();
    let output = teachtree_in(folder.path(), &["init", "arm.csv", "--yes"]);
    assert_ne!(output.status.code(), Some(2), "{}", all_said(&output));
    let binding = fs::read_to_string(folder.path().join("arm.binding.yaml")).unwrap();
    let lines = binding.lines().skip_while(|line| !line.trim_start_matches("# ").starts_with("robots:"));
    let lines: Vec<&str> = lines.take_while(|line| !line.is_empty()).collect();
    if lines.first().is_some_and(|line| line.starts_with("robots:")) {
        assert!(output.status.success(), "{binding}\n{}", all_said(&output));
    }
    lines.join("\n")
}

#[test]
fn joints_of_known_arms() {
    let wave = |middle: f64, time: f64| middle + 0.3 * (time + middle).sin();
    let panda = ["q_0", "q_1", "q_2", "q_3", "q_4", "q_5", "q_6", "gripper_width"];
    let middles = [0.0, 0.3, 0.0, -2.0, 0.0, 2.0, 0.8];
    let joint = |at: usize, time: f64| middles.get(at).map_or(0.04 - 0.03 * (time - 2.0).tanh(), |it| wave(*it, time));
    insta::assert_snapshot!("joints_of_a_panda", robots(&panda, joint));
    // The fourth joint of a Panda is never positive.
    assert_eq!(robots(&panda, |at, time| if at == 3 { 0.2 } else { joint(at, time) }), "");
    let so101 = ["shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll", "gripper"];
    let percent =
        |at: usize, time: f64| if at == 5 { 50.0 + 40.0 * time.cos() } else { 60.0 * (time + at as f64).sin() };
    insta::assert_snapshot!("joints_of_an_so101", robots(&so101, percent));
    insta::assert_snapshot!("ticks_of_an_so101", robots(&so101, |at, time| 2048.0 + 10.0 * percent(at, time)));
}

#[test]
fn the_recordings_of_a_file_are_counted_with_the_command_for_all() {
    let folder = folder(&["tests/fixtures/init/robomimic.hdf5"]);
    let output = teachtree_in(folder.path(), &["init", "robomimic.hdf5", "--yes"]);
    let all = "teachtree analyze 'robomimic.hdf5#*'    # all 2 recordings of the file";
    assert!(said(&output).contains(all), "{}", all_said(&output));
    assert!(teachtree_in(folder.path(), &["analyze", "robomimic.hdf5#*"]).status.success());
    let output = teachtree_in(folder.path(), &["init", "robomimic.hdf5#demo_1", "--yes", "--force"]);
    assert!(!said(&output).contains("#*"), "{}", all_said(&output));
}

/// Neither the position of the hand nor that of an object shows that a gripper carries something.
#[test]
fn a_gripper_of_unknown_position_misses_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let width = |time: f64| if (3.0..8.0).contains(&time) { 0.03 } else { 0.08 };
    let row = |row: u32| {
        let time = f64::from(row) / 50.0;
        format!("{time:.2},{:.4},{:.4}\n", (time / 3.0).sin(), width(time))
    };
    let text: String = (0..600).map(row).collect();
    fs::write(folder.path().join("joints.csv"), format!("time,j1,gripper_width\n{text}")).unwrap();
    let output = teachtree_in(folder.path(), &["init", "joints.csv", "--yes"]);
    assert!(said(&output).contains("Grasp object"), "{}", all_said(&output));
    assert!(!said(&output).contains("Miss "), "{}", all_said(&output));
    // The default rules follow the binding.
    let project = fs::read_to_string(folder.path().join("teachtree.yaml")).unwrap();
    assert!(!project.contains("rules:"), "{project}");
}

#[test]
fn a_log_without_anything_known_gets_a_binding_to_fill_in() {
    let folder = tempfile::tempdir().unwrap();
    let names = ["alpha", "beta", "gamma", "joint_1", "joint_2", "joint_3", "joint_4"];
    let mut text = format!("time,{},note\n", names.join(","));
    for row in 0..200_u32 {
        let time = f64::from(row) * 0.02;
        let values: Vec<String> = (1..=names.len()).map(|at| format!("{:.4}", (time * at as f64).sin())).collect();
        text.push_str(&format!("{time:.2},{},good\n", values.join(",")));
    }
    fs::write(folder.path().join("odd.csv"), text).unwrap();
    let output = teachtree_in(folder.path(), &["init", "odd.csv", "--yes"]);
    assert_eq!(output.status.code(), Some(1), "{}", all_said(&output));
    insta::assert_snapshot!("nothing_recognized", all_said(&output));
    // Each command that it names does its work, or names the line to fill in.
    let inspected = teachtree_in(folder.path(), &["inspect", "odd.csv"]);
    assert!(inspected.status.success(), "{}", all_said(&inspected));
    for command in [["check", "odd.binding.yaml"], ["analyze", "odd.csv"]] {
        let refused = teachtree_in(folder.path(), &command);
        assert_eq!(refused.status.code(), Some(2), "{}", all_said(&refused));
        assert!(complained(&refused).contains("`right.tcp.position` is not filled in"), "{}", complained(&refused));
    }
    let binding = folder.path().join("odd.binding.yaml");
    let blank = fs::read_to_string(&binding).unwrap();
    let filled = blank.replacen("[\"???\", \"???\", \"???\"]", "[alpha, beta, gamma]", 1);
    let filled: Vec<&str> = filled.lines().filter(|line| line.starts_with('#') || !line.contains("???")).collect();
    fs::write(&binding, filled.join("\n")).unwrap();
    let analyzed = teachtree_in(folder.path(), &["analyze", "odd.csv"]);
    assert!(analyzed.status.success(), "{}", all_said(&analyzed));
}

#[test]
fn a_log_of_texts_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("list.csv"), "operator,task\nAnn,pick\nBob,place\n").unwrap();
    let output = teachtree_in(folder.path(), &["init", "list.csv", "--yes"]);
    assert_eq!(output.status.code(), Some(2), "{}", all_said(&output));
    assert!(complained(&output).contains("found only texts (`operator`, `task`)"), "{}", complained(&output));
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
}
