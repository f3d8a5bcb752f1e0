//! `cargo run --release --example recognition -- 1..200 1001..1050` makes docs/recognition.md: every shipped task, taught by many people,
//! recognised by one set of rules, and counted. Everything happens in memory; what is written does not depend on the number of threads.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a program says what it does")]

mod coordination;
mod person;
mod ruleset;
mod tables;
mod transforms;

use clap::Parser;
use indicatif::{ProgressBar, ProgressStyle};
use person::{Person, Rulesets};
use rayon::prelude::*;
use std::ops::RangeInclusive;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;
use teachtree::world::shipped;

/// The page without its tables; `{{name}}` is where they go.
const PAGE: &str = include_str!("page.md");
const PAGE_OF_BOTH_HANDS: &str = include_str!("both_hands.md");
/// The chapter's own recording is two tasks in a row and has a test of its own.
const NOT_COUNTED: &str = "paper_box";

/// Measures recognition over many simulated people
#[derive(Parser)]
struct Args {
    /// The people, the last one included
    #[arg(value_parser = seeds, default_value = "1..200")]
    seeds: RangeInclusive<u64>,
    /// Other people, whose pooled figures stand beside
    #[arg(value_parser = seeds)]
    others: Option<RangeInclusive<u64>>,
    /// How many of the people are also recorded and judged otherwise, which takes most of the time; all when left out
    #[arg(long, value_name = "COUNT")]
    stressed: Option<u64>,
    /// Only these scenes; a part of a name is enough
    #[arg(long)]
    scenes: Vec<String>,
    /// The scenes with two hands, in place of those with one
    #[arg(long)]
    both_hands: bool,
    /// Where to write the page; docs/recognition.md, or docs/recognition_both_hands.md, when left out
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
    let wanted = |name: &&str| args.scenes.is_empty() || args.scenes.iter().any(|part| name.contains(part.as_str()));
    let hands = |name: &&str| shipped::scene(name).is_ok_and(|scene| (scene.hands.len() > 1) == args.both_hands);
    let scenes: Vec<&'static str> =
        shipped::names().filter(|name| *name != NOT_COUNTED).filter(wanted).filter(hands).collect();
    let people = watch(&scenes, &args.seeds, &rules, args.stressed.unwrap_or(u64::MAX))?;
    let others = args.others.as_ref().map(|seeds| watch(&scenes, seeds, &rules, 0)).transpose()?;
    for refused in people.iter().flat_map(|person| &person.refused) {
        eprintln!("refused: {refused}");
    }

    let said = |seeds: &RangeInclusive<u64>| format!("{}..{}", seeds.start(), seeds.end());
    let mut sets = vec![(said(&args.seeds), people.as_slice())];
    sets.extend(args.others.iter().map(&said).zip(others.as_deref()));
    let mut command: Vec<String> = sets.iter().map(|(seeds, _)| seeds.clone()).collect();
    command.extend(args.stressed.map(|count| format!("--stressed {count}")));
    let pooled = tables::pooled(&sets);
    let parts = [
        ("arguments", command.join(" ")),
        ("count", people.len().to_string()),
        ("scenes", scenes.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")),
        ("tasks", tables::tasks(&people)),
        ("wrong", tables::wrong(&people)),
        ("segments", tables::segments(&people)),
        ("boundaries", tables::boundaries(&people)),
        ("sequences", tables::sequences(&people)),
        ("stress", tables::stress(&people)),
        ("ends", tables::ends(&rules)),
        ("backwards", tables::backwards(&people)),
        ("additivity", tables::additivity(&people)),
        ("coordination", tables::coordination(&people)),
        ("pooled", pooled.clone()),
    ];
    let (page, place) = if args.both_hands {
        (PAGE_OF_BOTH_HANDS, "docs/recognition_both_hands.md")
    } else {
        (PAGE, "docs/recognition.md")
    };
    let out = args.out.clone().unwrap_or_else(|| place.into());
    let page = parts.iter().fold(page.to_string(), |page, (name, part)| page.replace(&format!("{{{{{name}}}}}"), part));
    std::fs::write(&out, page).map_err(|error| format!("{}: {error}", out.display()))?;
    println!("{}\n{pooled}", out.display());
    Ok(())
}

/// All seeds of all scenes, in this order; the first `stressed` seeds under every condition.
fn watch(
    scenes: &[&'static str],
    seeds: &RangeInclusive<u64>,
    rules: &Rulesets,
    stressed: u64,
) -> Result<Vec<Person>, String> {
    let cases: Vec<(&'static str, u64)> =
        scenes.iter().flat_map(|scene| seeds.clone().map(move |seed| (*scene, seed))).collect();
    let bar = ProgressBar::new(cases.len() as u64);
    bar.set_style(
        ProgressStyle::with_template("{pos}/{len} {wide_bar} {eta}").unwrap_or_else(|_| ProgressStyle::default_bar()),
    );
    let start = Instant::now();
    let people: Result<Vec<Person>, _> = cases
        .par_iter()
        .map(|&(scene, seed)| {
            let person = Person::watch(scene, seed, rules, seed - seeds.start() < stressed);
            bar.inc(1);
            // Where there is no terminal to draw in, a line now and then.
            if bar.is_hidden() && bar.position().is_multiple_of(100) {
                eprintln!("{} of {}", bar.position(), cases.len());
            }
            person.map_err(|error| format!("{scene} {seed}: {error}"))
        })
        .collect();
    bar.finish_and_clear();
    let took_s = start.elapsed().as_secs_f64();
    let count = seeds.end() - seeds.start() + 1;
    println!("seeds {}..{}: {took_s:.0} s, {:.1} s a seed", seeds.start(), seeds.end(), took_s / count as f64);
    people
}

/// `1..200`.
fn seeds(text: &str) -> Result<RangeInclusive<u64>, String> {
    let ends = text.split_once("..").and_then(|(first, last)| Some((first.parse().ok()?, last.parse().ok()?)));
    ends.filter(|(first, last)| first <= last)
        .map(|(first, last)| first..=last)
        .ok_or("wanted seeds such as 1..200".into())
}
