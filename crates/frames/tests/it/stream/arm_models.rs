//! Arms that come with the program, and the numbers that LeRobot logs of their motors. Poses are compared with those that pinocchio 4.1 computes from the URDFs
//! of the package example-robot-data.

use std::path::Path;
use teachtree_base::error::InputError;
use teachtree_frames::{OpenRequest, OpenedLog, open};

const MOTORS: [&str; 6] = ["shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll", "gripper"];

/// Degrees of the joints of an SO-101; the frame of its gripper, m; the rotation of the gripper, w x y z; the distance of the pads, m.
type So101Posture = ([f64; 6], [f64; 3], [f64; 4], f64);

const SO101: [So101Posture; 3] = [
    ([0.0; 6], [0.391361, -0.000009, 0.22647], [0.706895, 0.017214, -0.7069, -0.017206], 0.0158),
    (
        [30.0, -40.0, 50.0, 20.0, -60.0, 45.0],
        [0.258054, -0.118772, 0.119618],
        [0.597289, 0.14113, -0.479671, -0.627092],
        0.073437,
    ),
    (
        [-80.0, 60.0, -70.0, -50.0, 120.0, -10.0],
        [0.106632, 0.343598, 0.316982],
        [0.038729, 0.308175, 0.915447, -0.255901],
        0.004446,
    ),
];

/// The ranges of an arm that was calibrated: not in the middle of its ticks, and the gripper opens by 100 degrees.
const CALIBRATION: &str = r#"{
    "shoulder_pan": {"id": 1, "drive_mode": 0, "homing_offset": -1024, "range_min": 800, "range_max": 3000},
    "shoulder_lift": {"id": 2, "drive_mode": 0, "homing_offset": 12, "range_min": 900, "range_max": 3100},
    "elbow_flex": {"id": 3, "drive_mode": 0, "homing_offset": 5, "range_min": 950, "range_max": 3150},
    "wrist_flex": {"id": 4, "drive_mode": 0, "homing_offset": -7, "range_min": 850, "range_max": 3000},
    "wrist_roll": {"id": 5, "drive_mode": 0, "homing_offset": 99, "range_min": 0, "range_max": 4095},
    "gripper": {"id": 6, "drive_mode": 0, "homing_offset": 1, "range_min": 2000, "range_max": 3137}
}"#;
const RANGES: [[f64; 2]; 6] =
    [[800.0, 3000.0], [900.0, 3100.0], [950.0, 3150.0], [850.0, 3000.0], [0.0, 4095.0], [2000.0, 3137.0]];

const BINDING: &str = "robots: {arm: {model: so101, hand: right}}\nscene: {bodies: {}}\n";

/// Opens a log of an SO-101 with these numbers of its motors in each row.
fn opened(rows: &[[f64; 6]], binding: &str) -> Result<OpenedLog, InputError> {
    let folder = tempfile::tempdir().unwrap();
    let titles: Vec<String> = MOTORS.iter().map(|motor| format!("observation.state.{motor}.pos")).collect();
    let mut log = format!("time,{}\n", titles.join(","));
    for (row, numbers) in rows.iter().enumerate() {
        let cells: Vec<String> = numbers.iter().map(f64::to_string).collect();
        log += &format!("{row},{}\n", cells.join(","));
    }
    std::fs::write(folder.path().join("arm.json"), CALIBRATION).unwrap();
    opened_in(folder.path(), &log, binding)
}

fn opened_in(folder: &Path, log: &str, binding: &str) -> Result<OpenedLog, InputError> {
    let [table, file] = ["log.csv", "b.yaml"].map(|name| folder.join(name));
    std::fs::write(&table, log).unwrap();
    std::fs::write(&file, binding).unwrap();
    open(&OpenRequest { log: table, binding: Some(file), ..OpenRequest::default() })
}

fn components<const N: usize>(opened: &OpenedLog, channel: &str, letters: [&str; N], row: usize) -> [f64; N] {
    letters.map(|letter| opened.recording.columns[&format!("{channel}.{letter}")].values[row])
}

fn distance<const N: usize>(one: [f64; N], other: [f64; N]) -> f64 {
    one.iter().zip(other).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

/// Whether the hand is where pinocchio says for each row of [`SO101`].
fn check(opened: &OpenedLog, what: &str) {
    for (row, (_, frame, rotation, apart)) in SO101.iter().enumerate() {
        let thumb = components(opened, "right.thumb.position", ["x", "y", "z"], row);
        assert!(distance(thumb, *frame) < 1e-5, "{what}, row {row}: {thumb:?}, expected {frame:?}");
        let found = components(opened, "right.palm.rotation", ["w", "x", "y", "z"], row);
        let negated = found.map(|part| -part);
        assert!(distance(found, *rotation).min(distance(negated, *rotation)) < 3e-5, "{what}, row {row}: {found:?}");
        let opening = opened.recording.columns["right.gripper.opening"].values[row];
        assert!((opening - (apart - 0.0044)).abs() < 1e-5, "{what}, row {row}: {opening}");
    }
}

#[test]
fn an_so101_stands_where_pinocchio_finds_it() {
    let percent = |closed_to_open: f64, degrees: f64| (degrees + 10.0) / closed_to_open * 100.0;
    let rows = SO101.map(|([arm @ .., gripper], ..)| {
        let [a, b, c, d, e] = arm;
        [a, b, c, d, e, percent(110.0, gripper)]
    });
    check(&opened(&rows, BINDING).unwrap(), "degrees");
    // A column with a unit of its own is used as it is.
    let of_all = BINDING.replace("hand: right", "hand: right, joints: 'observation.state.<joint>.pos [deg]'");
    check(&opened(&SO101.map(|(joints, ..)| joints), &of_all).unwrap(), "degrees of all");
    // The columns of a mean are converted one by one.
    let column =
        |motor: &str| format!("{motor}: {{mean: [observation.state.{motor}.pos, observation.state.{motor}.pos]}}");
    let means = BINDING.replace("hand: right", &format!("hand: right, joints: {{{}}}", MOTORS.map(column).join(", ")));
    check(&opened(&rows, &means).unwrap(), "means");
    let halves = [110.0, 100.0, 96.83, 95.0, 180.0];
    let rows = rows.map(|mut row| {
        row.iter_mut().zip(halves).for_each(|(number, half)| *number *= 100.0 / half);
        row
    });
    check(&opened(&rows, &BINDING.replace("hand: right", "hand: right, norm: percent")).unwrap(), "percent");
}

/// The numbers are those of `_normalize` in LeRobot.
#[test]
fn numbers_of_a_calibrated_arm_become_angles() {
    let tick = 360.0 / 4095.0;
    let ticks = SO101.map(|(joints, ..)| {
        let mut numbers = joints;
        for (number, [first, last]) in numbers.iter_mut().zip(RANGES).take(5) {
            *number = (first + last) / 2.0 + *number / tick;
        }
        numbers[5] = 2000.0 + (joints[5] + 10.0) / tick;
        numbers
    });
    let of_range = |row: [f64; 6], scale: [f64; 2]| {
        let mut row = row;
        for (number, [first, last]) in row.iter_mut().zip(RANGES).take(5) {
            *number = (*number - first) / (last - first) * scale[0] + scale[1];
        }
        row[5] = (row[5] - 2000.0) / 1137.0 * 100.0;
        row
    };
    let percent = ticks.map(|row| of_range(row, [200.0, -100.0]));
    let degrees = ticks.map(|row| {
        let mut numbers = of_range(row, [200.0, -100.0]);
        for ((number, [first, last]), tick_of_row) in numbers.iter_mut().zip(RANGES).zip(row).take(5) {
            *number = (tick_of_row - (first + last) / 2.0) * tick;
        }
        numbers
    });
    for (norm, rows) in [("ticks", ticks), ("percent", percent), ("degrees", degrees)] {
        let keys = format!("hand: right, norm: {norm}, calibration: arm.json");
        check(&opened(&rows, &BINDING.replace("hand: right", &keys)).unwrap(), norm);
    }
}

#[test]
fn a_panda_stands_where_pinocchio_finds_it() {
    let folder = tempfile::tempdir().unwrap();
    let log = "time,q[0],q[1],q[2],q[3],q[4],q[5],q[6],width\n\
        0,0,-0.785398,0,-2.356194,0,1.570796,0.785398,0.04\n0.1,0.5,-0.3,0.7,-1.9,-0.4,2.2,-1.1,0.07\n";
    let binding = "robots:\n  arm: {model: panda, hand: left, joints: 'q[<index>]', gripper: {mean: ['width [m]', '= 0 m']}}\n\
        channels:\n  right.thumb.position: {link: arm.panda_hand_tcp}\nscene: {bodies: {}}\n";
    let opened = opened_in(folder.path(), log, binding).unwrap();
    for (row, point, pad, opening) in [
        (0, [0.306891, 0.0, 0.486882], [0.306891, -0.02, 0.486882], 0.04),
        (1, [0.221548, 0.537341, 0.581452], [0.214399, 0.570749, 0.589052], 0.07),
    ] {
        let found = components(&opened, "right.thumb.position", ["x", "y", "z"], row);
        assert!(distance(found, point) < 2e-6, "row {row}: {found:?}");
        let found = components(&opened, "left.thumb.position", ["x", "y", "z"], row);
        assert!(distance(found, pad) < 2e-6, "row {row}: {found:?}");
        assert!((opened.recording.columns["left.gripper.opening"].values[row] - opening).abs() < 1e-9);
    }
    // Fingers that are not logged say nothing about the opening.
    let alone = binding.replace(", gripper: {mean: ['width [m]', '= 0 m']}", "");
    let columns = opened_in(folder.path(), log, &alone).unwrap().recording.columns;
    assert!(columns.contains_key("left.palm.rotation.w") && !columns.contains_key("left.gripper.opening"));
}

/// The poses follow from the home pose and the screw axes that the documentation of Interbotix arms gives, by the product of exponentials, without the URDF.
#[test]
fn a_vx300s_stands_where_its_screw_axes_put_it() {
    let folder = tempfile::tempdir().unwrap();
    let log =
        "time,q[0],q[1],q[2],q[3],q[4],q[5],q[6]\n0,0,0,0,0,0,0,1\n1,0.3,-0.4,0.5,0.6,-0.7,0.8,0\n2,0,0,0,0,0,0,0.5\n";
    let binding = "robots: {arm: {model: vx300s, hand: left, joints: 'q[<index>]', gripper: 'q[6] * 0.03956 + 0.01844 [m]'}}\n\
        scene: {bodies: {}}\n";
    let opened = opened_in(folder.path(), log, binding).unwrap();
    let poses: [([f64; 3], [f64; 4], f64); 2] = [
        ([0.536494, 0.0, 0.42705], [1.0, 0.0, 0.0, 0.0], 0.07912),
        ([0.382598, 0.050979, 0.476708], [0.725788, 0.644865, -0.21085, 0.113681], 0.0),
    ];
    for (row, (tool, rotation, opening)) in poses.into_iter().enumerate() {
        let pads =
            ["thumb", "index"].map(|pad| components(&opened, &format!("left.{pad}.position"), ["x", "y", "z"], row));
        let middle = [0, 1, 2].map(|axis| f64::midpoint(pads[0][axis], pads[1][axis]));
        assert!(distance(middle, tool) < 1e-5, "row {row}: {middle:?}, expected {tool:?}");
        assert!((distance(pads[0], pads[1]) - opening).abs() < 1e-6, "row {row}: {pads:?}");
        let found = components(&opened, "left.palm.rotation", ["w", "x", "y", "z"], row);
        assert!(
            distance(found, rotation).min(distance(found.map(|part| -part), rotation)) < 1e-5,
            "row {row}: {found:?}"
        );
        assert!((opened.recording.columns["left.gripper.opening"].values[row] - opening).abs() < 1e-6, "row {row}");
    }
}

#[test]
fn channels_of_the_binding_replace_those_of_the_tool() {
    let own = "channels: {right.gripper.opening: 'observation.state.gripper.pos * 0.9 [mm]'}\n";
    let opened = opened(&[[0.0, 0.0, 0.0, 0.0, 0.0, 50.0]; 3], &format!("{BINDING}{own}")).unwrap();
    assert!((opened.recording.columns["right.gripper.opening"].values[0] - 0.045).abs() < 1e-12);
    assert!(opened.recording.columns.contains_key("right.index.position.x"));
}

#[test]
fn each_fault_of_a_model_is_one_error_with_its_place() {
    for (from, to, place, said) in [
        ("model: so101", "model: so102", "b.yaml:1:23", "found `so102`, expected one of `so101`, `panda`, `vx300s`"),
        ("model: so101", "urdf: a.urdf, model: so101", "b.yaml:1:", "expected `urdf` with a file, or `model`"),
        ("model: so101, ", "", "b.yaml:1:", "expected `urdf` with a file, or `model`"),
        ("model: so101", "model: panda", "b.yaml:1:23", "expected `joints`, the columns of its joints"),
        (
            "hand: right",
            "joints: state.pos",
            "b.yaml:1:38",
            "found `state.pos` for all joints, expected `<joint>` or `<index>`",
        ),
        (
            "hand: right",
            "hand: right, joints: state.<joint>",
            "b.yaml:1:",
            "the log has no column `state.shoulder_pan`",
        ),
        (
            "hand: right",
            "joints: {sholder_pan: q}",
            "b.yaml:1:",
            "`so101` has no joint that moves by itself `sholder_pan`; did you mean `shoulder_pan`?",
        ),
        ("hand: right", "norm: ticks", "b.yaml:1:36", "`norm: ticks` needs the `calibration` of the arm"),
        ("hand: right", "calibration: none.json", "b.yaml:1:43", "none.json"),
        (
            "model: so101, hand: right",
            "model: panda, joints: 'q[<index>]', norm: percent",
            "b.yaml:1:58",
            "`norm` is for motors of LeRobot",
        ),
    ] {
        assert!(BINDING.contains(from), "{from}");
        let error = opened(&[[0.0; 6]; 3], &BINDING.replacen(from, to, 1)).map(|_| ()).unwrap_err().to_string();
        assert!(error.contains(said) && error.contains(place), "{to}: {error}");
    }
    // The usual columns are those of LeRobot.
    let folder = tempfile::tempdir().unwrap();
    let error = opened_in(folder.path(), "time,j1\n0,1\n1,2\n", BINDING).map(|_| ()).unwrap_err();
    assert!(error.to_string().contains("the log has no column `observation.state.shoulder_pan.pos`"), "{error}");
    assert!(error.help.as_deref().is_some_and(|help| help.contains("`joints: state.<joint>`")), "{error:?}");
}

#[test]
fn each_fault_of_a_calibration_is_one_error_with_its_place() {
    let binding = BINDING.replace("hand: right", "hand: right, calibration: own.json");
    for (from, to, said) in [
        (
            "\"range_min\": 800",
            "\"range_min\": 3000",
            "own.json:2:85: `shoulder_pan` has the range 3000 to 3000, expected two ticks in order",
        ),
        ("\"range_max\": 3137", "\"range_max\": 5000", "`gripper` has the range 2000 to 5000"),
        ("\"range_min\": 800, ", "", "own.json:2:21: shoulder_pan: the key `range_min` is missing"),
        ("\"gripper\"", "\"hand\"", "b.yaml:1:56: the file has no motor `gripper`; it has shoulder_pan, "),
        ("}\n}", "}\n", "own.json:"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        assert!(CALIBRATION.contains(from), "{from}");
        std::fs::write(folder.path().join("own.json"), CALIBRATION.replacen(from, to, 1)).unwrap();
        let error = opened_in(folder.path(), "time,q\n0,1\n1,2\n", &binding).map(|_| ()).unwrap_err().to_string();
        assert!(error.contains(said), "{to}: {error}");
    }
}

/// A motor that turns against its joint: LeRobot turns percent, and not degrees.
#[test]
fn drive_modes_turn_degrees_and_ticks() {
    let folder = tempfile::tempdir().unwrap();
    let reversed = CALIBRATION.replacen("\"drive_mode\": 0", "\"drive_mode\": 1", 1);
    std::fs::write(folder.path().join("own.json"), reversed).unwrap();
    let half = 1100.0 * 360.0 / 4095.0;
    for (norm, number, angle) in
        [("degrees", 10.0, -10.0), ("ticks", 1900.0 + 10.0, -10.0 * 360.0 / 4095.0), ("percent", 10.0, half / 10.0)]
    {
        let log = format!("time,p\n0,{number}\n0.1,{number}\n0.2,{number}\n");
        let binding = format!(
            "robots: {{arm: {{model: so101, joints: {{shoulder_pan: p}}, norm: {norm}, calibration: own.json}}}}\n\
             channels: {{right.palm.position: {{link: arm.shoulder_link, at: [0 m, 1 m, 0 m]}}}}\nscene: {{bodies: {{}}}}\n"
        );
        let opened = opened_in(folder.path(), &log, &binding).unwrap();
        let [x, y, _] = components(&opened, "right.palm.position", ["x", "y", "z"], 0);
        let found = (x - 0.0388353).atan2(y).to_degrees();
        assert!((found - angle).abs() < 1e-3, "{norm}: {found}, expected {angle}");
    }
}
