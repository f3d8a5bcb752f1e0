//! Stamps of too few digits, lost bodies and forces in counts are explained in live logs as in whole ones.

use crate::ROOT;
use crate::program::{all_said, teachtree_in};
use std::path::Path;

/// What `live` prints of an example with other cells, and its status. A row is its number and its cells by column.
fn live(change: impl Fn(usize, &[&str], &mut Vec<String>), lines: &str) -> (String, Option<i32>) {
    let example = Path::new(ROOT).join("examples/contact_flags");
    let text = std::fs::read_to_string(example.join("box.csv")).unwrap();
    let titles: Vec<&str> = text.lines().next().unwrap().split(',').collect();
    let rows = text.lines().skip(1).enumerate().map(|(row, line)| {
        let mut cells: Vec<String> = line.split(',').map(str::to_string).collect();
        change(row, &titles, &mut cells);
        cells.join(",") + "\n"
    });
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("log.csv"), format!("{}\n{}", titles.join(","), rows.collect::<String>()))
        .unwrap();
    let binding = std::fs::read_to_string(example.join("box.binding.yaml")).unwrap();
    std::fs::write(folder.path().join("b.yaml"), binding.replace("channels:", &format!("{lines}channels:"))).unwrap();
    let output = teachtree_in(folder.path(), &["live", "log.csv", "--binding", "b.yaml", "--no-labels"]);
    (all_said(&output), output.status.code())
}

fn set(titles: &[&str], cells: &mut [String], column: &str, value: &str) {
    cells[titles.iter().position(|title| *title == column).unwrap()] = value.to_string();
}

#[test]
fn stamps_of_too_few_digits_are_the_cause() {
    let whole = |_: usize, titles: &[&str], cells: &mut Vec<String>| {
        let stamp: f64 = cells[0].parse().unwrap();
        set(titles, cells, "t_ms", &((stamp / 1000.0).floor() * 1000.0).to_string());
    };
    let (said, status) = live(whole, "");
    assert_eq!(status, Some(2), "{said}");
    assert!(said.contains("rows share each time stamp") && said.contains("stamps need enough digits"), "{said}");
}

/// The box is carried for a while between the rows 420 and 640.
#[test]
fn a_body_at_zero_is_lost() {
    let lost = |row: usize, titles: &[&str], cells: &mut Vec<String>| {
        if (500..530).contains(&row) {
            ["box_x", "box_y", "box_z", "box_qx", "box_qy", "box_qz"]
                .iter()
                .for_each(|title| set(titles, cells, title, "0"));
            set(titles, cells, "box_qw", "1");
        }
    };
    for lines in ["", "resample: 100 Hz\n"] {
        let (plain, _) = live(|_, _, _| {}, lines);
        assert!(!plain.contains("lost body"), "{plain}");
        let (said, status) = live(lost, lines);
        assert_eq!(status, Some(0), "{said}");
        assert!(said.contains("issue   not_a_number box.position: ") && said.contains("exactly 0 0 0"), "{said}");
        // It neither turns nor falls.
        assert!(!said.contains("Turn") && said.matches(" Drop ").count() <= plain.matches(" Drop ").count(), "{said}");
    }
}

#[test]
fn values_beyond_all_units_are_named() {
    let large = |row: usize, titles: &[&str], cells: &mut Vec<String>| {
        if row > 500 {
            set(titles, cells, "pad_a_x", "4000000");
        }
    };
    let (said, status) = live(large, "");
    assert_eq!(status, Some(0), "{said}");
    assert!(said.contains("values beyond 1e6 in SI units are in another unit, or counts"), "{said}");
}
