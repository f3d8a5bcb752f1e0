//! The share of right boundaries by confidence: of recordings, and of simulated operators.

use crate::gold;
use crate::kind::{Kind, Set};
use crate::recording_result::{SEVEN, label_file, rules_and_frames, spans};
use std::collections::BTreeMap;
use std::path::Path;
use teachtree::{Analysis, Log, Rules};
use teachtree_analysis::TrackId;
use teachtree_analysis::confidence::calibrated as calibration;
use teachtree_analysis::score::{NameMap, Truth};
use teachtree_base::hands::Side;
use teachtree_base::recording::Recording;
use teachtree_frames::{self as stream, OpenRequest};
use teachtree_measure::confidence::ConfidenceSample;
use teachtree_world::{shipped, teach};

/// Maximum distance of a correct boundary from the true one, s.
const RIGHT_S: f64 = 0.15;
/// The precision of boundaries that human annotators set, s.
const LABELED_S: f64 = 0.25;

/// Analyzes a log by a rule file, or by the default rules.
fn analyzed(path: &Path, binding: Option<&Path>, rules: Option<&Path>) -> Result<Analysis, String> {
    let options = binding.map_or_else(Log::options, |binding| Log::options().binding(binding));
    let rules = rules.map_or_else(Rules::options, |file| Rules::options().file(file));
    let analyze = move || {
        let log = options.open(path)?;
        rules.for_log(&log)?.analyze(&log)?.with_confidence()
    };
    analyze().map_err(|error: teachtree::Error| error.to_string())
}

/// Samples by the confidence that the program prints, instead of by stability.
pub fn calibrated(samples: &[ConfidenceSample]) -> Vec<ConfidenceSample> {
    let calibrated = |it: &ConfidenceSample| ConfidenceSample { share: calibration(it.share), ..*it };
    samples.iter().map(calibrated).collect()
}

/// The boundaries of a recording whose truth has them, each with its stability.
pub fn of_recording(kind: Kind, path: &Path, root: &Path) -> Result<Vec<ConfidenceSample>, String> {
    if !matches!(kind.set(), Set::OneArm | Set::Wiping | Set::Snap | Set::Desk) {
        return Ok(vec![]);
    }
    let surgemes = root.join("examples/desk_surgemes.rules");
    let is_desk = kind.set() == Set::Desk;
    let binding = root.join("demos").join(format!("{}.binding.yaml", kind.binding()));
    let analysis = analyzed(path, Some(&binding), is_desk.then_some(surgemes.as_path()))?;
    let request = OpenRequest { log: path.to_path_buf(), binding: Some(binding), ..OpenRequest::default() };
    let opened = stream::open(&request).map_err(|error| error.to_string())?;
    let mut starts: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    let mut within = RIGHT_S;
    // The labeled spans, if some of the time has no label.
    let mut labeled = None;
    match kind.set() {
        Set::OneArm => {
            for start in gold::one_arm(&opened.recording) {
                starts.entry(start.names[0]).or_default().push(start.at_s);
            }
            // Failed touches end in a Release that no gold knows.
            starts.remove("Release");
        }
        Set::Wiping if analysis.issues().iter().any(|issue| issue.kind == "stuck_sensor") => {}
        Set::Wiping => {
            let labels = spans(&label_file(path), &opened, "1=mask,2=Trace,3=mask")?;
            within = LABELED_S;
            starts.insert("Trace", labels.iter().filter(|it| it.names == ["Trace"]).map(|it| it.start_s).collect());
        }
        Set::Desk => {
            let labels = spans(&label_file(path), &opened, SEVEN)?;
            within = LABELED_S;
            for (_, name) in SEVEN.split(',').filter_map(|pair| pair.split_once('=')) {
                let of_name = labels.iter().filter(|it| it.names == [name]);
                starts.insert(name, of_name.map(|it| it.start_s).collect());
            }
            labeled = Some(labels);
        }
        _ => {
            let states = std::fs::read_to_string(path.join("R_State.dat")).unwrap_or_default();
            let contact = states.lines().filter_map(|line| line.trim().parse().ok()).nth(1);
            let success = !path.to_string_lossy().contains("ERROR");
            if let (true, Some(contact)) = (success, contact) {
                starts.insert("Trace", vec![contact]);
            }
        }
    }
    // Of an assembly only the first contact is known.
    let first_only = kind.set() == Set::Snap;
    let who = if is_desk { TrackId::Both } else { TrackId::Hand(Side::Right) };
    let is_labeled =
        |at_s: f64| labeled.as_ref().is_none_or(|spans| spans.iter().any(|it| it.start_s <= at_s && at_s < it.end_s));
    let mut sure = vec![];
    for (name, at) in starts {
        let found = analysis
            .segments()
            .into_iter()
            .filter(|it| it.primitive() == name && it.track() == who && is_labeled(it.start_s()));
        let found = found.take(if first_only { 1 } else { usize::MAX });
        sure.extend(found.filter_map(|it| {
            let right = at.iter().any(|at| (it.start_s() - at).abs() <= within);
            Some(ConfidenceSample { share: it.confidence()?.stability, right })
        }));
    }
    Ok(sure)
}

/// Calls `each` with a scene's name, a seed and the demonstration of that seed, for all scenes of one hand and `seeds` seeds each.
pub fn demonstrations(
    seeds: u64,
    each: &mut dyn FnMut(&str, u64, Recording) -> Result<(), String>,
) -> Result<(), String> {
    for seed in 1..=seeds {
        for name in shipped::names() {
            let scene = shipped::scene(name).map_err(|error| error.to_string())?;
            if scene.hands.len() > 1 {
                continue;
            }
            let operator = shipped::operator(name).map_err(|error| error.to_string())?;
            each(name, seed, teach(&scene, &operator, seed).map_err(|error| error.to_string())?)?;
        }
    }
    Ok(())
}

/// The boundaries of simulated operators, those of all scenes of one hand with these seeds, each with its stability.
pub fn of_simulation(seeds: u64) -> Result<Vec<ConfidenceSample>, String> {
    let folder = tempfile::tempdir().map_err(|error| error.to_string())?;
    let mut sure = vec![];
    demonstrations(seeds, &mut |name, seed, recording| {
        let path = folder.path().join(format!("{name}_{seed}.csv"));
        teachtree_logs::read::formats::write(&recording, &path).map_err(|error| error.to_string())?;
        let analysis = analyzed(&path, None, None)?;
        let opened = stream::open(&OpenRequest { log: path, ..OpenRequest::default() });
        let opened = opened.map_err(|error| error.to_string())?;
        let (rules, frames) = rules_and_frames(&opened)?;
        let truth = Truth::of_recording(&recording, &NameMap::default()).unwrap_or_default();
        let truth = truth.relabeled(&rules, &frames).map_err(|error| error.to_string())?;
        for track in &truth.tracks {
            let found = analysis.segments().into_iter().filter(|it| it.track() == track.who);
            // The first segment begins with the recording.
            sure.extend(found.filter(|it| it.frames().start > 0).filter_map(|it| {
                let same =
                    |span: &&teachtree_analysis::score::Span| span.names.iter().any(|name| name == it.primitive());
                let right =
                    track.primitives.iter().filter(same).any(|span| (span.start_s - it.start_s()).abs() <= RIGHT_S);
                Some(ConfidenceSample { share: it.confidence()?.stability, right })
            }));
        }
        Ok(())
    })?;
    Ok(sure)
}
