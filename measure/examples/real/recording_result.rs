//! A recording in, what was found in it against what is true of it out.

use crate::gold::{self, PrimitiveStart, TimeSpan};
use crate::kind::{Kind, Set};
use crate::peer;
use crate::variants::Warp;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use std::path::{Path, PathBuf};
use teachtree_analysis::json::Meta;
use teachtree_analysis::score::{self, KnownNames, NameMap, Share, Span, Stage, Tally, TrackTruth, Truth};
use teachtree_analysis::{self as analysis, Analysis, Segment, Track, TrackId, UNKNOWN};
use teachtree_base::diagnostic::{Severity, render};
use teachtree_base::hands::Side;
use teachtree_base::units::Dimension;
use teachtree_engine::evaluator::evaluate;
use teachtree_frames as stream;
use teachtree_frames::OpenRequest;
use teachtree_frames::OpenedLog;
use teachtree_frames::frames::Frames;
use teachtree_language::graph::lower;
use teachtree_language::{self as language, Request, Rules};
use teachtree_logs::read::labels;
use teachtree_report as report;

/// A boundary that is farther off than this was not found, s.
const SAME_S: f64 = 1.0;
/// Boundaries of a hand-over and the ends of an Approach are right within these, s.
const PASS_S: f64 = 0.15;
const CONTACT_S: f64 = 0.1;

/// What a recording adds to the table. What does not apply is empty.
#[derive(Default)]
pub struct RecordingResult {
    /// Frames and segments against labels: of the rules, and of a simple peer.
    pub labels: Vec<(&'static str, Tally)>,
    pub peers: Vec<(&'static str, Tally)>,
    /// How far each boundary is off, s; `None` where it was not found.
    pub boundaries: Vec<(&'static str, f64, Option<f64>)>,
    /// Segments that no task explains, of all.
    pub unexplained: Share,
    /// Hand-overs that were found, of the true ones; and others.
    pub passes: Share,
    pub false_passes: usize,
    /// Shares of other kinds, by what they say.
    pub shares: Vec<(&'static str, Share)>,
    /// Time that is covered, of the time that should be, s.
    pub covered: Option<(&'static str, f64, f64)>,
    /// The tasks that were found, by hand.
    pub tasks: Vec<String>,
    /// The result as text, for `--each`.
    pub printed: String,
}

/// The names of DESK's surgemes, and with those taken together that differ only in which pole is near.
pub const SEVEN: &str = "S1=Approach,S2=Grasp,S3=Lift,S4=Transfer,S5=Exchange,S6=Bring,S7=Place";
const FIVE: &str = "S1=Approach,S2=Grasp,S3=Lift,S4=Lift,S5=Exchange,S6=Place,S7=Place";
const WIPING: &str = "1=Approach|Move|Release,2=Trace|Slide|Press,3=Approach|Move|Release";

/// Which rules: shipped ones, or those of a folder before them; with the shipped values, or with others.
#[derive(Clone, Copy, Default)]
pub struct RuleChoice<'a> {
    pub folder: Option<&'a Path>,
    /// The number of a draw of values, each between 0.7 and 1.3 times what it is.
    pub draw: Option<u64>,
}

/// Analyses a recording and holds it against what is true of it.
pub fn found(kind: Kind, path: &Path, root: &Path, rules: RuleChoice) -> Result<RecordingResult, String> {
    let original = opened(path, &root.join("demos").join(format!("{}.binding.yaml", kind.binding())))?;
    found_in(kind, &Original { path, opened: &original }, &original, Warp::NONE, root, rules)
}

/// A recording as it is, which knows what is true of all variants of it.
pub struct Original<'a> {
    pub path: &'a Path,
    pub opened: &'a OpenedLog,
}

pub fn opened(log: &Path, binding: &Path) -> Result<OpenedLog, String> {
    let request =
        OpenRequest { log: log.to_path_buf(), binding: Some(binding.to_path_buf()), ..OpenRequest::default() };
    stream::open(&request).map_err(|error| error.to_string())
}

/// Analyses a variant of a recording, whose times are those of the original after `warp`, and holds it against what is true of the original.
pub fn found_in(
    kind: Kind,
    original: &Original,
    opened: &OpenedLog,
    warp: Warp,
    root: &Path,
    rules: RuleChoice,
) -> Result<RecordingResult, String> {
    let path = original.path;
    let truth = &original.opened.recording;
    let labeled = |map: &str| -> Result<Vec<Span>, String> {
        let spans = spans(&label_file(path), original.opened, map)?.into_iter();
        let warped = spans.map(|it| Span { start_s: warp.clamped(it.start_s), end_s: warp.clamped(it.end_s), ..it });
        Ok(warped.filter(|it| it.start_s < it.end_s).collect())
    };
    let of = |gold: Vec<TimeSpan>| -> Vec<TimeSpan> {
        let warped = gold.iter().map(|it| TimeSpan { from_s: warp.clamped(it.from_s), to_s: warp.clamped(it.to_s) });
        warped.filter(|it| it.from_s < it.to_s).collect()
    };
    let hand = TrackId::Hand(if warp.other_hand { Side::Left } else { Side::Right });
    let starts = |starts: Vec<PrimitiveStart>| -> Vec<PrimitiveStart> {
        // What has begun with the recording has no boundary in it.
        let begins =
            |at_s: f64| warp.of(at_s).filter(|at_s| *at_s > warp.from_s + SAME_S && *at_s < warp.to_s - PASS_S);
        let who = |who: TrackId| if who == TrackId::Both { who } else { hand };
        starts
            .into_iter()
            .filter_map(|it| Some(PrimitiveStart { at_s: begins(it.at_s)?, who: who(it.who), ..it }))
            .collect()
    };
    let two = opened.hands().len() > 1;
    let usual = if two { "bimanual.rules" } else { "contact.rules" };
    let (analysis, known) = analyze(opened, shipped(rules, usual), rules.draw)?;
    let mut found =
        RecordingResult { printed: printed(&analysis), tasks: tasks(&analysis), ..RecordingResult::default() };
    match kind.set() {
        Set::OneArm => {
            boundaries(&analysis, &starts(gold::one_arm(truth)), &mut found);
            explained(&analysis, &mut found.unexplained);
        }
        Set::HandOver => {
            hand_overs(&analysis, &of(gold::hand_overs(truth)), &mut found);
            explained(&analysis, &mut found.unexplained);
        }
        Set::LiftTogether => boundaries(&analysis, &starts(gold::lifted_together(truth)), &mut found),
        Set::PegInHole => {
            covered(&analysis, TrackId::Both, &["Fit", "Insert"], "Fit or Insert", &of(gold::mated(truth)), &mut found)
        }
        Set::Lever => covered(&analysis, hand, &["Turn"], "Turn", &of(gold::pressed(truth)), &mut found),
        Set::Wipe => covered(&analysis, hand, &["Trace", "Press"], "Trace", &of(gold::wiped(truth)), &mut found),
        Set::Latch => covered(&analysis, hand, &["Turn"], "Turn", &of(gold::latch(truth)), &mut found),
        Set::Desk => {
            let exchanges = labeled("S1=mask,S2=mask,S3=mask,S4=mask,S5=Exchange,S6=mask,S7=mask")?;
            let classes = labeled(SEVEN)?;
            desk_passes(&analysis, &attempts_joined(exchanges), &classes, &mut found);
            let surgemes = root.join("examples/desk_surgemes.rules");
            let surgemes = rules
                .folder
                .map(|folder| folder.join("desk_surgemes.rules"))
                .filter(|own| own.is_file())
                .unwrap_or(surgemes);
            let (seven, _) = analyze(opened, surgemes, rules.draw)?;
            let truth = track(TrackId::Both, classes);
            found.labels.push(("7 classes", tally(&truth, &seven)?));
            let five = track(TrackId::Both, labeled(FIVE)?);
            found
                .labels
                .push(("5 classes", tally(&five, &renamed(&seven, &[("Transfer", "Lift"), ("Bring", "Place")]))?));
        }
        // A sensor that is stuck measures nothing: what counts is that this is reported.
        Set::Wiping if analysis.issues.iter().any(|issue| issue.kind == "stuck_sensor") => {
            let mut share = Share::default();
            share.count(!analysis.tracks.iter().flat_map(|it| &it.relabeled).any(|it| it.primitive == "Trace"));
            found.shares.push(("a stuck sensor is printed and makes no contact", share));
        }
        Set::Wiping => {
            let truth = track(hand, labeled(WIPING)?);
            check(WIPING, &known)?;
            found.labels.push(("", tally(&truth, &analysis)?));
            let by_force = peer::share_of_force(&opened.recording, "right.palm.force", hand, "Trace", "Move");
            if !warp.other_hand {
                found.peers.push(("0.35 × the 90th percentile of the force", tally(&truth, &by_force)?));
            }
        }
        Set::Peeling => {
            let truth = track(TrackId::Both, labeled("1=Apart,2=Apart,3=Contact,4=Apart,5=Apart")?);
            let ours = by_both(&analysis, &["MainGrasp(left)", "MainGrasp(right)", "EqualGrasp"]);
            found.labels.push(("", tally(&truth, &ours)?));
            let by_force =
                peer::share_of_force(&opened.recording, "right.palm.force", TrackId::Both, "Contact", "Apart");
            if !warp.other_hand {
                found.peers.push(("0.35 × the 90th percentile of the force", tally(&truth, &by_force)?));
            }
        }
        Set::Snap => {
            snap(path, opened, &analysis, warp, &mut found);
        }
    }
    Ok(found)
}

fn shipped(rules: RuleChoice, name: &str) -> PathBuf {
    rules.folder.map(|folder| folder.join(name)).filter(|own| own.is_file()).unwrap_or_else(|| PathBuf::from(name))
}

/// The shipped rules for a log, and what they read of it.
pub fn rules_and_frames(opened: &OpenedLog) -> Result<(Rules, Frames), String> {
    loaded(opened, PathBuf::from(if opened.hands().len() > 1 { "bimanual.rules" } else { "contact.rules" }), None)
}

/// Runs rules over a log, as `teachtree analyze` does.
fn analyze(opened: &OpenedLog, file: PathBuf, draw: Option<u64>) -> Result<(Analysis, KnownNames), String> {
    let (rules, frames) = loaded(opened, file, draw)?;
    analysis::check_rate(&rules, frames.layout.rate_hz).map_err(|error| error.to_string())?;
    let leaves = evaluate(&lower(&rules), &frames).map_err(|error| error.to_string())?;
    Ok((analysis::analyze(&rules, &frames, &leaves), KnownNames::new(&rules)))
}

fn loaded(opened: &OpenedLog, file: PathBuf, draw: Option<u64>) -> Result<(Rules, Frames), String> {
    // Rules of one's own bring the hand model that lies beside them.
    let beside = |name: &String| file.parent().map(|folder| folder.join(name)).filter(|own| own.is_file());
    let name = opened.hand_model().file;
    let hand_file = Some(beside(&name).map_or(name, |own| own.display().to_string()));
    let mut request = Request {
        files: vec![file],
        hand_file,
        overrides: opened.params.clone(),
        needs_tree: true,
        ..Request::default()
    };
    if let (Some(draw), Some(rules)) = (draw, language::load(&request).rules) {
        request.overrides = varied(&rules, draw, opened);
    }
    let loaded = language::load(&request);
    let errors: Vec<_> = loaded.diagnostics.into_iter().filter(|found| found.severity == Severity::Error).collect();
    let rules = loaded.rules.filter(|_| errors.is_empty()).ok_or_else(|| render(&errors, &loaded.sources, false))?;
    let frames = opened.frames(&report::channels(&rules)).map_err(|error| error.to_string())?;
    Ok((rules, frames))
}

/// The params of rules, each between 0.7 and 1.3 times its value and within its range: the same for a param in every recording. No duration is shorter
/// than a sample.
fn varied(rules: &Rules, draw: u64, opened: &OpenedLog) -> Vec<(String, String)> {
    let time = &opened.recording.time;
    let step = time.last().zip(time.first()).map_or(0.0, |(last, first)| last - first) / time.len().max(2) as f64;
    let value = |param: &language::rules::Param| {
        let of_name =
            param.name.bytes().fold(draw, |sum, byte| sum.wrapping_mul(1_000_003).wrapping_add(u64::from(byte)));
        let wanted = param.value * ChaCha8Rng::seed_from_u64(of_name).random_range(0.7..=1.3);
        let value = param.range.map_or(wanted, |(low, high)| wanted.clamp(low, high));
        let value = if param.dimension == Dimension::TIME { value.max(param.value.min(1.1 * step)) } else { value };
        (param.name.clone(), format!("{value} {}", param.dimension.si_unit()))
    };
    rules.params.iter().map(value).collect()
}

pub fn label_file(log: &Path) -> PathBuf {
    let name = log.file_stem().unwrap_or_default().to_string_lossy();
    log.with_file_name(format!("{name}_segments.csv"))
}

fn check(map: &str, known: &KnownNames) -> Result<(), String> {
    NameMap::of_pairs(map).and_then(|map| map.check(known, "map")).map_err(|error| error.to_string())
}

/// The spans of a label file under other names.
pub fn spans(file: &Path, opened: &OpenedLog, map: &str) -> Result<Vec<Span>, String> {
    let labels = labels::read(file, &opened.log, &opened.row_time).map_err(|error| error.to_string())?;
    let map = NameMap::of_pairs(map).map_err(|error| error.to_string())?;
    let span = |it: &labels::Interval| {
        let names = map.get(&it.name).map(<[String]>::to_vec).filter(|names| !names.is_empty())?;
        Some(Span { names, start_s: it.start_s, end_s: it.end_s })
    };
    Ok(labels.intervals.iter().filter_map(span).collect())
}

fn track(who: TrackId, primitives: Vec<Span>) -> Truth {
    Truth { tracks: vec![TrackTruth { who, primitives, tasks: None }] }
}

fn tally(truth: &Truth, analysis: &Analysis) -> Result<Tally, String> {
    let rows = score::score(truth, analysis, Stage::Relabeled, &Meta::default()).map_err(|error| error.to_string())?;
    let mut all = Tally::default();
    rows.iter().for_each(|row| all.add(&row.tally));
    Ok(all)
}

/// The same with some primitives called by other names; equal neighbors are joined.
fn renamed(analysis: &Analysis, names: &[(&str, &str)]) -> Analysis {
    let mut analysis = analysis.clone();
    for track in &mut analysis.tracks {
        for segment in &mut track.relabeled {
            if let Some((_, other)) = names.iter().find(|(name, _)| *name == segment.primitive) {
                segment.primitive = (*other).to_string();
            }
        }
        joined(&mut track.relabeled);
    }
    analysis
}

fn joined(segments: &mut Vec<Segment>) {
    let mut whole: Vec<Segment> = Vec::new();
    for segment in segments.drain(..) {
        match whole
            .last_mut()
            .filter(|last| last.primitive == segment.primitive && last.frames.end == segment.frames.start)
        {
            Some(last) => (last.frames.end, last.end_s) = (segment.frames.end, segment.end_s),
            None => whole.push(segment),
        }
    }
    *segments = whole;
}

/// The track of both hands as Contact while it says one of these, else as Apart.
fn by_both(analysis: &Analysis, names: &[&str]) -> Analysis {
    let both = analysis.track(TrackId::Both).map_or(&[][..], |track| &track.relabeled);
    let is_contact =
        |frame: usize| both.iter().any(|it| it.frames.contains(&frame) && names.contains(&it.primitive.as_str()));
    peer::labeled(TrackId::Both, analysis.frames, analysis.rate_hz, analysis.start_s, |frame| {
        if is_contact(frame) { "Contact" } else { "Apart" }
    })
}

/// The relabeled segments of a track.
fn relabeled(analysis: &Analysis, who: TrackId) -> &[Segment] {
    analysis.track(who).map_or(&[][..], |track| &track.relabeled)
}

fn boundaries(analysis: &Analysis, gold: &[PrimitiveStart], found: &mut RecordingResult) {
    for start in gold {
        let of_name = relabeled(analysis, start.who).iter().filter(|it| start.names.contains(&it.primitive.as_str()));
        let off = of_name.map(|it| (it.start_s - start.at_s).abs()).min_by(f64::total_cmp).filter(|off| *off <= SAME_S);
        found.boundaries.push((start.names[0], start.at_s, off));
    }
}

fn hand_overs(analysis: &Analysis, gold: &[TimeSpan], found: &mut RecordingResult) {
    let passes: Vec<&Segment> = relabeled(analysis, TrackId::Both).iter().filter(|it| it.primitive == "Pass").collect();
    let is_true = |it: &Segment, gold: &TimeSpan| {
        (it.start_s - gold.from_s).abs() <= PASS_S && (it.end_s - gold.to_s).abs() <= PASS_S
    };
    for gold in gold {
        found.passes.count(passes.iter().any(|it| is_true(it, gold)));
    }
    found.false_passes +=
        passes.iter().filter(|it| !gold.iter().any(|gold| it.start_s < gold.to_s && gold.from_s < it.end_s)).count();
}

/// Attempts at one exchange, which follow each other at once, as one.
fn attempts_joined(spans: Vec<Span>) -> Vec<Span> {
    let mut joined: Vec<Span> = Vec::new();
    for span in spans {
        match joined.last_mut().filter(|last| span.start_s - last.end_s <= SAME_S) {
            Some(last) => last.end_s = span.end_s,
            None => joined.push(span),
        }
    }
    joined
}

/// A hand-over is found where a Pass meets the time that operators call one; it is false where all of it is called something else.
fn desk_passes(analysis: &Analysis, exchanges: &[Span], labeled: &[Span], found: &mut RecordingResult) {
    let passes: Vec<&Segment> = relabeled(analysis, TrackId::Both).iter().filter(|it| it.primitive == "Pass").collect();
    let meets = |it: &Segment, span: &Span| it.start_s < span.end_s + PASS_S && span.start_s < it.end_s + PASS_S;
    exchanges.iter().for_each(|span| found.passes.count(passes.iter().any(|it| meets(it, span))));
    let elsewhere = |it: &&&Segment| {
        !exchanges.iter().any(|span| meets(it, span))
            && labeled.iter().any(|span| span.start_s < it.end_s && it.start_s < span.end_s)
    };
    found.false_passes += passes.iter().filter(elsewhere).count();
}

fn covered(
    analysis: &Analysis,
    who: TrackId,
    names: &[&str],
    printed: &'static str,
    gold: &[TimeSpan],
    found: &mut RecordingResult,
) {
    let segments = relabeled(analysis, who).iter().filter(|it| names.contains(&it.primitive.as_str()));
    let segments: Vec<&Segment> = segments.collect();
    let shared = |gold: &TimeSpan| -> f64 {
        segments.iter().map(|it| (it.end_s.min(gold.to_s) - it.start_s.max(gold.from_s)).max(0.0)).sum()
    };
    let all: f64 = gold.iter().map(|gold| gold.to_s - gold.from_s).sum();
    found.covered = Some((printed, gold.iter().map(shared).sum(), all));
}

/// The end of the first Approach against the state file, and whether the part is found to go in.
fn snap(path: &Path, opened: &OpenedLog, analysis: &Analysis, warp: Warp, found: &mut RecordingResult) {
    let states = std::fs::read_to_string(path.join("R_State.dat")).unwrap_or_default();
    let states: Vec<f64> = states.lines().filter_map(|line| line.trim().parse().ok()).collect();
    let segments = relabeled(analysis, TrackId::Hand(if warp.other_hand { Side::Left } else { Side::Right }));
    // In the sixth state file the alignment has no length: the insertion begins with the first contact.
    let success = !path.file_name().is_some_and(|name| name.to_string_lossy().starts_with("ERROR"));
    if let (true, Some(contact)) = (success, states.get(1).and_then(|at_s| warp.of(*at_s))) {
        let ends = segments.iter().find(|it| it.primitive == "Approach").map(|it| it.end_s);
        let mut share = Share::default();
        share.count(ends.is_some_and(|end| (end - contact).abs() <= CONTACT_S));
        found.shares.push(("end of Approach within 0.1 s", share));
        let mut share = Share::default();
        let felt = peer::first_above(&opened.recording, "right.palm.force", peer::SNAP_N);
        share.count(felt.is_some_and(|felt| (felt - contact).abs() <= CONTACT_S));
        if !warp.other_hand {
            found.shares.push(("the same by 3 N", share));
        }
    }
    let inserted = segments.iter().any(|it| it.primitive == "Insert");
    let mut share = Share::default();
    if success {
        share.count(inserted);
        found.shares.push(("Insert in successes", share));
    } else {
        share.count(!inserted);
        found.shares.push(("no Insert in failures", share));
    }
}

/// What each task is made of, in order. A primitive with several places may stand at any of them.
fn place(task: &str, primitive: &str) -> &'static [usize] {
    let handles = matches!(primitive, "MainGrasp(left)" | "MainGrasp(right)" | "EqualGrasp");
    match (task, primitive) {
        (_, "Move" | "Approach") => &[0],
        (_, "Grasp") => &[1],
        (_, "Release") => &[9],
        ("pick_and_place" | "pick_and_follow" | "pick_and_press", "Pass") => &[3, 6],
        ("carry_together", _) if handles => &[3],
        ("peg_in_hole", "Insert")
        | ("peg_pullout_from_hole", "Pullout")
        | ("turn_screw", "Turn")
        | ("slide", "Slide") => &[5],
        ("push", "Push") | ("push_and_trace", "Trace" | "Push") | ("fit", "Fit" | "Insert") => &[5],
        ("pick_and_follow", "Follow") | ("pick_and_press", "Press") => &[5],
        (_, "Translate") => &[2, 4, 7],
        (_, "Place") => &[8],
        _ => &[],
    }
}

/// Counts the segments of the hands that the tasks do not explain: what stands in no named task and is neither Move nor Approach, and in a task what
/// is left over by the longest part of it that goes in the order of that task.
fn explained(analysis: &Analysis, unexplained: &mut Share) {
    let hands = analysis.tracks.iter().filter(|track| track.who != TrackId::Both);
    for track in hands {
        let idle = |it: &&Segment| matches!(it.primitive.as_str(), "Move" | "Approach");
        let mut fits = 0;
        let in_task = |it: &Segment| track.tasks.iter().any(|task| task.frames.contains(&it.frames.start));
        fits += track.relabeled.iter().filter(|it| !in_task(it)).filter(idle).count();
        for task in &track.tasks {
            fits += match task.task.as_str() {
                UNKNOWN => task.segments.iter().filter(idle).count(),
                name => in_order(name, &task.segments),
            };
        }
        let all = outside(track) + track.tasks.iter().map(|task| task.segments.len()).sum::<usize>();
        unexplained.add(Share { right: all - fits, of: all });
    }
}

fn outside(track: &Track) -> usize {
    track.relabeled.iter().filter(|it| !track.tasks.iter().any(|task| task.frames.contains(&it.frames.start))).count()
}

/// How many segments the longest part has that goes in the order of the task. Two consecutive segments of one primitive do not count as being in order, except Move and Approach.
fn in_order(task: &str, segments: &[Segment]) -> usize {
    // The most segments so far that end at each place.
    let mut most = [0_usize; 10];
    for segment in segments {
        let before = most;
        for &at in place(task, &segment.primitive) {
            let until = if at == 0 { 1 } else { at };
            let best = before.iter().take(until).max().copied().unwrap_or_default();
            most[at] = most[at].max(best + 1);
        }
    }
    most.into_iter().max().unwrap_or_default()
}

/// The tasks of each hand, in order.
fn tasks(analysis: &Analysis) -> Vec<String> {
    let tasks = analysis.tracks.iter().flat_map(|track| track.tasks.iter().filter(|task| task.task != UNKNOWN));
    tasks.map(|task| task.task.clone()).collect()
}

fn printed(analysis: &Analysis) -> String {
    let mut lines = Vec::new();
    for track in &analysis.tracks {
        let tasks: Vec<String> = track
            .tasks
            .iter()
            .map(|task| {
                let segments: Vec<String> =
                    task.segments.iter().map(|it| format!("{} {:.2}", it.primitive, it.start_s)).collect();
                format!("    {} {}: {}", track.who, task.task, segments.join(", "))
            })
            .collect();
        lines.extend(tasks);
    }
    lines.join("\n")
}
