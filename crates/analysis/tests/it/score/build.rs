//! Truths and results written as short texts.

use std::sync::LazyLock;
use teachtree_analysis::json::Meta;
use teachtree_analysis::score::{Row, Span, Stage, Tally, TrackTruth, Truth, score};
use teachtree_analysis::{Analysis, Segment, TaskSpan, Track, TrackId};
use teachtree_base::hands::Side;
use teachtree_base::meaning::Primitives;

pub const RIGHT: TrackId = TrackId::Hand(Side::Right);
/// Frames per second of all results here.
const RATE_HZ: f64 = 1000.0;

/// Segments such as `Move 1 Grasp 0.5`, lengths in seconds, the first one at `start_s`; `-` is a gap.
pub fn segments(start_s: f64, text: &str) -> Vec<Segment> {
    let words: Vec<&str> = text.split_whitespace().collect();
    let mut start_s = start_s;
    let mut segments = Vec::new();
    for pair in words.chunks(2) {
        let end_s = start_s + pair[1].parse::<f64>().unwrap();
        let frame = |time_s: f64| (time_s * RATE_HZ).round() as usize;
        if pair[0] != "-" {
            let frames = frame(start_s)..frame(end_s);
            let (was, by) = (Vec::new(), Vec::new());
            let primitive = pair[0].into();
            segments.push(Segment { primitive, frames, start_s, end_s, was, by, ..Segment::default() });
        }
        start_s = end_s;
    }
    segments
}

/// Spans such as `Move|Approach 1 - 0.5 Grasp 2`; `-` is masked.
pub fn spans(text: &str) -> Vec<Span> {
    let span = |segment: Segment| Span {
        names: segment.primitive.split('|').map(str::to_string).collect(),
        start_s: segment.start_s,
        end_s: segment.end_s,
    };
    segments(0.0, text).into_iter().map(span).collect()
}

/// The truth of the right hand, without tasks.
pub fn truth(text: &str) -> Truth {
    Truth { tracks: vec![TrackTruth { who: RIGHT, primitives: spans(text), tasks: None }] }
}

/// A result of the right hand, the same before and after relabeling.
pub fn result(text: &str) -> Analysis {
    analysis(segments(0.0, text), Vec::new())
}

/// A result with tasks such as `pick 1 - 2 place 1`.
pub fn with_tasks(text: &str, tasks: &str) -> Analysis {
    let all = segments(0.0, text);
    let task = |span: Segment| TaskSpan {
        task: span.primitive,
        segments: Vec::new(),
        frames: span.frames,
        start_s: span.start_s,
        end_s: span.end_s,
        ..TaskSpan::default()
    };
    analysis(all, segments(0.0, tasks).into_iter().map(task).collect())
}

/// The primitives of the shipped rules, and *Lift*, a kind of Translate.
static PRIMITIVES: LazyLock<Primitives> = LazyLock::new(|| {
    let text = "use \"bimanual.rules\"\nprimitive Lift is Translate\nextend single_hand before carried { lifted and load > 90 N => Lift }";
    teachtree_language::load_text("lift.rules", text).rules.unwrap().by_name()
});

fn analysis(segments: Vec<Segment>, tasks: Vec<TaskSpan>) -> Analysis {
    let end_s = segments.last().map_or(0.0, |last| last.end_s);
    let track = Track { who: RIGHT, relabeled: segments.clone(), segments, tasks, composites: Vec::new() };
    let frames = (end_s * RATE_HZ).round() as usize;
    let stretches = track.segments.chunk_by(|one, next| one.end_s == next.start_s);
    let stretches = stretches.map(|all| (all[0].start_s, all[all.len() - 1].end_s)).collect();
    Analysis {
        frames,
        rows: frames,
        rate_hz: RATE_HZ,
        start_s: 0.0,
        end_s,
        stretches,
        tracks: vec![track],
        issues: Vec::new(),
        primitives: PRIMITIVES.clone(),
        ..Analysis::default()
    }
}

pub fn meta(log: &str) -> Meta {
    Meta { log: log.into(), rules: vec!["rules/contact.rules".into()], digest: "5a17".into(), ..Meta::default() }
}

pub fn rows(truth: &Truth, analysis: &Analysis) -> Vec<Row> {
    score(truth, analysis, Stage::Relabeled, &meta("log.csv")).unwrap()
}

/// The counts of the one track of a truth.
pub fn tally(true_text: &str, text: &str) -> Tally {
    rows(&truth(true_text), &result(text)).remove(0).tally
}

/// Nearly equal: times are added up.
pub fn near(found: Option<f64>, wanted: f64) {
    let found = found.unwrap();
    assert!((found - wanted).abs() < 1e-9, "found {found}, expected {wanted}");
}
