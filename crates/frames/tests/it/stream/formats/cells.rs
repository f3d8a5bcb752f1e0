//! Cells of delimited text: quotes, ends of lines, comments, and the lines that messages name.

use crate::shared::files::{bound_text, values};
use proptest::prelude::*;
use std::io::Cursor;
use teachtree_logs::read::formats::delimited_text;
use teachtree_logs::read::table::ColumnRequest;

/// Cells with and without quotes; also quotes that are doubled, closed early, or within a text.
fn cell() -> impl Strategy<Value = String> {
    prop_oneof![
        "[a-c ]{0,3}",
        "-?[0-9]{1,3}(\\.[0-9]{0,3})?",
        "\"([a-c, \r#]|\"\"){0,5}\"",
        "\"[a-c,]{0,3}\"[a-c]{1,2}",
        "[a-c]{1,2}\"[a-c\"]{0,2}",
    ]
}

proptest! {
    /// The crate `csv` is the reference.
    #[test]
    fn cells_are_those_of_the_reference(
        rows in prop::collection::vec((prop::collection::vec(cell(), 3), 0..4usize), 1..20)
    ) {
        // A row of numbers shows that the line above has the titles.
        let mut text = "a,b,c\n1,2,3\n".to_string();
        for (cells, end) in rows {
            text += &cells.join(",");
            text += ["\n", "\r\n", "\r", "\n\n"][end];
        }
        let mut reference = csv::ReaderBuilder::new().flexible(true).trim(csv::Trim::Fields).from_reader(text.as_bytes());
        let expected: Vec<csv::StringRecord> = reference.records().map(Result::unwrap).collect();
        prop_assert!(expected.iter().all(|record| record.len() == 3), "{:?}", text);
        let source = delimited_text::source(Box::new(Cursor::new(text.clone())), "log.csv").unwrap();
        let table = source.read(&[ColumnRequest::Text; 3], Some(100.0)).unwrap();
        prop_assert_eq!(table.time.len(), expected.len(), "{:?}", text);
        for (column, texts) in table.texts.iter().enumerate() {
            let expected: Vec<&str> = expected.iter().map(|record| &record[column]).collect();
            prop_assert_eq!(texts, &expected, "{:?}", text);
        }
    }
}

#[test]
fn a_byte_order_mark_is_not_part_of_the_first_cell() {
    let binding = "time: 1\nchannels: {right.gripper.opening: 2}\n";
    for text in ["\u{feff}0,5\n1,6\n", "\u{feff}# made by hand\n0,5\n1,6\n", "\u{feff}0;5\n1;\"6\"\n"] {
        let (recording, _) = bound_text("log.csv", text, binding).unwrap();
        assert_eq!(
            (recording.time.as_slice(), values(&recording, "right.gripper.opening")),
            (&[0.0, 1.0][..], &[5.0, 6.0][..])
        );
    }
}

#[test]
fn a_last_line_without_an_end_may_be_a_comment() {
    let binding = "channels: {right.gripper.opening: b}\n";
    let (recording, issues) = bound_text("log.csv", "# by hand\ntime,b\n0,5\n1,\"6\"\n# the end", binding).unwrap();
    assert_eq!(values(&recording, "right.gripper.opening"), [5.0, 6.0]);
    assert!(issues.is_empty(), "{issues:?}");
}

#[test]
fn a_message_about_the_header_names_its_line() {
    let refused = |text: &[u8]| {
        let source = delimited_text::source(Box::new(Cursor::new(text.to_vec())), "log.csv");
        source.map(|source| source.header_place).map_err(|error| error.to_string())
    };
    assert_eq!(refused(b"time,b\n0,1\n").unwrap(), "log.csv row 1");
    assert_eq!(refused(b"Device,ATI Gamma\n\ntime,a,b\n0,1,2\n").unwrap(), "log.csv row 3");
    assert_eq!(refused(b"# by hand\ntime,b\n0,1\n").unwrap(), "log.csv row 2");
    insta::assert_snapshot!(refused(b"# by hand\ntime,\xff\n0,1\n").unwrap_err(), @"log.csv row 2 column 2: found `�`, expected text in UTF-8");
}
