//! `teachtree teach`: an operator script in a scene, recorded; one simulated operator, or many in parallel.

mod live;
mod remote_options;

use super::progress::Progress;
use super::retarget::{open_robot, open_scene};
use super::source::{in_operator, in_scene, is_yaml};
use super::{Failure, output};
use rayon::iter::{IntoParallelRefIterator, ParallelIterator};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use teachtree_base::error::InputError;
use teachtree_base::recording::{Event, Recording};
use teachtree_base::scene::Scene;
use teachtree_base::yaml;
use teachtree_logs::read::formats;
use teachtree_logs::read::text;
use teachtree_world::{self as world, Operator};

/// No batch has more recordings.
const MOST: u64 = 100_000;

#[derive(clap::Args)]
#[command(after_help = "Examples:
  teachtree teach paper_box paper_box -o demonstration.csv --seed 7
  teachtree teach peg_in_hole peg_in_hole --seeds 1..200 -o recordings
  teachtree teach pick_and_place --live")]
pub struct Args {
    /// A shipped scene by name, or a scene file
    scene: String,
    /// A shipped operator by name, or an operator file; required without `--live`
    #[arg(required_unless_present = "live")]
    operator: Option<String>,
    /// Output file of the recording, or folder with `--seeds`; its scene is written beside it. `--live` never replaces a file
    #[arg(long, short, value_name = "LOG")]
    #[arg(required_unless_present = "live")]
    out: Option<PathBuf>,
    /// Random seed; equal seeds give identical recordings
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// The first and the last seed of several simulated operators, such as `1..200`; files are named after the operator and the seed
    #[arg(long, value_name = "FIRST..LAST", value_parser = seeds, conflicts_with = "seed")]
    seeds: Option<(u64, u64)>,
    /// Factor of the simulated operator's variation: 0 for none, 1 as in the operator file
    #[arg(long, alias = "noise", value_name = "FACTOR", value_parser = factor, default_value_t = 1.0)]
    variation: f64,
    /// The robot that will perform the task, by name or a robot file; the operator gets virtual hands of its size
    #[arg(long, value_name = "ROBOT")]
    robot: Option<String>,
    #[command(flatten)]
    live: live::LiveArgs,
}

pub fn run(args: &Args) -> Result<(), Failure> {
    {
        args.live.check()?;
        if args.live.live {
            return live::run(args);
        }
    }
    // The command line has both.
    let (operator_name, out) = (args.operator.as_deref().unwrap_or_default(), args.out.clone().unwrap_or_default());
    let (scene, mut operator) = open(&args.scene, operator_name)?;
    if args.variation != 1.0 {
        operator.variation = operator.variation.scaled(args.variation);
    }
    let files = [args.scene.as_str(), operator_name].into_iter().filter(|name| is_yaml(name));
    let mut inputs: Vec<PathBuf> = files.map(PathBuf::from).collect();
    if let Some(robot) = &args.robot {
        let (robot, parts) = open_robot(robot)?;
        inputs.extend(parts);
        operator = operator.with_hands(robot.hands_scale());
    }
    let in_its_file = |failure: Failure| match failure {
        Failure::Input(error) => in_operator(operator_name, in_scene(&args.scene, error)).into(),
        other => other,
    };
    if let Some((first, last)) = args.seeds {
        let name = stem(operator_name);
        let places: Vec<(u64, PathBuf)> =
            (first..=last).map(|seed| (seed, out.join(format!("{name}_{seed:04}.csv")))).collect();
        places.iter().try_for_each(|(_, place)| output::may_record(place, &inputs))?;
        return many(&scene, &operator, &places, &out).map_err(in_its_file);
    }
    output::may_record(&out, &inputs)?;
    let recording = teach(&scene, &operator, args.seed).map_err(in_its_file)?;
    formats::write(&recording, &out)?;
    let duration = recording.time.last().copied().unwrap_or_default();
    let mut printed = format!("{}: {} frames, {duration:.1} s\n", out.display(), recording.time.len());
    for (hand, tasks, begun) in hand_tasks(&recording) {
        let tasks = if tasks.is_empty() { "no task".into() } else { tasks.join(", ") };
        let begun = begun.map_or(String::new(), |task| format!(", and was doing {task} when the recording ended"));
        printed += &format!("the {hand} hand completed {tasks}{begun}\n");
    }
    for event in losses(&recording) {
        let hand = event.subjects.first().map_or("a", String::as_str);
        printed += &format!("the {hand} hand lost its object at {:.1} s\n", event.time_s);
    }
    for event in events(&recording, "step_left_undone") {
        if let [hand, step] = event.subjects.as_slice() {
            let (time_s, step) = (event.time_s, step_of(operator_name, hand, step));
            printed += &format!("the {hand} hand gave up {step} at {time_s:.1} s: the step took too long\n");
        }
    }
    for event in events(&recording, "contact_not_met") {
        if let [hand, step, body] = event.subjects.as_slice() {
            let (time_s, step) = (event.time_s, step_of(operator_name, hand, step));
            printed += &format!(
                "the {hand} hand did not meet `{body}` in {step}: it reached the end of its path at {time_s:.1} s\n"
            );
        }
    }
    output::print(&printed)?;
    Ok(())
}

/// Records an operator in a scene, with a progress bar.
pub fn record(scene: &str, operator: &str, seed: u64) -> Result<Recording, Failure> {
    let (scene, operator) = open(scene, operator)?;
    teach(&scene, &operator, seed)
}

fn teach(scene: &Scene, operator: &Operator, seed: u64) -> Result<Recording, Failure> {
    let progress = Progress::new("teaching");
    Ok(world::teach_with_progress(scene, operator, seed, &mut |part| progress.set(part))?)
}

/// Kinds of events that are counted over many recordings, and what a hand did in each.
const NOTED: [(&str, &str); 3] = [
    ("object_lost", "lost its object"),
    ("step_left_undone", "gave up a step of its script that took too long"),
    ("contact_not_met", "did not meet the body that ends a step of its script"),
];

/// Records many simulated operators, as many at a time as there are processors. What a seed gives does not depend on the others.
fn many(scene: &Scene, operator: &Operator, places: &[(u64, PathBuf)], folder: &Path) -> Result<(), Failure> {
    let cannot =
        |error: std::io::Error| InputError::new(folder.display().to_string(), format!("cannot be made: {error}"));
    std::fs::create_dir_all(folder).map_err(cannot)?;
    let count = places.len();
    let progress = Progress::new("teaching");
    let done = AtomicU64::new(0);
    let frames = places.par_iter().map(|(seed, place)| {
        let recording = world::teach(scene, operator, *seed)?;
        formats::write(&recording, place)?;
        progress.set((done.fetch_add(1, Ordering::Relaxed) + 1) as f64 / count as f64);
        let idle = hand_tasks(&recording).all(|(_, tasks, _)| tasks.is_empty());
        let happened = NOTED.map(|(kind, _)| events(&recording, kind).next().is_some());
        Ok::<_, InputError>((recording.time.len(), happened, idle))
    });
    let recorded = frames.collect::<Result<Vec<_>, _>>()?;
    drop(progress);
    let frames: usize = recorded.iter().map(|(frames, ..)| frames).sum();
    let mut printed = format!("{}: {count} recordings, {frames} frames\n", folder.display());
    for (at, (_, what)) in NOTED.iter().enumerate() {
        let of_them = recorded.iter().filter(|(_, happened, _)| happened[at]).count();
        if of_them > 0 {
            printed += &format!("in {of_them} of them a hand {what}\n");
        }
    }
    let idle = recorded.iter().filter(|(.., idle)| *idle).count();
    if idle > 0 {
        printed += &format!("in {idle} of them no hand completed a task\n");
    }
    output::print(&printed)?;
    Ok(())
}

/// A step of the script of a hand, with its place where the operator is a file.
fn step_of(operator: &str, hand: &str, step: &str) -> String {
    let error = InputError::new(format!("operator `{operator}`, hands.{hand}.{step}"), "");
    let place = if is_yaml(operator) { format!(" ({})", in_operator(operator, error).place) } else { String::new() };
    format!("`{step}` of its script{place}")
}

/// Of each hand the tasks that it did, in order of time, and then that which it had begun and not let go of: as the truth has them.
fn hand_tasks(recording: &Recording) -> impl Iterator<Item = (&str, Vec<&str>, Option<&str>)> {
    recording.labels.iter().filter_map(|(name, tasks)| {
        let hand = name.strip_suffix(".task")?;
        let labels = recording.labels.get(&format!("{hand}.label"))?;
        let rows: Vec<(&str, &str)> = tasks.iter().map(String::as_str).zip(labels.iter().map(String::as_str)).collect();
        // The same task once more begins with a way to the object.
        let goes_on = |one: &(&str, &str), next: &(&str, &str)| one.0 == next.0 && !world::sets_out(one.1, next.1);
        let runs: Vec<(&str, &str)> = rows.chunk_by(goes_on).filter_map(|run| run.last().copied()).collect();
        let (last, at_work) = runs.last().map(|(task, label)| (*task, !world::ends_task(label)))?;
        let begun = Some(last).filter(|task| at_work && !task.is_empty());
        let ended = &runs[..runs.len() - usize::from(begun.is_some())];
        Some((hand, ended.iter().map(|(task, _)| *task).filter(|task| !task.is_empty()).collect(), begun))
    })
}

/// When a hand lost what it held: it goes back for it, but not for ever.
fn losses(recording: &Recording) -> impl Iterator<Item = &Event> {
    events(recording, "object_lost")
}

fn events<'a>(recording: &'a Recording, kind: &'a str) -> impl Iterator<Item = &'a Event> {
    recording.events.iter().filter(move |event| event.kind == kind)
}

/// The scene and the operator of these names, or in these files.
fn open(scene: &str, operator: &str) -> Result<(Scene, Operator), InputError> {
    let swapped = |error: InputError| match read(scene) {
        Ok(Some(text)) if Operator::read(&text, scene).is_ok() => {
            error.help("this is an operator file; the scene comes first: `teachtree teach SCENE OPERATOR`")
        }
        _ => error,
    };
    let scene = open_scene(scene).map_err(swapped)?;
    let operator = match read(operator)? {
        Some(text) => Operator::read(&text, operator)?,
        None => world::operator(operator)?,
    };
    Ok((scene, operator))
}

/// The text of a file; `None` for what is not a path but the name of something shipped.
fn read(name: &str) -> Result<Option<String>, InputError> {
    if !is_yaml(name) {
        return Ok(None);
    }
    text::read(Path::new(name), yaml::MAX_BYTES as u64).map(Some)
}

/// What recordings of an operator are called: `scenes/push.operator.yaml` is `push`.
fn stem(operator: &str) -> &str {
    let name = Path::new(operator).file_name().and_then(|name| name.to_str()).unwrap_or(operator);
    name.split('.').next().unwrap_or(name)
}

/// `1..200`.
fn seeds(text: &str) -> Result<(u64, u64), String> {
    let wanted = || format!("expected seeds such as 1..200, at most {MOST} of them");
    let (first, last) = text.split_once("..").ok_or_else(wanted)?;
    let (first, last) = (first.parse::<u64>(), last.parse::<u64>());
    let (Ok(first), Ok(last)) = (first, last) else { return Err(wanted()) };
    if first > last {
        return Err(format!("the first seed, {first}, is after the last one, {last}; expected {last}..{first}"));
    }
    if last - first < MOST { Ok((first, last)) } else { Err(wanted()) }
}

fn factor(text: &str) -> Result<f64, String> {
    let number = text.parse::<f64>().ok().filter(|number| (0.0..=10.0).contains(number));
    number.ok_or_else(|| "expected a number from 0 to 10".to_string())
}
