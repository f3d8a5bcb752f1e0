//! Numbers that stand for values that were not measured, such as -9999: found in the columns of a whole log.
//!
//! Such a number is one of a list, and lies far beyond all other values of its column.

use teachtree_logs::issue::{Issue, IssueKind};
use teachtree_logs::names;
use teachtree_logs::read::table::Table;

/// The numbers that trackers and data acquisition write where they have no value.
const SENTINELS: [f64; 8] = [-999.0, -9999.0, -99_999.0, -999_999.0, -32_768.0, 9999.0, 99_999.0, 999_999.0];
/// A sentinel is farther from the other values than this many times their range.
const ISOLATED: f64 = 10.0;
/// The least distance of a sentinel from the other values, in the unit of the column.
const LEAST_DISTANCE: f64 = 500.0;

/// Makes the sentinels of a table unmeasured, column by column.
pub(super) fn unmeasure(titles: &[String], table: &mut Table) -> Vec<Issue> {
    let mut issues = vec![];
    for (title, values) in titles.iter().zip(&mut table.numbers) {
        let Some(sentinel) = sentinel(values) else { continue };
        let rows: Vec<usize> =
            (0..).zip(&*values).filter(|(_, value)| **value == sentinel).map(|(row, _)| row).collect();
        let stamp = |row: Option<&usize>| row.and_then(|row| table.time.get(*row)).copied().unwrap_or_default();
        let (start_s, end_s) = (stamp(rows.first()), stamp(rows.last()));
        let samples = if rows.len() == 1 { "1 sample is".into() } else { format!("{} samples are", rows.len()) };
        let (name, _) = names::split_known_unit(title);
        let message = format!(
            "{samples} {sentinel} in the column `{name}`, far from all other values; they count as not measured"
        );
        issues.push(Issue { kind: IssueKind::NOT_A_NUMBER, start_s, end_s, channel: String::new(), message });
        values.iter_mut().filter(|value| **value == sentinel).for_each(|value| *value = f64::NAN);
    }
    issues
}

/// The sentinel of a column: its least or its greatest value.
fn sentinel(values: &[f64]) -> Option<f64> {
    let range = |except: f64| {
        let others = values.iter().filter(|value| **value != except && !value.is_nan());
        others.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(*value), high.max(*value)))
    };
    let (least, greatest) = range(f64::NAN);
    [least, greatest].into_iter().filter(|value| SENTINELS.contains(value)).find(|sentinel| {
        let (low, high) = range(*sentinel);
        let distance = (low - sentinel).max(sentinel - high);
        // If a column has two levels and one of them is such a number, its range cannot be compared.
        high > low && distance > LEAST_DISTANCE.max(ISOLATED * (high - low))
    })
}
