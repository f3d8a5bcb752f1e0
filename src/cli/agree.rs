//! `teachtree agree`: the labels of two people, compared.

use super::analysis::AnalysisArgs;
use super::output_args::{FormatArg, OutArg};
use super::parallel::{LogResults, ParallelArgs, distinct_failures};
use super::truth::{LabelTrackArg, check_labels, labeled};
use super::{Failure, output};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use teachtree_analysis::TrackId;
use teachtree_analysis::agreement::json::{AgreementByKind, json};
use teachtree_analysis::agreement::{Agreement, Span};
use teachtree_analysis::score::{KnownNames, NameMap};
use teachtree_base::error::InputError;
use teachtree_logs::read::labels::LabelKind;
use teachtree_report::agreement::text;
use teachtree_session::Labels;
use teachtree_session::files::label_file;
use teachtree_session::score::{is_of_set, read_labels};
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
    /// The recordings that both labeled; a folder stands for all its logs, `set#*` for all episodes of a data set
    #[arg(required = true, value_name = "LOG")]
    logs: Vec<PathBuf>,
    #[command(flatten)]
    track: LabelTrackArg,
    /// Fail when Cohen's kappa of primitives over all recordings is below this
    #[arg(long, value_name = "KAPPA", value_parser = kappa)]
    min_kappa: Option<f64>,
    /// Mapping of the names in the files to the names that are compared: a YAML file, or `S1=Move,S2=Grasp,S9=mask`
    #[arg(long, value_name = "MAP")]
    map: Option<String>,
    #[command(flatten)]
    form: FormatArg<Format>,
    #[command(flatten)]
    out: OutArg,
    #[command(flatten)]
    analysis: AnalysisArgs,
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
    let mut logs = args.analysis.logs(&args.logs)?;
    args.analysis.source.check(logs.len())?;
    for labels in [&args.one, &args.other] {
        if !labels.exists() {
            return Err(InputError::new(labels.display().to_string(), "there is no such file or folder").into());
        }
        check_labels(labels, logs.len())?;
    }
    for labels in [&args.one, &args.other] {
        logs = labeled(logs, labels)?;
    }
    let map = args.map.iter().fold(Labels::default(), |labels, map| labels.map(map)).names()?;
    let LogResults { done, failed } = args.many.each_log("comparing", &logs, |log| compare(args, log, &map))?;
    let (mut rows, mut all, failures) = (Vec::new(), AgreementByKind::new(), distinct_failures(failed));
    for (log, kinds) in done {
        for (kind, agreement) in &kinds {
            all.entry(*kind).or_default().add(agreement);
        }
        rows.push((log.display().to_string(), kinds));
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
    let people = [&args.one, &args.other].map(|path| path.display().to_string());
    let text = match args.form.format {
        Format::Text => text(&people, rows, all),
        Format::Json => json(&people, rows, all),
    };
    let Some(path) = &args.out.file else { return args.form.print(&text) };
    let mut inputs = args.analysis.inputs(logs);
    inputs.extend([&args.one, &args.other].into_iter().cloned().chain(args.map.iter().map(PathBuf::from)));
    output::write(path, &text, &inputs)
}

fn compare(args: &Args, log: &Path, map: &NameMap) -> Result<AgreementByKind, Failure> {
    let log = args.analysis.source.open(log)?;
    let opened = log.opened()?;
    let only = match *log.hands() {
        [side] => Some(TrackId::Hand(side)),
        _ => None,
    };
    let track = args.track.who().or(only);
    let read = |path: &Path| -> Result<Tracks, Failure> {
        let file = label_file(path, &opened.log)?;
        // The words in a data set stand for names of the rules.
        let known = if is_of_set(&file) {
            KnownNames::new(args.analysis.rules.load(&log)?.set())
        } else {
            KnownNames::default()
        };
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
                wrong("the row names no track, and the recording has several").help("name it with --track")
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
