//! `annotate` of a LeRobot set: primitives as `motion` and tasks as `subtask`, in words, in the forms that programs read.

use super::super::Failure;
use super::super::print_args::is_quiet;
use super::super::progress::Progress;
use super::super::source::is_yaml;
use super::{Args, Destination, Summary, outcomes, provenance};
use serde_json::json;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::path::Path;
use teachtree_base::error::InputError;
use teachtree_base::spelling::nearest;
use teachtree_base::yaml;
use teachtree_logs::read::formats;
use teachtree_logs::read::formats::lerobot::annotate::{AnnotationTarget, Label, LabelFormat, Request, success};
use teachtree_logs::read::text;
use teachtree_report::words::{Phrasing, Style};
use teachtree_session::Analysis;
use teachtree_session::{AnalysisInternals, LogInternals, RulesInternals};

/// How many different labels are listed.
const LISTED: usize = 30;

/// Options of LeRobot sets.
#[derive(clap::Args)]
pub struct LeRobot {
    /// LeRobot: the labels to write; by default both
    #[arg(long, value_enum, value_name = "STYLE")]
    style: Vec<StyleArg>,
    /// LeRobot: wording of labels: a YAML file whose lines replace those of the shipped `words.yaml`, `NAME=TEMPLATE` for one primitive, task or body, or
    /// `TEMPLATE` for all names, such as `{name}[ {object}][ ({partner})]`, with `{hand}` for the hand; may be repeated
    #[arg(long, value_name = "TEMPLATE|FILE.yaml")]
    words: Vec<String>,
    /// LeRobot: write `language_persistent`; the default when no other form is named
    #[arg(long)]
    language: bool,
    /// LeRobot: write `meta/subtasks.parquet` and the column `subtask_index`, as lerobot 0.4.4 to 0.5 reads them: the tasks, or the primitives with `--style motion`
    #[arg(long)]
    legacy: bool,
    /// LeRobot: write the stages of SARM into `meta/episodes`: the tasks as `sparse_…`, the primitives as `dense_…`
    #[arg(long)]
    sarm: bool,
    /// LeRobot 2.0 and 2.1: write columns `annotation.teachtree.…`, `meta/tasks.jsonl` and `meta/modality.json`, as GR00T reads them
    #[arg(long)]
    gr00t: bool,
    /// LeRobot: write `meta/lerobot_annotations.json`, which the annotation tab of LeRobot's visualizer opens and `score --labels` reads
    #[arg(long)]
    prelabels: bool,
}

/// Labels by the name that LeRobot gives them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum StyleArg {
    /// The primitives
    Motion,
    /// The tasks
    Subtask,
}

impl Destination for LeRobot {
    fn is_kind_of(&self, data: &Path) -> Result<bool, InputError> {
        Ok(data.is_dir() && formats::is_set(data))
    }

    fn given(&self) -> Option<&'static str> {
        let forms = self.language || self.legacy || self.sarm || self.gr00t || self.prelabels;
        let is_given = forms || !self.words.is_empty() || !self.style.is_empty();
        is_given.then_some("--words, --style and the forms of labels are of LeRobot sets")
    }

    fn annotate(&self, args: &Args) -> Result<(), Failure> {
        let phrasing = phrasing(&self.words)?;
        let wanted = |style: &Style| {
            let named = |arg: &StyleArg| match arg {
                StyleArg::Motion => *style == Style::Motion,
                StyleArg::Subtask => *style == Style::Subtask,
            };
            self.style.is_empty() || self.style.iter().any(named)
        };
        let styles: Vec<Style> = Style::ALL.into_iter().filter(wanted).collect();
        let mut forms = forms(self)?;
        let legacy = legacy(&self.style, &forms)?;
        // `subtask_index` has one style; labels of the other one are written only where another form takes them.
        let styles: Vec<Style> = match forms.as_slice() {
            [LabelFormat::Legacy] => styles.into_iter().filter(|style| style.name() == legacy).collect(),
            _ => styles,
        };
        let names: Vec<&str> = styles.iter().map(|style| style.name()).collect();
        let set = AnnotationTarget::open(&args.data)?;
        set.refuse_forms(&forms)?;
        if !args.replace {
            set.refuse_labeled(&forms, &names)?;
        }
        let logs = formats::all_of(&args.data)?.unwrap_or_default();
        args.analysis.source.check(logs.len())?;
        let found = args.many.each("analyzing", &logs, |log| {
            let log = args.analysis.source.open(log)?;
            let bodies: BTreeSet<String> = log.opened()?.recording.scene.bodies.keys().cloned().collect();
            Ok::<_, Failure>((args.analyzed(&log)?, bodies))
        })?;
        let (mut analyses, mut failures) = (BTreeMap::new(), Vec::new());
        let (mut bodies, mut left_out) = (BTreeSet::new(), Vec::new());
        let mut successes: BTreeMap<usize, Vec<bool>> = BTreeMap::new();
        for ((episode, log), found) in logs.iter().enumerate().zip(found) {
            let rows = found.as_ref().ok().and_then(|(analysis, _)| outcomes::success_rows(analysis));
            successes.extend(rows.map(|rows| (episode, rows)));
            match found {
                Ok((analysis, _)) if args.leaves_out(&analysis) => left_out.push(episode),
                Ok((analysis, more)) => {
                    bodies.extend(more);
                    analyses.insert(episode, analysis);
                }
                Err(failure) => failures.push(failure.of_log(log)),
            }
        }
        if analyses.is_empty() && !left_out.is_empty() {
            failures.push(args.refuse_failures(left_out.len()).into());
        }
        if analyses.is_empty() {
            return Failure::some(failures, 0);
        }
        check_names(&phrasing, &analyses, bodies)?;
        let (is_success_written, success_lines) = success_column(args, &set, &successes, logs.len())?;
        forms.extend(is_success_written.then_some(LabelFormat::Success));
        let labels: BTreeMap<usize, Vec<Label>> =
            analyses.iter().map(|(episode, analysis)| (*episode, labels(analysis, &styles, &phrasing))).collect();
        let unlabeled: Vec<usize> = (0..logs.len()).filter(|episode| !analyses.contains_key(episode)).collect();
        let binding = args.analysis.source.binding_of(&args.data)?;
        let mut provenance_json = provenance(binding.as_deref(), analyses.values());
        if let Some(provenance_json) = provenance_json.as_object_mut() {
            provenance_json.insert("styles".into(), json!(names));
            provenance_json.insert("words".into(), json!(phrasing.texts()));
            if !unlabeled.is_empty() {
                provenance_json.insert("episodes_without_labels".into(), json!(unlabeled));
            }
            if !left_out.is_empty() {
                provenance_json.insert("failed_episodes".into(), json!(left_out));
            }
        }
        let progress = (!is_quiet()).then(|| Progress::new("writing"));
        let request = Request {
            forms: &forms,
            styles: &names,
            legacy,
            labels: &labels,
            successes: &successes,
            provenance: &provenance_json,
        };
        set.write(&args.out, &request, &mut |part| progress.iter().for_each(|bar| bar.set(part)))?;
        drop(progress);
        let counts = label_counts(&labels);
        let summary = Summary {
            text: text(args, &labels, &counts, logs.len()) + &success_lines,
            recordings: logs.len(),
            labeled: analyses.keys().map(usize::to_string).collect(),
            left_out: left_out.iter().map(|episode| format!("episode {episode}")).collect(),
            successes: successes.values().map(|rows| rows.contains(&true)).collect(),
            labels: counts,
            signals: Vec::new(),
        };
        summary.print(args)?;
        Failure::some(failures, analyses.len())
    }
}

/// The words of the shipped table, in which the tables and then the templates of `--words` replace lines.
///
/// # Errors
/// A file that cannot be read, or a template that is wrong.
pub fn phrasing(words: &[String]) -> Result<Phrasing, InputError> {
    let (tables, templates): (Vec<String>, Vec<String>) =
        words.iter().cloned().partition(|text| is_yaml(text) && !text.contains(['=', '{']));
    let read = |phrasing: Phrasing, file: String| {
        let text = text::read(Path::new(&file), yaml::MAX_BYTES as u64)?;
        phrasing.with_table(&text, &file)
    };
    tables.into_iter().try_fold(Phrasing::shipped()?, read)?.with_templates(&templates)
}

/// The forms that are asked for.
fn forms(own: &LeRobot) -> Result<Vec<LabelFormat>, InputError> {
    if own.language && own.legacy {
        let message =
            "the versions of lerobot that read --legacy load no set with language columns, found --language too";
        return Err(InputError::new("--legacy", message).help("write two copies"));
    }
    let asked = [
        (own.language, LabelFormat::Language),
        (own.legacy, LabelFormat::Legacy),
        (own.sarm, LabelFormat::Sarm),
        (own.gr00t, LabelFormat::Gr00t),
        (own.prelabels, LabelFormat::Prelabels),
    ];
    let forms: Vec<LabelFormat> = asked.into_iter().filter(|(is_asked, _)| *is_asked).map(|(_, form)| form).collect();
    Ok(if forms.is_empty() { vec![LabelFormat::Language] } else { forms })
}

/// The style of `subtask_index`, of which there is one.
fn legacy(styles: &[StyleArg], forms: &[LabelFormat]) -> Result<&'static str, InputError> {
    match styles {
        [] => Ok(Style::Subtask.name()),
        styles if styles.iter().all(|style| *style == StyleArg::Motion) => Ok(Style::Motion.name()),
        styles if styles.iter().all(|style| *style == StyleArg::Subtask) => Ok(Style::Subtask.name()),
        _ if !forms.contains(&LabelFormat::Legacy) => Ok(Style::Subtask.name()),
        _ => {
            Err(InputError::new("--style", "`subtask_index` has one style, found two").help("name the one of --legacy"))
        }
    }
}

/// Whether `next.success` is written, and the lines about it. The column needs a value for each frame, so it is written only where the outcome of each episode
/// is known; a column of the set is kept unless it is to be replaced.
fn success_column(
    args: &Args,
    set: &AnnotationTarget,
    successes: &BTreeMap<usize, Vec<bool>>,
    episodes: usize,
) -> Result<(bool, String), InputError> {
    let name = success::COLUMN;
    if successes.is_empty() {
        return Ok((false, String::new()));
    }
    let contradictions = set.success_contradictions(successes)?;
    let is_there = contradictions.is_some();
    let unknown: Vec<usize> = (0..episodes).filter(|episode| !successes.contains_key(episode)).collect();
    let is_wanted = args.replace || !is_there;
    let is_written = is_wanted && unknown.is_empty();
    let what = match (is_written, is_wanted) {
        (true, _) => "it is replaced",
        (false, true) => "it is kept",
        (false, false) => "it is kept, `--replace` replaces it",
    };
    let mut lines = outcomes::contradictions(name, &contradictions.unwrap_or_default(), successes, what);
    if is_written {
        let _ = writeln!(lines, "`{name}`: {}", outcomes::counts(successes));
    } else if is_wanted {
        let what = if is_there { "replaced" } else { "written" };
        let unknown = outcomes::named(&unknown, usize::to_string);
        let _ = writeln!(lines, "`{name}` is not {what}, since outcomes are unknown: {unknown}");
    }
    Ok((is_written, lines))
}

/// Refuses a template of the command line or of a table for a name that nothing has.
fn check_names(
    phrasing: &Phrasing,
    analyses: &BTreeMap<usize, Analysis>,
    bodies: BTreeSet<String>,
) -> Result<(), InputError> {
    let mut known = bodies;
    for analysis in analyses.values() {
        known.extend(analysis.rules().primitives().chain(analysis.rules().tasks()).map(str::to_string));
        known.extend(analysis.rules().set().label_names());
    }
    let Some((name, place)) = phrasing.unknown(&known) else { return Ok(()) };
    let error = InputError::new(place, format!("there is no primitive, task or body `{name}`"));
    Err(match nearest(name, known.iter().map(String::as_str)) {
        Some(near) => error.help(format!("did you mean `{near}`?")),
        None => error.help(format!("there are {}", known.into_iter().collect::<Vec<_>>().join(", "))),
    })
}

/// The labels of an episode.
fn labels(analysis: &Analysis, styles: &[Style], phrasing: &Phrasing) -> Vec<Label> {
    let of = |style: &Style| {
        let words = phrasing.of(analysis.found(), *style);
        let style = style.name();
        words.into_iter().map(move |words| Label { style, row: words.row, end: words.end, content: words.content })
    };
    styles.iter().flat_map(of).collect()
}

/// How often each label was written, by style and words.
fn label_counts(labels: &BTreeMap<usize, Vec<Label>>) -> BTreeMap<(&str, &str), usize> {
    let mut counts: BTreeMap<(&str, &str), usize> = BTreeMap::new();
    for label in labels.values().flatten() {
        *counts.entry((label.style, &label.content)).or_default() += 1;
    }
    counts
}

/// The table of labels for people.
fn text(
    args: &Args,
    labels: &BTreeMap<usize, Vec<Label>>,
    counts: &BTreeMap<(&str, &str), usize>,
    episodes: usize,
) -> String {
    let mut text = format!(
        "{}: {} of {episodes} episodes with labels, {} labels\n",
        args.out.display(),
        labels.values().filter(|labels| !labels.is_empty()).count(),
        counts.values().sum::<usize>()
    );
    for ((style, content), count) in counts.iter().take(LISTED) {
        let _ = writeln!(text, "  {style:<8} {count:>5}  {content}");
    }
    if counts.len() > LISTED {
        let _ = writeln!(text, "  … {} more", counts.len() - LISTED);
    }
    text
}
