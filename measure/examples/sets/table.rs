//! What was measured in, a table in Markdown out.

use super::manifest::Set;
use super::measured::{MeasuredRecording, MeasuredSet, SHIPPED};
use std::path::Path;
use teachtree_analysis::score::Tally;

/// A row for each set, a column for each method.
pub fn table(measured: &[(&Set, MeasuredSet)]) -> String {
    let mut methods: Vec<&str> = Vec::new();
    for method in measured.iter().flat_map(|(set, _)| &set.manifest.methods) {
        if !methods.contains(&method.name.as_str()) {
            methods.push(&method.name);
        }
    }
    methods.push(SHIPPED);
    let titles: Vec<&str> =
        ["set", "license", "recordings"].into_iter().chain(methods.iter().copied()).chain(["first"]).collect();
    let mut lines = vec![row(&titles), row(&vec!["---"; titles.len()])];
    for (set, found) in measured {
        let count = found.recordings.len().to_string();
        let figures: Vec<String> =
            methods.iter().map(|method| found.tally(method).map_or("–".into(), |it| figures(set, &it))).collect();
        let manifest = &set.manifest;
        let mut cells = vec![manifest.name.as_str(), &manifest.license, &count];
        cells.extend(figures.iter().map(String::as_str));
        cells.push(&manifest.first);
        lines.push(row(&cells));
    }
    lines.join("\n")
}

/// A line for each set: what its labels come from, and what its methods do.
pub fn explanations(measured: &[(&Set, MeasuredSet)]) -> String {
    let line = |set: &Set| {
        let methods = set.manifest.methods.iter().map(|method| format!("; {}: {}", method.name, method.about));
        format!("- {}: labels from {}{}", set.manifest.name, set.manifest.truth, methods.collect::<String>())
    };
    let lines: Vec<String> = measured.iter().map(|(set, _)| line(set)).collect();
    lines.join("\n")
}

/// A line for each recording of a set.
pub fn recordings(found: &MeasuredSet) -> String {
    let line = |recording: &MeasuredRecording| {
        let figures = recording.tallies.iter().map(|(name, tally)| format!("{name} {}", rates(tally)));
        format!("{}: {}", recording.log.display(), figures.collect::<Vec<_>>().join("; "))
    };
    let lines: Vec<String> = found.recordings.iter().map(line).collect();
    lines.join("\n")
}

/// How a set that is not there is downloaded.
pub fn instructions(set: &Set, downloads: &Path) -> String {
    let manifest = &set.manifest;
    let packages = manifest.python.join(" ");
    format!(
        "{}: not in {}. Its address is {}; in that folder:\n    {}\n    pip install {packages}",
        manifest.name,
        downloads.display(),
        manifest.address,
        manifest.download.trim().replace('\n', "\n    "),
    )
}

fn figures(set: &Set, tally: &Tally) -> String {
    if set.manifest.frames_only { percent(tally.accuracy()) } else { rates(tally) }
}

fn rates(tally: &Tally) -> String {
    format!("{} / {}", percent(tally.accuracy()), percent(tally.f1()[2]))
}

fn percent(rate: Option<f64>) -> String {
    rate.map_or("–".into(), |rate| format!("{:.1}", 100.0 * rate))
}

fn row(cells: &[&str]) -> String {
    format!("| {} |", cells.join(" | "))
}
