//! Small rule sets, frames and leaves, written as short texts.

use std::ops::Range;
use std::sync::LazyLock;
use teachtree_analysis::{Analysis, Segment, TrackId, analyze};
use teachtree_base::channels::{ChannelSpec, DERIVED, Fallback};
use teachtree_base::diagnostic::Span;
use teachtree_base::hands::Side;
use teachtree_base::meaning::Primitives;
use teachtree_base::units::Dimension;
use teachtree_engine::runs::{Leaves, Run, append};
use teachtree_frames::frames::{ColumnKey, Frames, HandLayout, Layout};
use teachtree_language::rules::*;

/// Frames per second of all logs here: one frame is 10 ms.
pub const RATE_HZ: f64 = 100.0;

/// The fourteen primitives of one hand and the four of both.
const PRIMITIVES: &str = "Move Approach Grasp Translate Slide Insert Pullout Release Place Turn Press Follow Push Trace \
                          EqualGrasp MainGrasp Pass Fit";

/// What a hand does in the shipped primitives.
static MEANINGS: LazyLock<Primitives> =
    LazyLock::new(|| teachtree_language::load_text("all.rules", "use \"bimanual.rules\"").rules.unwrap().by_name());

/// A rule set with the primitives of the chapter, without tasks and relabeling.
pub fn bare(settle_s: f64) -> Rules {
    let primitives = PRIMITIVES.split_whitespace();
    let primitive = |name: &str| Primitive {
        name: name.into(),
        sided: name == "MainGrasp",
        is: None,
        does: MEANINGS.does(name).or_else(|| MEANINGS.does(&format!("{name}(left)"))),
        other: None,
        span: Span::default(),
    };
    let tree = |name: &str, scope| Tree {
        name: name.into(),
        scope,
        settle: Some(seconds(settle_s)),
        root: Branch { choices: Vec::new(), span: Span::default() },
        span: Span::default(),
    };
    Rules {
        primitives: primitives.map(primitive).collect(),
        trees: vec![tree("single_hand", TreeScope::EachHand), tree("both_hands", TreeScope::BothHands)],
        ..Rules::default()
    }
}

/// The tasks and relabeling rules of the shipped files in short.
pub fn chapter() -> Rules {
    let mut rules = bare(0.05);
    task(&mut rules, "turn_screw", "Turn turning 0.1745", "").joined = true;
    task(&mut rules, "peg_in_hole", "Insert", "");
    task(&mut rules, "peg_pullout_from_hole", "Pullout", "");
    task(&mut rules, "pick_and_follow", "Follow", "");
    task(&mut rules, "push_and_trace", "Trace", "");
    task(&mut rules, "pick_and_press", "Press lasting 0.15", "");
    task(&mut rules, "push", "Push travelling 0.02", "Grasp Translate");
    task(&mut rules, "fit", "Fit", "");
    task(&mut rules, "carry_together", "EqualGrasp, MainGrasp", "");
    task(&mut rules, "pick_and_place", "Translate, Place, Pass", "");
    task(&mut rules, "slide", "Slide travelling 0.02", "");
    between(&mut rules, "", "Slide Turn +", "Approach Release", "Grasp Translate", "Grasp");
    between(&mut rules, "", "Slide Turn +", "Place", "Place Release", "Place");
    between(&mut rules, "", "Place Slide + < 0.25", "Translate", "Translate", "Translate");
    between(&mut rules, "", "Push", "Approach", "Grasp", "Grasp");
    between(&mut rules, "", "Fit < 0.3", "Translate", "Translate", "Translate");
    pass(&mut rules);
    separate(&mut rules, "Translate", "Fit Insert Pullout Turn");
    become_(&mut rules, "turn_screw", "Insert Pullout", "Turn");
    between(&mut rules, "push_and_trace", "Push", "Trace", "Trace", "Trace");
    between(&mut rules, "pick_and_follow", "Press", "Translate", "Follow", "Follow");
    rules
}

pub fn seconds(value: f64) -> Constant {
    Constant { value, dimension: Dimension::TIME, params: Vec::new(), span: Span::default() }
}

/// `Grasp`, `MainGrasp(left)`.
pub fn label(rules: &Rules, text: &str) -> Label {
    let (name, side) = match text.split_once('(') {
        Some((name, side)) => (name, Side::from_name(side.trim_end_matches(')'))),
        None => (text, None),
    };
    Label { primitive: rules.primitive(name).expect(name), side }
}

pub fn labels(rules: &Rules, text: &str) -> Vec<Label> {
    text.split_whitespace().map(|word| label(rules, word)).collect()
}

/// A task from Move to Release; keys such as `Push travelling 0.02, Turn`.
pub fn task<'a>(rules: &'a mut Rules, name: &str, keys: &str, without: &str) -> &'a mut Task {
    let keys = keys.split(", ").map(|key| {
        let words: Vec<&str> = key.split_whitespace().collect();
        let asked = |what: &str| (words.get(1) == Some(&what)).then(|| seconds(words[2].parse().unwrap()));
        Key {
            label: Pattern::of(label(rules, words[0])),
            lasting: asked("lasting"),
            travelling: asked("travelling"),
            turning: asked("turning"),
            span: Span::default(),
        }
    });
    let task = Task {
        name: name.into(),
        first: Pattern::of(label(rules, "Move")),
        last: Pattern::of(label(rules, "Release")),
        keys: keys.collect(),
        all_keys: false,
        without: labels(rules, without),
        joined: false,
        failure: false,
        span: Span::default(),
    };
    rules.tasks.push(task);
    rules.tasks.last_mut().unwrap()
}

fn relabel(rules: &mut Rules, task: &str, kind: RelabelKind, text: String) {
    let of = rules.tasks.iter().position(|other| other.name == task).map(|at| TaskId(at as u32));
    rules.relabels.push(RelabelRule { task: of, kind, text, span: Span::default() });
}

/// `X between A and B becomes C`; `what` such as `Slide Turn + < 0.25`.
pub fn between(rules: &mut Rules, task: &str, what: &str, before: &str, after: &str, becomes: &str) {
    let (names, shorter) = what.split_once(" < ").map_or((what, None), |(names, limit)| (names, Some(limit)));
    let run = names.ends_with('+');
    let kind = RelabelKind::Between {
        what: labels(rules, names.trim_end_matches('+')),
        run,
        shorter: shorter.map(|limit| seconds(limit.parse().unwrap())),
        between: (labels(rules, before), labels(rules, after)),
        becomes: label(rules, becomes),
    };
    relabel(rules, task, kind, format!("{what} between {before} and {after} becomes {becomes}"));
}

pub fn become_(rules: &mut Rules, task: &str, what: &str, becomes: &str) {
    let kind = RelabelKind::Become { what: labels(rules, what), becomes: label(rules, becomes) };
    relabel(rules, task, kind, format!("{what} become {becomes}"));
}

/// `sequence A, B C *, D becomes E`.
pub fn sequence(rules: &mut Rules, elements: &str, becomes: &str) {
    let element = |text: &str| match text.chars().last() {
        Some('*') => (labels(rules, text.trim_end_matches('*')), Repetition::ZeroOrMore),
        Some('+') => (labels(rules, text.trim_end_matches('+')), Repetition::OneOrMore),
        _ => (labels(rules, text), Repetition::Once),
    };
    let kind =
        RelabelKind::Sequence { elements: elements.split(", ").map(element).collect(), becomes: label(rules, becomes) };
    relabel(rules, "", kind, format!("sequence {elements} becomes {becomes}"));
}

/// `(X or Y)+ between A and B in one hand and between C and D in the other becomes E`, or `separate`.
pub fn in_hands(rules: &mut Rules, what: &str, one: [&str; 2], other: [&str; 2], becomes: Option<&str>) {
    let pair = |[before, after]: [&str; 2]| (labels(rules, before), labels(rules, after));
    let kind = RelabelKind::BetweenInHands {
        what: labels(rules, what),
        run: true,
        shorter: None,
        one: pair(one),
        other: pair(other),
        becomes: becomes.map(|becomes| label(rules, becomes)),
    };
    relabel(rules, "", kind, format!("{what} becomes {}", becomes.unwrap_or("separate")));
}

/// The rule of a hand-over.
fn pass(rules: &mut Rules) {
    let kind = RelabelKind::BetweenInHands {
        what: labels(rules, "MainGrasp EqualGrasp"),
        run: true,
        shorter: None,
        one: (labels(rules, "Grasp Translate"), labels(rules, "Release")),
        other: (labels(rules, "Approach"), labels(rules, "Translate Place")),
        becomes: Some(label(rules, "Pass")),
    };
    relabel(rules, "", kind, "(MainGrasp or EqualGrasp)+ … becomes Pass".into());
}

pub fn separate(rules: &mut Rules, what: &str, without: &str) {
    let kind = RelabelKind::Separate { what: vec![label(rules, what)], without: labels(rules, without) };
    relabel(rules, "", kind, format!("{what} in both without {without} becomes separate"));
}

/// Runs such as `Move 5 Approach 12`, lengths in frames; `-` is `separate`.
pub fn runs(rules: &Rules, from: usize, text: &str) -> Vec<Run> {
    let words: Vec<&str> = text.split_whitespace().collect();
    let mut runs = Vec::new();
    let mut start = from;
    for pair in words.chunks(2) {
        let end = start + pair[1].parse::<usize>().unwrap();
        let label = (pair[0] != "-").then(|| label(rules, pair[0]));
        append(&mut runs, Run { start, end, label });
        start = end;
    }
    runs
}

/// The leaves of one stretch by track: `&[("right", "Move 5 …"), ("both", "- 5 …")]`.
pub fn leaves(rules: &Rules, from: usize, tracks: &[(&str, &str)]) -> Leaves {
    let mut leaves = Leaves::default();
    for (track, text) in tracks {
        let runs = runs(rules, from, text);
        leaves.frames = from..runs.last().unwrap().end;
        match Side::from_name(track) {
            Some(side) => _ = leaves.hands.insert(side, runs),
            None => leaves.both = runs,
        }
    }
    leaves
}

/// Frames without columns, with these stretches.
pub fn frames(stretches: &[Range<usize>]) -> Frames {
    let len = stretches.last().map_or(0, |last| last.end);
    Frames {
        layout: Layout {
            rate_hz: RATE_HZ,
            hands: Side::BOTH
                .map(|side| HandLayout { side, fingers: Vec::new(), contacts: Vec::new(), knows_distance: false })
                .into_iter()
                .collect(),
        },
        len,
        time: (0..len).map(|frame| frame as f64 / RATE_HZ).collect(),
        stretches: stretches.to_vec(),
        ..Frames::default()
    }
}

/// Adds the columns of a derived channel for both hands: component by component as a function of the frame.
pub fn column(frames: &mut Frames, name: &str, value: impl Fn(usize, u32) -> f64) {
    let derived = DERIVED.iter().find(|derived| derived.name == name).unwrap();
    let channel = u32::try_from(frames.channels.len()).unwrap();
    frames.channels.push(ChannelSpec {
        name: name.into(),
        per_hand: true,
        axis: None,
        shape: derived.shape,
        dimension: derived.dimension,
        absent: Fallback::Derived,
    });
    for side in Side::BOTH {
        for component in 0..u32::try_from(derived.shape.components().len()).unwrap() {
            let key = ColumnKey { channel, side: Some(side), slot: 0, component };
            frames.columns.insert(key, (0..frames.len).map(|frame| value(frame, component)).collect());
        }
    }
}

/// Analyses one stretch of tracks without columns.
pub fn run(rules: &Rules, tracks: &[(&str, &str)]) -> Analysis {
    let leaves = leaves(rules, 0, tracks);
    analyze(rules, &frames(std::slice::from_ref(&leaves.frames)), &[leaves])
}

/// Analyses one hand; the target goes 1 mm and turns 0.01 rad in each frame.
pub fn one_hand(rules: &Rules, text: &str) -> Analysis {
    let leaves = leaves(rules, 0, &[("right", text)]);
    analyze(rules, &moving(std::slice::from_ref(&leaves.frames)), &[leaves])
}

/// Frames in which the target goes 1 mm and turns 0.01 rad in each frame.
pub fn moving(stretches: &[Range<usize>]) -> Frames {
    let mut frames = frames(stretches);
    column(&mut frames, "target", |_, _| 0.0);
    column(&mut frames, "target.position", |frame, axis| if axis == 0 { frame as f64 * 1e-3 } else { 0.0 });
    column(&mut frames, "target.spin", |_, _| 0.01 * RATE_HZ);
    frames
}

/// The names of segments in a row.
pub fn names(segments: &[Segment]) -> String {
    segments.iter().map(|segment| segment.primitive.as_str()).collect::<Vec<_>>().join(" ")
}

/// A line for each task of a hand: `0–1.2 pick_and_place (slide): Move Approach …`, with `[start]`, `[end]` where it is open.
pub fn tasks(analysis: &Analysis, side: Side) -> Vec<String> {
    let track = analysis.track(TrackId::Hand(side)).unwrap();
    let line = |task: &teachtree_analysis::TaskSpan| {
        let secondary =
            if task.secondary.is_empty() { String::new() } else { format!(" ({})", task.secondary.join(" ")) };
        let start = if task.open_start { "[start] " } else { "" };
        let end = if task.open_end { " [end]" } else { "" };
        let (from, to) = (task.start_s, task.end_s);
        format!("{from:.2}–{to:.2} {start}{}{end}{secondary}: {}", task.task, names(&task.segments))
    };
    track.tasks.iter().map(line).collect()
}
