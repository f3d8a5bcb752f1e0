//! Bad input on the command line: one message with the place, what was found, what was wanted and what to do; exit status 2, and nothing is written.

use crate::program::{complained, demonstrate, said, teachtree};
use serde_json::Value;
use std::path::Path;

const LOG: &str = "tests/fixtures/logs/whole.csv";

fn shipped(file: &str) -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(file)).unwrap()
}

/// A file of this text in a folder.
fn file(folder: &tempfile::TempDir, name: &str, text: &str) -> String {
    let path = folder.path().join(name);
    std::fs::write(&path, text).unwrap();
    path.to_str().unwrap().to_string()
}

/// What is said when it refuses.
fn refused(args: &[&str]) -> String {
    let output = teachtree(args);
    let printed = complained(&output);
    assert_eq!(output.status.code(), Some(2), "{args:?}: {}{printed}", said(&output));
    assert!(printed.starts_with("error: ") && printed.lines().all(|line| line.len() < 250), "{args:?}: {printed}");
    printed
}

/// A scene that cannot be simulated is reported at the line of the fault, by all commands that simulate it.
#[test]
fn sizes_and_masses_that_nothing_has_are_refused_at_their_line() {
    let folder = tempfile::tempdir().unwrap();
    let (out, sound) = (folder.path().join("log.csv"), shipped("scenes/peg_in_hole.yaml"));
    for (from, to, wanted) in [
        (
            "[15 mm, 80 mm]",
            "[1e-9 mm, 80 mm]",
            "scene.yaml:6:121: bodies.peg.parts.0: has a radius of 1e-12 m, expected 0.1 mm to 10 m",
        ),
        (
            "[15 mm, 80 mm]",
            "[15 mm, 1e300 m]",
            "scene.yaml:6:121: bodies.peg.parts.0: has a height of 1e300 m, expected 0.1 mm to 10 m",
        ),
        (
            "{box: [30 mm, 40 mm, 40 mm], at: [21.5668 mm, 21.",
            "{box: [30 mm, 11 m, 40 mm], at: [21.5668 mm, 21.",
            "scene.yaml:17:5: bodies.holder.parts.1: has an edge of 11 m",
        ),
        ("mass: 40 g", "mass: 1e300 kg", "scene.yaml:6:29: bodies.peg.mass: found 1e300 kg, expected 0.1 g to 1000 kg"),
        (
            "mass: 40 g, ",
            "",
            "scene.yaml:6:8: bodies.peg: is an object without mass, expected one such as `mass: 50 g`",
        ),
        (
            "mass: 40 g, friction: 0.2",
            "mass: 40 g, friction: 55",
            "scene.yaml:6:45: bodies.peg.friction: found 55, expected 0 to 10",
        ),
        (
            "position: [-90 mm",
            "position: [-1e300 m",
            "scene.yaml:6:60: bodies.peg.position: found -1e300 m, expected at most 1000 m",
        ),
        (
            "tip_radius: 10 mm",
            "tip_radius: 10 m",
            "scene.yaml:25:56: hands.right.tip_radius: found 10 m, expected 0.1 mm to 100 mm",
        ),
    ] {
        let scene = file(&folder, "scene.yaml", &sound.replacen(from, to, 1));
        let printed = refused(&["teach", &scene, "peg_in_hole", "-o", out.to_str().unwrap()]);
        assert!(printed.contains(wanted), "{printed}, expected {wanted}");
        assert!(!out.exists());
    }
}

/// A scene inside a binding is checked like one in a file, and reported at its line in the binding.
#[test]
fn a_scene_in_a_binding_is_checked() {
    let folder = tempfile::tempdir().unwrap();
    let scene: String = shipped("tests/fixtures/logs/box.yaml").lines().map(|line| format!("  {line}\n")).collect();
    for (from, to, wanted) in [
        ("[thumb, index]", "[thumb, thumb]", "b.yaml:7:22: scene.hands.right.fingers: found thumb twice"),
        (
            "[0 m, 0 m, -10 mm]",
            "[0 m, 1e9 m, 0 m]",
            "b.yaml:5:37: scene.bodies.base.position: found 1000000000 m, expected at most 1000 m",
        ),
        ("mass: 50 g", "mass: 0 g", "b.yaml:4:11: scene.bodies.cube: found 0 kg, expected a mass (kg) above 0"),
    ] {
        let text = format!("scene:\n{scene}");
        assert!(text.contains(from));
        let binding = file(&folder, "b.yaml", &text.replacen(from, to, 1));
        let printed = refused(&["analyze", LOG, "--binding", &binding]);
        assert!(printed.contains(wanted), "{printed}, expected {wanted}");
    }
    let binding = file(&folder, "b.yaml", &format!("scene:\n{scene}"));
    assert!(teachtree(&["analyze", LOG, "--binding", &binding]).status.success());
}

/// A text may say much in few words: a list of which another one has many aliases. That is refused before it is written out.
#[test]
fn aliases_that_say_too_much_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let text = format!("zzz: &a [{}1]\nb: [{}*a]\n", "1, ".repeat(100_000), "*a, ".repeat(50_000));
    let scene = file(&folder, "scene.yaml", &text);
    let printed = refused(&["teach", &scene, "stamp", "-o", folder.path().join("a.csv").to_str().unwrap()]);
    assert!(printed.contains("the text has more than 1048576 values when its aliases are written out"), "{printed}");
}

/// A JSON file that is empty or was cut has no column to look at.
#[test]
fn json_that_ends_too_early_is_reported_without_a_column() {
    let folder = tempfile::tempdir().unwrap();
    for (text, wanted) in [
        ("", "commands.json: the file is empty"),
        (" \n", "commands.json: the file is empty"),
        ("{\"schema\": \"teachtree.commands/1\",\n \"tasks\": [", "commands.json:2: ends in the middle of a list"),
        ("{\"schema\":\n", "commands.json:2: ends in the middle: a value is missing"),
        ("{\"schema\": 5}", "commands.json:1:12: found `5`, expected a text"),
        ("{\"schema\" 5}", "commands.json:1:11: not valid JSON: expected `:`"),
    ] {
        let commands = file(&folder, "commands.json", text);
        let printed = refused(&["simulate", &commands, "--scene", "slide", "-o", "none.csv"]);
        assert!(printed.contains(wanted), "{printed}, expected {wanted}");
        assert!(printed.contains("help: commands are the JSON file that `teachtree retarget` writes"), "{printed}");
    }
}

/// Integers in nanoseconds, microseconds and milliseconds are reported apart, and the advice does.
#[test]
fn stamps_in_another_unit_are_reported_with_the_unit_that_does() {
    let folder = tempfile::tempdir().unwrap();
    let log = shipped(LOG);
    let stamped = |heading: &str, per_s: f64, from: f64| {
        let rows = log.lines().skip(1).map(|line| {
            let (time, rest) = line.split_once(',').unwrap();
            format!("{:.0},{rest}\n", from + time.parse::<f64>().unwrap() * per_s)
        });
        log.lines().take(1).map(|line| line.replace("time [s]", heading) + "\n").chain(rows).collect::<String>()
    };
    for (unit, per_s) in [("ms", 1e3), ("us", 1e6), ("ns", 1e9)] {
        for from in [0.0, 1.7e9 * per_s] {
            let path = file(&folder, "log.csv", &stamped("time", per_s, from));
            let printed = refused(&["analyze", &path, "--scene", "tests/fixtures/logs/box.yaml"]);
            assert!(printed.contains(&format!("if the stamps are in {unit}, write `time [{unit}]`")), "{printed}");
            let path = file(&folder, "log.csv", &stamped(&format!("time [{unit}]"), per_s, from));
            let output = teachtree(&["analyze", &path, "--scene", "tests/fixtures/logs/box.yaml"]);
            assert!(output.status.success(), "{unit}: {}", complained(&output));
        }
    }
}

/// What the message about a gap says closes it.
#[test]
fn the_advice_about_a_gap_bridges_it() {
    let folder = tempfile::tempdir().unwrap();
    let gap = "tests/fixtures/logs/gap.csv";
    let gaps = |more: &[&str]| {
        let output = teachtree(
            &[&["analyze", gap, "--scene", "tests/fixtures/logs/box.yaml", "--format", "json"], more].concat(),
        );
        let printed: Value = serde_json::from_str(&said(&output)).unwrap_or_else(|_| panic!("{}", complained(&output)));
        let issues = printed["issues"].as_array().unwrap().clone();
        let of_gaps = issues.into_iter().filter(|issue| issue["kind"] == "gap");
        of_gaps.map(|issue| issue["message"].as_str().unwrap().to_string()).collect::<Vec<_>>()
    };
    let printed = gaps(&[]);
    assert_eq!(printed.len(), 1, "{printed:?}");
    let settings: Vec<&str> = printed[0].split('`').skip(1).step_by(2).collect();
    assert!(
        matches!(settings[..], [resample, bridge] if resample.starts_with("resample: ") && bridge.starts_with("bridge: ")),
        "{printed:?}"
    );
    let binding = file(&folder, "bridge.yaml", &(settings.join("\n") + "\n"));
    assert_eq!(gaps(&["--binding", &binding]), Vec::<String>::new());
}

/// Numbers that only a slip of the finger makes are shown as they were meant, not with hundreds of digits.
#[test]
fn huge_and_tiny_numbers_are_reported_in_short() {
    let folder = tempfile::tempdir().unwrap();
    let commands = r#"{"schema": "teachtree.commands/1", "log": "", "rate_hz": 1e300, "scene": "", "tasks": []}"#;
    let commands = file(&folder, "commands.json", commands);
    let robot = shipped("robots/gifu_hand_iii_right.yaml");
    let heavy = file(&folder, "heavy.yaml", &robot.replacen("mass: 550 g", "mass: 1e280 kg", 1));
    let binding = file(&folder, "rate.yaml", "resample: 1e300 Hz\n");
    let times = file(&folder, "times.csv", "time [s],cube.position.x [m]\n1e250,0\n-1e250,0\n");
    let (out, scene) = (folder.path().join("out.csv"), "tests/fixtures/logs/box.yaml");
    let out = out.to_str().unwrap();
    for (args, wanted) in [
        (&["simulate", &commands, "--scene", "slide", "-o", out][..], "has 1e300 samples a second"),
        (&["command", LOG, "--scene", scene, "--robot", &heavy, "-o", out], "has a mass of 1e2"),
        (&["analyze", LOG, "--scene", scene, "--binding", &binding], "found 1e300 Hz"),
        (&["analyze", &times, "--scene", scene], "-1e250 s after 1e250 s"),
    ] {
        let printed = refused(args);
        assert!(printed.contains(wanted), "{printed}, expected {wanted}");
    }
}

/// Commands of which one grasp cannot be taken are written, said to be, and refused by `simulate`.
#[test]
fn commands_with_a_grasp_that_cannot_be_taken_are_written_and_said_to_be() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_string();
    let (log, commands, out) = (path("log.csv"), path("commands.json"), path("robot.csv"));
    demonstrate("pick_and_follow", &[], &log);
    let made = teachtree(&["command", &log, "--robot", "arm_with_gripper", "-o", &commands]);
    assert_eq!(made.status.code(), Some(1), "{}{}", said(&made), complained(&made));
    let printed = said(&made);
    assert!(printed.contains("no grasp, ") && printed.contains("written: "), "{printed}");
    assert!(
        printed.ends_with("The grasp is impossible for this hand, so `simulate` refuses these commands\n"),
        "{printed}"
    );
    let written: Value = serde_json::from_str(&std::fs::read_to_string(&commands).unwrap()).unwrap();
    assert!(!written["tasks"][0]["segments"].as_array().unwrap().is_empty());
    let simulated =
        teachtree(&["simulate", &commands, "--robot", "arm_with_gripper", "--scene", "pick_and_follow", "-o", &out]);
    assert_eq!(simulated.status.code(), Some(1), "{}", complained(&simulated));
    assert!(!Path::new(&out).exists());
    let help = said(&teachtree(&["command", "--help"]));
    let help = help.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(help.contains("`simulate` refuses such commands"), "{help}");
}

#[test]
fn a_table_without_a_header_is_told_what_is_expected() {
    let folder = tempfile::tempdir().unwrap();
    let log = file(&folder, "bare.csv", "0.0,1.5,2\n0.1,1,2\n0.2,1,2\n");
    for args in [&["analyze", log.as_str()][..], &["analyze", &log, "--scene", "scenes/pick_and_place.yaml"]] {
        let printed = refused(args);
        assert!(
            printed.contains("bare.csv row 1: the columns have no names, expected a header such as `time [s],"),
            "{printed}"
        );
        assert!(printed.contains("help: add a header, or name the columns by their numbers in a binding"), "{printed}");
    }
}

/// Errors of bodies name the key, and the meaning of the numbers of a shape.
#[test]
fn errors_of_shapes_name_the_key_that_is_expected() {
    let folder = tempfile::tempdir().unwrap();
    for (part, wanted) in [
        (
            "cylindre: [15 mm, 80 mm]",
            "found the key `cylindre`, expected one of `box`, `cylinder`, `ball`, `at`, `turned`\n  help: did you mean `cylinder`?",
        ),
        ("cylinder: [15 mm]", "found a list of 1, expected two lengths, the radius and the height"),
        ("box: [640 mm, 600 mm]", "found a list of 2, expected three edge lengths, along x, y and z"),
        ("box: [6 mm, 6 mm, 0 mm]", "found 0 m, expected a length (m) above 0"),
        ("at: [0 mm, 0 mm, 0 mm]", "has no shape, expected one of `box`, `cylinder`, `ball`"),
        ("ball: 3 mm, box: [6 mm, 6 mm, 6 mm]", "has `box` and `ball`, expected one shape a part"),
    ] {
        let scene = format!("bodies:\n  cube:\n    role: object\n    parts: [{{{part}}}]\n");
        let printed = refused(&["check", &file(&folder, "a.scene.yaml", &scene)]);
        assert!(printed.contains(wanted) && printed.contains("a.scene.yaml:4:"), "{part}: {printed}");
        // The number of shapes is known at the end of the part.
        let place = if wanted.starts_with("has ") { "bodies.cube.parts" } else { "bodies.cube.parts[0]" };
        assert!(printed.contains(place), "{part}: {printed}");
    }
}

/// A flag from a column of numbers needs a threshold; a binding that binds nothing is the cause, not the missing scene.
#[test]
fn bindings_without_thresholds_and_channels_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let log = file(&folder, "log.csv", &gripper_log().replace(",w\n", ",w [mm]\n"));
    let path = file(&folder, "b.yaml", &binding("", "").replace("\"w > 20\"", "w"));
    let printed = refused(&["analyze", &log, "--binding", &path]);
    let wanted = "b.yaml:4:3: `right.gripper.closed` is a flag and `w` is a length (m), expected a threshold such as `w < 40 mm`";
    assert!(printed.contains(wanted), "{printed}");
    let empty = file(&folder, "empty.yaml", "# nothing\n");
    let printed = refused(&["analyze", &log, "--binding", &empty]);
    assert!(printed.contains("no channel is bound, and no column of the log has a canonical name"), "{printed}");
    let without_scene = file(&folder, "c.yaml", "channels:\n  right.tcp.position: [x, y, z]\n");
    let printed = refused(&["analyze", &log, "--binding", &without_scene]);
    assert!(printed.contains("describe the bodies below `scene` in the binding"), "{printed}");
}

/// Two seconds of a gripper, at 20 Hz.
fn gripper_log() -> String {
    let row = |at: u32| format!("{:.2},{:.3},0,0.2,1,0,0,0,0,0,{at}\n", f64::from(at) / 20.0, f64::from(at) / 100.0);
    let rows: String = (0..40).map(row).collect();
    format!("time,x,y,z,qw,qx,qy,qz,fx,fy,w\n{rows}")
}

/// A binding of this log, with these channels and keys.
fn binding(channels: &str, keys: &str) -> String {
    format!(
        "channels:\n  right.tcp.position: [x, y, z]\n  right.tcp.rotation: [qw, qx, qy, qz]\n  right.gripper.closed: \"w > 20\"\n{channels}\
         {keys}scene:\n  bodies:\n    cube: {{role: object, mass: 50 g}}\n    table: {{role: support}}\n    box: {{role: socket}}\n"
    )
}

/// What `analyze` refuses in a binding whatever the log contains, `check` refuses without the log, in the same words.
#[test]
fn check_refuses_a_binding_that_analyze_refuses() {
    let folder = tempfile::tempdir().unwrap();
    let log = file(&folder, "log.csv", &gripper_log());
    let path = folder.path().join("b.binding.yaml");
    let path = path.to_str().unwrap();
    let mut messages = Vec::new();
    for (channels, keys) in [
        ("  right.thunb.position: [x, y, z]\n", ""),
        ("  right.gripper.openning: w\n", ""),
        ("  cubes.position: [x, y, z]\n", ""),
        ("  contact.cube.tabel: w\n", ""),
        ("  cube: w\n", ""),
        ("  cube.position: [x, y]\n", ""),
        ("  cube.position: \"w > 3\"\n", ""),
        ("  cube.rotation: [x, y, z, w]\n  cube.position: {at: [0 mm, 0 mm, 5 mm], of: left.palm}\n", ""),
        ("  left.gripper.closed: {between: [left.thumb, left.index], below: 5 mm}\n", ""),
        ("", "pads: {of: tcp, opening: gripper, axis: y}\n"),
        ("", "sensors: {right.wrist.force: {tool: 400 g}}\n"),
        ("  right.wrist.force: [fx, fy, z]\n", "sensors: {right.wrist.force: {tool: learned}}\n"),
        ("  right.wrist.force: [fx, fy, z]\n", "sensors: {right.wrist.force: {frame: left.palm.rotation}}\n"),
        ("  right.wrist.force: [fx, fy, z]\n", "sensors: {right.wrist.force: {time_offset: -20 ms}}\n"),
        ("", "tare: {channels: [right.thumb.force], from: 0 s, to: 1 s}\n"),
        ("", "places: {bock: {by: cube, when: rest}}\n"),
        ("", "places: {box: {by: cube, when: first_contact}}\n"),
        ("", "trust: [right.gripper.closed]\n"),
        ("", "params: {near_onn: 30 mm}\n"),
        ("", "hand_file: hand_griper.rules\n"),
        ("", "expect: pick_and_plase\n"),
        ("", "signals: {grasp: start of Grasb of cube}\n"),
        ("", "start_signals: {grasp: start of Grasp of cup}\n"),
    ] {
        std::fs::write(path, binding(channels, keys)).unwrap();
        let analyzed = complained(&teachtree(&["analyze", &log, "--binding", path]));
        let output = teachtree(&["check", path]);
        assert_eq!(output.status.code(), Some(2), "{channels}{keys}: {}{}", said(&output), complained(&output));
        let checked = complained(&output);
        let first = checked.lines().next().unwrap().replace(folder.path().to_str().unwrap(), "");
        let (place, message) = first.strip_prefix("error: /").unwrap().split_once(": ").unwrap();
        assert!(analyzed.contains(message), "{channels}{keys}: {checked}{analyzed}");
        // Errors of rules have no place in the binding when a log is analyzed.
        assert!(analyzed.contains(place) || analyzed.starts_with("error["), "{channels}{keys}: {checked}{analyzed}");
        messages.push(first);
    }
    for part in [
        "b.binding.yaml:5:3: `thunb` is not a part of a hand",
        "`right.gripper.openning` is not a channel; did you mean `right.gripper.opening`?",
        "the scene has no body `cubes`; did you mean `cube`?",
        "no channel `right.thumb.force` is bound",
        "there is no param `near_onn` to override",
        "the rules have no task `pick_and_plase`; did you mean `pick_and_place`?",
    ] {
        assert!(messages.iter().any(|message| message.contains(part)), "{part}: {messages:#?}");
    }
    // Properties of the log are not errors of the binding: names of columns, objects without columns, units that its header may have.
    std::fs::write(path, binding("  <object>.position: [a, b, c]\n  right.gripper.opening: \"o [mm]\"\n", "")).unwrap();
    assert_eq!(said(&teachtree(&["check", path])), format!("{path}: a binding, without errors\n"));
    std::fs::write(path, "channels: {right.tcp.position: [x, y, z]}\n").unwrap();
    let of_form = format!("{path}: a binding, without errors\n  `analyze LOG` checks its bodies and rules\n");
    assert_eq!(said(&teachtree(&["check", path])), of_form);
    // Rules of one's own are named with the binding that is for them.
    let rules = file(&folder, "own.rules", "use \"contact.rules\"\nparam lift = 3 mm in 1 mm .. 10 mm\n");
    std::fs::write(path, binding("", "params: {lift: 4 mm}\n")).unwrap();
    assert!(complained(&teachtree(&["check", path])).contains("name them too: `teachtree check my.rules"));
    let output = teachtree(&["check", &rules, path]);
    assert!(output.status.success(), "{}{}", said(&output), complained(&output));
}

#[test]
fn shipped_bindings_are_checked_without_their_logs() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut folders = vec![root.join("demos"), root.join("examples")];
    let mut checked = 0;
    while let Some(folder) = folders.pop() {
        for path in std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
            if path.is_dir() {
                folders.push(path);
            } else if path.to_str().unwrap().ends_with(".binding.yaml") {
                let output = teachtree(&["check", path.to_str().unwrap()]);
                assert!(output.status.success(), "{}", complained(&output));
                checked += 1;
            }
        }
    }
    assert!(checked > 20, "{checked}");
}

/// `check` of a scene, without its path.
fn checked(folder: &tempfile::TempDir, scene: &str) -> String {
    let path = file(folder, "cell.scene.yaml", scene);
    let output = teachtree(&["check", &path]);
    assert!(output.status.success(), "{}", complained(&output));
    said(&output).replace(&path, "cell.scene.yaml")
}

#[test]
fn check_reports_bodies_that_a_scene_places_wrongly() {
    let folder = tempfile::tempdir().unwrap();
    let scene = shipped("scenes/pick_and_place.yaml");
    let sound = checked(&folder, &scene);
    assert_eq!(sound, "cell.scene.yaml: a scene, without errors\n");
    let place = |from: &str, to: &str| {
        assert!(scene.contains(from), "{scene}");
        checked(&folder, &scene.replacen(from, to, 1))
    };
    let body = scene.lines().find(|line| line.contains("role: object")).unwrap();
    let position = body.split("position: ").nth(1).unwrap().split(']').next().unwrap();
    let parts: Vec<f64> = position
        .trim_start_matches('[')
        .split(',')
        .map(|part| part.trim().trim_end_matches(" mm").parse().unwrap())
        .collect();
    let [x, y, z] = parts[..] else { panic!("{position}") };
    let low = place(position, &format!("[{x} mm, {y} mm, {} mm", z - 12.0));
    assert!(low.contains("cell.scene.yaml:") && low.contains("it begins 12 mm inside `base`"), "{low}");
    // What is advised is right.
    let advised = low.split("`position: ").nth(1).unwrap().split(']').next().unwrap();
    assert_eq!(place(position, advised), sound);
    let far = place(position, &format!("[{x} m, {y} m, {z} m"));
    assert!(far.contains("from every other body, out of reach of a hand"), "{far}");
    let advised = far.split("`position: ").nth(1).unwrap().split(']').next().unwrap();
    assert_eq!(place(position, advised), sound);
}

#[test]
fn shipped_scenes_place_their_bodies_rightly() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folders = ["scenes", "demos/robosuite", "tests/fixtures/logs"].map(|folder| root.join(folder));
    let files = folders.iter().flat_map(|folder| std::fs::read_dir(folder).unwrap()).map(|entry| entry.unwrap().path());
    let scenes: Vec<String> = files
        .filter(|path| path.extension().is_some_and(|it| it == "yaml"))
        .map(|path| path.display().to_string())
        .collect();
    assert!(scenes.len() > 40, "{}", scenes.len());
    let output = teachtree(&[&["check"], &scenes.iter().map(String::as_str).collect::<Vec<_>>()[..]].concat());
    assert!(output.status.success(), "{}", complained(&output));
    assert!(!said(&output).contains("warning"), "{}", said(&output));
}
