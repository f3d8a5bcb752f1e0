//! `teachtree test`: recordings against what is expected of them.

mod mutate;

use super::analysis::AnalysisArgs;
use super::junit::{self, Outcome, Suite, xml};
use super::output_args::FormatArg;
use super::parallel::texts;
use super::print_args::is_quiet;
use super::rules::{HandArg, RuleArgs, SetArg};
use super::source::SourceArgs;
use super::{Failure, output};
use mutate::mutate;
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use teachtree_analysis::coverage::Coverage;
use teachtree_analysis::expect::{self, Expectation};
use teachtree_base::error::InputError;
use teachtree_language::Rules;
use teachtree_logs::read::text;
use teachtree_session::files::all_logs;
use teachtree_session::project_file::Setting;
use teachtree_session::{Analysis, AnalysisInternals, RulesInternals};

/// How expectation files end.
const ENDING: &str = "expect";

/// Options of `test`.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  teachtree test                              all expectations in this folder and below\n  teachtree test logs/ --update               add what is missing, and write expectations for logs that have none\n  teachtree test logs/lift.expect --update --replace  accept the results of one recording\n  teachtree test logs/ --pending              write results to NAME.expect.new, for `cargo insta review -e expect`\n  teachtree test logs/ --coverage --min-coverage 80\n  teachtree test logs/ --mutate\n  teachtree test logs/ --format junit > teachtree.xml\n  teachtree test logs/ --format json"
)]
pub struct Args {
    /// Expectation files, or folders with expectation files
    #[arg(value_name = "PATH", default_value = ".")]
    paths: Vec<PathBuf>,
    /// Add results that no line expects; write an expectation file, with the rules and binding given here, for each log in the named folders that has none
    #[arg(long)]
    update: bool,
    /// With `--update`: replace lines that the result does not meet, except `pinned` ones
    #[arg(long, requires = "update")]
    replace: bool,
    /// Write results that differ to `NAME.expect.new`, for review with `cargo insta review --workspace-root . --extensions expect`
    #[arg(long, conflicts_with = "update")]
    pending: bool,
    /// Report choices that are never taken, and conditions that are never true or never false when evaluated
    #[arg(long)]
    coverage: bool,
    /// Fail when coverage is below this, in percent
    #[arg(long, value_name = "PERCENT")]
    min_coverage: Option<f64>,
    /// Change comparisons, thresholds and times one by one, and list the changes that no expectation detects
    #[arg(long)]
    mutate: bool,
    /// Coverage and mutation of this rule file only, such as an extension of the shipped rules; may be repeated
    #[arg(long, value_name = "FILE.rules")]
    only: Vec<String>,
    #[command(flatten)]
    analysis: AnalysisArgs,
    #[command(flatten)]
    form: FormatArg<Format>,
}

/// Forms of results.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Format {
    /// Text
    Text,
    /// `teachtree.test/1`: a result for each expectation
    Json,
    /// JUnit, for CI systems: a test for each expectation
    Junit,
}

impl Format {
    const fn name(self) -> &'static str {
        match self {
            Self::Text => "text",
            Self::Json => "json",
            Self::Junit => "junit",
        }
    }
}

impl Args {
    /// Whether coverage and mutation are of the rule file with this name.
    fn counts(&self, file: &str) -> bool {
        self.only.is_empty() || self.only.iter().any(|only| is_file(file, only))
    }

    /// Refuses `--only` of files that no expectation uses.
    fn check_only(&self, cases: &[Case]) -> Result<(), InputError> {
        let files: BTreeSet<&str> =
            cases.iter().flat_map(|case| &case.rules().sources.files).map(|file| file.name.as_str()).collect();
        for only in &self.only {
            if !files.iter().any(|file| is_file(file, only)) {
                let message = format!(
                    "no expectation uses this rule file; found {}",
                    files.iter().copied().collect::<Vec<_>>().join(", ")
                );
                return Err(InputError::new(only, message));
            }
        }
        Ok(())
    }
}

/// Whether the name of a rule file is the one that is asked for, with or without its folders.
fn is_file(name: &str, asked: &str) -> bool {
    Path::new(name).ends_with(asked.trim_start_matches("./")) || name == asked
}

/// An expectation with what its recording gave.
struct Case {
    path: PathBuf,
    expectation: Expectation,
    analysis: Analysis,
}

impl Case {
    fn rules(&self) -> &Rules {
        self.analysis.rules().set()
    }
}

/// Runs `test`.
pub fn run(args: &Args) -> Result<(), Failure> {
    let mut printed = String::new();
    let mut tests = Vec::new();
    let mut failures = Vec::new();
    let mut cases = Vec::new();
    let mut expectations = expectations(&args.paths)?;
    if args.mutate && args.form.format != Format::Text {
        let error = InputError::new("--mutate", "prints text only");
        return Err(error.help(format!("omit `--format {}`", args.form.format.name())).into());
    }
    let AnalysisArgs { rules, source } = &args.analysis;
    let given = !rules.rules.is_empty() || !rules.set.values.is_empty() || rules.hand.file.is_some();
    if !args.update && (given || source.binding.is_some() || source.scene.is_some()) {
        let message = "rules, params, hand model, binding and scene are read from each `.expect` file, found them on the command line";
        return Err(InputError::new("the command line", message)
            .help("edit the settings of the files, or write new ones with `--update`")
            .into());
    }
    let new = if args.update { new_expectations(args, &expectations)? } else { Vec::new() };
    expectations.extend_from_slice(&new);
    if expectations.is_empty() {
        let place = args.paths.iter().map(|path| path.display().to_string()).collect::<Vec<_>>().join(", ");
        return Err(InputError::new(place, "there are no expectations (`.expect` files) here")
            .help("`teachtree test FOLDER --update` writes one beside each log")
            .into());
    }
    expectations.sort();
    let mut unmet = 0;
    for path in expectations {
        let mut case = match read(&path) {
            Ok(case) => case,
            // The other expectations are still tested.
            Err(failure) => {
                let message = "the recording cannot be analyzed".to_string();
                tests.push(test(&path, Outcome::Error(message, texts(std::slice::from_ref(&failure)).join("\n"))));
                failures.push(failure);
                if new.contains(&path) {
                    // It expects nothing, and would be met for ever.
                    let _ = std::fs::remove_file(&path);
                }
                continue;
            }
        };
        if new.contains(&path) {
            let _ = writeln!(printed, "new      {}", path.display());
        }
        let found = expect::lines(case.analysis.found());
        let mut differences = expect::compare(&case.expectation.lines, &found, case.expectation.tolerance_s);
        let shown = path.display();
        let pending = path.with_extension(format!("{ENDING}.new"));
        if args.pending && !differences.is_empty() {
            output::write(&pending, &expect::pending(&case.expectation, &found), &[])?;
        } else if args.pending || args.update {
            // What was found before is no longer.
            let _ = std::fs::remove_file(&pending);
        }
        let met = differences.is_empty();
        if args.update && !met {
            let text = case.expectation.updated(&found, args.replace);
            if text != case.expectation.text() {
                output::write(&path, &text, &[])?;
                if !new.contains(&path) {
                    let word = if args.replace { "accepted" } else { "added to" };
                    let _ = writeln!(printed, "{word} {shown}");
                }
            }
            case.expectation = Expectation::read(&text, &shown.to_string())?;
            case.expectation.count_from(case.analysis.meta().zero_stamp_s);
            differences = expect::compare(&case.expectation.lines, &found, case.expectation.tolerance_s);
        }
        if met && !is_quiet() {
            let _ = writeln!(printed, "ok       {shown}");
        }
        let mut outcome = Outcome::Passed(String::new());
        if !differences.is_empty() {
            unmet += 1;
            let mut lines = String::new();
            for (line, difference) in &differences {
                let place = if *line > 0 { format!("{shown}:{line}") } else { shown.to_string() };
                let _ = writeln!(lines, "  {place}: {difference}");
            }
            let _ = write!(printed, "FAILED   {shown}\n{lines}");
            let message = match differences.as_slice() {
                [(_, one)] => one.to_string(),
                several => format!("{} differences", several.len()),
            };
            outcome = Outcome::Failed(message, lines);
        }
        tests.push(test(&path, outcome));
        cases.push(case);
    }
    if cases.is_empty() && printed.is_empty() && args.form.format == Format::Text {
        return Failure::all(failures);
    }
    if !is_quiet() {
        let plural = if cases.len() == 1 { "" } else { "s" };
        let _ =
            writeln!(printed, "{} recording{plural}: {} as expected, {unmet} not", cases.len(), cases.len() - unmet);
    }
    if args.update && unmet > 0 {
        let left = if args.replace {
            "pinned lines are not replaced"
        } else {
            "`--update --replace` accepts the results, except for lines marked `pinned`"
        };
        let _ = writeln!(printed, "{left}");
    }
    if args.pending && unmet > 0 {
        printed.push_str("the results are in the `.expect.new` files: `cargo insta review --workspace-root . --extensions expect`, or `--update --replace`\n");
    }
    args.check_only(&cases)?;
    let mut enough = true;
    if args.coverage || args.min_coverage.is_some() {
        let mut lines = String::new();
        enough = coverage(args, &cases, &mut lines)?;
        let outcome = match enough {
            true => Outcome::Passed(lines.clone()),
            false => Outcome::Failed("the coverage is too low".into(), lines.clone()),
        };
        tests.push(junit::Case { name: "coverage".into(), class: SUITE.into(), outcome });
        printed.push_str(&lines);
    }
    match args.form.format {
        Format::Text => output::print(&printed)?,
        Format::Json => output::print_json(&json(&tests))?,
        Format::Junit => output::print_data(&xml(SUITE, &[Suite { name: SUITE.into(), cases: tests }]))?,
    }
    if args.mutate {
        if unmet > 0 {
            output::print("no mutation: rules are changed only when all is as expected\n")?;
        } else {
            output::print(&mutate(args, &cases))?;
        }
    }
    Failure::all(failures)?;
    if unmet > 0 || !enough { Err(Failure::Negative) } else { Ok(()) }
}

/// The name of the tests in JUnit.
const SUITE: &str = "teachtree test";

/// The result of an expectation as a test, by its name and folder.
fn test(path: &Path, outcome: Outcome) -> junit::Case {
    let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    junit::Case { name, class: folder.display().to_string(), outcome }
}

/// `teachtree.test/1`.
fn json(tests: &[junit::Case]) -> String {
    let result = |test: &junit::Case| {
        let (result, message, details) = match &test.outcome {
            Outcome::Passed(details) => ("passed", "", details),
            Outcome::Failed(message, details) => ("failed", message.as_str(), details),
            Outcome::Error(message, details) => ("error", message.as_str(), details),
        };
        json!({
            "name": test.name,
            "folder": test.class,
            "result": result,
            "message": message,
            "details": details.lines().map(str::trim_start).collect::<Vec<_>>(),
        })
    };
    let tests: Vec<Value> = tests.iter().map(result).collect();
    format!("{:#}\n", json!({ "schema": "teachtree.test/1", "tests": tests }))
}

/// The expectation files that are named, and those in folders and below.
fn expectations(paths: &[PathBuf]) -> Result<Vec<PathBuf>, InputError> {
    let mut found = Vec::new();
    let mut open: Vec<PathBuf> = paths.to_vec();
    while let Some(path) = open.pop() {
        if !path.is_dir() {
            if path.is_file() && path.extension().is_none_or(|ending| ending != ENDING) {
                let beside = path.with_extension(ENDING);
                let fix = match beside.is_file() {
                    true => format!("`teachtree test {}` tests the expectations beside it", beside.display()),
                    false => format!(
                        "write one with `teachtree test {} --update`",
                        path.parent().filter(|at| !at.as_os_str().is_empty()).unwrap_or(Path::new(".")).display()
                    ),
                };
                let message = "expected an expectation (`NAME.expect`) or a folder of them, found another file";
                return Err(InputError::new(path.display().to_string(), message).help(fix));
            }
            found.push(path);
            continue;
        }
        let fail = |error: std::io::Error| {
            InputError::new(path.display().to_string(), format!("the folder cannot be read: {error}"))
        };
        for entry in std::fs::read_dir(&path).map_err(fail)? {
            let entry = entry.map_err(fail)?;
            let kind = entry.file_type().map_err(fail)?;
            let inner = entry.path();
            // A link may lead round in a circle.
            if kind.is_dir() {
                open.push(inner);
            } else if inner.extension().is_some_and(|ending| ending == ENDING) {
                found.push(inner);
            }
        }
    }
    found.sort();
    found.dedup();
    Ok(found)
}

/// Writes an empty expectation beside each log in the named folders that has none.
fn new_expectations(args: &Args, known: &[PathBuf]) -> Result<Vec<PathBuf>, Failure> {
    let mut written = Vec::new();
    for folder in args.paths.iter().filter(|path| path.is_dir()) {
        let Ok(logs) = all_logs(std::slice::from_ref(folder)) else { continue };
        // An episode of a data set has no place beside it.
        for log in logs.into_iter().filter(|log| log.is_file()) {
            let path = log.with_extension(ENDING);
            if known.contains(&path) || path.exists() {
                continue;
            }
            let name = |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let mut head = format!("log: {}\n", name(&log));
            let mut setting = |key: &str, path: &Path| {
                let _ = writeln!(head, "{key}: {}", beside(path, log.parent().unwrap_or(Path::new("."))));
            };
            let AnalysisArgs { rules, source } = &args.analysis;
            let settings = source.settings(&log)?;
            let of_project = |setting: &Option<Setting<PathBuf>>| setting.as_ref().map(|setting| setting.value.clone());
            let binding = source.binding.clone().or_else(|| of_project(&settings.binding));
            let scene = source.scene.clone().or_else(|| of_project(&settings.scene));
            let of_rules = settings.rules.as_ref().filter(|_| rules.rules.is_empty()).map(|setting| &setting.value);
            let hand_file = rules.hand.file.as_ref().or(settings.hand_file.as_ref().map(|setting| &setting.value));
            binding.iter().for_each(|path| setting("binding", path));
            scene.iter().for_each(|path| setting("scene", path));
            of_rules.unwrap_or(&rules.rules).iter().for_each(|path| setting("rules", path));
            hand_file.iter().for_each(|hand| setting("hand", Path::new(hand)));
            let of_project = settings.params.iter().map(|(param, setting)| (param, &setting.value));
            for (param, value) in of_project.chain(rules.set.values.iter().map(|(param, value)| (param, value))) {
                let _ = writeln!(head, "set: {param} = {value}");
            }
            let _ = writeln!(head, "tolerance: {} ms", expect::TOLERANCE_S * 1e3);
            output::write(&path, &head, &[])?;
            written.push(path);
        }
    }
    Ok(written)
}

/// The relative path to a file from a folder, with `/` on all systems; names of shipped files as they are. Only where there is no relative path, as from one
/// drive to another, it is absolute.
fn beside(path: &Path, folder: &Path) -> String {
    // The folder of a bare name is the current one.
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let (Ok(whole), Ok(folder)) = (std::fs::canonicalize(path), std::fs::canonicalize(folder)) else {
        return path.display().to_string();
    };
    let common = whole.components().zip(folder.components()).take_while(|(a, b)| a == b).count();
    if common == 0 {
        return whole.display().to_string();
    }
    let up = folder.components().skip(common).map(|_| "..".into());
    let down = whole.components().skip(common).map(|part| part.as_os_str().to_string_lossy().into_owned());
    up.chain(down).collect::<Vec<String>>().join("/")
}

/// The largest expectation that is read, bytes.
const MAX_EXPECTATION: u64 = 16 << 20;

/// Reads an expectation and analyses its recording.
fn read(path: &Path) -> Result<Case, Failure> {
    let shown = path.display().to_string();
    let text = text::read(path, MAX_EXPECTATION)?;
    let mut expectation = Expectation::read(&text, &shown)?;
    let folder = path.parent().unwrap_or(Path::new("."));
    let place = |name: &String| folder.join(name);
    // What does not lie beside the expectation is the name of a shipped file.
    let found = |name: &String| if place(name).is_file() { place(name) } else { PathBuf::from(name) };
    let [binding, scene] = [&expectation.binding, &expectation.scene].map(|name| name.as_ref().map(place));
    // The settings of an expectation are all that count.
    let source = SourceArgs { binding, scene, is_alone: true };
    let rules = RuleArgs {
        rules: expectation.rules.iter().map(found).collect(),
        hand: HandArg { file: expectation.hand.as_ref().map(|hand| found(hand).display().to_string()) },
        set: SetArg { values: expectation.set.clone() },
    };
    let analysis = AnalysisArgs { rules, source };
    let log = analysis.read(&folder.join(&expectation.log))?;
    let rules = analysis.rules.load(&log).map_err(|error| Failure::from(error).named_in(&shown))?;
    expectation.check(rules.set(), &shown)?;
    let analysis = rules.analyze(&log)?;
    expectation.count_from(analysis.meta().zero_stamp_s);
    Ok(Case { path: path.to_path_buf(), expectation, analysis })
}

/// Says what the recordings show of the rules; whether that is enough.
fn coverage(args: &Args, cases: &[Case], printed: &mut String) -> Result<bool, Failure> {
    let mut coverage = Coverage::default();
    for case in cases {
        let run = case.analysis.run()?;
        coverage.add(case.rules(), &run.frames, &run.leaves)?;
    }
    let coverage = coverage.of_files(|file| args.counts(file));
    let (seen, of) = coverage.seen();
    let percent = coverage.percent();
    let _ = writeln!(printed, "coverage: {seen} of {of} outcomes of choices and conditions seen, {percent:.1} %");
    if args.coverage {
        for gap in coverage.gaps() {
            let _ = writeln!(printed, "  {:<11} {}   {}", gap.what, gap.text, gap.place);
        }
    }
    let enough = args.min_coverage.is_none_or(|least| percent >= least);
    if let Some(least) = args.min_coverage.filter(|_| !enough) {
        let _ = writeln!(printed, "FAILED   coverage is {percent:.1} %, expected {least} %");
    }
    Ok(enough)
}
