//! The recording with which the page opens, and tasks whose boundaries follow those of primitives.

use super::page::{no_complaints, opened, visited};
use super::{OPENED, demos, folder};
use std::path::Path;

/// The page opens with the first failure, else with the first recording that disagrees with its labels.
#[test]
fn the_page_opens_with_the_first_recording_that_needs_attention() {
    let folder = folder();
    let logs = folder.path().join("logs");
    std::fs::write(logs.join("b.labels.csv"), "track,label,start_s,end_s\nright,Push,12,24\n").unwrap();
    {
        let Some((mut browser, _studio)) = visited(folder.path(), &OPENED) else { return };
        opened(&mut browser, "b");
        let agreement = browser.text("#agreement");
        assert!(
            agreement.starts_with("Agreement with labels (this recording): segment F1 ")
                && agreement.contains(" at 50 % overlap; "),
            "{agreement}"
        );
        assert!(!agreement.contains("boundaries"), "{agreement}");
        no_complaints(&browser);
    }
    // A recording that ends before its task is a failure.
    let binding = folder.path().join("lift.yaml");
    let text = std::fs::read_to_string(&binding).unwrap();
    std::fs::write(&binding, format!("{text}\nexpect: pick_and_place\n")).unwrap();
    let whole = std::fs::read_to_string(logs.join("c7.csv")).unwrap();
    let cut: Vec<&str> = whole.lines().take(60).collect();
    std::fs::write(logs.join("c7.csv"), cut.join("\n") + "\n").unwrap();
    let Some((mut browser, studio)) = visited(folder.path(), &OPENED) else { return };
    assert_eq!(studio.get("api/list")["recordings"][2]["outcome"], "failure");
    opened(&mut browser, "c7");
    assert_eq!(browser.text("#recordings [aria-current] b"), "c7");
    no_complaints(&browser);
}

/// The rows of a kind in a label file: label, start, end, pinned.
fn rows(text: &str, kind: &str) -> Vec<[String; 4]> {
    let rows = text.lines().skip(1).map(|row| row.split(',').collect::<Vec<_>>());
    rows.filter(|row| row[1] == kind).map(|row| [row[2], row[3], row[4], row[5]].map(str::to_string)).collect()
}

fn saved(file: &Path, is_wanted: impl Fn(&str) -> bool) -> String {
    for _ in 0..3000 {
        let text = std::fs::read_to_string(file).unwrap_or_default();
        if is_wanted(&text) {
            return text;
        }
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    panic!("never so: {}", std::fs::read_to_string(file).unwrap_or_default());
}

#[test]
fn tasks_follow_the_boundaries_of_their_primitives() {
    let folder = tempfile::tempdir().unwrap();
    let log = "SawyerNutAssembly_demo_1.csv";
    std::fs::copy(demos().join(log), folder.path().join(log)).unwrap();
    let binding = demos().join("sawyer_nut_assembly.binding.yaml");
    let Some((mut browser, studio)) = visited(folder.path(), &[log, "--binding", binding.to_str().unwrap()]) else {
        return;
    };
    opened(&mut browser, "SawyerNutAssembly_demo_1");
    let track = &studio.get("api/recording/0")["data"]["tracks"][0];
    let between = track["tasks"][1]["start"].as_f64().unwrap();
    let segments = track["relabeled"].as_array().unwrap();
    let at = segments.iter().position(|segment| (segment[1].as_f64().unwrap() - between).abs() < 1e-6).unwrap();
    assert!(at > 0);
    // The boundary between the last primitive of a task and the first one of the next moves by 100 frames, a second.
    browser.eval(&format!("document.querySelector(\"[data-edge='0 primitive {at} 0']\").focus()"));
    browser.key("PageUp");
    let file = folder.path().join("SawyerNutAssembly_demo_1.labels.csv");
    let text = saved(&file, |text| !text.is_empty());
    let (primitives, tasks) = (rows(&text, "primitive"), rows(&text, "task"));
    assert_eq!((primitives.len(), tasks.len()), (2, 2), "{text}");
    let moved: f64 = primitives[0][2].parse().unwrap();
    assert!((moved - between - 1.0).abs() < 1e-6, "{moved}, {between}");
    assert_eq!((&tasks[0][2], &tasks[1][1]), (&primitives[0][2], &primitives[0][2]), "{text}");
    assert!(primitives.iter().all(|row| row[3] == "pinned") && tasks.iter().all(|row| row[3].is_empty()), "{text}");
    // All that is accepted is what is shown.
    browser.wait("!document.querySelector('#label-status').textContent.startsWith('saving')");
    browser.key("a");
    let text = saved(&file, |text| rows(text, "task").iter().all(|row| row[3] == "pinned"));
    let tasks = rows(&text, "task");
    assert_eq!((&tasks[0][2], &tasks[1][1]), (&primitives[0][2], &primitives[0][2]), "{text}");
    // Undone twice, nothing is labeled.
    browser.click("#undo");
    browser.click("#undo");
    saved(&file, str::is_empty);
    no_complaints(&browser);
}
