//! Calibrations as files: `inspect --calibrate` writes them, `live --calibration` reads them.

use crate::live_log::{Rows, demonstration, without_contacts};
use crate::program::{complained, said, teachtree_fed, teachtree_in};
use std::path::Path;
use teachtree::{Calibration, ErrorKind, Rules};

/// A log as a file with its scene beside it.
fn written(rows: &Rows, scene: &str, folder: &Path) -> String {
    let line = |row: &Vec<f64>| row.iter().map(f64::to_string).collect::<Vec<_>>().join(",");
    let lines: Vec<String> = std::iter::once(rows.titles.join(",")).chain(rows.rows.iter().map(line)).collect();
    std::fs::write(folder.join("log.csv"), lines.join("\n")).unwrap();
    std::fs::write(folder.join("log.scene.yaml"), scene).unwrap();
    lines.join("\n")
}

#[test]
fn a_calibration_file_is_what_was_learned() {
    let folder = tempfile::tempdir().unwrap();
    let rows = without_contacts("pick_and_place");
    let scene = serde_json::to_string(&demonstration("pick_and_place").scene).unwrap();
    let csv = written(&rows, &scene, folder.path());
    let inspected = teachtree_in(folder.path(), &["inspect", "log.csv", "--calibrate", "cell.json"]);
    assert!(inspected.status.success(), "{}", complained(&inspected));
    let log = rows.log();
    let rules = Rules::for_log(&log).unwrap();
    let text = std::fs::read_to_string(folder.path().join("cell.json")).unwrap();
    assert_eq!(text, Calibration::of(&log, &rules).unwrap().text().unwrap());
    assert_eq!(Calibration::parse("cell.json", &text).unwrap().rate_hz(), 1000.0);
    // The file replaces the recording.
    let [file, recording] = ["cell.json", "log.csv"].map(|name| folder.path().join(name).display().to_string());
    let scene = folder.path().join("log.scene.yaml").display().to_string();
    let live = |calibration: &str| {
        let args = ["live", "-", "--scene", &scene, "--no-labels", "--calibration", calibration];
        said(&teachtree_fed(&args, csv.as_bytes()))
    };
    let of_file = live(&file);
    assert!(of_file.contains("task    right pick_and_place"), "{of_file}");
    assert_eq!(of_file, live(&recording));
    // A recording is not lost.
    let refused = teachtree_in(folder.path(), &["inspect", "log.csv", "--calibrate", "log.csv"]);
    assert_eq!(refused.status.code(), Some(2));
}

#[test]
fn what_is_not_a_calibration_is_refused() {
    let rows = without_contacts("pick_and_place");
    let log = rows.log();
    let text = Calibration::of(&log, &Rules::for_log(&log).unwrap()).unwrap().text().unwrap();
    let rate = text.replace("\"rate_hz\": 1000.0", "\"rate_hz\": -1.0");
    assert_ne!(rate, text);
    for wrong in ["", "{}", &text[..text.len() / 2], &text.replace("calibration/1", "calibration/9"), &rate] {
        let error = Calibration::parse("cell.json", wrong).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Format);
        assert!(error.to_string().starts_with("cell.json"), "{error}");
    }
}
