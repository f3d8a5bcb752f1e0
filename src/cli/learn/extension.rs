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
use teachtree_analysis::TrackId;
use teachtree_analysis::json::printed;
use teachtree_analysis::score::{NameMap, Truth};
use teachtree_learn::Declaration;
use teachtree_new_primitive::{BaseRules, MarkedRecording, NewPrimitive, learn_primitive, marks};
use teachtree_session::{LabelsInternals, LogInternals};

/// Intervals that are listed, at most.
const LISTED: usize = 12;

/// Runs `learn --new`.
pub fn run(args: &Args, new: &Declaration) -> Result<(), Failure> {
    let logs = args.analysis.logs(&args.logs)?;
    args.truth.check(&logs)?;
    let places: Vec<&Path> = args.out.iter().map(PathBuf::as_path).collect();
    args.analysis.checked_inputs(&logs, &places)?;
    let map = args.truth.names()?;
    args.analysis.source.check(logs.len())?;
    let LogResults { done, failed } = args.many.each_log("reading", &logs, |log| read(args, log, new, &map))?;
    Failure::all(distinct_failures(failed))?;
    let (recordings, warnings): (Vec<MarkedRecording>, Vec<Vec<String>>) = done.into_iter().map(|(_, it)| it).unzip();
    warnings.iter().flatten().for_each(|warning| output::warn(warning));
    let rules =
        BaseRules::new(&args.analysis.rules.options(), recordings.iter().map(|one| &one.log), args.out.as_deref())?;
    let progress = (!is_quiet()).then(|| Progress::new("learning"));
    let advance = |part: f64| progress.iter().for_each(|bar| bar.set(part));
    let learned = args.many.each("learning", &[()], |_| learn_primitive(new, &recordings, &rules, &advance))?.pop();
    drop(progress);
    let learned = learned.ok_or(Failure::Negative)??;
    let text = &learned.text;
    let is_proved = learned.extension.proof.is_proved();
    let is_written = is_proved || args.anyway;
    if let (Some(path), true) = (&args.out, is_written) {
        let mut inputs = args.analysis.inputs(&logs);
        inputs.extend(args.truth.labels.iter().cloned());
        output::write(path, text, &inputs)?;
    }
    if args.form.format == Format::Json {
        let written =
            RuleOutput { rules: text, is_better: is_proved, file: args.out.as_deref().filter(|_| is_written) };
        args.form.print(&printed(&json::of_primitive(&written, &learned)))?;
        return if is_proved { Ok(()) } else { Err(Failure::Negative) };
    }
    output::print(&table(args, &learned)?)?;
    if args.out.is_none() && is_written {
        output::print_data(&format!("\n{text}"))?;
    }
    if is_proved { Ok(()) } else { Err(Failure::Negative) }
}

fn read(args: &Args, log: &Path, new: &Declaration, map: &NameMap) -> Result<(MarkedRecording, Vec<String>), Failure> {
    let labels = args.truth.labels_of(log)?;
    let log = args.analysis.read(log)?;
    let opened = log.opened()?;
    let is_unlabeled = match &labels {
        Some(labels) => lacks_labels(labels, log.path()),
        None => Truth::of_recording(&opened.recording, map).is_none(),
    };
    if is_unlabeled {
        return Ok((MarkedRecording { log, tracks: Vec::new() }, Vec::new()));
    }
    let only = match log.hands().as_slice() {
        [hand] => Some(TrackId::Hand(*hand)),
        _ => None,
    };
    let (truth, warnings) = args.truth.of_log(log.path())?.of_any_names(opened, only, map)?;
    let tracks = marks(&truth, new);
    Ok((MarkedRecording { log, tracks }, warnings))
}

fn table(args: &Args, learned: &NewPrimitive) -> Result<String, Failure> {
    let mut text = learned.summary()?;
    let listed = learned.questions();
    if !listed.is_empty() {
        let _ = writeln!(text, "\nleast certain first; label these to learn more:");
        for it in listed.iter().take(LISTED) {
            let ([start_s, end_s], name) = (it.time_s, learned.log(it.recording).name());
            let _ = writeln!(
                text,
                "  {name}  {}  {start_s:.3} – {end_s:.3} s  {}, {:.0} % of other guards agree",
                it.who,
                it.state(),
                it.agreement * 100.0
            );
        }
        if listed.len() > LISTED {
            let _ = writeln!(text, "  … and {} more", listed.len() - LISTED);
        }
    }
    let place = args.out.as_ref().map_or("standard output".into(), |path| path.display().to_string());
    let _ = if learned.extension.proof.is_proved() || args.anyway {
        writeln!(text, "\nwritten to {place}")
    } else {
        writeln!(text, "\nnothing is written; --anyway writes it")
    };
    Ok(text)
}
