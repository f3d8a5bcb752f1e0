//! What changes when recordings are changed as another laboratory would have made them: a table in Markdown.

use crate::kind::Kind;
use crate::recording_result::{Original, RecordingResult, RuleChoice, found_in, opened};
use crate::tables;
use crate::variants::{Lab, VARIANTS, Variant};
use rayon::prelude::*;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use teachtree_analysis::score::{Share, Tally};

/// Maximum distance of a correct boundary from the true one, s.
const RIGHT_S: f64 = 0.15;

/// All recordings in one variant.
#[derive(Default)]
struct VariantTotals {
    boundaries: Share,
    unexplained: Share,
    passes: Share,
    false_passes: usize,
    others: Share,
    covered_s: (f64, f64),
    labels: Tally,
    same_tasks: Share,
    refused: Vec<String>,
}

impl VariantTotals {
    fn add(&mut self, found: &RecordingResult, tasks: Option<&[String]>) {
        for (.., off) in &found.boundaries {
            self.boundaries.count(off.is_some_and(|off| off <= RIGHT_S));
        }
        self.unexplained.add(found.unexplained);
        self.passes.add(found.passes);
        self.false_passes += found.false_passes;
        found.shares.iter().filter(|(name, _)| !name.contains("3 N")).for_each(|(_, share)| self.others.add(*share));
        if let Some((_, right, all)) = found.covered {
            self.covered_s = (self.covered_s.0 + right, self.covered_s.1 + all);
        }
        found.labels.iter().for_each(|(_, tally)| self.labels.add(tally));
        if let Some(tasks) = tasks {
            self.same_tasks.count(found.tasks == tasks);
        }
    }
}

/// A row for each variant, over all recordings that can be changed so.
pub fn table(logs: &[(Kind, PathBuf)], root: &Path, rules: RuleChoice, wanted: &str, each: bool) -> String {
    let mut text = String::from(
        "| variant | recordings | boundaries within 0.15 s | segments that no task explains | Pass, false | contact covered | HIRO, stuck sensors | \
         frames / F1@50 of labels | tasks unchanged |\n|---|---|---|---|---|---|---|---|---|\n",
    );
    for variant in VARIANTS.iter().filter(|(name, _)| name.contains(wanted)) {
        let results: Vec<_> =
            logs.par_iter().map(|(kind, path)| (path, of_recording(*kind, path, root, rules, variant))).collect();
        let mut sum = VariantTotals::default();
        let mut count = 0;
        for (path, result) in results {
            let name = path.strip_prefix(root).unwrap_or(path).display().to_string();
            match result {
                Ok(None) => {}
                Ok(Some((found, tasks))) => {
                    count += 1;
                    // What is cut off has other tasks.
                    let whole = !variant.0.contains("begins") && !variant.0.contains("ends");
                    if each {
                        eprintln!("## {}: {}", variant.0, tables::line(&name, &found));
                        if whole && found.tasks != tasks {
                            eprintln!("    tasks were {}", tasks.join(", "));
                        }
                    }
                    sum.add(&found, whole.then_some(&tasks));
                }
                Err(error) => {
                    eprintln!("{}: {name}: {error}", variant.0);
                    sum.refused.push(name);
                }
            }
        }
        text.push_str(&row(variant.0, count, &sum));
    }
    text
}

type VariantResult = Option<(RecordingResult, Vec<String>)>;

/// What is found in a variant of a recording, and the tasks of the original; `None` where it cannot be changed so.
fn of_recording(
    kind: Kind,
    path: &Path,
    root: &Path,
    rules: RuleChoice,
    (_, change): &Variant,
) -> Result<VariantResult, String> {
    let Some(mut lab) = Lab::read(kind, path, root)? else { return Ok(None) };
    if !change(&mut lab) {
        return Ok(None);
    }
    let folder = tempfile::tempdir().map_err(|error| error.to_string())?;
    // Failed trials of HIRO are known by the names of their folders.
    let folder = folder.path().join(path.file_name().unwrap_or_default()).with_extension("");
    std::fs::create_dir_all(&folder).map_err(|error| error.to_string())?;
    let (log, binding, warp) = lab.write(&folder)?;
    let original = opened(path, &root.join("demos").join(format!("{}.binding.yaml", kind.binding())))?;
    let as_it_is = crate::recording_result::found(kind, path, root, rules)?;
    let changed = opened(&log, &binding)?;
    let found = found_in(kind, &Original { path, opened: &original }, &changed, warp, root, rules)?;
    Ok(Some((found, as_it_is.tasks)))
}

fn row(name: &str, count: usize, sum: &VariantTotals) -> String {
    let share =
        |share: Share| if share.of == 0 { "–".to_string() } else { format!("{} of {}", share.right, share.of) };
    let percent = |rate: Option<f64>| rate.map_or("–".into(), |rate| format!("{:.1}", 100.0 * rate));
    let (right, all) = sum.covered_s;
    let covered = if all > 0.0 { format!("{:.0} %", 100.0 * right / all) } else { "–".into() };
    let mut text = format!("| {name} | {count} |");
    let _ = write!(text, " {} | {} |", share(sum.boundaries), share(sum.unexplained));
    let passes = if sum.passes.of == 0 { "–".into() } else { format!("{}, {}", share(sum.passes), sum.false_passes) };
    let _ = write!(text, " {passes} | {covered} | {} |", share(sum.others));
    let _ = write!(text, " {} / {} |", percent(sum.labels.accuracy()), percent(sum.labels.f1()[2]));
    let _ = writeln!(text, " {} |", share(sum.same_tasks));
    text
}
