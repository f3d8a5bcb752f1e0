//! Robot files: what is refused, and where.

use super::kinematics::shipped;
use teachtree::robot;

/// Each fixture has one mistake; its first line says which place and words the error must have.
#[test]
fn every_mistake_in_a_robot_is_told_at_its_line() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/robots");
    let mut seen = 0;
    let mut wrong = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap().to_string();
        let text = std::fs::read_to_string(&path).unwrap();
        let wanted = text.lines().next().unwrap().trim_start_matches("# ");
        let error = robot::read(&text, &name).map_or_else(|error| error.to_string(), |_| "no error".into());
        let missing = wanted.split(" | ").filter(|word| !error.contains(word));
        wrong.extend(missing.map(|word| format!("{name}: wanted `{word}`, found `{error}`")));
        seen += 1;
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(seen >= 12, "{seen}");
}

#[test]
fn the_shipped_robots_can_be_read_and_an_unknown_name_lists_them() {
    for name in robot::names() {
        assert!(!shipped(name).links.is_empty(), "{name}");
    }
    let error = robot::open("gifu", &|_| unreachable!()).unwrap_err().to_string();
    assert!(error.contains("`gifu_hand_iii_right`") && error.contains("no shipped robot"), "{error}");
}

#[test]
fn every_number_of_a_shipped_robot_says_where_it_comes_from() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("robots");
    for entry in std::fs::read_dir(folder).unwrap() {
        let text = std::fs::read_to_string(entry.unwrap().path()).unwrap();
        for line in text.lines().filter(|line| line.contains('{')) {
            assert!(line.contains("source: "), "{line}");
        }
    }
}
