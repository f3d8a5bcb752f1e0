//! docs/adding_a_primitive.md is what the program says: its rules are those of the example, and its outputs come from them.

use crate::program::{all_said, demonstrate, teachtree_in};
use std::path::Path;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Runs the program in a folder, and gives all that it says.
fn said(folder: &Path, args: &[&str]) -> String {
    all_said(&teachtree_in(folder, args)).trim().to_string()
}

/// The blocks of a kind in a page.
fn blocks<'a>(page: &'a str, kind: &str) -> Vec<&'a str> {
    let begins = format!("```{kind}\n");
    page.split(&begins).skip(1).map(|rest| rest.split("\n```").next().unwrap()).collect()
}

/// The primitives and tasks of a timeline, without the times: those belong to the physics.
fn story(timeline: &str) -> Vec<String> {
    let (_, list) = timeline.split_once("\nright\n").unwrap();
    let names = |line: &str| {
        let also = line.split_once(" also ").map_or("", |(_, also)| also);
        format!("{} {also}", line.trim().split("  ").next().unwrap_or_default()).trim().to_string()
    };
    list.lines().filter(|line| !line.is_empty()).map(names).collect()
}

#[test]
fn the_page_shows_what_the_program_says_before_and_after_a_new_primitive() {
    let page = std::fs::read_to_string(root().join("docs/adding_a_primitive.md")).unwrap();
    let rules = std::fs::read_to_string(root().join("examples/tap.rules")).unwrap();
    assert_eq!(blocks(&page, "rules"), [rules.trim()]);
    let shown = blocks(&page, "text");
    let [before, clash, checked, after] = shown.as_slice() else { panic!("{} blocks", shown.len()) };

    let folder = tempfile::tempdir().unwrap();
    let write = |text: &str| std::fs::write(folder.path().join("tap.rules"), text).unwrap();
    std::fs::copy(root().join("examples/tap.operator.yaml"), folder.path().join("tap.operator.yaml")).unwrap();
    said(folder.path(), &["teach", "pick_and_press", "tap.operator.yaml", "-o", "tap.csv"]);

    write(&rules.replace("held before Press", "held first"));
    assert_eq!(said(folder.path(), &["check", "tap.rules"]), *clash);
    write(&rules);
    assert_eq!(said(folder.path(), &["check", "tap.rules"]), *checked);

    let (was, is) = (
        said(folder.path(), &["analyze", "tap.csv", "--rules", "contact.rules"]),
        said(folder.path(), &["analyze", "tap.csv", "--rules", "tap.rules"]),
    );
    assert_eq!(story(&was), story(before));
    assert_eq!(story(&is), story(after));
    insta::assert_snapshot!(format!("{}\n\n{}", story(&was).join("\n"), story(&is).join("\n")));
}

#[test]
fn the_scene_of_the_page_is_taught_and_reported() {
    let page = std::fs::read_to_string(root().join("docs/scenes.md")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    for block in blocks(&page, "yaml") {
        let (name, _) = block.split_once('\n').unwrap();
        std::fs::write(folder.path().join(name.trim_start_matches("# ")), block).unwrap();
    }
    said(folder.path(), &["teach", "cup.yaml", "cup.operator.yaml", "-o", "cup.csv", "--seed", "7"]);
    assert_eq!(story(&said(folder.path(), &["analyze", "cup.csv"]))[0], "pick_and_place cup");
}

#[test]
fn a_primitive_of_short_contacts_changes_nothing_where_there_are_none() {
    let folder = tempfile::tempdir().unwrap();
    let tap = root().join("examples/tap.rules");
    for scene in ["pick_and_place", "pick_and_press"] {
        demonstrate(scene, &["--seed", "3"], folder.path().join("log.csv"));
        // The last two columns are the digest of the rules and the version.
        let csv = |more: &[&str]| -> Vec<String> {
            let table = said(folder.path(), &[&["analyze", "log.csv", "--format", "csv"], more].concat());
            let found = |line: &str| line.rsplitn(3, ',').last().map(str::to_string);
            table.lines().filter_map(found).collect()
        };
        assert_eq!(csv(&["--rules", tap.to_str().unwrap()]), csv(&[]), "{scene}");
    }
}
