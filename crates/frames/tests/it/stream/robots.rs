//! Joints through a URDF in a binding: where the tool point and the fingertips are, and how far the gripper is open, against closed forms.

use nalgebra::{Rotation3, Vector3};
use std::path::Path;
use teachtree_base::error::InputError;
use teachtree_frames::{OpenRequest, OpenedLog, open};

/// Two links of 300 mm and 200 mm turn about z, on a column of 500 mm that slides up; a parallel gripper whose second finger mimics the first.
const ARM: &str = r#"<robot name="arm">
  <link name="base"/><link name="lift"/><link name="upper"/><link name="lower"/><link name="hand"/><link name="left"/><link name="right"/>
  <joint name="z" type="prismatic"><parent link="base"/><child link="lift"/><origin xyz="0 0 0.5"/><axis xyz="0 0 1"/><limit lower="0" upper="0.4"/></joint>
  <joint name="shoulder" type="revolute"><parent link="lift"/><child link="upper"/><axis xyz="0 0 1"/><limit lower="-3" upper="3"/></joint>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="0.3 0 0"/><axis xyz="0 0 1"/><limit lower="-3" upper="3"/></joint>
  <joint name="wrist" type="fixed"><parent link="lower"/><child link="hand"/><origin xyz="0.2 0 0" rpy="3.141592653589793 0 0"/></joint>
  <joint name="finger" type="prismatic"><parent link="hand"/><child link="left"/><axis xyz="0 1 0"/><limit lower="0" upper="0.04"/></joint>
  <joint name="finger2" type="prismatic"><parent link="hand"/><child link="right"/><axis xyz="0 -1 0"/><limit lower="0" upper="0.04"/><mimic joint="finger"/></joint>
</robot>"#;

const LOG: &str = "time,q0,q1,q2,width\n0,100,30,60,60\n0.1,150,-20,45,40\n0.2,200,,45,20\n0.3,250,10,-80,10\n";

const BINDING: &str = "
hand_file: hand_gripper.rules
robots:
  arm:
    urdf: arm.urdf
    joints: {z: 'q0 [mm]', shoulder: 'q1 [deg]', elbow: '-q2 [deg]', finger: {mean: ['width [mm]', '= 0 mm']}}
    position: [1 m, 2 m, 0 m]
    rotation: [0, 0, 0, 1]
channels:
  right.thumb.position: {link: arm.left, at: [0 mm, 0 mm, 100 mm]}
  right.index.position: {link: arm.right, at: [0 mm, 0 mm, 100 mm]}
  right.palm.position: {link: arm.hand}
  right.palm.rotation: {link: arm.hand}
  right.gripper.opening: {between: [right.thumb, right.index], less: 5 mm}
  right.gripper.closed: {between: [right.thumb, right.index], below: 30 mm}
scene:
  bodies: {}
";

fn opened(folder: &Path, binding: &str) -> Result<OpenedLog, InputError> {
    let [log, file] = ["log.csv", "b.yaml"].map(|name| folder.join(name));
    std::fs::write(folder.join("arm.urdf"), ARM).unwrap();
    std::fs::write(&log, LOG).unwrap();
    std::fs::write(&file, binding).unwrap();
    open(&OpenRequest { log, binding: Some(file), ..OpenRequest::default() })
}

#[test]
fn tool_point_fingertips_and_opening_come_from_the_joints() {
    let folder = tempfile::tempdir().unwrap();
    let recording = opened(folder.path(), BINDING).unwrap().recording;
    let value = |name: &str, row: usize| recording.columns[name].values[row];
    let vector =
        |name: &str, row: usize| Vector3::from(["x", "y", "z"].map(|axis| value(&format!("{name}.{axis}"), row)));
    for (row, [z, shoulder, elbow, width]) in
        [(0, [0.1, 30.0, -60.0, 0.06]), (1, [0.15, -20.0, -45.0, 0.04]), (3, [0.25, 10.0, 80.0, 0.01])]
    {
        let (first, both) = (f64::to_radians(shoulder), f64::to_radians(shoulder + elbow));
        let (x, y) = (0.3 * first.cos() + 0.2 * both.cos(), 0.3 * first.sin() + 0.2 * both.sin());
        // The root is turned by half a turn about z.
        let hand = Vector3::new(1.0 - x, 2.0 - y, 0.5 + z);
        assert!((vector("right.palm.position", row) - hand).norm() < 1e-12, "row {row}");
        // The hand is upside down: its y points to the other side, and its z down.
        let aside = Vector3::new(-both.sin(), both.cos(), 0.0) * (width / 2.0);
        let below = Vector3::new(0.0, 0.0, -0.1);
        assert!((vector("right.thumb.position", row) - (hand + aside + below)).norm() < 1e-12, "row {row}");
        assert!((vector("right.index.position", row) - (hand - aside + below)).norm() < 1e-12, "row {row}");
        assert!((value("right.gripper.opening", row) - (width - 0.005)).abs() < 1e-12);
        assert_eq!(value("right.gripper.closed", row), f64::from(u8::from(width < 0.03)));
        let [w, i, j, k] = ["w", "x", "y", "z"].map(|part| value(&format!("right.palm.rotation.{part}"), row));
        let found = nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, i, j, k));
        let wanted = Rotation3::from_axis_angle(&Vector3::z_axis(), both + std::f64::consts::PI)
            * Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
        assert!((found.to_rotation_matrix().matrix() - wanted.matrix()).norm() < 1e-9, "row {row}");
    }
    // A joint that was not measured leaves open where the links after it are, and so how far apart its fingertips are.
    assert!(value("right.palm.position.x", 2).is_nan() && value("right.gripper.opening", 2).is_nan());
    assert!(recording.columns.keys().all(|name| !name.starts_with("robots.")), "{:?}", recording.columns.keys());
}

#[test]
fn each_fault_of_a_robot_is_one_error_with_its_place() {
    let folder = tempfile::tempdir().unwrap();
    for (from, to, said) in [
        ("urdf: arm.urdf", "urdf: leg.urdf", "b.yaml:5:11: "),
        ("urdf: arm.urdf", "urdf: arm.urdf\n    hand: right", "b.yaml:6:11: `hand` is for the tool of a `model`"),
        (
            "urdf: arm.urdf",
            "urdf: arm.urdf\n    gripper: width [mm]",
            "b.yaml:6:14: `gripper` is for the gripper of a `model`",
        ),
        ("urdf: arm.urdf", "urdf: arm.urdf\n    norm: ticks", "b.yaml:6:11: `norm` is for motors of LeRobot"),
        ("shoulder: ", "sholder: ", "`arm.urdf` has no joint that moves by itself `sholder`; did you mean `shoulder`?"),
        ("finger: {", "finger2: {", "`arm.urdf` has no joint that moves by itself `finger2`; did you mean `finger`?"),
        (
            "arm.hand}\n  right.palm.rotation",
            "arm.hamd}\n  right.palm.rotation",
            "`arm.urdf` has no link `hamd`; did you mean `hand`?",
        ),
        ("{link: arm.left,", "{link: arn.left,", "`robots` has no `arn`; did you mean `arm`?"),
        ("{link: arm.left,", "{link: left,", "found `left`, expected a robot and its link: `arm.left`"),
        ("'q1 [deg]'", "'q9 [deg]'", "the log has no column `q9`"),
        ("'q0 [mm]'", "'q0 [deg]'", "`deg` is an angle (rad), expected a length (m)"),
        (
            "right.palm.position: {link: arm.hand}",
            "right.wrist.force: {link: arm.hand}",
            "is neither a position nor a rotation",
        ),
        ("less: 5 mm", "below: 5 mm", "`right.gripper.opening` is not a flag; only flags have a limit"),
        (", below: 30 mm", "", "`right.gripper.closed` is a flag, expected a limit such as `below: 30 mm`"),
        (
            "between: [right.thumb, right.index], less",
            "between: [right.thumb, right.ring], less",
            "no channel `right.ring.position` is bound",
        ),
    ] {
        assert!(BINDING.contains(from), "{from}");
        let error = opened(folder.path(), &BINDING.replacen(from, to, 1)).map(|_| ()).unwrap_err().to_string();
        assert!(error.contains(said) && error.contains("b.yaml:"), "{to}: {error}");
    }
    // Of a joint there is neither a threshold nor a choice.
    let error = opened(folder.path(), &BINDING.replacen("'q1 [deg]'", "'q1 > 0.5'", 1)).map(|_| ()).unwrap_err();
    assert!(error.to_string().contains("a joint has neither a threshold nor a `?`"), "{error}");
    std::fs::write(folder.path().join("arm.urdf"), "<robot").unwrap();
    std::fs::write(folder.path().join("b.yaml"), BINDING).unwrap();
    let request = OpenRequest {
        log: folder.path().join("log.csv"),
        binding: Some(folder.path().join("b.yaml")),
        ..OpenRequest::default()
    };
    let error = open(&request).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("arm.urdf:1:") && error.contains("is not valid XML"), "{error}");
}

#[test]
fn degrees_that_are_read_as_radians_are_reported() {
    let folder = tempfile::tempdir().unwrap();
    let rows: String = (0..40).map(|row| format!("{},100,{},60,60\n", f64::from(row) * 0.1, row * 2)).collect();
    let wrong = BINDING.replace("'q1 [deg]'", "q1");
    for (binding, reported) in [(BINDING, 0), (wrong.as_str(), 1)] {
        let [log, file] = ["long.csv", "long.yaml"].map(|name| folder.path().join(name));
        std::fs::write(folder.path().join("arm.urdf"), ARM).unwrap();
        std::fs::write(&log, format!("time,q0,q1,q2,width\n{rows}")).unwrap();
        std::fs::write(&file, binding).unwrap();
        let opened = open(&OpenRequest { log, binding: Some(file), ..OpenRequest::default() }).unwrap();
        let issues: Vec<_> = opened.issues.iter().filter(|it| it.channel == "robots.arm.shoulder").collect();
        assert_eq!(issues.len(), reported, "{issues:?}");
        assert!(issues.iter().all(|it| it.message.contains("in another unit (`[deg]`")), "{issues:?}");
    }
}

/// The arm with more in its file, of a log of a moment, and what is reported of the file.
fn with(more: &str, binding: &str) -> Result<(OpenedLog, Vec<String>), String> {
    let folder = tempfile::tempdir().unwrap();
    let [log, file] = ["log.csv", "b.yaml"].map(|name| folder.path().join(name));
    let urdf = match more.strip_prefix("HEAD ") {
        Some(head) => format!("{head}\n{ARM}"),
        None => ARM.replace("</robot>", &format!("{more}</robot>")),
    };
    std::fs::write(folder.path().join("arm.urdf"), urdf).unwrap();
    std::fs::write(&log, LOG).unwrap();
    std::fs::write(&file, binding).unwrap();
    let opened = open(&OpenRequest { log, binding: Some(file), ..OpenRequest::default() });
    let opened = opened.map_err(|error| error.to_string())?;
    let of_file = opened.issues.iter().filter(|issue| issue.kind == "unread_part");
    let reports = of_file.map(|issue| issue.message.clone()).collect();
    Ok((opened, reports))
}

/// Files that other programs load.
#[test]
fn what_no_bound_link_needs_does_not_keep_a_robot_from_being_read() {
    let folder = tempfile::tempdir().unwrap();
    let wanted = opened(folder.path(), BINDING).unwrap().recording.columns;
    let joint = |kind: &str, more: &str| {
        format!(
            "<link name=\"more\"/><joint name=\"j\" type=\"{kind}\"><parent link=\"hand\"/><child link=\"more\"/>{more}</joint>"
        )
    };
    let inertia = "<link name=\"more\"><inertial><mass value=\"1\"/><inertia ixx=\"-1\" iyy=\"1\" izz=\"1\"/></inertial></link>\
        <joint name=\"j\" type=\"fixed\"><parent link=\"hand\"/><child link=\"more\"/></joint>";
    for (more, report) in [
        (joint("revolute", "<limit lower=\"0\" upper=\"0\"/>"), "`j` goes from 0 to 0, expected the smaller end first; its limits are not used"),
        (joint("revolute", ""), "its limits are not used"),
        (joint("prismatic", "<limit lower=\"-1e+16\" upper=\"1e+16\"/>"), "`lower` is `-1e+16`, expected a number; its limits are not used"),
        (joint("revolute", "<limit lower=\"\" upper=\"\"/>"), "`lower` is ``"),
        (joint("planar", ""), "the joint is `planar`"),
        (joint("revolute", "<mimic joint=\"none\"/>"), "`j` mimics `none`, which does not move by itself; no bound channel depends on it"),
        (joint("revolute", "<axis xyz=\"0 0 0\"/><limit lower=\"0\" upper=\"1\"/>"), "an axis without direction"),
        (
            "<link name=\"world\"/><joint name=\"free\" type=\"floating\"><parent link=\"world\"/><child link=\"base\"/></joint>".into(),
            "the joint is `floating`, expected one of revolute, continuous, prismatic, fixed; it counts as fixed",
        ),
        ("<link name=\"leftover\"/>".into(), "the link `leftover` is not connected to the root `base`"),
        (inertia.into(), ""),
        ("<!-- old -- not used -->".into(), ""),
        ("HEAD <!DOCTYPE robot>".into(), ""),
    ] {
        let (opened, reports) = with(&more, BINDING).unwrap_or_else(|error| panic!("{more}: {error}"));
        let same = |name: &String, values: &[f64]| {
            wanted[name].values.iter().zip(values).all(|(one, other)| (one - other).abs() < 1e-12 || one.is_nan() && other.is_nan())
        };
        assert!(opened.recording.columns.iter().all(|(name, column)| same(name, &column.values)), "{more}");
        assert_eq!(reports.len(), usize::from(!report.is_empty()), "{more}: {reports:?}");
        assert!(reports.iter().all(|found| found.contains(report) && found.contains("arm.urdf:")), "{more}: {reports:?}");
    }
}

#[test]
fn what_a_bound_link_needs_must_be_readable() {
    let bound = BINDING.replace("right.palm.position: {link: arm.hand}", "right.palm.position: {link: arm.more}");
    let joint = |more: &str| {
        format!(
            "<link name=\"more\"/><joint name=\"j\" type=\"revolute\"><parent link=\"hand\"/><child link=\"more\"/>{more}</joint>"
        )
    };
    let error = |more: &str| with(more, &bound).map(|_| ()).unwrap_err();
    assert!(error(&joint("<mimic joint=\"none\"/>")).contains("`j` mimics `none`"));
    assert!(
        error(&joint("<origin xyz=\"0 0 ${z}\"/><limit lower=\"0\" upper=\"1\"/>")).contains("xacro robot.urdf.xacro")
    );
    assert!(error("<link name=\"more\"/>").contains("the link `more` is not connected to the root `base`"));
    let itself = joint("<mimic joint=\"j\"/>");
    assert!(error(&itself).contains("`j` mimics itself"));
}

#[test]
fn a_joint_may_mimic_one_that_mimics_another_and_a_locked_one_stays() {
    let bound = BINDING.replace("right.palm.position: {link: arm.hand}", "right.palm.position: {link: arm.c}");
    // Along x, on the base: half of the finger's way and 0.1 m, twice that and 0.01 m, and 0.5 m that are locked.
    let joint = |name: &str, on: &str, more: &str| {
        format!(
            "<link name=\"{name}\"/><joint name=\"j{name}\" type=\"prismatic\"><parent link=\"{on}\"/><child link=\"{name}\"/>{more}</joint>"
        )
    };
    let more = joint("a", "base", "<mimic joint=\"finger\" multiplier=\"0.5\" offset=\"0.1\"/>")
        + &joint("b", "a", "<mimic joint=\"ja\" multiplier=\"2\" offset=\"0.01\"/>")
        + &joint("c", "b", "<limit lower=\"0.5\" upper=\"0.5\"/>");
    let (opened, _) = with(&more, &bound).unwrap();
    let found = &opened.recording.columns["right.palm.position.x"].values;
    for (found, width) in found.iter().zip([0.06, 0.04, 0.02, 0.01]) {
        let finger = width / 2.0;
        let first = 0.5 * finger + 0.1;
        // The root is at 1 m, turned by half a turn.
        assert!((found - (1.0 - (first + 2.0 * first + 0.01 + 0.5))).abs() < 1e-12, "{found}");
    }
}
