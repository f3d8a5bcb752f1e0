//! `test --mutate`: the changes of the rules that no expectation notices.

use super::{Args, Case};
use crate::cli::progress::Progress;
use rayon::prelude::*;
use std::fmt::Write;
use std::sync::atomic::{AtomicUsize, Ordering};
use teachtree_analysis::analyze as find;
use teachtree_analysis::expect;
use teachtree_base::diagnostic::Span;
use teachtree_language::Rules;
use teachtree_language::graph::lower;
use teachtree_language::mutation::{mutants, witness};
use teachtree_session::{AnalysisInternals, leaves};

/// Changes the rules one place at a time, and says which changes no expectation notices.
pub fn mutate(args: &Args, cases: &[Case]) -> String {
    // Expectations of the same rules are tried together.
    let mut sets: Vec<(String, Vec<&Case>)> = Vec::new();
    for case in cases {
        let digest = case.rules().digest();
        match sets.iter_mut().find(|(known, _)| *known == digest) {
            Some((_, same)) => same.push(case),
            None => sets.push((digest, vec![case])),
        }
    }
    let mut printed = String::new();
    for (_, cases) in sets {
        let Some(rules) = cases.first().map(|case| case.rules()) else { continue };
        let file = |span: Span| rules.sources.files.get(span.file as usize).map_or("", |file| file.name.as_str());
        let all: Vec<_> = mutants(rules).filter(|mutant| args.counts(file(mutant.span))).collect();
        let progress = Progress::new("mutating");
        let done = AtomicUsize::new(0);
        let noticed: Vec<bool> = all
            .par_iter()
            .map(|mutant| {
                let noticed = cases.iter().any(|case| notices(case, &mutant.rules));
                progress.set((done.fetch_add(1, Ordering::Relaxed) + 1) as f64 / all.len().max(1) as f64);
                noticed
            })
            .collect();
        drop(progress);
        let count = noticed.iter().filter(|noticed| **noticed).count();
        let names: Vec<String> = cases.iter().map(|case| case.path.display().to_string()).collect();
        let _ = writeln!(printed, "mutation: {count} of {} changes noticed by {}", all.len(), names.join(", "));
        for (mutant, _) in all.iter().zip(&noticed).filter(|(_, noticed)| !**noticed) {
            let text = rules.sources.text(mutant.span).split_whitespace().collect::<Vec<_>>().join(" ");
            let _ =
                writeln!(printed, "  not noticed: {} in {text}   {}", mutant.what, rules.sources.place(mutant.span));
            if let Some(recording) = witness(rules, mutant) {
                let _ = writeln!(printed, "    {recording} would notice it");
            }
        }
    }
    printed
}

/// Whether changed rules give something else than is expected, or cannot run.
fn notices(case: &Case, rules: &Rules) -> bool {
    let Ok(run) = case.analysis.run() else { return true };
    let frames = &run.frames;
    let Ok(leaves) = leaves(rules, &lower(rules), frames) else { return true };
    let found = expect::lines(&find(rules, frames, &leaves));
    !expect::compare(&case.expectation.lines, &found, case.expectation.tolerance_s).is_empty()
}
