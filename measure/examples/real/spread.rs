//! How far the figures of the table can be trusted: how they spread over the recordings, and over other values of the rules.

use crate::kind::{Kind, Set};
use crate::recording_result::{RecordingResult, RuleChoice, found};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use teachtree_analysis::score::statistics::quantile;
use teachtree_analysis::score::{Share, Tally};

/// Maximum distance of a correct boundary from the true one, s.
const RIGHT_S: f64 = 0.15;
/// How often the recordings are drawn anew.
const DRAWN: usize = 2000;

/// A figure of some recordings, 0 to 1; `None` where it says nothing of them.
type Figure = (&'static str, fn(&[&RecordingResult]) -> Option<f64>);

const FIGURES: [Figure; 5] = [
    ("boundaries within 0.15 s", |found| {
        let right = |off: &Option<f64>| off.is_some_and(|off| off <= RIGHT_S);
        let all: Vec<bool> = found.iter().flat_map(|it| &it.boundaries).map(|(.., off)| right(off)).collect();
        share(all.iter().filter(|right| **right).count(), all.len())
    }),
    ("segments that tasks explain", |found| {
        let sum = sum(found, |it| it.unexplained);
        share(sum.of - sum.right, sum.of)
    }),
    ("Pass", |found| sum(found, |it| it.passes).rate()),
    ("contact covered", |found| {
        let covered = found.iter().filter_map(|it| it.covered);
        let (right, all) = covered.fold((0.0, 0.0), |sum, (_, right, all)| (sum.0 + right, sum.1 + all));
        (all > 0.0).then(|| right / all)
    }),
    ("F1@50 of labels", |found| {
        let mut tally = Tally::default();
        found.iter().flat_map(|it| &it.labels).for_each(|(_, own)| tally.add(own));
        tally.f1()[2]
    }),
];

fn share(right: usize, of: usize) -> Option<f64> {
    (of > 0).then(|| right as f64 / of as f64)
}

fn sum(found: &[&RecordingResult], of: fn(&RecordingResult) -> Share) -> Share {
    found.iter().fold(Share::default(), |mut sum, it| {
        sum.add(of(it));
        sum
    })
}

/// Who made a recording, as far as its name says; recordings of one person are not independent.
fn person(kind: Kind, path: &Path) -> String {
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    match kind.set() {
        Set::Desk => name.split('_').next().unwrap_or_default().to_string(),
        _ => name.into_owned(),
    }
}

/// A row for each set and figure: as shipped, its interval by drawing people anew, and the middle and the worst of other values of the rules.
pub fn table(logs: &[(Kind, PathBuf)], root: &Path, rules: RuleChoice, draws: u64) -> Result<String, String> {
    let all = |rules: RuleChoice| -> Vec<Option<RecordingResult>> {
        logs.par_iter().map(|(kind, path)| found(*kind, path, root, rules).ok()).collect()
    };
    let shipped = all(rules);
    let varied: Vec<Vec<Option<RecordingResult>>> =
        (1..=draws).map(|draw| all(RuleChoice { draw: Some(draw), ..rules })).collect();
    let mut sets: BTreeMap<Set, Vec<usize>> = BTreeMap::new();
    for (at, (kind, _)) in logs.iter().enumerate() {
        sets.entry(kind.set()).or_default().push(at);
    }
    let mut text = format!(
        "| set | figure | shipped values | 95 % by drawing people anew | {draws} draws of all values within 30 %: median, worst |\n|---|---|---|---|---|\n"
    );
    for (set, members) in sets {
        // The same recording may be in the project and in a folder.
        let mut people: BTreeMap<String, Vec<usize>> = BTreeMap::new();
        for at in members {
            let (kind, path) = &logs[at];
            people.entry(person(*kind, path)).or_default().push(at);
        }
        for (name, figure) in FIGURES {
            let of = |from: &[Option<RecordingResult>], at: &[usize]| -> Option<f64> {
                figure(&at.iter().filter_map(|at| from[*at].as_ref()).collect::<Vec<_>>())
            };
            let every: Vec<usize> = people.values().flatten().copied().collect();
            let Some(rate) = of(&shipped, &every) else { continue };
            let mut rng = ChaCha8Rng::seed_from_u64(1);
            let groups: Vec<&Vec<usize>> = people.values().collect();
            let mut anew: Vec<f64> = (0..DRAWN)
                .filter_map(|_| {
                    let drawn =
                        (0..groups.len()).flat_map(|_| groups[rng.random_range(0..groups.len())].iter().copied());
                    of(&shipped, &drawn.collect::<Vec<_>>())
                })
                .collect();
            anew.sort_by(f64::total_cmp);
            let mut others: Vec<f64> = varied.iter().filter_map(|found| of(found, &every)).collect();
            others.sort_by(f64::total_cmp);
            let percent =
                |values: &[f64], at: f64| quantile(values, at).map_or("–".into(), |it| format!("{:.1}", 100.0 * it));
            let _ = writeln!(
                text,
                "| {} | {name} | {:.1} % | {} to {} %, {} people or recordings | {}, {} % |",
                set.about().0,
                100.0 * rate,
                percent(&anew, 0.025),
                percent(&anew, 0.975),
                groups.len(),
                percent(&others, 0.5),
                percent(&others, 0.0)
            );
        }
    }
    Ok(text)
}
