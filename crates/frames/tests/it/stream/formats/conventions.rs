//! What other programs write beside numbers, or in place of them (tools/make_convention_fixtures.py): scales, units, fields, decimal numbers, sentinels.

use super::{bound, bound_text, fixture, folder, header, stamps, values};
use crate::shared::files::columns;
use std::path::PathBuf;
use teachtree_logs::read::formats;

fn file(name: &str) -> PathBuf {
    fixture("conventions").join(name)
}

fn near(found: &[f64], wanted: &[f64]) -> bool {
    let same = |(a, b): (&f64, &f64)| a.is_nan() && b.is_nan() || (a - b).abs() < 1e-9;
    found.len() == wanted.len() && found.iter().zip(wanted).all(same)
}

#[test]
fn scales_offsets_and_units_in_attributes_count() {
    assert_eq!(header(&file("packed.hdf5")), ["count", "height [m]", "time", "width [millimeters]"]);
    let binding = "channels: {right.gripper.opening: width, cube.position: [height, '= 0 m', '= 0 m']}\n";
    let (log, _) = bound(&file("packed.hdf5"), binding).unwrap();
    assert!(near(values(&log, "right.gripper.opening"), &[0.01, 0.02, 0.03, 0.04]));
    let height = values(&log, "cube.position.x");
    assert!(near(height, &[0.6, 0.7, f64::NAN, 0.8]), "{height:?}");
    let error = bound(&file("packed.hdf5"), "channels: {right.gripper.opening: 'width [m]'}\n").unwrap_err();
    assert!(error.contains("`width` is in `millimeters` as the header says, not in `m`"), "{error}");
}

#[test]
fn fields_of_structured_arrays_in_hdf5_are_columns() {
    let found = columns(formats::open(&file("fields.hdf5")).unwrap());
    assert!(near(&found["frames/tcp[1]"], &[0.125, 0.5, 0.875, 1.25]), "{found:?}");
    assert_eq!(found["frames/pose/turns"], [-1.0, -2.0, -3.0, 300.0]);
    assert_eq!(found["frames/is_closed"], [0.0, 1.0, 1.0, 0.0]);
    let binding = "time: frames/stamp\nchannels: {right.gripper.opening: frames/pose/z, right.label: frames/word}\n";
    let (log, _) = bound(&file("fields.hdf5"), binding).unwrap();
    assert_eq!((&*log.time, values(&log, "right.gripper.opening")[3]), (&[0.0, 0.5, 1.0, 1.5][..], 1.0));
    assert_eq!(log.labels["right.label"], ["Move", "Grasp", "Grasp", "Move"]);
}

#[test]
fn matrices_of_poses_may_be_stored_column_by_column() {
    let found = columns(formats::open(&file("matrices.mat")).unwrap());
    assert!(near(&found["pose.position.y"], &[0.0, 0.2, 0.4, 0.6]), "{found:?}");
    let half = 0.5_f64.sqrt();
    assert!(near(&found["pose.rotation.w"], &[1.0, half, 0.0, -half]), "{:?}", found["pose.rotation.w"]);
    assert!(near(&found["pose.rotation.z"], &[0.0, half, 1.0, half]), "{:?}", found["pose.rotation.z"]);
}

#[test]
fn numbers_that_parquet_stores_as_bytes_are_read() {
    let found = columns(formats::open(&file("types.parquet")).unwrap());
    for name in ["decimal", "wide", "list[0]"] {
        assert!(near(&found[name], &[0.08, -0.04, 123_456.789, 0.0]), "{name}: {:?}", found[name]);
    }
    assert!(near(&found["half"], &[0.5, -1.25, 65_504.0, f64::NAN]), "{:?}", found["half"]);
    assert!(near(&found["missing"], &[f64::NAN, 0.08, f64::NAN, -0.04]), "{:?}", found["missing"]);
    let found = stamps(&file("int96.parquet"), "time: stamp\nchannels: {right.gripper.opening: a}\n").unwrap();
    assert_eq!(found, [1_795_288_020.0, 1_795_288_020.5, 1_795_288_021.0, 1_795_288_021.5]);
}

#[test]
fn sentinels_count_as_not_measured() {
    let log = |sentinel: &str| {
        let row = |row: usize| {
            let width = if (30..40).contains(&row) { sentinel.to_string() } else { format!("{}", 10 + row) };
            format!("{},{width}\n", row as f64 * 0.01)
        };
        format!("t,w\n{}", (0..100).map(row).collect::<String>())
    };
    let binding = "time: t\nchannels: {right.gripper.opening: 'w [mm]', right.gripper.closed: 'w [mm] < 60 mm'}\n";
    for sentinel in ["-9999", "-999.0", "-32768", "99999"] {
        let (read, issues) = bound_text("log.csv", &log(sentinel), binding).unwrap();
        for channel in ["right.gripper.opening", "right.gripper.closed"] {
            let missing: Vec<usize> = (0..100).filter(|row| values(&read, channel)[*row].is_nan()).collect();
            assert_eq!(missing, (30..40).collect::<Vec<_>>(), "{sentinel} {channel}");
        }
        let told = issues.iter().find(|issue| issue.kind == "not_a_number").unwrap();
        assert_eq!((told.start_s, told.end_s), (0.3, 0.39));
        assert!(told.message.starts_with("10 samples are -") || sentinel == "99999", "{}", told.message);
    }
    insta::assert_snapshot!(bound_text("log.csv", &log("-9999"), binding).unwrap().1[0].message, @"10 samples are -9999 in the column `w`, far from all other values; they count as not measured");
    // A value near the others is one of them, and a column of two values has no other values.
    let row = |row: usize| format!("{},{}\n", row as f64 * 0.01, if row < 50 { 0 } else { 9999 });
    let two_values = format!("t,w\n{}", (0..100).map(row).collect::<String>());
    for text in [log("-900"), log("99"), two_values] {
        let (read, issues) = bound_text("log.csv", &text, binding).unwrap();
        assert!(issues.is_empty() && values(&read, "right.gripper.opening").iter().all(|value| !value.is_nan()));
    }
}

#[test]
fn texts_of_spreadsheets_and_of_c_libraries_are_missing_values() {
    let unmeasured = [
        "NULL",
        "null",
        "NaN",
        "nan",
        "#N/A",
        "#DIV/0!",
        "#NUM!",
        "1.#QNAN",
        "-1.#IND",
        "1.#INF",
        "-nan(ind)",
        "<NA>",
        "None",
        ".",
        "--",
        "Infinity",
    ];
    let rows: String = (0..).zip(unmeasured).map(|(row, text)| format!("{row},{text}\n")).collect();
    let (log, _) =
        bound_text("log.csv", &format!("t,a\n{rows}"), "time: t\nchannels: {right.gripper.opening: a}\n").unwrap();
    assert!(values(&log, "right.gripper.opening").iter().all(|value| value.is_nan()));
    assert!(bound_text("log.csv", "t,a\n0,lost\n", "time: t\nchannels: {right.gripper.opening: a}\n").is_err());
}

#[test]
fn units_may_be_words() {
    for (unit, width) in
        [("mm", 0.04), ("Millimeters", 0.04), ("millimetre", 0.04), ("inches", 1.016), ("Meter", 40.0), ("cm", 0.4)]
    {
        let text = format!("Time (Sec),width [{unit}]\n0,40\n0.01,40\n");
        let (log, _) = bound_text("log.csv", &text, "time: Time\nchannels: {right.gripper.opening: width}\n").unwrap();
        assert!(near(values(&log, "right.gripper.opening"), &[width, width]), "{unit}");
    }
    let (log, _) =
        bound_text("log.csv", "t (msec),f [gf]\n0,100\n10,100\n", "time: t\nchannels: {right.palm.level: f}\n")
            .unwrap();
    assert!(near(values(&log, "right.palm.level"), &[0.980_665; 2]) && log.time[1] == 0.01);
    // Ordinal numbers and parts of the body are not units.
    let text = "t,marker (second),x (foot)\n0,1,2\n";
    assert_eq!(
        values(
            &bound_text("log.csv", text, "time: t\nchannels: {right.gripper.opening: 'x (foot)'}\n").unwrap().0,
            "right.gripper.opening"
        ),
        [2.0]
    );
}

/// LabVIEW, OpenSim, the marker files of Motion Analysis, and pandas.
#[test]
fn headings_of_other_programs_are_read_whatever_the_name_ends_in() {
    let titles = |name: &str, text: &str| header(&folder(&[(name, text)]).path().join(name));
    let labview = "LabVIEW Measurement\t\nSeparator\tTab\nDate\t2026/03/01\n***End_of_Header***\t\n\t\nChannels\t2\t\nSamples\t3\t3\n\
        X0\t0.0\t0.0\t\nDelta_X\t0.01\t0.01\t\n***End_of_Header***\t\t\nX_Value\tx\twidth\tComment\n0.00\t1\t2\n0.01\t1\t2\n";
    assert_eq!(titles("log.lvm", labview), ["X_Value", "x", "width"]);
    let open_sim =
        "Coordinates\nnRows=2\nnColumns=3\ninDegrees=no\nendheader\ntime\tx\twidth\n0.00\t1\t2\n0.01\t1\t2\n";
    assert_eq!(titles("log.sto", open_sim), ["time", "x", "width"]);
    let markers = "PathFileType\t4\t(X/Y/Z)\tlog.trc\nDataRate\tNumFrames\tNumMarkers\tUnits\n100.00\t2\t2\tmm\n\
        Frame#\tTime\tTCP\t\t\tCUBE\t\t\t\n\t\tX1\tY1\tZ1\tX2\tY2\tZ2\n\n1\t0.00\t1\t2\t3\t4\t5\t6\n2\t0.01\t1\t2\t3\t4\t5\t6\n";
    assert_eq!(titles("log.trc", markers), ["Frame#", "Time", "X1", "Y1", "Z1", "X2", "Y2", "Z2"]);
    let pandas = ",tcp,tcp,cube,cube\n,x,y,x,y\ntime,,,,\n0.00,1,2,3,4\n0.01,1,2,3,4\n";
    assert_eq!(titles("log.csv", pandas), ["time", "tcp.x", "tcp.y", "cube.x", "cube.y"]);
    // The error of a rigid body of Motive has its title one line higher.
    let motive = "Format Version,1.23\n\n,Name,cube,cube,cube,tool\n,,Rotation,Position,Mean Marker Error,Position\n\
        Frame,Time (Seconds),X,X,,X\n0,0.0,1,2,3,4\n1,0.1,1,2,3,4\n";
    let wanted = ["cube.Rotation.X", "cube.Position.X", "cube.Mean Marker Error", "tool.Position.X"];
    assert_eq!(titles("log.csv", motive), [&["Frame", "Time (Seconds)"], &wanted[..]].concat());
    // A delimiter behind the titles alone is surplus.
    assert_eq!(titles("log.csv", "t,a,\n0,1\n1,1\n"), ["t", "a"]);
    // Text without rows of numbers is not a table.
    let folder = folder(&[("notes.md", "# Notes\n1, 2\n"), ("log.json", "[\n0.1,\n0.2,\n0.3]\n")]);
    for name in ["notes.md", "log.json"] {
        let error = bound(&folder.path().join(name), "").unwrap_err();
        assert!(error.contains("its first bytes are those of no known format"), "{error}");
    }
}

#[test]
fn what_stands_for_a_file_is_named() {
    let pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n";
    let page = "<!DOCTYPE html>\n<html><body>404</body></html>\n";
    let folder = folder(&[("log.csv", pointer), ("log.parquet", pointer), ("page.csv", page)]);
    let refused = |name: &str| bound(&folder.path().join(name), "").unwrap_err();
    insta::assert_snapshot!([refused("log.csv"), refused("log.parquet"), refused("page.csv")].join("\n"), @r"
    log.csv: found a pointer of Git LFS, expected the file that it stands for
      help: `git lfs pull` fetches the files of a repository
    log.parquet: found a pointer of Git LFS, expected the file that it stands for
      help: `git lfs pull` fetches the files of a repository
    page.csv: found a web page (HTML), expected a log: the download has failed
      help: download the file again, with the access that its server asks for
    ");
}
