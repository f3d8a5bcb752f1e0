//! `audit`: planted faults are found, each by its kind, and the good recordings are not.

use crate::program::{all_said, complained, said, teachtree_in};
use crate::sets::with_set;
use serde_json::Value;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A hand that grasps the box, lets go of it where it is, and then does what it was to do.
const FAILS: &str = "
name: the first grasp fails
variation: human
measured: {decimals: 6, contact_flags: true}
occasions: {touch: top}
grips:
  pinch: {object: box, contacts: {thumb: [0 mm, -30 mm, 12 mm], index: [-14 mm, 30 mm, 12 mm], middle: [14 mm, 30 mm, 12 mm]}}
  top: {object: box, contacts: {index: [0 mm, 0 mm, 35 mm]}}
hands:
  right:
    start: {grip: pinch, opened: 25 mm, offset: [-60 mm, -150 mm, 250 mm]}
    steps:
      - {phase: approach, reach: {grip: pinch, opened: 12 mm, speed: 180 mm/s}}
      - {phase: grasp, close: {force: 1.2 N, speed: 60 mm/s}}
      - {hold: 600 ms}
      - {phase: lose it, open: {by: 25 mm, speed: 120 mm/s}}
      - {phase: go up, reach: {grip: pinch, opened: 25 mm, offset: [0 mm, 0 mm, 150 mm]}}
      - {phase: approach again, reach: {grip: pinch, opened: 12 mm, speed: 180 mm/s}}
      - {phase: grasp again, close: {force: 1.2 N, speed: 60 mm/s}}
      - {hold: 200 ms}
      - {phase: lift, carry: {along: [0, 0, 1], distance: 25 mm, speed: 60 mm/s}}
      - {phase: bring, bring: {to: [110 mm, 40 mm, 75 mm], speed: 250 mm/s}}
      - {phase: put down, carry: {along: [0, 0, -1], distance: 80 mm, speed: 60 mm/s, until: {contact: base}}}
      - {hold: 250 ms}
      - {phase: let go, open: {by: 25 mm, speed: 120 mm/s}}
      - {reach: {grip: pinch, opened: 25 mm, offset: [0 mm, 0 mm, 60 mm]}}
";

fn run(folder: &Path, args: &[&str]) -> String {
    let output = teachtree_in(folder, args);
    assert!(output.status.success(), "{args:?}: {}", all_said(&output));
    said(&output)
}

/// Writes rows of a recording as another one, with stamps from 0 on.
fn put(folder: &Path, name: &str, header: &str, rows: &[&str]) {
    let rows = rows.iter().enumerate().map(|(at, row)| {
        let (_, cells) = row.split_once(',').unwrap();
        format!("{:.3},{cells}\n", at as f64 / 1000.0)
    });
    std::fs::write(folder.join(format!("{name}.csv")), format!("{header}\n{}", rows.collect::<String>())).unwrap();
    std::fs::copy(folder.join("good_0001.scene.yaml"), folder.join(format!("{name}.scene.yaml"))).unwrap();
}

fn kinds(recording: &Value) -> Vec<&str> {
    recording["findings"].as_array().unwrap().iter().map(|finding| finding["kind"].as_str().unwrap()).collect()
}

#[test]
fn planted_faults_are_found_and_good_recordings_are_not() {
    let folder = tempfile::tempdir().unwrap();
    let set = folder.path().join("set");
    run(folder.path(), &["teach", "pick_and_place", "pick_and_place", "--seeds", "1..6", "-o", "set"]);
    for entry in std::fs::read_dir(&set).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap().replace("pick_and_place", "good");
        std::fs::rename(&path, set.join(name)).unwrap();
    }
    let text = std::fs::read_to_string(set.join("good_0001.csv")).unwrap();
    let (header, rows) = text.split_once('\n').unwrap();
    let rows: Vec<&str> = rows.lines().collect();
    // Far above the box, and with the box in the hand.
    let (early, middle) = (rows.len() / 8, rows.len() * 6 / 10);
    put(&set, "begins_late", header, &rows[middle..]);
    put(&set, "ends_early", header, &rows[..middle]);
    put(&set, "nothing", header, &rows[..early]);
    put(&set, "pauses", header, &[&rows[..early], &vec![rows[early]; 5000], &rows[early..]].concat());
    std::fs::write(folder.path().join("fails.operator.yaml"), FAILS).unwrap();
    run(folder.path(), &["teach", "pick_and_place", "fails.operator.yaml", "-o", "set/fails.csv", "--seed", "1"]);
    run(folder.path(), &["teach", "push_and_trace", "push_and_trace", "-o", "set/another.csv", "--seed", "1"]);

    let args = ["audit", "set", "--format", "json", "--keep", "keep.json", "--page", "page.html"];
    let text = run(folder.path(), &args);
    let document: Value = serde_json::from_str(&text).unwrap();
    let recordings = document["recordings"].as_array().unwrap();
    assert_eq!(recordings.len(), 12);
    let mut clean: Vec<String> = Vec::new();
    for recording in recordings {
        let (log, kinds) = (recording["log"].as_str().unwrap(), kinds(recording));
        let has = |kind: &str| assert!(kinds.contains(&kind), "{log} lacks {kind}: {recording}");
        match log.strip_prefix("set/").unwrap().trim_end_matches(".csv") {
            "begins_late" | "ends_early" => has("cut_off"),
            "nothing" | "pauses" => has("idle"),
            "fails" => has("failed_grasp"),
            "another" => has("lacks_task"),
            // A simulated operator that loses the box and takes it up again mends the failure; another second task is unusual.
            _ if recording["tasks"].as_array().unwrap().len() > 1
                && !recording["tasks"].to_string().contains("dropped") =>
            {
                has("unlike")
            }
            _ => {
                assert!(kinds.is_empty(), "{log}: {recording}");
                clean.push(log.into());
            }
        }
        if kinds.contains(&"failed_grasp") {
            assert!(log.ends_with("fails.csv"), "{recording}");
        }
    }
    assert!(clean.len() >= 4, "{clean:?}");
    let keep: Vec<String> =
        serde_json::from_str(&std::fs::read_to_string(folder.path().join("keep.json")).unwrap()).unwrap();
    assert_eq!(keep, clean);
    let page = std::fs::read_to_string(folder.path().join("page.html")).unwrap();
    assert!(recordings.iter().all(|recording| page.contains(recording["log"].as_str().unwrap())));
    assert!(!page.contains("<script") && !page.contains("http"), "the page stands alone");
    // The same on one core, and as a table.
    assert_eq!(run(folder.path(), &["audit", "set", "--format", "json", "--jobs", "1"]), text);
    let table = run(folder.path(), &["audit", "set", "--format", "csv"]);
    let findings: usize = recordings.iter().map(|recording| kinds(recording).len().max(1)).sum();
    assert_eq!(table.lines().count(), findings + 1);
    let status = |args: &[&str]| teachtree_in(folder.path(), &[&["audit", "set"], args].concat()).status.code();
    assert_eq!(status(&["--fail-on", "cut_off"]), Some(1));
    assert_eq!(status(&["--fail-on", "out_of_order"]), Some(0));
    // With all of them allowed all are good.
    let all = "idle,cut_off,failed_grasp,lacks_task,out_of_order,unlike";
    let allowed = run(folder.path(), &["audit", "set", "--allow", all]);
    assert!(allowed.contains("12 of 12 recordings are good"), "{allowed}");
    // A recording that cannot be read is none of the others' fault.
    std::fs::write(set.join("broken.csv"), "time [s],right.thumb.position.x [m]\n0,x\n").unwrap();
    std::fs::copy(set.join("fails.scene.yaml"), set.join("broken.scene.yaml")).unwrap();
    let output = teachtree_in(folder.path(), &["audit", "set", "--format", "json"]);
    assert_eq!(output.status.code(), Some(3));
    let document: Value = serde_json::from_str(&said(&output)).unwrap();
    assert!(
        document["recordings"].as_array().unwrap() == recordings && document["failed"][0]["log"] == "set/broken.csv"
    );
}

/// A hand that brings two boxes, one after the other.
fn two_boxes(order: [&str; 2]) -> String {
    let mut text = String::from(
        "name: two boxes\nmeasured: {decimals: 6, contact_flags: true}\noccasions: {without: []}\ngrips:\n",
    );
    for side in ["left", "right"] {
        text += &format!(
            "  {side}: {{object: {side}_box, contacts: {{thumb: [0 mm, -30 mm, 12 mm], index: [-14 mm, 30 mm, 12 mm], middle: [14 mm, 30 mm, 12 mm]}}}}\n"
        );
    }
    text += "hands:\n  right:\n    start: {grip: right, opened: 25 mm, offset: [60 mm, -150 mm, 250 mm]}\n    steps:\n";
    for side in order {
        let x = if side == "left" { -110 } else { 110 };
        for step in [
            format!("reach: {{grip: {side}, opened: 20 mm, offset: [0 mm, 0 mm, 110 mm]}}"),
            format!("reach: {{grip: {side}, opened: 12 mm, speed: 180 mm/s}}"),
            "close: {force: 1.2 N, speed: 60 mm/s}".into(),
            "hold: 200 ms".into(),
            "carry: {along: [0, 0, 1], distance: 25 mm, speed: 60 mm/s}".into(),
            format!("bring: {{to: [{x} mm, 100 mm, 75 mm], speed: 250 mm/s}}"),
            "carry: {along: [0, 0, -1], distance: 80 mm, speed: 60 mm/s, until: {contact: base}}".into(),
            "hold: 250 ms".into(),
            "open: {by: 25 mm, speed: 120 mm/s}".into(),
            format!("reach: {{grip: {side}, opened: 25 mm, offset: [0 mm, 0 mm, 120 mm]}}"),
        ] {
            text += &format!("      - {{{step}}}\n");
        }
    }
    text
}

#[test]
fn steps_in_another_order_are_found() {
    let folder = tempfile::tempdir().unwrap();
    let scene = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/independent.yaml")).unwrap();
    let one_hand: String =
        scene.lines().filter(|line| !line.starts_with("  left: {fingers")).map(|line| format!("{line}\n")).collect();
    assert_ne!(scene, one_hand);
    std::fs::write(folder.path().join("boxes.yaml"), one_hand).unwrap();
    std::fs::write(folder.path().join("usual.operator.yaml"), two_boxes(["left", "right"])).unwrap();
    std::fs::write(folder.path().join("other.operator.yaml"), two_boxes(["right", "left"])).unwrap();
    std::fs::create_dir(folder.path().join("set")).unwrap();
    for seed in 1..=5 {
        let (operator, name) = if seed == 3 { ("other", "other") } else { ("usual", "usual") };
        let (operator, log) = (format!("{operator}.operator.yaml"), format!("set/{name}_{seed}.csv"));
        run(folder.path(), &["teach", "boxes.yaml", &operator, "-o", &log, "--seed", &seed.to_string()]);
    }
    let document: Value = serde_json::from_str(&run(folder.path(), &["audit", "set", "--format", "json"])).unwrap();
    for recording in document["recordings"].as_array().unwrap() {
        let expected = if recording["log"] == "set/other_3.csv" { vec!["out_of_order"] } else { Vec::new() };
        assert_eq!(kinds(recording), expected, "{recording}");
    }
    assert!(document["usual"][0].as_str().unwrap().starts_with("4 of 5 recordings have pick_and_place left_box"));
}

fn demos() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("demos/robosuite")
}

#[test]
fn recordings_of_robots_have_the_faults_that_they_have() {
    let audit = |name: &str, binding: &str| -> Vec<String> {
        let (log, binding) = (format!("{name}.csv"), format!("{binding}.binding.yaml"));
        let text = run(&demos(), &["audit", &log, "--binding", &binding, "--format", "json"]);
        let document: Value = serde_json::from_str(&text).unwrap();
        kinds(&document["recordings"][0]).into_iter().map(str::to_string).collect()
    };
    for (name, binding) in [
        ("BaxterPegInHole_demo_1", "baxter_peg_in_hole"),
        ("SawyerNutAssembly_demo_1", "sawyer_nut_assembly"),
        ("SawyerPickPlace_demo_1", "sawyer_pick_place"),
        ("SawyerStack_demo_1", "sawyer_stack"),
        ("nut_assembly_panda_demo_1", "panda_nut_assembly"),
        ("stack_panda_demo_1", "panda_stack"),
        ("wipe_panda_demo_1", "wipe"),
    ] {
        assert_eq!(audit(name, binding), Vec::<String>::new(), "{name}");
    }
    // The left gripper lets go of the pot, which stands, and grasps it again.
    assert_eq!(audit("BaxterLift_demo_1", "baxter_lift"), ["failed_grasp"]);
    // They end with the cube in the air.
    assert_eq!(audit("SawyerLift_demo_1", "sawyer_lift"), ["cut_off"]);
    assert_eq!(audit("lift_demo_1", "panda_lift"), ["cut_off"]);
}

#[test]
fn the_good_recordings_of_a_file_are_listed_in_a_copy_of_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    std::fs::copy(demos().join("lift.hdf5"), path("lift.hdf5")).unwrap();
    std::fs::copy(demos().join("lift_hdf5.binding.yaml"), path("b.yaml")).unwrap();
    let before = std::fs::read(path("lift.hdf5")).unwrap();
    let audit =
        |more: &[&str]| teachtree_in(folder.path(), &[&["audit", "lift.hdf5", "--binding", "b.yaml"], more].concat());
    // One recording waits for seconds; both begin with a closed gripper, which is not a failed grasp, and end with the cube in the air.
    let output = audit(&["--allow", "cut_off", "--mask", "masked.hdf5"]);
    assert!(output.status.success(), "{}", all_said(&output));
    assert!(
        said(&output).contains("1 of 2 recordings are good") && !said(&output).contains("failed grasp"),
        "{}",
        said(&output)
    );
    assert_eq!(std::fs::read(path("lift.hdf5")).unwrap(), before);
    let of = |file: &str| {
        run(folder.path(), &["analyze", &format!("{file}#demo_3"), "--binding", "b.yaml", "--format", "csv"])
    };
    assert_eq!(of("masked.hdf5"), of("lift.hdf5").replace("lift.hdf5", "masked.hdf5"));
    for (args, message) in [
        (&["--mask", "masked.hdf5"][..], "exists already"),
        (&["lift.hdf5#demo_1", "--mask", "other.hdf5"][..], "a mask needs one HDF5 file"),
        (&["--keep", "lift.hdf5"][..], "is an input of this command"),
        (&["--rest", "0"][..], "expected a time in s greater than 0"),
    ] {
        let output = audit(args);
        assert!(output.status.code() == Some(2) && complained(&output).contains(message), "{}", all_said(&output));
    }
    let python = std::env::var("TEACHTREE_PYTHON").unwrap_or_else(|_| "python3".into());
    let read = "import h5py; file = h5py.File('masked.hdf5'); print(list(file['mask/teachtree_audit'].asstr()), 'teachtree_audit' in file.attrs)";
    let run = |code: &str| Command::new(&python).args(["-c", code]).current_dir(folder.path()).output();
    if !run("import h5py").is_ok_and(|output| output.status.success()) {
        let _ = writeln!(std::io::stderr(), "skipped: Python with `h5py` is not installed");
        return;
    }
    let output = run(read).unwrap();
    assert_eq!(
        String::from_utf8_lossy(&output.stdout).trim(),
        "['demo_1'] True",
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
}

#[test]
fn the_good_episodes_of_a_set_are_numbers() {
    let folder = with_set();
    let output = teachtree_in(folder.path(), &["audit", "set", "--binding", "b.yaml", "--keep", "keep.json"]);
    assert!(output.status.success(), "{}", all_said(&output));
    // The second one ends, and the third one begins, with the nut in the hand.
    assert_eq!(std::fs::read_to_string(folder.path().join("keep.json")).unwrap(), "[0]\n");
    let args = ["audit", "set", "--binding", "b.yaml", "--keep", "keep.txt", "--allow", "cut_off,lacks_task"];
    assert!(teachtree_in(folder.path(), &args).status.success());
    assert_eq!(std::fs::read_to_string(folder.path().join("keep.txt")).unwrap(), "0\n1\n2\n");
}

/// A gripper that carries a cube, in other columns than those of channels: the tool point is in mm, a row has the stamp of
/// the one before, 0.4 s are missing, and the opening has a spike.
fn faulty_log() -> String {
    let mut text = String::from("time,x,y,z,w,cx,cy,cz\n");
    for row in 0..400_u32 {
        if (120..128).contains(&row) {
            continue;
        }
        let time = f64::from(if row == 200 { 199 } else { row }) * 0.05;
        let held = (5.0..15.0).contains(&time);
        let along = 0.4 * ((time - 5.0) / 10.0).clamp(0.0, 1.0);
        let height = if held { 0.15 - 0.1 * ((time - 10.0) / 5.0).abs() } else { 0.3 };
        let cube = if held { height } else { 0.05 };
        let opening =
            if row == 40 { 9000.0 } else { f64::from(u8::from(!held)) * 60.0 + 20.0 + 0.1 * (7.7 * time).sin() };
        text += &format!("{time},{},0,{},{opening},{along},0,{cube}\n", along * 1e3, height * 1e3);
    }
    text
}

const FAULTY: &str = "channels:
  right.tcp.position: [x, y, z]
  right.gripper.closed: w < 50
  cube.position: [cx, cy, cz]
scene:
  bodies:
    cube: {role: object, mass: 50 g, parts: [{box: [40 mm, 40 mm, 40 mm]}]}
    table: {role: support, position: [0 mm, 0 mm, 20 mm], parts: [{box: [2 m, 2 m, 20 mm]}]}
";

/// With a binding, an audit has the findings that it has without one, and the issues that `analyze` prints.
#[test]
fn an_audit_with_a_binding_finds_what_one_without_finds_and_what_analyze_prints() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("log.csv"), faulty_log()).unwrap();
    std::fs::write(folder.path().join("b.yaml"), FAULTY).unwrap();
    let audit = |more: &[&str]| -> Value {
        let args = [&["audit", "log.csv", "--format", "json"], more].concat();
        serde_json::from_str::<Value>(&run(folder.path(), &args)).unwrap()["recordings"][0].clone()
    };
    let (without, with) = (audit(&[]), audit(&["--binding", "b.yaml"]));
    let of_columns = |recording: &Value| -> Vec<Value> {
        let findings = recording["findings"].as_array().unwrap().iter();
        findings.filter(|it| it["column"].is_string() && it["kind"] != "setup").cloned().collect()
    };
    assert_eq!(of_columns(&with), of_columns(&without));
    let found = kinds(&with);
    for kind in ["setup", "missing_frames", "equal_stamps", "spike"] {
        assert!(found.contains(&kind), "{kind}: {with:#}");
    }
    let analyzed = run(folder.path(), &["analyze", "log.csv", "--binding", "b.yaml", "--format", "json"]);
    let analyzed: Value = serde_json::from_str(&analyzed).unwrap();
    assert_eq!(with["issues"], analyzed["issues"]);
    let setup = with["findings"].as_array().unwrap().iter().find(|it| it["kind"] == "setup").unwrap();
    let message = setup["message"].as_str().unwrap();
    assert!(message.starts_with("implausible_unit: ") && message.contains("` [mm]`"), "{message}");
    assert_eq!(setup["column"], "right.tcp.position");
    // People read the same, and other issues below the table.
    let output = teachtree_in(folder.path(), &["audit", "log.csv", "--binding", "b.yaml"]);
    assert!(said(&output).contains("wrong setup: right.tcp.position: implausible_unit: "), "{}", said(&output));
    assert!(complained(&output).contains("issues, which `--format json` lists"), "{}", complained(&output));
    assert_eq!(
        teachtree_in(folder.path(), &["audit", "log.csv", "--binding", "b.yaml", "--fail-on", "setup"]).status.code(),
        Some(1)
    );
    // Without the mistakes nothing is wrong with the setup.
    let mended = FAULTY.replace("[x, y, z]", "[\"x [mm]\", \"y [mm]\", \"z [mm]\"]");
    std::fs::write(folder.path().join("b.yaml"), mended).unwrap();
    assert!(!kinds(&audit(&["--binding", "b.yaml"])).contains(&"setup"));
}
