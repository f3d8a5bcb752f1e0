//! `export lerobot`: bags as a LeRobot set, at one rate.

use super::super::annotate::{phrasing, provenance};
use super::super::parallel::named_failures;
use super::super::print_args::is_quiet;
use super::super::progress::Progress;
use super::super::{Failure, output};
use super::bag::{Choice, OpenBag};
use super::cut::{Cut, CutArgs, Episodes};
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use teachtree_analysis::episodes::EpisodeSpan;
use teachtree_base::error::InputError;
use teachtree_logs::read::formats::lerobot::new_set::{Episode, Features, NewSet};
use teachtree_session::Analysis;

/// Options of `export lerobot`.
#[derive(clap::Args, Clone)]
#[command(
    after_help = "Examples:\n  teachtree export lerobot bags/*.mcap -o my_set --task 'put the cube in the box'\n  teachtree export lerobot session_1 session_2 -o my_set --binding arm.binding.yaml --fps 20\n  teachtree export lerobot bag.mcap -o my_set --state /joint_states.position --action /commands --camera /wrist/compressed --task wipe\nA bag is an MCAP file, a bag of ROS 1, or a folder or `.db3` file of ROS 2; another folder stands for the bags in it. With a binding, each recognized task is an episode, with labels in words and `next.success`; without one, each motion between rests is an episode.\nExit status: 0 fine, 2 bad usage or input, 3 some bags failed and the others are in the set."
)]
pub struct Args {
    /// Bags or folders of them, in the order of the episodes
    #[arg(required = true, value_name = "BAG")]
    bags: Vec<PathBuf>,
    /// Path of the set, which must not exist
    #[arg(long, short, value_name = "SET")]
    out: PathBuf,
    #[command(flatten)]
    how: CutArgs,
    /// Frames per second
    #[arg(long, value_name = "HZ", default_value = "30", value_parser = clap::value_parser!(u32).range(1..=1000))]
    fps: u32,
    /// Description of the task of all episodes, instead of the words of the recognized tasks
    #[arg(long, value_name = "TEXT")]
    task: Option<String>,
    #[command(flatten)]
    choice: Choice,
    /// Name of the robot in the set
    #[arg(long, value_name = "NAME")]
    robot: Option<String>,
}

impl Args {
    /// Refuses options that do not fit together, before a bag is read.
    fn check(&self) -> Result<(), InputError> {
        let (has_rules, cut) = (self.how.has_rules(&self.bags)?, self.how.cut(&self.bags)?);
        if cut == Cut::Tasks && !has_rules {
            let error = InputError::new("--cut", "tasks are found by rules, found no binding");
            return Err(error.help("give one with --binding, or `--cut rests`"));
        }
        if cut != Cut::Tasks && self.task.is_none() && !has_rules {
            let error =
                InputError::new("--task", "expected the task of the episodes, which an export without a binding needs");
            return Err(error.help("such as `--task 'put the cube in the box'`"));
        }
        output::refuse_existing(&self.out)?;
        output::refuse_inputs(&self.out, &self.how.analysis.files(&self.bags))
    }
}

/// What happened so far.
#[derive(Default)]
struct Report {
    bags: usize,
    /// Episodes that are left out, with the reasons.
    left_out: Vec<String>,
    successes: usize,
    /// What the labels were made by.
    provenance: Option<Value>,
}

impl Report {
    /// Adds the rules of the labels of a bag, those of all bags once.
    fn add_provenance(&mut self, binding: Option<&Path>, analysis: &Analysis) {
        let mut made = provenance(binding, [analysis]);
        let Some(known) = &mut self.provenance else {
            self.provenance = Some(made);
            return;
        };
        let rules = made.get_mut("rules").and_then(Value::as_array_mut).map(std::mem::take).unwrap_or_default();
        if let Some(all) = known.get_mut("rules").and_then(Value::as_array_mut) {
            rules.into_iter().for_each(|of| {
                if !all.contains(&of) {
                    all.push(of);
                }
            });
        }
    }
}

/// Runs `export lerobot`.
pub fn run(args: &Args) -> Result<(), Failure> {
    let bags = args.how.analysis.logs(&args.bags)?;
    let args = &Args { bags, ..args.clone() };
    args.check()?;
    let words = phrasing(&args.how.words)?.texts();
    args.how.analysis.source.check(args.bags.len())?;
    let progress = (!is_quiet() && args.bags.len() > 1).then(|| Progress::new("exporting"));
    let (mut set, mut report, mut failed) = (None, Report::default(), Vec::new());
    for (at, path) in args.bags.iter().enumerate() {
        match export(args, path, &mut set, &mut report) {
            Ok(()) => report.bags += 1,
            Err(failure) => failed.push((path, failure)),
        }
        progress.iter().for_each(|bar| bar.set((at + 1) as f64 / args.bags.len() as f64));
    }
    drop(progress);
    let failures = named_failures(failed);
    let Some((set, features)) = set.filter(|(set, _): &(NewSet, Features)| set.episodes() > 0) else {
        if failures.is_empty() {
            return Err(no_episode(args, &report, args.how.cut(&args.bags)?).into());
        }
        return Failure::some(failures, 0);
    };
    let text = summary(args, &set, &features, &report);
    set.finish(&made_of(args, &report, &words))?;
    if !is_quiet() {
        output::print(&text)?;
    }
    Failure::some(failures, report.bags)
}

/// Writes the episodes of a bag.
fn export(args: &Args, path: &Path, set: &mut Option<(NewSet, Features)>, report: &mut Report) -> Result<(), Failure> {
    let mut bag = args.choice.open(path)?;
    let episodes = Episodes::of(&args.how, path, &bag)?;
    let features = features(args, &bag, &episodes);
    if let Some((_, known)) = set {
        same(path, known, &features)?;
    }
    for span in &episodes.spans {
        let made = episode(args, &mut bag, &episodes, span)?;
        match made {
            Ok(episode) => {
                report.successes += usize::from(episode.success.contains(&true));
                if set.is_none() {
                    *set = Some((NewSet::new(&args.out, features.clone())?, features.clone()));
                }
                if let Some((set, _)) = set {
                    set.add(episode)?;
                }
            }
            Err(why) => {
                report.left_out.push(format!("{} {:.2}–{:.2} s: {why}", path.display(), span.start_s, span.end_s))
            }
        }
    }
    if let Some(analysis) = &episodes.analysis {
        report.add_provenance(args.how.analysis.source.binding_of(path)?.as_deref(), analysis);
    }
    Ok(())
}

/// What the frames of a bag have.
fn features(args: &Args, bag: &OpenBag, episodes: &Episodes) -> Features {
    let state = bag.state.names();
    let action = if args.choice.is_next_state() { state.clone() } else { bag.action.names() };
    Features {
        fps: args.fps,
        robot: args.robot.clone(),
        state,
        action,
        cameras: bag.cameras.iter().map(|camera| (camera.name.clone(), camera.size)).collect(),
        has_labels: episodes.analysis.is_some(),
        has_success: episodes.cut == Cut::Tasks,
    }
}

/// Refuses a bag with other columns or cameras than the first one.
fn same(path: &Path, known: &Features, found: &Features) -> Result<(), InputError> {
    let wrong = |message: String| {
        let error = InputError::new(path.display().to_string(), message);
        Err(error
            .help("`--state`, `--action` and `--camera` select columns that all bags have; or export this bag alone"))
    };
    let lists = [("observation.state", &known.state, &found.state), ("action", &known.action, &found.action)];
    for (feature, expected, found) in lists {
        let mut differing = found.iter().filter(|name| !expected.contains(name));
        let mut lacking = expected.iter().filter(|name| !found.contains(name));
        if let Some(name) = lacking.next() {
            return wrong(format!("lacks `{name}` of `{feature}`, which the bags before have"));
        }
        if let Some(name) = differing.next() {
            return wrong(format!("has `{name}` for `{feature}`, which the bags before lack"));
        }
        if expected != found {
            return wrong(format!("has the columns of `{feature}` in another order than the bags before"));
        }
    }
    if known.cameras != found.cameras {
        let names = |of: &Features| -> String {
            let of_each = |(name, [height, width, _]): &(String, [usize; 3])| format!("{name} {width} x {height}");
            of.cameras.iter().map(of_each).collect::<Vec<_>>().join(", ")
        };
        return wrong(format!("has the cameras `{}`, expected `{}`", names(found), names(known)));
    }
    Ok(())
}

/// An episode with more frames is left out.
const MOST_FRAMES: usize = 10_000_000;

/// The frames of an episode, or why it is left out.
fn episode(
    args: &Args,
    bag: &mut OpenBag,
    episodes: &Episodes,
    span: &EpisodeSpan,
) -> Result<Result<Episode, String>, InputError> {
    let ([from, to], fps) = (bag.span(), f64::from(args.fps));
    let (start_s, end_s) = (span.start_s.max(from), span.end_s.min(to));
    let frames = if end_s > start_s { (((end_s - start_s) * fps + 1e-6) as usize).saturating_add(1) } else { 0 };
    if frames > MOST_FRAMES {
        return Ok(Err(format!("it would have {frames} frames, expected at most {MOST_FRAMES}: is a stamp wrong?")));
    }
    if frames < 2 {
        return Ok(Err(format!("not all topics have messages then, they do from {from:.2} to {to:.2} s")));
    }
    let Some(task) = args.task.clone().or_else(|| episodes.task(span)) else {
        return Ok(Err("no task is found in it, and `--task` names none".into()));
    };
    let times: Vec<f64> = (0..frames).map(|frame| (start_s + frame as f64 / fps).min(end_s)).collect();
    let mut made = Episode { task, ..Episode::default() };
    let mut states = Vec::with_capacity(frames);
    for time in &times {
        let number = |row: Vec<f64>| row.into_iter().map(|value| value as f32).collect::<Vec<f32>>();
        let missing = |name: &str| format!("{name} has no message near {time:.2} s");
        match (bag.state.at(*time), bag.action.at(*time)) {
            (Ok(state), Ok(action)) => {
                states.push(number(state));
                made.action.extend(number(action));
            }
            (Err(name), _) | (_, Err(name)) => return Ok(Err(missing(name))),
        }
    }
    if args.choice.is_next_state() {
        made.action = states.iter().skip(1).chain(states.last()).flatten().copied().collect();
    }
    made.state = states.concat();
    for at in 0..bag.cameras.len() {
        let mut pictures = Vec::with_capacity(frames);
        for time in &times {
            let Some(camera) = bag.cameras.get(at) else { continue };
            let Some(place) = camera.at(*time) else {
                return Ok(Err(format!("{} has no picture near {time:.2} s", camera.name)));
            };
            pictures.push(bag.spool.read(place)?);
        }
        made.pictures.push(pictures);
    }
    made.labels = episodes.labels(start_s, frames, fps);
    if episodes.cut == Cut::Tasks {
        let is_success = span.is_success == Some(true);
        // The action of a frame leads to the state of the next one.
        let done =
            |frame: usize| is_success && (frame + 1 == frames || times.get(frame + 1) >= Some(&span.succeeded_s));
        made.success = (0..frames).map(done).collect();
    }
    Ok(Ok(made))
}

/// What the set was made of.
fn made_of(args: &Args, report: &Report, words: &[String]) -> Value {
    let none = || provenance(None, []);
    let mut made = report.provenance.clone().unwrap_or_else(none);
    if let Some(made) = made.as_object_mut() {
        let bags: Vec<String> = args.bags.iter().map(|bag| bag.display().to_string()).collect();
        made.insert("bags".into(), json!(bags));
        made.insert("words".into(), json!(words));
    }
    made
}

fn no_episode(args: &Args, report: &Report, cut: Cut) -> InputError {
    let place = args.out.display().to_string();
    let error = InputError::new(place, "no episode is found, expected one or more");
    match (report.left_out.first(), cut) {
        (Some(first), _) => error.help(format!("the first one is left out: {first}")),
        (None, Cut::Tasks) => {
            error.help("`teachtree analyze BAG --binding …` shows what the rules find; `--cut rests`")
        }
        (None, _) => error.help("`--cut whole` makes one episode of each bag"),
    }
}

/// What was written.
fn summary(args: &Args, set: &NewSet, features: &Features, report: &Report) -> String {
    let mut text = format!(
        "{}: {}, {} frames at {} Hz, from {}\n",
        args.out.display(),
        counted(set.episodes(), "episode"),
        set.frames(),
        args.fps,
        counted(report.bags, "bag")
    );
    let mut line = |name: &str, names: &[String]| {
        let _ = match names {
            [] => writeln!(text, "  {name}: none"),
            names => writeln!(text, "  {name}: {} numbers, {}", names.len(), shortened(names)),
        };
    };
    line("observation.state", &features.state);
    line("action", &features.action);
    for (name, [height, width, _]) in &features.cameras {
        let _ = writeln!(text, "  {name}: {width} x {height}");
    }
    if features.has_success {
        let _ = writeln!(text, "  next.success: {} of {} episodes", report.successes, set.episodes());
    }
    for why in &report.left_out {
        let _ = writeln!(text, "left out: {why}");
    }
    text
}

/// `1 bag`, `3 bags`.
fn counted(count: usize, what: &str) -> String {
    if count == 1 { format!("1 {what}") } else { format!("{count} {what}s") }
}

/// The first and the last of many names.
fn shortened(names: &[String]) -> String {
    match names {
        [first, _, _, .., last] => format!("{first} … {last}"),
        names => names.join(", "),
    }
}
