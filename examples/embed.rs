//! A whole program that embeds the library: it reads a recording, runs rules of its own over it, prints the tasks, and asks why.
//!
//! `cargo run --features examples --example embed` takes a recording that comes with the project;
//! `cargo run --features examples --example embed -- LOG [BINDING]` another one.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "it is a program")]

use std::process::ExitCode;
use teachtree::{Error, Log, Question, Rules};

/// The shipped rules, extended by a primitive: a hand that holds something still in the air.
const RULES: &str = r#"
use "contact.rules"

param hold_time = 300 ms in 100 ms .. 1 s

primitive Hold is Translate

extend single_hand before carried {
  not supported and not walled and ((not moving) for hold_time) => Hold
}
"#;

fn run(log: Option<String>, binding: Option<String>) -> Result<(), Error> {
    let log = match (log, binding) {
        (Some(log), None) => Log::open(log)?,
        (Some(log), Some(binding)) => Log::options().binding(binding).open(log)?,
        (None, _) => {
            let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/demos/robosuite");
            let binding = format!("{folder}/sawyer_nut_assembly.binding.yaml");
            Log::options().binding(binding).open(format!("{folder}/SawyerNutAssembly_demo_1.csv"))?
        }
    };
    let rules = Rules::options().text("hold", RULES).for_log(&log)?;
    for warning in rules.warnings() {
        eprintln!("{warning}");
    }
    let analysis = rules.analyze(&log)?;
    for task in analysis.tasks() {
        println!("{task}");
        for segment in task.segments() {
            println!("  {segment}");
        }
    }
    for issue in analysis.issues() {
        println!("issue: {} {}", issue.kind, issue.message);
    }
    // Why the longest Hold is one, and no Translate.
    let holds = analysis.segments().into_iter().filter(|segment| segment.primitive() == "Hold");
    let length = |segment: &teachtree::Segment| segment.end_s() - segment.start_s();
    if let Some(longest) = holds.max_by(|a, b| length(a).total_cmp(&length(b))) {
        let middle = (longest.start_s() + longest.end_s()) / 2.0;
        let question = Question::at(middle).track(longest.track()).why_not("Translate");
        print!("\n{}", analysis.explain(&question)?);
    }
    Ok(())
}

fn main() -> ExitCode {
    let mut args = std::env::args().skip(1);
    match run(args.next(), args.next()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}
