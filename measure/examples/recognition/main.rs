//! `cargo example recognition -- 1..200 1001..1050` writes docs/measurements/recognition.md: every shipped task, demonstrated by many simulated
//! operators and analyzed with one set of rules. Recordings stay in memory; the page does not depend on the number of threads.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a command-line program prints")]

mod coordination;
mod ruleset;
mod tables;
mod transforms;
mod trial;

use clap::Parser;
use indicatif::{ProgressBar, ProgressStyle};
use rayon::prelude::*;
use std::ops::RangeInclusive;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;
use teachtree_measure::seeds;
use teachtree_world::shipped;
use trial::{Rulesets, Trial};

/// The page without its tables; `{{name}}` marks their places.
const PAGE: &str = include_str!("page.md");
const PAGE_OF_BOTH_HANDS: &str = include_str!("both_hands.md");
/// The experiment of Kawasaki et al. (2014) is two tasks in a row and has a test of its own.
const NOT_COUNTED: &str = "paper_box";

/// Measures recognition on simulated operators
#[derive(Parser)]
struct Args {
    /// Seeds of the operators, the last one included
    #[arg(value_parser = seeds::parse, default_value = "1..200")]
    seeds: RangeInclusive<u64>,
    /// Seeds of other operators, whose pooled results are printed beside
    #[arg(value_parser = seeds::parse)]
    others: Option<RangeInclusive<u64>>,
    /// The number of operators for the stress conditions, which take most of the time; default all
    #[arg(long, value_name = "COUNT")]
    stressed: Option<u64>,
    /// Only scenes whose name contains one of these texts
    #[arg(long)]
    scenes: Vec<String>,
    /// The scenes with two hands instead of those with one
    #[arg(long)]
    both_hands: bool,
    /// The page to write; default docs/measurements/recognition.md, or docs/measurements/recognition_both_hands.md
    #[arg(long, short)]
    out: Option<PathBuf>,
}

fn main() -> ExitCode {
    match run(&Args::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::from(2)
        }
    }
}

fn run(args: &Args) -> Result<(), String> {
    let rules = Rulesets::load(args.both_hands)?;
    let selected = |name: &&str| args.scenes.is_empty() || args.scenes.iter().any(|part| name.contains(part.as_str()));
    let hands = |name: &&str| shipped::scene(name).is_ok_and(|scene| (scene.hands.len() > 1) == args.both_hands);
    let scenes: Vec<&'static str> =
        shipped::names().filter(|name| *name != NOT_COUNTED).filter(selected).filter(hands).collect();
    let trials = run_trials(&scenes, &args.seeds, &rules, args.stressed.unwrap_or(u64::MAX))?;
    let others = args.others.as_ref().map(|seeds| run_trials(&scenes, seeds, &rules, 0)).transpose()?;
    for refused in trials.iter().flat_map(|trial| &trial.refused) {
        eprintln!("refused: {refused}");
    }

    let format_range = |seeds: &RangeInclusive<u64>| format!("{}..{}", seeds.start(), seeds.end());
    let mut sets = vec![(format_range(&args.seeds), trials.as_slice())];
    sets.extend(args.others.iter().map(&format_range).zip(others.as_deref()));
    let mut command: Vec<String> = sets.iter().map(|(seeds, _)| seeds.clone()).collect();
    command.extend(args.stressed.map(|count| format!("--stressed {count}")));
    let pooled = tables::pooled(&sets);
    let parts = [
        ("arguments", command.join(" ")),
        ("count", trials.len().to_string()),
        ("scenes", scenes.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")),
        ("tasks", tables::tasks(&trials)),
        ("wrong", tables::wrong(&trials)),
        ("segments", tables::segments(&trials)),
        ("boundaries", tables::boundaries(&trials)),
        ("sequences", tables::sequences(&trials)),
        ("stress", tables::stress(&trials)),
        ("ends", tables::ends(&rules)),
        ("backwards", tables::backwards(&trials)),
        ("additivity", tables::additivity(&trials)),
        ("coordination", tables::coordination(&trials)),
        ("pooled", pooled.clone()),
    ];
    let (page, place) = if args.both_hands {
        (PAGE_OF_BOTH_HANDS, "docs/measurements/recognition_both_hands.md")
    } else {
        (PAGE, "docs/measurements/recognition.md")
    };
    let out = args.out.clone().unwrap_or_else(|| place.into());
    let page = parts.iter().fold(page.to_string(), |page, (name, part)| page.replace(&format!("{{{{{name}}}}}"), part));
    std::fs::write(&out, page).map_err(|error| format!("{}: {error}", out.display()))?;
    println!("{}\n{pooled}", out.display());
    Ok(())
}

/// Runs all seeds of all scenes, in this order; the first `stressed` seeds also under the stress conditions.
fn run_trials(
    scenes: &[&'static str],
    seeds: &RangeInclusive<u64>,
    rules: &Rulesets,
    stressed: u64,
) -> Result<Vec<Trial>, String> {
    let cases: Vec<(&'static str, u64)> =
        scenes.iter().flat_map(|scene| seeds.clone().map(move |seed| (*scene, seed))).collect();
    let bar = ProgressBar::new(cases.len() as u64);
    bar.set_style(
        ProgressStyle::with_template("{pos}/{len} {wide_bar} {eta}").unwrap_or_else(|_| ProgressStyle::default_bar()),
    );
    let start = Instant::now();
    let trials: Result<Vec<Trial>, _> = cases
        .par_iter()
        .map(|&(scene, seed)| {
            let trial = Trial::run(scene, seed, rules, seed - seeds.start() < stressed);
            bar.inc(1);
            // Without a terminal, a line per hundred trials.
            if bar.is_hidden() && bar.position().is_multiple_of(100) {
                eprintln!("{} of {}", bar.position(), cases.len());
            }
            trial.map_err(|error| format!("{scene} {seed}: {error}"))
        })
        .collect();
    bar.finish_and_clear();
    let took_s = start.elapsed().as_secs_f64();
    let count = seeds.end() - seeds.start() + 1;
    println!("seeds {}..{}: {took_s:.0} s, {:.1} s a seed", seeds.start(), seeds.end(), took_s / count as f64);
    trials
}
