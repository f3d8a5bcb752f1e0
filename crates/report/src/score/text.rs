//! A score as tables: what was right over all, then tasks, mistakes, primitives, recordings. No line of a table is longer than 100 characters
//! as long as names are no longer than those of the paper.

use super::{NOTHING, ms, percent, shortened, task_names};
use teachtree_analysis::json::Meta;
use teachtree_analysis::number::fixed;
use teachtree_analysis::score::{BoundaryErrors, Row, Score, Share, Tally, TaskPair};

/// Mistakes that are listed.
const LISTED: usize = 20;
/// The longest name of a recording that is shown whole.
const LOG: usize = 28;
/// Columns of the names before the measures over all.
const GUTTER: usize = 18;

/// Writes the tables of scores of the same recordings; `meta` says by which rules.
pub fn text(scores: &[Score], meta: &Meta) -> String {
    let mut lines = Vec::new();
    for score in scores {
        if !lines.is_empty() {
            lines.push(String::new());
        }
        let recordings = score.recordings();
        let plural = if recordings == 1 { "" } else { "s" };
        let scored = fixed(score.all.scored_s(), 1);
        lines.push(format!("{recordings} recording{plural}, {scored} s scored, {}", score.stage));
        let params: String = meta.params.iter().map(|(name, value)| format!("; {name} = {value}")).collect();
        lines.push(format!("rules {}{params}", meta.rules.join(", ")));
        lines.push(String::new());
        lines.extend(over_all(&score.all));
        if score.all.tasks.is_some() {
            lines.extend(tasks(score));
            lines.extend(mistakes(score));
        }
        lines.extend(primitives(&score.all));
        if score.rows.len() > 1 {
            lines.extend(rows(score));
        }
    }
    lines.iter().map(|line| format!("{}\n", line.trim_end())).collect()
}

fn over_all(tally: &Tally) -> Vec<String> {
    let mut lines = Vec::new();
    let mut line = |name: &str, text: String| lines.push(format!("{name:GUTTER$}{text}"));
    if tally.tasks.is_some() {
        line("tasks found", share(tally.tasks_found()));
        line("  in sequence", share(tally.task_sequences()));
        line("false tasks", tally.false_tasks().to_string());
    }
    line("sequences equal", share(tally.sequences));
    line("frame accuracy", percent(tally.accuracy()));
    let [ten, quarter, half] = tally.f1().map(percent);
    line("segmental F1", format!("{ten} at 10 % overlap, {quarter} at 25 %, {half} at 50 %"));
    line("edit score", percent(tally.edit()));
    line("boundaries", errors(&tally.boundary_errors()));
    line("  by contact", errors(&tally.contact_errors()));
    lines
}

fn share(share: Share) -> String {
    match share.bounds() {
        None => NOTHING.into(),
        Some((low, high)) => {
            let (low, high) = (fixed(low * 100.0, 1), fixed(high * 100.0, 1));
            format!("{} of {}, {} (95 % bounds {low} to {high} %)", share.right, share.of, percent(share.rate()))
        }
    }
}

fn errors(errors: &BoundaryErrors) -> String {
    let found = format!("{} of {} found", errors.found.right, errors.found.of);
    if errors.off_s.is_empty() {
        return found;
    }
    format!("{found}, off by {} ms (median), {} ms (95th percentile)", ms(errors.median_s()), ms(errors.p95_s()))
}

fn tasks(score: &Score) -> Vec<String> {
    let mut table =
        Table::new(&["task", "true", "found", "rate", "95 % bounds", "named", "precision", "sequence equal"]);
    for (task, measures) in score.all.task_measures() {
        let bounds = measures.found.bounds().map_or_else(
            || NOTHING.into(),
            |(low, high)| format!("{} to {} %", fixed(low * 100.0, 1), fixed(high * 100.0, 1)),
        );
        table.row([
            task.into(),
            measures.found.of.to_string(),
            measures.found.right.to_string(),
            percent(measures.found.rate()),
            bounds,
            measures.named.of.to_string(),
            percent(measures.named.rate()),
            percent(measures.sequences.rate()),
        ]);
    }
    let names = task_names(score);
    let confusion = score.all.task_confusion();
    let numbers: Vec<String> = (1..=names.len()).map(|number| number.to_string()).collect();
    let header: Vec<&str> = ["true, in rows"].into_iter().chain(numbers.iter().map(String::as_str)).collect();
    let mut matrix = Table::new(&header);
    for (truth, number) in names.iter().zip(1..) {
        let cells = names.iter().map(|result| confusion.get(&(*truth, *result)).map_or(".".into(), usize::to_string));
        matrix.row([format!("{number} {truth}")].into_iter().chain(cells));
    }
    let mut lines = vec![String::new()];
    lines.extend(table.lines());
    lines.push(String::new());
    lines.extend(matrix.lines());
    lines
}

/// The tasks that are not right, or not in their sequence.
fn mistakes(score: &Score) -> Vec<String> {
    let wrong = |pair: &&TaskPair| !pair.is_right() || pair.sequence != pair.true_sequence;
    let of_row = |row: &'_ Row| row.tally.task_pairs().iter().filter(wrong).cloned().collect::<Vec<_>>();
    let all: Vec<(&Row, TaskPair)> =
        score.rows.iter().flat_map(|row| of_row(row).into_iter().map(move |pair| (row, pair))).collect();
    let mut lines = Vec::new();
    if !all.is_empty() {
        lines.extend([String::new(), "not as the truth".into()]);
    }
    for (row, pair) in all.iter().take(LISTED) {
        let (start, end) = (fixed(pair.time_s.0, 3), fixed(pair.time_s.1, 3));
        let what = match (pair.is_right(), pair.is_true()) {
            (true, _) => format!("{} in another sequence", pair.truth),
            (false, true) => format!("{} found as {}", pair.truth, pair.result),
            (false, false) => format!("no task, found as {}", pair.result),
        };
        lines.push(format!("  {} {} {start} to {end} s: {what}", shortened(&row.log, LOG), row.who));
        for (name, sequence) in [("true ", &pair.true_sequence), ("found", &pair.sequence)] {
            if !sequence.is_empty() && pair.sequence != pair.true_sequence {
                lines.push(format!("    {name} {}", sequence.join(" ")));
            }
        }
    }
    if all.len() > LISTED {
        lines.push(format!("  and {} more; --format json lists all", all.len() - LISTED));
    }
    lines
}

fn primitives(tally: &Tally) -> Vec<String> {
    let header =
        ["primitive", "true s", "found s", "precision", "recall", "segments", "F1 50 %", "starts", "median", "95th ms"];
    let mut table = Table::new(&header);
    for name in tally.primitives() {
        let segments = tally.segments.get(name).copied().unwrap_or_default();
        let [.., half] = segments.f1();
        let errors = tally.errors_of(name);
        table.row([
            name.into(),
            fixed(tally.true_s(name), 1),
            fixed(tally.result_s(name), 1),
            percent(tally.precision(name)),
            percent(tally.recall(name)),
            format!("{}/{}", segments.results, segments.truths),
            percent(half),
            format!("{}/{}", errors.found.right, errors.found.of),
            ms(errors.median_s()),
            ms(errors.p95_s()),
        ]);
    }
    [String::new()].into_iter().chain(table.lines()).collect()
}

fn rows(score: &Score) -> Vec<String> {
    let mut table =
        Table::new(&["recording", "track", "accuracy", "F1 50 %", "edit", "contacts", "95th ms", "tasks", "sequence"]);
    for Row { log, who, tally } in &score.rows {
        let contact = tally.contact_errors();
        let found = tally.tasks_found();
        let tasks = tally.tasks.as_ref().map_or(NOTHING.into(), |_| format!("{}/{}", found.right, found.of));
        let [.., half] = tally.f1();
        table.row([
            shortened(log, LOG),
            who.to_string(),
            percent(tally.accuracy()),
            percent(half),
            percent(tally.edit()),
            format!("{}/{}", contact.found.right, contact.found.of),
            ms(contact.p95_s()),
            tasks,
            if tally.sequences.right == tally.sequences.of { "equal" } else { "other" }.into(),
        ]);
    }
    [String::new()].into_iter().chain(table.lines()).collect()
}

/// Columns as wide as their widest cell, the first to the left and the others to the right.
struct Table {
    rows: Vec<Vec<String>>,
}

impl Table {
    fn new(header: &[&str]) -> Self {
        Self { rows: vec![header.iter().map(|title| (*title).to_string()).collect()] }
    }

    fn row(&mut self, cells: impl IntoIterator<Item = String>) {
        self.rows.push(cells.into_iter().collect());
    }

    fn lines(&self) -> Vec<String> {
        let columns = self.rows.iter().map(Vec::len).max().unwrap_or_default();
        let wide = |column: usize| {
            let cells = self.rows.iter().filter_map(|row| row.get(column));
            cells.map(|cell| cell.chars().count()).max().unwrap_or_default()
        };
        let widths: Vec<usize> = (0..columns).map(wide).collect();
        let line = |row: &Vec<String>| {
            let cells = row.iter().zip(&widths).enumerate().map(|(column, (cell, width))| match column {
                0 => format!("{cell:width$}"),
                _ => format!("  {cell:>width$}"),
            });
            cells.collect()
        };
        self.rows.iter().map(line).collect()
    }
}
