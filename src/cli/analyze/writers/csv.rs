//! `--format csv`: a table of segments and tasks, with one header for all recordings.

use super::Writer;

pub const WRITER: Writer = Writer {
    join: |table, text| {
        let header = if table.is_empty() { 0 } else { text.find('\n').map_or(0, |at| at + 1) };
        table.push_str(&text[header..]);
    },
    omits_issues: true,
    ..Writer::new("csv", |analysis, _| analysis.csv())
};
