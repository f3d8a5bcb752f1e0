//! What a binding makes of a foreign log.

use std::path::Path;
use teachtree_base::recording::Recording;
use teachtree_base::scene::Scene;
use teachtree_base::units::Dimension;
use teachtree_frames::OpenRequest;
use teachtree_frames::OpenedLog;
use teachtree_frames::bind::{BindingFile, bind};
use teachtree_frames::open;
use teachtree_logs::read::formats::delimited_text;

fn opened() -> OpenedLog {
    let [log, binding] =
        ["foreign.csv", "whole.yaml"].map(|file| Path::new(crate::ROOT).join("tests/fixtures/bindings").join(file));
    open(&OpenRequest { log, binding: Some(binding), ..OpenRequest::default() }).unwrap()
}

/// The value of a column at a time, s.
fn at(recording: &Recording, name: &str, time: f64) -> f64 {
    let row = recording.time.iter().position(|stamp| (stamp - time).abs() < 1e-9).unwrap();
    recording.columns[name].values[row]
}

#[test]
fn columns_get_canonical_names_in_si() {
    let recording = opened().recording;
    assert_eq!(recording.columns["right.thumb.position.x"].dimension, Dimension::LENGTH);
    // The header says millimeters, and the third component comes from the column `TipB 2`.
    assert_eq!(at(&recording, "right.thumb.position.x", 0.1), -0.060);
    assert_eq!(at(&recording, "right.index.position.z", 0.1), 0.06);
    assert_eq!(recording.labels["right.label"].first().unwrap(), "idle");
    assert_eq!(recording.labels["right.label"].last().unwrap(), "hold");
}

#[test]
fn stamps_in_milliseconds_become_an_even_base() {
    let time = opened().recording.time;
    assert_eq!(time.len(), 37);
    assert!(time.iter().enumerate().all(|(row, stamp)| (stamp - row as f64 * 0.02).abs() < 1e-12));
}

#[test]
fn poses_are_interpolated_and_forces_held() {
    let recording = opened().recording;
    // Samples at 0.03 s (row 1) and 0.05 s (row 2): z is 10 and 20 mm, the turn about z is 0.01 and 0.02 rad.
    assert!((at(&recording, "right.thumb.position.z", 0.04) - 0.015).abs() < 1e-12);
    assert!((at(&recording, "box.rotation.z", 0.04) - (0.015f64 / 2.0).sin()).abs() < 1e-6);
    assert!((at(&recording, "box.rotation.w", 0.04) - (0.015f64 / 2.0).cos()).abs() < 1e-6);
    // Touch begins with row 10 at 0.25 s: the sample at 0.24 s still holds the one before.
    assert_eq!(at(&recording, "right.index.contact", 0.24), 0.0);
    assert_eq!(at(&recording, "right.index.contact", 0.26), 1.0);
}

#[test]
fn signs_and_tare_are_applied() {
    let recording = opened().recording;
    // The column reads 0.25 N at rest and 2.25 N in contact; it is bound with a minus and tared.
    assert!(at(&recording, "right.thumb.force.x", 0.1).abs() < 1e-12);
    assert!((at(&recording, "right.thumb.force.x", 0.4) + 2.0).abs() < 1e-12);
}

#[test]
fn seconds_that_are_called_milliseconds_are_refused() {
    let rows: String = (0..50).map(|row| format!("{},1,2,3\n", f64::from(row) * 0.01)).collect();
    let log = format!("t,x,y,z\n{rows}");
    let text = "time: t [ms]\nresample: 100 Hz\nchannels: {box.position: '<xyz>'}\n";
    let file = BindingFile::parse(text.into(), "binding.yaml".into()).unwrap();
    let source = delimited_text::source(Box::new(std::io::Cursor::new(log.into_bytes())), "log.csv").unwrap();
    insta::assert_snapshot!(bind(source, &file, Scene::default()).unwrap_err());
}

#[test]
fn a_trusted_force_counts_although_it_is_constant() {
    let fixture = |name: &str| Path::new(crate::ROOT).join("tests/fixtures/logs").join(name);
    let (scene, log) = (Some(fixture("box.yaml")), fixture("stuck_sensor.csv"));
    let folder = tempfile::tempdir().unwrap();
    let binding = folder.path().join("trust.yaml");
    std::fs::write(&binding, "trust: [right.thumb.force]\n").unwrap();
    let stuck = |binding| {
        let opened =
            open(&OpenRequest { log: log.clone(), binding, scene: scene.clone(), ..OpenRequest::default() }).unwrap();
        let frames = opened.frames(&[super::ask("load")]).unwrap();
        let printed =
            frames.issues.iter().any(|issue| issue.kind == "stuck_sensor" && issue.channel == "right.thumb.force");
        (printed, super::column(&frames, "load", 0, 0)[0])
    };
    assert_eq!(stuck(None), (true, 0.0));
    assert_eq!(stuck(Some(binding)), (false, 0.8));
}

/// Where a log is resampled, `bridge` alone says how long a hole may be; elsewhere a row that a logger lost is put back.
#[test]
fn what_a_resampled_log_does_not_bridge_stays_a_gap() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let stamps = (0..40).filter(|row| *row != 20).map(|row| f64::from(row) * 0.04);
    let rows: String = stamps.map(|stamp| format!("{stamp:.2},{stamp:.2},0,0\n")).collect();
    std::fs::write(path("log.csv"), format!("t,x,y,z\n{rows}")).unwrap();
    let opened = |more: &str| {
        let scene = "scene: {bodies: {box: {role: object}}}";
        let text = format!("time: t [s]\n{more}\nchannels: {{box.position: '<xyz> [m]'}}\n{scene}\n");
        std::fs::write(path("log.binding.yaml"), text).unwrap();
        let binding = Some(path("log.binding.yaml"));
        let opened = open(&OpenRequest { log: path("log.csv"), binding, ..OpenRequest::default() }).unwrap();
        (opened.recording.time.len(), opened.issues.iter().any(|issue| issue.kind == "missing_row"))
    };
    assert_eq!(opened(""), (40, true));
    assert_eq!(opened("resample: 25 Hz\nbridge: 60 ms"), (39, false));
    assert_eq!(opened("resample: 25 Hz\nbridge: 90 ms"), (40, false));
}

mod linear {
    use crate::shared::files::{bound_text, values};
    use teachtree_frames::bind::BindingFile;

    /// The columns of a log with rows that are 10 ms apart, which are bound like this.
    fn bound(titles: &str, rows: &[&str], channels: &str) -> Result<teachtree_base::recording::Recording, String> {
        let rows: String = (0..).zip(rows).map(|(row, cells)| format!("{row},{cells}\n")).collect();
        let binding = format!("time: t * 0.01 [s]\nchannels:\n{channels}\n");
        bound_text("log.csv", &format!("t,{titles}\n{rows}"), &binding).map(|(recording, _)| recording)
    }

    /// The message about a binding that cannot be read.
    fn fault(text: &str) -> String {
        BindingFile::parse(text.into(), "binding.yaml".into()).unwrap_err().to_string()
    }

    #[test]
    fn scale_and_offset_apply_to_every_number() {
        let channels = "
  right.thumb.position: ['a * 0.5 [mm]', '-b * 2 - 1 [mm]', 'c + 3 [mm]']
  right.palm.position: {mean: ['p<xyz> * 10 [mm]', 'p<xyz> * 10 + 4 [mm]']}
  right.gripper.opening: 'adc * -0.1 + 70 [mm]'
  right.gripper.closed: 'adc * -0.1 + 70 [mm] < 60 mm'
  right.thumb.contact: free * -1 + 1";
        let rows = ["10,20,30,1,2,3,50,1", "12,22,32,1,2,3,200,0", "14,24,34,1,2,3,,0"];
        let log = bound("a,b,c,px,py,pz,adc,free", &rows, channels).unwrap();
        let near = |name: &str, wanted: [f64; 2]| {
            let found = values(&log, name);
            assert!(
                found.iter().zip(wanted).all(|(found, wanted)| (found - wanted).abs() < 1e-12),
                "{name}: {found:?}"
            );
        };
        assert_eq!(log.time, [0.0, 0.01, 0.02]);
        near("right.thumb.position.x", [0.005, 0.006]);
        near("right.thumb.position.y", [-0.041, -0.045]);
        near("right.thumb.position.z", [0.033, 0.035]);
        near("right.palm.position.y", [0.022, 0.022]);
        near("right.gripper.opening", [0.065, 0.05]);
        near("right.gripper.closed", [0.0, 1.0]);
        near("right.thumb.contact", [0.0, 1.0]);
        assert!(values(&log, "right.gripper.opening")[2].is_nan() && values(&log, "right.gripper.closed")[2].is_nan());
    }

    #[test]
    fn a_column_may_be_called_like_the_form() {
        let channels = "  right.gripper.opening: Marker - 2 [mm]";
        assert_eq!(
            values(&bound("Marker,Marker - 2", &["10,20", "10,20"], channels).unwrap(), "right.gripper.opening")[0],
            0.02
        );
        assert_eq!(values(&bound("Marker", &["10", "10"], channels).unwrap(), "right.gripper.opening")[0], 0.008);
    }

    #[test]
    fn a_unit_that_is_not_known_is_named_with_the_scale_that_converts_it() {
        let rows = ["10", "20"];
        let error = |channel: &str| bound("grip (counts)", &rows, channel).unwrap_err();
        let opening = |columns: &str| format!("  right.gripper.opening: '{columns}'");
        assert_eq!(
            error(&opening("grip")),
            "binding.yaml:3:3: the log has no column `grip`; `grip (counts)` has a unit that is not known: bind it with a scale, `grip (counts) * SCALE [UNIT]`"
        );
        let log = bound("grip (counts)", &rows, &opening("grip (counts) * 2 [mm]")).unwrap();
        assert_eq!(values(&log, "right.gripper.opening")[1], 0.04);
        assert!(error(&opening("grip (counts) [furlong]")).ends_with(
            "`furlong` is not a known unit, expected one of a length (m); a scale converts others: `grip (counts) * 0.001 [m]`"
        ));
        assert!(error(&opening("grip*2 [mm]")).contains("numbers with blanks around `*` and `+`"));
        assert!(fault("channels: {right.gripper.opening: grip * 0}").contains("the same in every row"));
    }

    #[test]
    fn a_header_with_another_unit_of_the_same_quantity_is_not_overruled() {
        let opening = |titles: &str| bound(titles, &["10", "20"], "  right.gripper.opening: 'x * 2 [mm]'");
        assert!(opening("x (m)").unwrap_err().contains("`x` is in `m` as the header says, not in `mm`"));
        // A length of an angle: the scale converts it.
        assert_eq!(values(&opening("x (deg)").unwrap(), "right.gripper.opening")[1], 0.04);
    }

    #[test]
    fn a_log_with_canonical_names_has_a_scale_of_time() {
        let log = |time: &str| {
            let text = "ticks,right.gripper.opening [mm]\n0,1\n1,2\n2,3\n";
            bound_text("log.csv", text, &format!("time: {time}\n")).map(|(recording, _)| recording.time)
        };
        assert_eq!(log("ticks * 20 [ms]").unwrap(), [0.0, 0.02, 0.04]);
        assert!(fault("time: ticks * 20 + 3 [ms]").contains("expected it as `time_offset: 5 s`"));
        assert!(fault("time: ticks * -20 [ms]").contains("time would run backward"));
    }
}
