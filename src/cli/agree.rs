//! `teachtree agree`: the labels of two people, compared.

use super::parallel::ParallelArgs;
use super::rules::{RuleArgs, read_by};
use super::source::SourceArgs;
use super::truth::{TrackArg, labeled};
use super::{Failure, output};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use teachtree_analysis::TrackId;
use teachtree_analysis::agreement::json::{AgreementByKind, json};
use teachtree_analysis::agreement::{Agreement, Span};
use teachtree_analysis::number::fixed;
use teachtree_analysis::score::{KnownNames, NameMap};
use teachtree_base::error::InputError;
use teachtree_logs::atomic_write::Files;
use teachtree_logs::read::labels::LabelKind;
use teachtree_session::Labels;
use teachtree_session::files::{all_logs, label_file};
use teachtree_session::score::{is_of_set, is_of_several, read_labels};
use teachtree_session::{LabelsInternals, LogInternals, RulesInternals};

/// Options of `agree`.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  teachtree agree mika/ noor/ recordings/\n  teachtree agree mika.csv noor.eaf demonstration.csv --track right\n  teachtree agree mika/ noor/ 'set#*' --binding arm.binding.yaml --min-kappa 0.8\n  teachtree agree mika/ noor/ recordings/ --format json -o agreement.json\nExit status: 0 compared, 1 less than --min-kappa, 2 bad input, 3 some recordings could not be compared."
)]
pub struct Args {
    /// The labels of the first person: a table or a file of ELAN; a folder with a file for each log
    one: PathBuf,
    /// The labels of the second person
    other: PathBuf,
    /// The recordings that both labeled; a folder stands for all logs in it, `set#*` for all episodes of a data set
    #[arg(required = true, value_name = "LOG")]
    logs: Vec<PathBuf>,
    /// The track of labels that have no column `track`
    #[arg(long, value_enum, value_name = "TRACK")]
    track: Option<TrackArg>,
    /// Fail when Cohen's kappa of primitives, all recordings together, is less than this
    #[arg(long, value_name = "KAPPA", value_parser = kappa)]
    min_kappa: Option<f64>,
    /// From the names that stand in the files to those that are compared: a YAML file, or `S1=Move,S2=Grasp,S9=mask`
    #[arg(long, value_name = "MAP")]
    map: Option<String>,
    /// What to write
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
    /// Where to write it; standard output when left out
    #[arg(long, short, value_name = "FILE")]
    out: Option<PathBuf>,
    #[command(flatten)]
    rules: RuleArgs,
    #[command(flatten)]
    source: SourceArgs,
    #[command(flatten)]
    many: ParallelArgs,
}

/// Forms of an agreement.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Format {
    /// Tables for the terminal
    Text,
    /// `teachtree.agreement/1`
    Json,
}

/// Reads a kappa.
fn kappa(text: &str) -> Result<f64, String> {
    let value: Option<f64> = text.trim().parse().ok().filter(|value| (-1.0..=1.0).contains(value));
    value.ok_or_else(|| "expected a number from -1 to 1".into())
}

/// The labels of a recording by track and kind.
type Tracks = BTreeMap<(TrackId, LabelKind), Vec<Span>>;

/// Runs `agree`.
pub fn run(args: &Args) -> Result<(), Failure> {
    let mut logs = all_logs(&args.logs)?;
    args.source.check(logs.len())?;
    for labels in [&args.one, &args.other] {
        if !labels.exists() {
            return Err(InputError::new(labels.display().to_string(), "there is no such file or folder").into());
        }
        if logs.len() > 1 && !is_of_several(labels) {
            let message = format!("one label file for {} recordings", logs.len());
            return Err(InputError::new(labels.display().to_string(), message)
                .help("name the folder in which every log has its label file, or a table with a column `log`")
                .into());
        }
    }
    for labels in [&args.one, &args.other] {
        logs = labeled(logs, labels, &args.many)?;
    }
    let map = args.map.iter().fold(Labels::default(), |labels, map| labels.map(map)).names()?;
    let compared = args.many.each("comparing", &logs, |log| compare(args, log, &map))?;
    let (mut rows, mut all, mut failures) = (Vec::new(), AgreementByKind::new(), Vec::new());
    for (log, compared) in logs.iter().zip(compared) {
        match compared {
            Ok(kinds) => {
                for (kind, agreement) in &kinds {
                    all.entry(*kind).or_default().add(agreement);
                }
                rows.push((log.display().to_string(), kinds));
            }
            Err(failure) if !failures.contains(&failure) => failures.push(failure),
            Err(_) => {}
        }
    }
    if rows.is_empty() {
        return Failure::all(failures);
    }
    write(args, &logs, &rows, &all)?;
    Failure::some(failures, rows.len())?;
    let found = all.get(&LabelKind::Primitive).and_then(Agreement::kappa);
    match (args.min_kappa, found) {
        (Some(least), Some(found)) if found < least => {
            output::complain(&format!("FAILED   kappa of primitives is {found:.3}, expected at least {least}"));
            Err(Failure::Negative)
        }
        (Some(least), None) => {
            output::complain(&format!("FAILED   kappa of primitives is not known, expected at least {least}"));
            Err(Failure::Negative)
        }
        _ => Ok(()),
    }
}

fn write(
    args: &Args,
    logs: &[PathBuf],
    rows: &[(String, AgreementByKind)],
    all: &AgreementByKind,
) -> Result<(), InputError> {
    let text = match args.format {
        Format::Text => text(args, rows, all),
        Format::Json => json(&[&args.one, &args.other].map(|path| path.display().to_string()), rows, all),
    };
    let Some(path) = &args.out else {
        return if args.format == Format::Text { output::print(&text) } else { output::print_json(&text) };
    };
    let read = read_by(&args.source, &args.rules);
    let map = args.map.as_deref().map(Path::new);
    let named = [args.one.as_path(), &args.other].into_iter().chain(map);
    let inputs: Vec<&Path> = logs.iter().chain(&read).map(PathBuf::as_path).chain(named).collect();
    let mut files = Files::default();
    output::add(&mut files, path, &text, &inputs)?;
    files.commit()
}

fn compare(args: &Args, log: &Path, map: &NameMap) -> Result<AgreementByKind, Failure> {
    let log = args.source.open(log)?;
    let opened = log.opened()?;
    let only = match *log.hands() {
        [side] => Some(TrackId::Hand(side)),
        _ => None,
    };
    let track = args.track.map(TrackId::from).or(only);
    let read = |path: &Path| -> Result<Tracks, Failure> {
        let file = label_file(path, &opened.log)?;
        // The words in a data set stand for names of the rules.
        let known =
            if is_of_set(&file) { KnownNames::new(args.rules.load(&log)?.set()) } else { KnownNames::default() };
        let found = read_labels(&file, opened, map, &known)?;
        let mut tracks = Tracks::new();
        for interval in found.intervals {
            let wrong = |message: &str| InputError::new(format!("{} {}", found.file, interval.place), message);
            let label = match map.get(&interval.name) {
                None => interval.name.clone(),
                Some([]) => continue,
                Some([one]) => one.clone(),
                Some(several) => {
                    let message = format!("`{}` is mapped to {} names, expected one", interval.name, several.len());
                    return Err(wrong(&message).help("two people are compared name by name").into());
                }
            };
            let who = interval.track.or(track).ok_or_else(|| {
                wrong("the row does not say which hand it is about, and the recording has several tracks")
                    .help("name it with --track")
            })?;
            let span = Span { label, start_s: interval.start_s, end_s: interval.end_s };
            tracks.entry((who, interval.kind)).or_default().push(span);
        }
        // Labels without a track may stand beside others of the same one.
        tracks.values_mut().for_each(|spans| spans.sort_by(|a, b| a.start_s.total_cmp(&b.start_s)));
        Ok(tracks)
    };
    let (one, other) = (read(&args.one)?, read(&args.other)?);
    let mut time: Vec<f64> = opened.row_time.iter().copied().filter(|time| time.is_finite()).collect();
    time.sort_by(f64::total_cmp);
    time.dedup();
    let mut kinds = AgreementByKind::new();
    let keys: BTreeSet<&(TrackId, LabelKind)> = one.keys().chain(other.keys()).collect();
    for key in keys {
        let spans = |tracks: &Tracks| tracks.get(key).cloned().unwrap_or_default();
        kinds.entry(key.1).or_default().add(&Agreement::new(&spans(&one), &spans(&other), &time));
    }
    Ok(kinds)
}

fn text(args: &Args, rows: &[(String, AgreementByKind)], all: &AgreementByKind) -> String {
    let mut text = String::new();
    let plural = if rows.len() == 1 { "" } else { "s" };
    let _ = writeln!(text, "{} and {}, {} recording{plural}", args.one.display(), args.other.display(), rows.len());
    for (kind, agreement) in all {
        let name = if *kind == LabelKind::Task { "tasks" } else { "primitives" };
        let _ = writeln!(
            text,
            "\n{name}: kappa {}, the same label on {} of {} frames that both labeled",
            number(agreement.kappa()),
            percent(agreement.share()),
            agreement.both()
        );
        let [one, other] = agreement.alone;
        if one + other > 0 {
            let _ = writeln!(text, "  labeled by one person only: {one} frames by the first, {other} by the second");
        }
        let mut table = vec![line(["label", "kappa", "frames of both", "boundaries", "alone", "median", "90 %"])];
        for label in agreement.labels() {
            table.push(row(label, &agreement.of_label(label)));
        }
        table.push(row("all", agreement));
        text.push_str(&table.concat());
        if rows.len() > 1 {
            text.push_str("  recording                                            kappa     frames\n");
            for (log, kinds) in rows {
                let Some(own) = kinds.get(kind) else { continue };
                let _ = writeln!(text, "  {log:<48}{:>10}{:>11}", number(own.kappa()), own.both());
            }
        }
    }
    if all.is_empty() {
        text.push_str("\nno labels\n");
    }
    text
}

fn row(label: &str, agreement: &Agreement) -> String {
    let boundaries = agreement.all_boundaries();
    let ms = |q: f64| boundaries.quantile_s(q).map_or("-".into(), |time| format!("{} ms", fixed(time * 1e3, 0)));
    let [one, other] = boundaries.alone;
    line([
        label,
        &number(agreement.kappa()),
        &agreement.same().to_string(),
        &boundaries.distances_s.len().to_string(),
        &format!("{one} + {other}"),
        &ms(0.5),
        &ms(0.9),
    ])
}

fn line([label, kappa, frames, pairs, alone, median, most]: [&str; 7]) -> String {
    format!("  {label:<20}{kappa:>8}{frames:>16}{pairs:>12}{alone:>10}{median:>10}{most:>10}\n")
}

fn number(value: Option<f64>) -> String {
    value.map_or("-".into(), |value| fixed(value, 3))
}

fn percent(share: Option<f64>) -> String {
    share.map_or("-".into(), |share| format!("{} %", fixed(share * 100.0, 1)))
}
