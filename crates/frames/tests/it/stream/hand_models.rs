//! The hand model that is chosen for what a log measures.

use crate::shared::files::folder;
use std::path::{Path, PathBuf};
use teachtree_base::hands::Side;
use teachtree_base::log_channel::LogChannel;
use teachtree_frames::bind::BindingFile;
use teachtree_frames::hand_models::{HandModel, HandModelRow, choose, read, shipped};
use teachtree_frames::{OpenRequest, open};

/// The hand model for a log of one hand with these channels.
fn of(channels: &[&str]) -> (String, String) {
    chosen(&[Side::Right], channels)
}

fn chosen(sides: &[Side], channels: &[&str]) -> (String, String) {
    let channels: Vec<LogChannel<'_>> = channels.iter().map(|name| LogChannel::parse(name).unwrap()).collect();
    let HandModel { file, reason } = choose(shipped(), sides, &channels);
    (file, reason)
}

/// Channels that meet a row and none above it, with the names in the reason.
const ROWS: [(&str, &[&str], &str); 9] = [
    ("hand_force.rules", &["right.index.force"], "right.index.force"),
    ("hand_flags.rules", &["right.thumb.contact"], "right.thumb.contact"),
    ("hand_flags.rules", &["right.index.contact.cube", "right.palm.force"], "right.index.contact.cube"),
    (
        "hand_gripper_wrist.rules",
        &[
            "right.thumb.position",
            "right.gripper.closed",
            "right.gripper.opening",
            "right.palm.force",
            "right.palm.contact",
        ],
        "right.gripper.opening and right.palm.force",
    ),
    ("hand_gripper.rules", &["right.thumb.position", "right.gripper.closed", "cube.position"], "right.gripper.closed"),
    ("hand_wrist.rules", &["right.thumb.position", "right.palm.force"], "right.palm.force"),
    (
        "hand_mechanism.rules",
        &["right.index.position", "latch.angle.bearing"],
        "latch.angle.bearing and right.index.position",
    ),
    (
        "hand_vision.rules",
        &["right.thumb.position", "right.ring.position"],
        "right.thumb.position and right.ring.position",
    ),
    ("hand_vision.rules", &["right.thumb.position", "right.palm.rotation"], "right.thumb.position"),
];

#[test]
fn each_row_is_chosen_by_its_channels() {
    for (file, channels, names) in ROWS {
        assert_eq!(of(channels), (file.to_string(), format!("since the log has {names}")), "{channels:?}");
    }
    // Each row, in the order of the table.
    let mut files: Vec<&str> = ROWS.iter().map(|(file, ..)| *file).collect();
    files.remove(2);
    assert_eq!(shipped().iter().map(|row| row.file.as_str()).collect::<Vec<_>>(), files);
}

#[test]
fn better_sensors_win_over_others() {
    let place = |file: &str| shipped().iter().position(|row| row.file == file).unwrap();
    for (file, channels, _) in ROWS {
        for (_, more, _) in ROWS {
            // Of two rows the upper one, or one that needs channels of both.
            let (both, _) = of(&[channels, more].concat());
            assert!(place(&both) <= place(file), "{channels:?} {more:?}: {both}");
        }
    }
}

#[test]
fn without_a_row_the_default_is_chosen() {
    for channels in [&[][..], &["cube.position", "right.palm.position"], &["left.gripper.closed"]] {
        let (file, reason) = of(channels);
        assert_eq!(file, "hand_force.rules");
        assert_eq!(reason, "since no row of rules/hand_models.yaml fits the channels of the log");
    }
    assert_eq!(chosen(&[], &["right.thumb.force"]).0, "hand_force.rules");
}

/// One file is for both hands: what both measure counts.
#[test]
fn the_model_is_for_every_hand() {
    let sides = [Side::Left, Side::Right];
    let closed = ["left.gripper.closed", "right.gripper.closed", "right.palm.force", "left.thumb.position"];
    let (file, reason) = chosen(&sides, &closed);
    assert_eq!(
        (file.as_str(), reason.as_str()),
        ("hand_gripper.rules", "since the log has left.gripper.closed and right.gripper.closed")
    );
    let (file, reason) = chosen(&sides, &["left.gripper.closed", "right.palm.force"]);
    assert_eq!((file.as_str(), reason.as_str()), ("hand_gripper.rules", "since the log has left.gripper.closed"));
}

#[test]
fn every_file_of_the_table_is_shipped() {
    assert_eq!(shipped().len(), 8);
    for HandModelRow { file, .. } in shipped() {
        assert!(Path::new(crate::ROOT).join("rules").join(file).is_file(), "{file}");
    }
    let error = read("- needs: [fingertip.farce]\n  file: a.rules\n", "own.yaml").unwrap_err().to_string();
    assert!(
        error.starts_with("own.yaml:1:") && error.contains("fingertip.farce") && error.contains("fingertip.force"),
        "{error}"
    );
}

/// The hand model of a table of zeros with these columns.
fn of_table(columns: &[&str], binding: Option<&str>) -> HandModel {
    let row = |time: f64| format!("{time}{}\n", ",0".repeat(columns.len()));
    let log = format!("time,{}\n{}{}", columns.join(","), row(0.0), row(0.1));
    let folder = folder(&[
        ("log.csv", log.as_str()),
        ("log.scene.yaml", "bodies: {cube: {role: object, radius: 20 mm}}\n"),
        ("b.yaml", binding.unwrap_or_default()),
    ]);
    let path = |name: &str| folder.path().join(name);
    let request =
        OpenRequest { log: path("log.csv"), binding: binding.map(|_| path("b.yaml")), ..OpenRequest::default() };
    open(&request).unwrap().hand_model()
}

/// The reason has the names of the log; a binding may name another file, and an optional column that the log lacks does not count.
#[test]
fn a_log_has_a_hand_model_with_a_reason() {
    let wrist = ["right.wrist.force.x", "right.wrist.force.y", "right.wrist.force.z"];
    let model = of_table(&[&wrist[..], &["right.gripper.closed"]].concat(), None);
    assert_eq!(
        model.to_string(),
        "hand_gripper_wrist.rules, since the log has right.gripper.closed and right.wrist.force"
    );
    let binding = "channels: {right.gripper.closed: 'g > 0.5', right.wrist.force: 'f<xyz>?'}\n";
    assert_eq!(
        of_table(&["g"], Some(binding)).to_string(),
        "hand_gripper.rules, since the log has right.gripper.closed"
    );
    assert_eq!(of_table(&["g", "fx", "fy", "fz"], Some(binding)).file, "hand_gripper_wrist.rules");
    let named = format!("hand_file: hand_wrist.rules\n{binding}");
    assert_eq!(of_table(&["g"], Some(&named)).to_string(), "hand_wrist.rules, as `hand_file` in the binding says");
}

fn bindings(folder: &str) -> Vec<PathBuf> {
    let folder = std::fs::read_dir(Path::new(crate::ROOT).join(folder)).unwrap();
    let mut files: Vec<PathBuf> = folder.map(|entry| entry.unwrap().path()).collect();
    files.retain(|path| path.to_str().unwrap().ends_with(".binding.yaml"));
    files.sort();
    files
}

/// The hand model of each shipped binding, and whether the binding names it.
#[test]
fn shipped_bindings_have_their_hand_files() {
    let mut found = vec![];
    for path in bindings("demos/bindings").into_iter().chain(bindings("demos/robosuite")) {
        let BindingFile { binding, .. } = BindingFile::read(&path).unwrap();
        let channels: Vec<LogChannel<'_>> =
            binding.channels.keys().filter_map(|name| LogChannel::parse(name)).collect();
        let has = |side: &Side| binding.channels.keys().any(|name| name.starts_with(&format!("{side}.")));
        let sides: Vec<Side> = Side::BOTH.into_iter().filter(has).collect();
        let HandModel { file, .. } = choose(shipped(), &sides, &channels);
        let name = path.file_name().unwrap().to_str().unwrap().replace(".binding.yaml", "");
        assert_ne!(binding.hand_file.as_ref(), Some(&file), "{name}: the line `hand_file` is not needed");
        let is_named = if binding.hand_file.is_some() { " (named)" } else { "" };
        found.push(format!("{name}: {}{is_named}", binding.hand_file.as_ref().unwrap_or(&file).replace(".rules", "")));
    }
    assert_eq!(
        found,
        [
            "dapg_door: hand_mechanism",
            "desk_yumi: hand_gripper_pair (named)",
            "dfki_hand: hand_vision",
            "hiro_snap: hand_wrist",
            "icsc_peeling: hand_holding (named)",
            "icsc_wiping: hand_wrist",
            "myodm: hand_vision",
            "robot_failures: hand_wrist",
            "task_board: hand_wrist",
            "baxter_lift: hand_flags",
            "baxter_peg_in_hole: hand_holding (named)",
            "door: hand_flags",
            "handover: hand_flags",
            "lift_hdf5: hand_gripper",
            "panda_lift: hand_flags (named)",
            "panda_nut_assembly: hand_flags (named)",
            "panda_stack: hand_flags (named)",
            "sawyer_lift: hand_flags (named)",
            "sawyer_nut_assembly: hand_flags (named)",
            "sawyer_pick_place: hand_flags (named)",
            "sawyer_stack: hand_flags (named)",
            "wipe: hand_wrist",
        ]
    );
}
