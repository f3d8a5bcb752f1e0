//! What was found in all recordings in, a table in Markdown out.

use crate::kind::{Kind, Set};
use crate::recording_result::RecordingResult;
use std::collections::BTreeMap;
use teachtree_analysis::score::statistics::quantile;
use teachtree_analysis::score::{Share, Tally};

/// A measure, our figure, and that of the simple peer.
struct Row {
    measure: String,
    ours: String,
    peer: String,
}

/// A row for each set, place and measure.
pub fn table(all: &[(Kind, bool, RecordingResult)]) -> String {
    let mut sets: BTreeMap<(Set, bool), Vec<&RecordingResult>> = BTreeMap::new();
    for (kind, given, found) in all {
        sets.entry((kind.set(), *given)).or_default().push(found);
    }
    let mut lines = vec![
        "| set | license | files | measure | rules | simple peer |".to_string(),
        "|---|---|---|---|---|---|".to_string(),
    ];
    for ((set, given), found) in sets {
        let (about, licence) = set.about();
        let place = if given { "named folders" } else { "demos" };
        for row in rows(&found) {
            lines.push(format!(
                "| {about} | {licence} | {}, {place} | {} | {} | {} |",
                found.len(),
                row.measure,
                row.ours,
                row.peer
            ));
        }
    }
    lines.join("\n")
}

/// A recording by itself.
pub fn line(name: &str, found: &RecordingResult) -> String {
    let measures = rows(&[found]).into_iter().map(|row| format!("{}: {} ({})", row.measure, row.ours, row.peer));
    let off = found.boundaries.iter().filter(|(.., off)| off.is_none_or(|off| off > 0.05)).map(|(name, at_s, off)| {
        let off = off.map_or("not found".into(), |off| format!("off by {off:.2} s"));
        format!("\n    {name} at {at_s:.2} s {off}")
    });
    format!("{name}\n  {}{}\n{}", measures.collect::<Vec<_>>().join("; "), off.collect::<String>(), found.printed)
}

fn rows(found: &[&RecordingResult]) -> Vec<Row> {
    let mut rows = Vec::new();
    let (ours, peers) = (tallies(found, |it| &it.labels), tallies(found, |it| &it.peers));
    for (name, tally) in &ours {
        let measure =
            ["frames / F1@50", name].into_iter().filter(|text| !text.is_empty()).collect::<Vec<_>>().join(", ");
        let peer = peers.iter().map(|(name, tally)| format!("{}: {name}", rates(tally))).collect::<Vec<_>>().join("; ");
        rows.push(Row { measure, ours: rates(tally), peer: dash(peer) });
    }
    let boundaries: Vec<Option<f64>> = found.iter().flat_map(|it| &it.boundaries).map(|(.., off)| *off).collect();
    if !boundaries.is_empty() {
        let mut off: Vec<f64> = boundaries.iter().flatten().copied().collect();
        off.sort_by(f64::total_cmp);
        let within = |most: f64| off.iter().filter(|off| **off <= most + 1e-9).count();
        let ours = format!(
            "median {} ms, {} within 0.05 s, {} within 0.15 s, {} not found",
            quantile(&off, 0.5).map_or("–".into(), |off| format!("{:.0}", off * 1000.0)),
            within(0.05),
            within(0.15),
            boundaries.len() - off.len(),
        );
        rows.push(Row { measure: format!("{} boundaries", boundaries.len()), ours, peer: dash(String::new()) });
    }
    let sum = |of: fn(&RecordingResult) -> Share| {
        found.iter().fold(Share::default(), |mut sum, it| {
            sum.add(of(it));
            sum
        })
    };
    let passes = sum(|it| it.passes);
    if passes.of > 0 {
        let others: usize = found.iter().map(|it| it.false_passes).sum();
        rows.push(Row {
            measure: "Pass".into(),
            ours: format!("{} of {}, {others} false", passes.right, passes.of),
            peer: dash(String::new()),
        });
    }
    let unexplained = sum(|it| it.unexplained);
    if unexplained.of > 0 {
        rows.push(Row {
            measure: "segments that no task explains".into(),
            ours: format!("{} of {}", unexplained.right, unexplained.of),
            peer: dash(String::new()),
        });
    }
    let mut shares: BTreeMap<&str, Share> = BTreeMap::new();
    found.iter().flat_map(|it| &it.shares).for_each(|(name, share)| shares.entry(name).or_default().add(*share));
    for (name, share) in shares {
        rows.push(Row {
            measure: name.into(),
            ours: format!("{} of {}", share.right, share.of),
            peer: dash(String::new()),
        });
    }
    let covered: Vec<_> = found.iter().filter_map(|it| it.covered).collect();
    if let Some((name, ..)) = covered.first() {
        let (right, all) = covered.iter().fold((0.0, 0.0), |sum, (_, right, all)| (sum.0 + right, sum.1 + all));
        let ours = if all > 0.0 { format!("{:.1} % of {all:.1} s", 100.0 * right / all) } else { "–".into() };
        rows.push(Row { measure: format!("{name} covers the contact"), ours, peer: dash(String::new()) });
    }
    rows
}

fn dash(text: String) -> String {
    if text.is_empty() { "–".into() } else { text }
}

fn tallies<'a>(
    found: &[&'a RecordingResult],
    of: fn(&RecordingResult) -> &Vec<(&'static str, Tally)>,
) -> BTreeMap<&'a str, Tally> {
    let mut all: BTreeMap<&str, Tally> = BTreeMap::new();
    found.iter().flat_map(|it| of(it)).for_each(|(name, tally)| all.entry(name).or_default().add(tally));
    all
}

fn rates(tally: &Tally) -> String {
    let percent = |rate: Option<f64>| rate.map_or("–".into(), |rate| format!("{:.1}", 100.0 * rate));
    format!("{} / {}", percent(tally.accuracy()), percent(tally.f1()[2]))
}
