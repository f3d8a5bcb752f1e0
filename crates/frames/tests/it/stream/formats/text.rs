//! Tables of text: what delimits them, where their header is, and sensors that are corrected.

use super::{bound, bound_text, folder, header, stamps, values};

const PALM: &str = "channels: {right.palm.position: p<xyz>}\n";

#[test]
fn the_first_line_tells_what_delimits() {
    let titles = |text: &str| header(&folder(&[("log.csv", text)]).path().join("log.csv"));
    assert_eq!(titles("t,p x,pz\n0,1,2\n"), ["t", "p x", "pz"]);
    assert_eq!(titles("t;px;pz\n0;1;2\n"), ["t", "px", "pz"]);
    assert_eq!(titles("t\tpx\tpz\n0\t1\t2\n"), ["t", "px", "pz"]);
    assert_eq!(titles("t [ms]  px   pz [mm]\n0 1 2\n"), ["t [ms]", "px", "pz [mm]"]);
    assert_eq!(titles("\"t, stamp\";px\n0;1\n"), ["t, stamp", "px"]);
    assert_eq!(titles("0,1,2\n1,1,2\n"), ["1", "2", "3"]);
    assert_eq!(titles("0 1\t 2 \n1 1 2\n"), ["1", "2", "3"]);
    assert_eq!(titles("# made by hand\n# t px pz\n0 1 2\n"), ["t", "px", "pz"]);
    assert_eq!(titles("# made by hand\nt,px,pz\n0,1,2\n"), ["t", "px", "pz"]);
}

/// Vicon Nexus, Motive of OptiTrack, and a spreadsheet.
#[test]
fn lines_above_titles_distinguish_columns_of_one_title() {
    let titles = |text: &str| header(&folder(&[("log.csv", text)]).path().join("log.csv"));
    let nexus =
        "Trajectories\n100\n,,S:cube,,,S:tool,,\nFrame,Sub Frame,X,Y,Z,X,Y,Z\n,,mm,mm,mm,mm,mm,mm\n1,0,1,2,3,4,5,6\n";
    let wanted = ["S:cube.X [mm]", "S:cube.Y [mm]", "S:cube.Z [mm]", "S:tool.X [mm]", "S:tool.Y [mm]", "S:tool.Z [mm]"];
    assert_eq!(titles(nexus), [&["Frame", "Sub Frame"], &wanted[..], &["time [s]"]].concat());
    let motive = "Format Version,1.23,Take Name,a\n\n,Type,Rigid Body,Rigid Body,Rigid Body,Rigid Body\n,Name,cube,cube,tool,tool\n\
        ,ID,7A,7A,7B,7B\n,,Rotation,Position,Rotation,Position\nFrame,Time (Seconds),X,X,X,X\n0,0.0,1,2,3,4\n";
    let wanted = ["cube.Rotation.X", "cube.Position.X", "tool.Rotation.X", "tool.Position.X"];
    assert_eq!(titles(motive), [&["Frame", "Time (Seconds)"], &wanted[..]].concat());
    assert_eq!(titles("tool,,cube,,t\nx,y,x,y,s\n1,2,3,4,5\n"), ["tool.x", "tool.y", "cube.x", "cube.y", "t.s"]);
    // Nothing distinguishes these.
    assert_eq!(titles("x,y,x,y\n1,2,3,4\n"), ["x", "y", "x", "y"]);
}

/// Two sections as Vicon Nexus exports them; the second one as a spreadsheet saves it.
const SECTIONS: &str = "Devices\n1000\n\nFrame,Sub Frame,Fx\n,,N\n1,0,5\n1,1,6\n2,0,7\n\nTrajectories,,,\n100,,,\n,,S:cube,,,S:tool,,\nFrame,Sub Frame,X,Y,Z,X,Y,Z\n\
    ,,mm,mm,mm,mm,mm,mm\n1,0,1,2,3,4,5,6\n2,0,1,2,3,4,5,6\n3,0,1,2,3,4,5,7\n";

#[test]
fn one_section_of_a_file_is_chosen_by_its_name() {
    let folder = folder(&[("log.csv", SECTIONS), ("lost.csv", &SECTIONS.replace("4,5,7", "4,five,7"))]);
    let path = |name: &str| folder.path().join(name);
    let wanted = ["S:cube.X [mm]", "S:cube.Y [mm]", "S:cube.Z [mm]", "S:tool.X [mm]", "S:tool.Y [mm]", "S:tool.Z [mm]"];
    assert_eq!(header(&path("log.csv#Trajectories")), [&["Frame", "Sub Frame"], &wanted[..], &["time [s]"]].concat());
    assert_eq!(header(&path("log.csv#devices")), ["Frame", "Sub Frame", "Fx [N]", "time [s]"]);
    let binding = "rate: 100 Hz\nchannels: {right.palm.position: '<xyz=6 7 8>'}\n";
    let (log, _) = bound(&path("log.csv#Trajectories"), binding).unwrap();
    assert_eq!(values(&log, "right.palm.position.z"), [0.006, 0.006, 0.007]);
    assert_eq!(
        values(
            &bound(
                &path("log.csv#Devices"),
                "rate: 1 kHz\nchannels: {right.palm.force: ['3 [N]', '= 0 N', '= 0 N']}\n"
            )
            .unwrap()
            .0,
            "right.palm.force.x"
        ),
        [5.0, 6.0, 7.0]
    );
    assert_eq!(
        bound(&path("log.csv"), binding).unwrap_err(),
        "log.csv: the file has the sections `Devices`, `Trajectories`\n  help: name one of them: `log.csv#Trajectories`"
    );
    assert!(bound(&path("log.csv#Joints"), binding).unwrap_err().contains("`Trajectories`; none is `Joints`"));
    // Rows are lines of the file.
    let error = bound(&path("lost.csv#Trajectories"), binding).unwrap_err();
    assert!(error.contains("lost.csv#Trajectories row 17 column S:tool.Y: found `five`"), "{error}");
    // The rate in the second line gives the stamps, one in the binding overrides it.
    let at = |file: &str, binding: &str| bound(&path(file), binding).unwrap().0.time.clone();
    let force = "channels: {right.palm.force: ['3 [N]', '= 0 N', '= 0 N']}\n";
    assert_eq!(at("log.csv#Devices", force), [0.0, 0.001, 0.002]);
    assert_eq!(at("log.csv#Devices", &format!("rate: 2 Hz\n{force}")), [0.0, 0.5, 1.0]);
    let position = "channels: {right.palm.position: '<xyz=6 7 8>'}\n";
    assert_eq!(at("log.csv#Trajectories", position), [0.0, 0.01, 0.02]);
    assert_eq!(at("log.csv#Trajectories", &format!("time: Frame\n{position}")), [1.0, 2.0, 3.0]);
    // As a column it has the same values, also where others have the stamps.
    let column = "time: Frame\nchannels: {right.gripper.closed: 'time > 0.005 s'}\n";
    let (log, _) = bound(&path("log.csv#Trajectories"), column).unwrap();
    assert_eq!(values(&log, "right.gripper.closed"), [0.0, 1.0, 1.0]);
    // A file of one section needs no name.
    let one = bound_text(
        "log.csv",
        SECTIONS.split_once("\n\nTraj").map(|(_, rest)| format!("Traj{rest}")).unwrap().as_str(),
        binding,
    )
    .unwrap();
    assert_eq!(values(&one.0, "right.palm.position.z"), [0.006, 0.006, 0.007]);
}

#[test]
fn lines_above_titles_are_skipped_where_rows_begin_with_a_text() {
    let text = "Rate: 100\nUnits: N, Counts: 1e6\nStatus (hex),Fx (N),Fy (N)\n0x8000,1,2\n0x8000,3,4\n0x8000,5,6\n";
    let titles = |text: &str| header(&folder(&[("log.csv", text)]).path().join("log.csv"));
    assert_eq!(titles(text), ["Status (hex)", "Fx (N)", "Fy (N)"]);
}

#[test]
fn numbers_bind_columns_with_names_too() {
    let (recording, _) = bound_text(
        "log.csv",
        "t,x,x,y\n0,1,2,3\n1,4,5,6\n",
        "time: t\nchannels: {right.palm.position: \"<xyz=3 2 4> [mm]\"}\n",
    )
    .unwrap();
    assert_eq!(values(&recording, "right.palm.position.x"), [0.002, 0.005]);
}

#[test]
fn columns_without_names_are_bound_by_number() {
    let text = "0 1 2 3\t\n  0.5\t4   5 6 \n1 7 8 9\n";
    let (recording, _) =
        bound_text("log.dat", text, "time: 1\nchannels: {right.palm.position: \"<xyz=2 3 4> [mm]\"}\n").unwrap();
    assert_eq!(recording.time, [0.0, 0.5, 1.0]);
    assert_eq!(values(&recording, "right.palm.position.y"), [0.002, 0.005, 0.008]);
}

/// However the text is cut into pieces while it is read: it is longer than the part that is read first, and than what a core takes at a time.
#[test]
fn a_long_table_with_blanks_is_read_to_its_end() {
    let row = |row: usize| {
        format!(
            "{}{:.3}{}{row} 0  {}\n",
            [" ", "", "\t"][row % 3],
            row as f64 / 1e3,
            " ".repeat(1 + row % 5),
            row * 7 % 31
        )
    };
    for rows in [100, 5_000, 90_000] {
        let text: String = (0..rows).map(row).collect();
        let (recording, issues) =
            bound_text("log.dat", &text, "time: 1\nchannels: {right.palm.position: \"<xyz=2 3 4>\"}\n").unwrap();
        assert!(issues.is_empty());
        assert_eq!(recording.time.len(), rows);
        assert!((0..rows).all(|row| values(&recording, "right.palm.position.x")[row] == row as f64));
        assert!((0..rows).all(|row| values(&recording, "right.palm.position.z")[row] == (row * 7 % 31) as f64));
    }
}

#[test]
fn a_comma_is_the_decimal_point_between_semicolons() {
    let text = "time;px;py;pz\n0,0;1,5;0;0\n0,1;2,5;0;0\n";
    let (recording, _) = bound_text("log.csv", text, PALM).unwrap();
    assert_eq!(recording.time, [0.0, 0.1]);
    assert_eq!(values(&recording, "right.palm.position.x"), [1.5, 2.5]);
}

#[test]
fn rows_without_stamps_have_a_rate() {
    let text = "px,py,pz\n1,2,3\n4,5,6\n";
    let (recording, _) = bound_text("log.csv", text, &format!("rate: 100 Hz\n{PALM}")).unwrap();
    assert_eq!(recording.time, [0.0, 0.01]);
    insta::assert_snapshot!(bound_text("log.csv", text, PALM).unwrap_err(), @"
    binding.yaml: the log has no column `time`
      help: name it in a binding as `time: <column>`, or write `rate: 100 Hz` if the rows are evenly spaced
    ");
}

#[test]
fn a_folder_of_tables_is_laid_on_one_time_base() {
    let folder = folder(&[
        ("run/pose.dat", "0 0 0 1\n0.02 2 0 1\n0.04 4 0 1\n"),
        ("run/force.dat", "0.01 5 0 0\n0.03 6 0 0\n0.05 7 0 0\n"),
        ("run/notes.txt", ""),
    ]);
    let log = folder.path().join("run");
    let binding = "
time: 1
channels:
  right.palm.position: pose.<xyz=2 3 4>
  right.palm.force: force.<xyz=2 3 4>
";
    let (recording, _) = bound(&log, &format!("{binding}resample: 100 Hz\n")).unwrap();
    let stamps: Vec<i64> = recording.time.iter().map(|time| (time * 1e3).round() as i64).collect();
    // The ends at which only one of them was measured are cut off.
    assert_eq!(stamps, [10, 20, 30, 40]);
    // Positions go on between their samples, forces stay.
    assert_eq!(values(&recording, "right.palm.position.x"), [1.0, 2.0, 3.0, 4.0]);
    assert_eq!(values(&recording, "right.palm.force.x"), [5.0, 5.0, 6.0, 6.0]);
    // A sensor that begins later than what may be bridged is reported to be silent until then.
    let (recording, _) = bound(&log, &format!("{binding}resample: 100 Hz\nbridge: 25 ms\ntime_offset: 0 s\nsensors: {{right.palm.force: {{time_offset: 30 ms}}}}\n")).unwrap();
    assert!(recording.time.len() > 4 && values(&recording, "right.palm.force.x")[0].is_nan());
    insta::assert_snapshot!(bound(&log, binding).unwrap_err(), @r"
    run: the bound columns are of 2 sheets with stamps of their own
      help: name the common rate in the binding, such as `resample: 100 Hz`
    ");
    // One of them alone needs no common rate.
    let alone = "time: 1\nchannels: {right.palm.force: force.<xyz=2 3 4>}\n";
    assert_eq!(bound(&log, alone).unwrap().0.time, [0.01, 0.03, 0.05]);
    let refused = "time: 1\nchannels: {right.palm.force: notes.<xyz=2 3 4>}\n";
    insta::assert_snapshot!(bound(&log, refused).unwrap_err(), @"binding.yaml:2:12: `notes` cannot be read: the file is empty, expected a header and rows");
}

const CAPTURE: &str = "NO_OF_FRAMES\t3\nFREQUENCY\t50\nMARKER_NAMES\ttip\tpillow\n";

#[test]
fn qualisys_markers_that_were_lost_are_not_measured() {
    let text = format!(
        "{CAPTURE}Frame\tTime\ttip X\ttip Y\ttip Z\tpillow X\tpillow Y\tpillow Z\t\n1\t0.00\t1\t2\t3\t0\t0\t0\n2\t0.02\t0.000\t0.000\t0.000\t4\t5\t6\t\n3\t0.04\t\t\t\t4\t5\t6\n"
    );
    let binding = "channels: {right.thumb.position: tip <XYZ>, cube.position: pillow <XYZ>}\n";
    let (recording, _) = bound_text("capture.tsv", &text, binding).unwrap();
    assert_eq!(recording.time, [0.0, 0.02, 0.04]);
    let tip = values(&recording, "right.thumb.position.z");
    assert!(tip[0] == 0.003 && tip[1].is_nan() && tip[2].is_nan());
    let pillow = values(&recording, "cube.position.x");
    assert!(pillow[0].is_nan() && pillow[1..] == [0.004, 0.004]);
}

#[test]
fn a_qualisys_file_with_fewer_frames_than_declared_is_truncated() {
    let frames = "1\t0.00\t1\t2\t3\t4\t5\t6\n2\t0.02\t1\t2\t3\t4\t5\t6\n";
    let titles = "Frame\tTime\ttip X\ttip Y\ttip Z\tpillow X\tpillow Y\tpillow Z\n";
    let issues = |frames: &str| {
        let binding = "channels: {right.thumb.position: tip <XYZ>}\n";
        let (_, issues) = bound_text("capture.tsv", &format!("{CAPTURE}{titles}{frames}"), binding).unwrap();
        issues.iter().map(|it| format!("{} {} s: {}", it.kind, it.start_s, it.message)).collect::<Vec<_>>().join("\n")
    };
    insta::assert_snapshot!(issues(frames), @"truncated 0.02 s: the header declares 3 frames, found 2: the file is incomplete");
    insta::assert_snapshot!(issues(&format!("{frames}3\t0.04\t1")), @"truncated 0.02 s: row 7, the last one, is cut short (found 3 fields, expected 8); it is left out; the header declares 3 frames, found 2: the file is incomplete");
    assert_eq!(issues(&format!("{frames}3\t0.04\t1\t2\t3\t4\t5\t6\n")), "");
}

#[test]
fn qualisys_frames_without_stamps_have_the_rate_of_the_header() {
    let (recording, issues) = bound_text(
        "capture.tsv",
        &format!("{CAPTURE}1\t2\t3\t4\t5\t6\n1\t2\t3\t4\t5\t6\n1\t2"),
        "channels: {right.thumb.position: tip <XYZ>}\n",
    )
    .unwrap();
    assert_eq!(recording.time, [0.0, 0.02]);
    assert_eq!(issues.len(), 1);
    insta::assert_snapshot!(issues[0].message, @"row 6, the last one, is cut short (found 2 fields, expected 6); it is left out; the header declares 3 frames, found 2: the file is incomplete");
    let refused = |rows: &str| bound_text("capture.tsv", &format!("{CAPTURE}{rows}"), "").unwrap_err();
    insta::assert_snapshot!(refused("1\t2\n1\t2\t3\t4\t5\t6\n"), @"capture.tsv row 4: found 2 fields, expected 6");
    insta::assert_snapshot!(refused("1\t2\t3\t4\t5\tfar\n1\t2\t3\t4\t5\t6\n"), @"capture.tsv row 4: found `far`, expected a number");
}

#[test]
fn a_flag_is_made_by_a_threshold() {
    let text = "time,opening [mm],pad\n0,80,0.1\n1,29,0.3\n2,,\n";
    let binding = "channels: {right.gripper.closed: opening < 30 mm, right.thumb.contact: pad > 0.2}\n";
    let (recording, _) = bound_text("log.csv", text, binding).unwrap();
    for name in ["right.gripper.closed", "right.thumb.contact"] {
        let flags = values(&recording, name);
        assert!(flags[..2] == [0.0, 1.0] && flags[2].is_nan(), "{name}: {flags:?}");
    }
    let wrong = |channel: &str| bound_text("log.csv", text, &format!("channels: {{{channel}}}\n")).unwrap_err();
    insta::assert_snapshot!(wrong("right.gripper.closed: opening < 30 N"), @"binding.yaml:1:12: `mm` is a length (m), expected a force (N)");
    insta::assert_snapshot!(wrong("right.gripper.closed: pad < 30 mm"), @"binding.yaml:1:12: the column `pad` has no unit to compare with the limit's, expected `pad [unit]`");
    insta::assert_snapshot!(wrong("right.gripper.opening: opening < 30 mm"), @"binding.yaml:1:12: `right.gripper.opening` is not a flag; only flags have a threshold");
}

/// A wrist sensor that is upright first and lies on its side then, with a tool of 1 kg, a bias of 0.5 N, and a push on an object of 3 N along x.
const WRIST: &str = "time,qw,qx,qy,qz,fx,fy,fz
0,1,0,0,0,0.5,0.5,10.31
1,1,0,0,0,0.5,0.5,10.31
2,0.7071067811865476,0,0.7071067811865476,0,-9.31,0.5,3.5
";

#[test]
fn a_wrist_sensor_is_turned_and_its_tool_taken_off() {
    let binding = "
channels: {right.palm.rotation: q<wxyz>, right.palm.force: f<xyz>}
sensors: {right.palm.force: {frame: right.palm.rotation, tool: 1 kg}}
tare: {channels: [right.palm.force], from: 0 s, to: 1.5 s}
";
    let (recording, _) = bound_text("log.csv", WRIST, binding).unwrap();
    let force = |row: usize| ["x", "y", "z"].map(|axis| values(&recording, &format!("right.palm.force.{axis}"))[row]);
    for (row, wanted) in [(0, [0.0, 0.0, 0.0]), (2, [3.0, 0.0, 0.0])] {
        for (found, wanted) in force(row).iter().zip(wanted) {
            assert!((found - wanted).abs() < 1e-9, "row {row}: {:?}", force(row));
        }
    }
}

#[test]
fn corrections_of_what_is_not_bound_are_refused() {
    let wrong = |sensors: &str| {
        let binding =
            format!("channels: {{right.palm.force: f<xyz>, right.thumb.contact: qx}}\nsensors: {{{sensors}}}\n");
        bound_text("log.csv", WRIST, &binding).unwrap_err()
    };
    insta::assert_snapshot!(
        [
            wrong("right.thumb.force: {tool: 1 kg}"),
            wrong("right.palm.force: {frame: right.palm.rotation}"),
            wrong("right.thumb.contact: {tool: 1 kg}"),
            wrong("right.palm.force: {time_offset: 12 ms}"),
        ]
        .join("\n")
    );
}

#[test]
fn a_sensor_that_reports_late_is_set_back() {
    let text = "time,px,py,pz,fx,fy,fz\n0,0,0,0,0,0,0\n0.1,1,0,0,0,0,0\n0.2,2,0,0,9,0,0\n0.3,3,0,0,9,0,0\n";
    let binding = "
channels: {right.palm.position: p<xyz>, right.palm.force: f<xyz>}
sensors: {right.palm.force: {time_offset: -50 ms}}
resample: 20 Hz
bridge: 200 ms
";
    let (recording, _) = bound_text("log.csv", text, binding).unwrap();
    let begins = values(&recording, "right.palm.force.x").iter().position(|force| *force > 1.0).unwrap();
    assert!((recording.time[begins] - 0.15).abs() < 1e-9);
    let there = values(&recording, "right.palm.position.x")[begins];
    assert!((there - 1.5).abs() < 1e-9, "{there}");
}

#[test]
fn units_stand_in_round_brackets_too() {
    let log = "t (ms),Opening (mm)\n0,10\n10,20\n";
    for column in ["Opening", "Opening (mm)", "Opening [mm]"] {
        let (recording, _) =
            bound_text("log.csv", log, &format!("time: t\nchannels: {{right.gripper.opening: \"{column}\"}}\n"))
                .unwrap();
        assert_eq!((values(&recording, "right.gripper.opening"), recording.time[1]), (&[0.01, 0.02][..], 0.01));
    }
}

#[test]
fn dates_and_clocks_are_stamps() {
    let at = |stamp: &str| {
        let log = format!("when;a\n{stamp};1\n2026-11-21T19:07:01Z;2\n");
        let folder = folder(&[("log.csv", log.as_str())]);
        stamps(&folder.path().join("log.csv"), "time: when\nchannels: {right.gripper.opening: a}\n")
    };
    assert_eq!(at("2026-11-21 19:07:00.25").unwrap(), [1_795_288_020.25, 1_795_288_021.0]);
    assert_eq!(at("2026-11-21 20:07:00.5+01:00").unwrap()[0], 1_795_288_020.5);
    assert_eq!(at("1970/01/01T00:00").unwrap()[0], 0.0);
    assert_eq!(at("2024-02-29 00:00:00").unwrap()[0], 1_709_164_800.0);
    insta::assert_snapshot!(at("2026-13-01 00:00").unwrap_err(), @r"
    log.csv row 2 column when: found `2026-13-01 00:00`, expected a time
      help: write dates as `2026-11-21 19:07:00.25`, times of day as `19:07:00.25` or `07:07:00.25 PM`, minutes as `07:00.25`
    ");
}

#[test]
fn columns_without_names_and_delimiters_too_many_do_no_harm() {
    let log = "t,a,,\n0,1,5,,\n1,2,6,,\n";
    let (recording, _) = bound_text("log.csv", log, "time: t\nchannels: {right.gripper.opening: 3}\n").unwrap();
    assert_eq!(values(&recording, "right.gripper.opening"), [5.0, 6.0]);
}

#[test]
fn rotation_vectors_become_quaternions() {
    // A third of a turn about the diagonal, and two thirds the other way round, which are the same rotation.
    let log = "t,rx,ry,rz,p[3],p[4],p[5]\n0,1.2091996,1.2091996,1.2091996,120,0,0\n1,-2.4183992,-2.4183992,-2.4183992,0,0,0\n";
    let channels = "{cube.rotation: r<rotvec>, right.palm.rotation: \"p[<rotvec=3 4 5>] [deg]\"}";
    let (recording, issues) = bound_text("log.csv", log, &format!("time: t\nchannels: {channels}\n")).unwrap();
    assert!(issues.is_empty(), "{issues:?}");
    for letter in ["w", "x", "y", "z"] {
        let of = values(&recording, &format!("cube.rotation.{letter}"));
        assert!(of.iter().all(|value| (value.abs() - 0.5).abs() < 1e-6), "{letter}: {of:?}");
    }
    let [w, x] = ["w", "x"].map(|letter| values(&recording, &format!("right.palm.rotation.{letter}")));
    assert!((w[0] - 0.5).abs() < 1e-6 && (x[0] - 0.75_f64.sqrt()).abs() < 1e-6 && w[1] == 1.0);
    // Degrees that are read as radians.
    let log = "t,x,y,z\n0,120,0,0\n1,120,0,0\n2,120,0,0\n";
    let (_, issues) = bound_text("log.csv", log, "time: t\nchannels: {cube.rotation: <rotvec>}\n").unwrap();
    assert!(issues.iter().any(|issue| issue.message.contains("if they are degrees, write")), "{issues:?}");
}

#[test]
fn angles_and_matrices_become_quaternions() {
    // A quarter turn about x, then one about z.
    let log = "t,r,p,y,m0,m1,m2,m3,m4,m5,m6,m7,m8\n0,90,0,90,0,0,1,1,0,0,0,1,0\n1,90,0,90,0,0,1,1,0,0,0,1,9\n";
    let (recording, _) = bound_text(
        "log.csv",
        log,
        "time: t\nchannels: {cube.rotation: \"<rpy> [deg]\", right.palm.rotation: [m0, m1, m2, m3, m4, m5, m6, m7, m8]}\n",
    )
    .unwrap();
    for letter in ["w", "x", "y", "z"] {
        let [of_angles, of_matrix] =
            ["cube", "right.palm"].map(|of| values(&recording, &format!("{of}.rotation.{letter}")));
        assert!((of_angles[0] - 0.5).abs() < 1e-12 && (of_matrix[0] - 0.5).abs() < 1e-9, "{letter}");
        // Values other than a rotation are unmeasured.
        assert!(of_matrix[1].is_nan());
    }
    assert!(!recording.columns.keys().any(|name| name.ends_with("roll") || name.ends_with("m00")));
    let wrong = |columns: &str| {
        bound_text("log.csv", log, &format!("time: t\nchannels: {{cube.rotation: {columns}}}\n")).unwrap_err()
    };
    insta::assert_snapshot!(
        [wrong("\"<xyz=r p y>\""), wrong("\"<rpy> [mm]\"")].join("\n"), @r"
    binding.yaml:2:12: `cube.rotation` has 4 components, found columns for 3; roll, pitch and yaw are `<rpy>`, a rotation vector is `<rotvec>`
    binding.yaml:2:12: `mm` is a length (m), expected an angle (rad)
    "
    );
}

#[test]
fn lines_about_the_recording_and_units_stand_above_the_numbers() {
    let binding = "channels: {right.gripper.opening: b}\n";
    for (name, log) in [
        ("log.csv", "Device,ATI Gamma\nRate,100\n\ntime (s),a (N),b (mm)\n0,1,2000\n0.01,NA,3000\n"),
        ("log.csv", "time,a,b\ns,N,mm\n0,1,2000\n0.01,null,3000\n"),
        (
            "log.txt",
            "Recording of a hand\nby: a test\ntime\ta\tb\n[s]\t-\t[mm]\n0,00\t1,0\t2000,0\n0,01\t1,0\t3000,0\n",
        ),
        ("log", "time;a;b\n0,00;1,0;2\n0,01;1,0;3\n"),
    ] {
        let (recording, _) = bound_text(name, log, binding).unwrap();
        assert_eq!(values(&recording, "right.gripper.opening"), [2.0, 3.0], "{log}");
        assert_eq!(recording.time, [0.0, 0.01]);
    }
    let refused = |log: &str| bound_text("log.csv", log, binding).unwrap_err();
    // Rows are counted as lines of the file; a first line that goes with the numbers is the titles.
    insta::assert_snapshot!(
        [
            refused("Device,ATI Gamma\n\ntime,a,b\n0,1,2\n0.01,far,far\n0.02,1,1\n"),
            refused("time,a,b\nnone,no,no\nyes,1,2\n0,1,2\n"),
            refused("\u{feff}Device\ntime,a,b\n0,1,2\n0,1\n0,1,2\n"),
        ]
        .join("\n"), @r"
    log.csv row 5 column b: found `far`, expected a number
    log.csv row 2 column time: found `none`, expected a time
    log.csv row 4: found 2 fields, expected 3 as in the header
    "
    );
    let folder = folder(&[]);
    let path = folder.path().join("log.csv");
    std::fs::write(&path, [0xff, 0xfe, b't', 0, b'\n', 0]).unwrap();
    insta::assert_snapshot!(bound(&path, binding).unwrap_err(), @r"
    log.csv: found text in UTF-16, expected UTF-8
      help: save it as UTF-8
    ");
}

/// Number of rows that is large enough for parallel reading.
const MANY: usize = 60_000;

/// A text of many rows whose cells tell their row, with some lines otherwise.
fn many(line_end: &str, otherwise: &[(usize, &str)]) -> String {
    let mut text = format!("time,px,py,pz,note{line_end}");
    for row in 2..MANY {
        match otherwise.iter().find(|(at, _)| *at == row) {
            Some((_, line)) => text.push_str(line),
            None => text.push_str(&format!("{},{row}.0625,-{row}e-3,0.123456789012345,a note", row as f64 / 1000.0)),
        }
        text.push_str(line_end);
    }
    text
}

#[test]
fn many_lines_are_read_as_a_few_are() {
    for line_end in ["\n", "\r\n"] {
        let text = many(
            line_end,
            &[(30_000, ""), (40_000, "40,\"40000.0625\",-40,0.5,\"a, b\""), (50_000, "50 , 1.5, ,nan,")],
        );
        let (recording, _) = bound_text("log.csv", &text, PALM).unwrap();
        let (x, y) = (values(&recording, "right.palm.position.x"), values(&recording, "right.palm.position.y"));
        // One line is empty.
        assert_eq!(recording.time.len(), MANY - 3);
        for (at, row) in (2..30_000).chain(30_001..MANY).enumerate() {
            assert_eq!(recording.time[at], row as f64 / 1000.0);
            if row != 50_000 {
                assert_eq!(
                    (x[at], y[at]),
                    (row as f64 + 0.0625, if row == 40_000 { -40.0 } else { -(row as f64) / 1000.0 })
                );
            } else {
                assert!(x[at] == 1.5 && y[at].is_nan());
            }
        }
    }
}

#[test]
fn what_is_wrong_far_down_is_reported_with_its_row() {
    let printed = |text: &str| bound_text("log.csv", text, PALM).unwrap_err().to_string();
    for line_end in ["\n", "\r\n"] {
        let printed = |otherwise: &[(usize, &str)]| printed(&many(line_end, otherwise));
        assert_eq!(printed(&[(52_345, "52.345,1,x,3,")]), "log.csv row 52345 column py: found `x`, expected a number");
        assert_eq!(
            printed(&[(7, ""), (52_345, "52.345,1,2")]),
            "log.csv row 52345: found 3 fields, expected 5 as in the header"
        );
        assert_eq!(
            printed(&[(52_345, "1,1,2,3,")]),
            "log.csv row 52345 column time: time runs backwards: 1 s after 52.344 s"
        );
        // The first of two.
        assert_eq!(
            printed(&[(20_000, "20,?,2,3,"), (52_345, "52.345,?,2,3,")]),
            "log.csv row 20000 column px: found `?`, expected a number"
        );
    }
    let open = printed(&many("\n", &[(52_345, "52.345,1,2,3,\"open")]));
    assert_eq!(open, "log.csv row 52345: a cell goes on over the end of its line: a quote is opened and not closed");
}

#[test]
fn a_last_row_that_is_cut_short_is_left_out_of_many() {
    let (recording, issues) = bound_text("log.csv", &format!("{}99,1,2", many("\n", &[])), PALM).unwrap();
    assert_eq!(recording.time.len(), MANY - 2);
    insta::assert_snapshot!(issues.iter().map(|it| format!("{} {}", it.kind, it.message)).collect::<Vec<_>>().join("\n"), @"truncated row 60000, the last one, is cut short (3 of 5 fields); it is left out");
}

/// If two columns share a name, neither is bound silently.
#[test]
fn a_name_that_occurs_twice_is_refused_with_both_columns() {
    let rows = "0,0.1,0.2,0.3,5,6,7\n0.01,0.1,0.2,0.3,5,6,7\n0.02,0.1,0.2,0.3,5,6,7\n";
    let log = format!("t,x,y,z,x,y,z\n{rows}");
    let position = "time: t\nchannels: {cube.position: <xyz>}\n";
    let refused = |name: &str, log: &str, binding: &str| bound_text(name, log, binding).unwrap_err();
    let twice = |binding: &str| refused("log.csv", &log, binding);
    // A time column, a text column, a column of a mean, an optional one, and one with a threshold.
    let stamps = format!("t,t,x,y,z\n{}", "0,0,1,2,3\n");
    let words = "time: t\nchannels: {right.gripper.opening: t, right.label: x}\n";
    let mean = "time: t\nchannels: {right.gripper.opening: {mean: [t, x]}}\n";
    let limit = "time: t\nchannels: {right.gripper.closed: z? > 6}\n";
    let capture = "NO_OF_FRAMES\t2\nFREQUENCY\t50\nMARKER_NAMES\ta\ta\n1\t2\t3\t4\t5\t6\n7\t8\t9\t1\t2\t3\n";
    let said = [
        twice(position),
        refused("log.csv", &stamps, position),
        twice(words),
        twice(mean),
        twice(limit),
        refused("log.tsv", capture, "channels: {cube.position: a <XYZ>}\n"),
    ];
    insta::assert_snapshot!(said.join("\n"), @"
    binding.yaml:2:12: `x` is the name of columns 2 and 5, expected a name that one column has: rename the others in the log, or bind the number
    binding.yaml:1:1: `t` is the name of columns 1 and 2, expected a name that one column has: rename the others in the log, or bind the number
    binding.yaml:2:38: `x` is the name of columns 2 and 5, expected a name that one column has: rename the others in the log, or bind the number
    binding.yaml:2:12: `x` is the name of columns 2 and 5, expected a name that one column has: rename the others in the log, or bind the number
    binding.yaml:2:12: `z` is the name of columns 4 and 7, expected a name that one column has: rename the others in the log, or bind the number
    binding.yaml:1:12: `a X` is the name of columns 2 and 5, expected a name that one column has: rename the others in the log, or bind the number
    ");
    // Columns that are not bound may share a name, and units distinguish columns with one name.
    let alone = log.replace("x,y,z\n", "x,y,w\n");
    let (recording, _) = bound_text("log.csv", &alone, "channels: {right.gripper.opening: w}\ntime: t\n").unwrap();
    assert_eq!(values(&recording, "right.gripper.opening"), [7.0; 3]);
    let units = log.replace("x,y,z,x,y,z", "x [m],y [m],z [m],x [N],y [N],z [N]");
    let both = "time: t\nchannels: {cube.position: '<xyz> [m]', right.thumb.force: '<xyz> [N]'}\n";
    let (recording, _) = bound_text("log.csv", &units, both).unwrap();
    assert_eq!((values(&recording, "cube.position.x")[0], values(&recording, "right.thumb.force.z")[0]), (0.1, 7.0));
    assert!(refused("log.csv", &units, position).contains("columns 2 and 5"));
}
