//! `learn --new`: one new primitive learned from labels, as a rule file that extends the present rules.

use super::super::parallel::{LogResults, distinct_failures};
use super::super::print_args::is_quiet;
use super::super::progress::Progress;
use super::super::truth::lacks_labels;
use super::super::{Failure, output};
use super::json::{self, RuleOutput};
use super::{Args, Format};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use teachtree_analysis::json::printed;
use teachtree_analysis::score::{NameMap, Truth};
use teachtree_analysis::{TrackId, score};
use teachtree_base::error::InputError;
use teachtree_base::hands::Side;
use teachtree_language::graph::compare::ExtensionProof;
use teachtree_language::{Rules, is_primitive, shipped};
use teachtree_learn::{Declaration, Extension, FoundInterval, MarkedTrack, Recognition, ShownRecording, extend};
use teachtree_session::files::all_logs;
use teachtree_session::{ErrorInternals, LabelsInternals, Log, LogInternals, RulesInternals, RulesOptions};

/// The rules that are extended where none are named: of one hand, of two.
const DEFAULT_RULES: [&str; 2] = ["contact.rules", "bimanual.rules"];
/// The agreement of guards from which on an interval with a label is not listed.
const CERTAIN: f64 = 0.9;
/// Intervals that are listed, at most.
const LISTED: usize = 12;

/// Reads a declaration: `Shake`, `Shake is Translate`, `Join(side) does insert while other does hold`.
pub fn declaration(text: &str) -> Result<Declaration, String> {
    let (name, meaning) = text.trim().split_once(char::is_whitespace).unwrap_or((text.trim(), ""));
    let (name, sided) = name.strip_suffix("(side)").map_or((name, false), |name| (name, true));
    if !is_primitive(name) {
        return Err(
            "expected the name of a primitive, such as `Shake`, or its declaration: `Shake is Translate`".into()
        );
    }
    let meaning = Some(meaning.trim().to_string()).filter(|meaning| !meaning.is_empty());
    Ok(Declaration { name: name.into(), sided, meaning })
}

/// A recording with what its labels say about the primitive.
struct LabeledLog {
    log: Log,
    tracks: Vec<MarkedTrack>,
    warnings: Vec<String>,
}

/// Runs `learn --new`.
pub fn run(args: &Args, new: &Declaration) -> Result<(), Failure> {
    let logs = all_logs(&args.logs)?;
    args.truth.check(&logs)?;
    let places: Vec<&Path> = args.out.iter().map(PathBuf::as_path).collect();
    args.analysis.checked_inputs(&logs, &places)?;
    let map = args.truth.names()?;
    args.analysis.source.check(logs.len())?;
    let LogResults { done, failed } = args.many.each_log("reading", &logs, |log| read(args, log, new, &map))?;
    Failure::all(distinct_failures(failed))?;
    let mut recordings: Vec<LabeledLog> = done.into_iter().map(|(_, recording)| recording).collect();
    recordings.iter().flat_map(|recording| &recording.warnings).for_each(|warning| output::warn(warning));
    let of_both = |track: &MarkedTrack| track.who == TrackId::Both && !track.marked.is_empty();
    let is_of_both = recordings.iter().flat_map(|one| &one.tracks).any(of_both);
    recordings.iter_mut().for_each(|one| one.tracks.retain(|track| (track.who == TrackId::Both) == is_of_both));
    let files = files(args, &logs, &recordings)?;
    let uses = uses(&files, args.out.as_deref())?;
    check_rules(args, &files, &recordings)?;
    let first = recordings.first().map(|one| one.log.clone());
    let load = |text: &str| -> Result<Rules, InputError> {
        let options = options(args, &files);
        let options = if text.is_empty() { options } else { options.text("the extension", text) };
        let log = first.as_ref().ok_or_else(|| InputError::new("the command line", "there are no recordings"))?;
        Ok(options.for_log(log).map_err(ErrorInternals::into_input)?.set().clone())
    };
    let shown: Vec<ShownRecording> = recordings.iter().map(LabeledLog::recording).collect::<Result<_, _>>()?;
    let progress = (!is_quiet()).then(|| Progress::new("learning"));
    let advance = |part: f64| progress.iter().for_each(|bar| bar.set(part));
    let learned = args.many.each("learning", &[()], |_| extend(new, &shown, &load, &advance))?.pop();
    drop(progress);
    let learned = learned.unwrap_or_else(|| Err(InputError::new("the command line", "there are no recordings")))?;
    let marked = recordings.iter().filter(|one| one.tracks.iter().any(|track| !track.marked.is_empty())).count();
    let text = format!(
        "/// *{}*, learned from {} labeled intervals in {marked} recordings.\n{uses}\n{}",
        new.name, learned.learned.marked, learned.text
    );
    let is_proved = learned.proof.is_proved();
    let is_written = is_proved || args.anyway;
    if let (Some(path), true) = (&args.out, is_written) {
        let mut inputs = args.analysis.inputs(&logs);
        inputs.extend(args.truth.labels.iter().cloned());
        output::write(path, &text, &inputs)?;
    }
    if args.form.format == Format::Json {
        let written =
            RuleOutput { rules: &text, is_better: is_proved, file: args.out.as_deref().filter(|_| is_written) };
        let names: Vec<String> = recordings.iter().map(|one| one.log.name()).collect();
        args.form.print(&printed(&json::of_primitive(&written, &new.name, &learned, &names)))?;
        return if is_proved { Ok(()) } else { Err(Failure::Negative) };
    }
    output::print(&table(args, new, &recordings, &learned, marked))?;
    if args.out.is_none() && is_written {
        output::print_data(&format!("\n{text}"))?;
    }
    if is_proved { Ok(()) } else { Err(Failure::Negative) }
}

/// The rules that are extended.
fn files(args: &Args, logs: &[PathBuf], recordings: &[LabeledLog]) -> Result<Vec<PathBuf>, InputError> {
    if !args.analysis.rules.rules.is_empty() {
        return Ok(args.analysis.rules.rules.clone());
    }
    if let Some(log) = logs.first()
        && let Some(rules) = args.analysis.source.settings(log)?.rules
    {
        return Ok(rules.value);
    }
    let two_hands = recordings.iter().all(|one| one.log.hands().len() > 1);
    Ok(vec![DEFAULT_RULES[usize::from(two_hands)].into()])
}

/// Refuses rules with errors, and recordings that need different hand models.
fn check_rules(args: &Args, files: &[PathBuf], recordings: &[LabeledLog]) -> Result<(), Failure> {
    let mut first: Option<Vec<String>> = None;
    for LabeledLog { log, .. } in recordings {
        let rules = options(args, files).for_log(log)?;
        let own: Vec<String> = rules.files().map(String::from).collect();
        let known = first.get_or_insert_with(|| own.clone());
        if *known != own {
            let hand_file = own.iter().find(|file| !known.contains(file)).cloned().unwrap_or_default();
            let message =
                format!("needs {hand_file}, expected the hand model of the other recordings; --hand names one for all");
            return Err(InputError::new(log.name(), message).into());
        }
    }
    Ok(())
}

fn options(args: &Args, files: &[PathBuf]) -> RulesOptions {
    let named = args.analysis.rules.options();
    if args.analysis.rules.rules.is_empty() {
        files.iter().fold(named, |options, file| options.file(file))
    } else {
        named
    }
}

/// The `use` lines of the extension.
///
/// # Errors
/// Rules that it could not use, as they are in another folder.
fn uses(files: &[PathBuf], out: Option<&Path>) -> Result<String, InputError> {
    let mut text = String::new();
    for file in files {
        let folder = |path: &Path| {
            path.parent().map(|folder| if folder.as_os_str().is_empty() { ".".into() } else { folder.to_path_buf() })
        };
        let is_shipped = shipped(&file.display().to_string()).is_some() && !file.exists();
        let beside = out.is_none_or(|out| {
            folder(out).and_then(|it| it.canonicalize().ok()) == folder(file).and_then(|it| it.canonicalize().ok())
        });
        if !is_shipped && !beside {
            let message = format!(
                "is not in the folder of {}, and a rule file uses only files beside it",
                out.map_or(String::new(), |out| out.display().to_string())
            );
            return Err(
                InputError::new(file.display().to_string(), message).help("write the extension beside the rules")
            );
        }
        let name = file.file_name().unwrap_or(file.as_os_str()).to_string_lossy();
        let _ = writeln!(text, "use \"{name}\"");
    }
    Ok(text)
}

fn read(args: &Args, log: &Path, new: &Declaration, map: &NameMap) -> Result<LabeledLog, Failure> {
    let labels = args.truth.labels_of(log)?;
    let log = args.analysis.read(log)?;
    let opened = log.opened()?;
    let is_unlabeled = match &labels {
        Some(labels) => lacks_labels(labels, log.path()),
        None => Truth::of_recording(&opened.recording, map).is_none(),
    };
    if is_unlabeled {
        return Ok(LabeledLog { log, tracks: Vec::new(), warnings: Vec::new() });
    }
    let only = match log.hands().as_slice() {
        [hand] => Some(TrackId::Hand(*hand)),
        _ => None,
    };
    let (truth, warnings) = args.truth.of_log(log.path())?.of_any_names(opened, only, map)?;
    let tracks = tracks(&truth, new);
    Ok(LabeledLog { log, tracks, warnings })
}

/// What labels say about a primitive. Where they name nothing else, it takes place at no other time; else nothing is known outside of them.
fn tracks(truth: &Truth, new: &Declaration) -> Vec<MarkedTrack> {
    let name = |side: Option<Side>| side.map_or(new.name.clone(), |side| format!("{}({side})", new.name));
    let sides: Vec<Option<Side>> = if new.sided { Side::BOTH.map(Some).to_vec() } else { vec![None] };
    let is_new = |span: &score::Span| sides.iter().any(|side| span.names.contains(&name(*side)));
    let is_alone = truth.tracks.iter().flat_map(|track| &track.primitives).all(is_new);
    let mut tracks = Vec::new();
    for track in truth.tracks.iter().filter(|track| !track.primitives.is_empty()) {
        for side in sides.iter().filter(|side| side.is_none() || track.who == TrackId::Both) {
            let times =
                |spans: &mut dyn Iterator<Item = &score::Span>| spans.map(|span| [span.start_s, span.end_s]).collect();
            let is_marked = |span: &&score::Span| span.names.contains(&name(*side));
            let known = (!is_alone).then(|| times(&mut track.primitives.iter()));
            let marked = times(&mut track.primitives.iter().filter(is_marked));
            tracks.push(MarkedTrack { who: track.who, side: *side, marked, known });
        }
    }
    tracks
}

impl LabeledLog {
    fn recording(&self) -> Result<ShownRecording<'_>, Failure> {
        let opened = self.log.opened()?;
        Ok(ShownRecording {
            name: self.log.name(),
            hands: self.log.hands(),
            duration_s: self.duration_s(),
            frames: Box::new(move |channels| opened.frames(channels)),
            tracks: self.tracks.clone(),
        })
    }

    fn duration_s(&self) -> f64 {
        let time = self.log.opened().map(|opened| opened.recording.time.clone()).unwrap_or_default();
        time.last().zip(time.first()).map_or(0.0, |(last, first)| last - first)
    }
}

fn table(args: &Args, new: &Declaration, recordings: &[LabeledLog], learned: &Extension, marked: usize) -> String {
    let [conditions, places] = learned.tried;
    let mut text = format!(
        "{} recordings, {marked} of them with {} labeled intervals of {}; {conditions} conditions at {places} places of the tree\n\n",
        recordings.len(),
        learned.learned.marked,
        new.name
    );
    for (name, it) in [("learned from", learned.learned), ("held out", learned.held_out)] {
        let Recognition { marked, found, matched, .. } = it;
        let (others, overlap) = (found.saturating_sub(matched), it.overlap() * 100.0);
        let _ =
            writeln!(text, "{name:<14}{matched} of {marked} intervals found, {others} others, overlap {overlap:.1} %");
    }
    let _ = writeln!(text, "{}", proof(&learned.proof));
    let elsewhere: Vec<usize> = (0..recordings.len()).filter(|at| recordings[*at].tracks.is_empty()).collect();
    if !elsewhere.is_empty() {
        let found = || learned.intervals.iter().filter(|it| it.is_found && elsewhere.contains(&it.recording));
        let found_s: f64 = found().map(|it| it.time_s[1] - it.time_s[0]).sum();
        let all_s: f64 = elsewhere.iter().map(|at| recordings[*at].duration_s()).sum();
        let _ = writeln!(
            text,
            "{} recordings without labels: found {} times, {found_s:.1} s of {all_s:.1} s ({:.1} %)",
            elsewhere.len(),
            found().count(),
            100.0 * found_s / all_s.max(f64::MIN_POSITIVE)
        );
    }
    let listed: Vec<&FoundInterval> =
        learned.intervals.iter().filter(|it| it.is_found != it.is_marked || it.agreement < CERTAIN).collect();
    if !listed.is_empty() {
        let _ = writeln!(text, "\nleast certain first; label these to learn more:");
        for it in listed.iter().take(LISTED) {
            let state = match (it.is_found, it.is_marked) {
                (true, true) => "found, labeled",
                (true, false) => "found",
                (false, true) => "missed",
                (false, false) => "not found",
            };
            let [start_s, end_s] = it.time_s;
            let name = recordings[it.recording].log.name();
            let _ = writeln!(
                text,
                "  {name}  {}  {start_s:.3} – {end_s:.3} s  {state}, {:.0} % of other guards agree",
                it.who,
                it.agreement * 100.0
            );
        }
        if listed.len() > LISTED {
            let _ = writeln!(text, "  … and {} more", listed.len() - LISTED);
        }
    }
    let place = args.out.as_ref().map_or("standard output".into(), |path| path.display().to_string());
    let _ = if learned.proof.is_proved() || args.anyway {
        writeln!(text, "\nwritten to {place}")
    } else {
        writeln!(text, "\nnothing is written; --anyway writes it")
    };
    text
}

fn proof(proof: &ExtensionProof) -> String {
    if proof.is_proved() {
        return "proved: it only adds to the rules".into();
    }
    let mut text = String::from("not proved that it only adds to the rules");
    proof.findings.iter().for_each(|finding| text.push_str(&format!("\n  {}   {}", finding.what, finding.place)));
    text
}
