//! Which primitives the rules can detect in a log at all, and which they cannot for lack of a channel: the trees are evaluated over intervals,
//! with each channel that is missing or constant in the log taken as such.

use super::log_contents::LogContents;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};
use teachtree_analysis::outcome::{self, Undetectable as Undetected, UnmeasuredTask};
use teachtree_base::channels::Fallback;
use teachtree_base::hands::{Finger, FingerPick, Side, TrackId};
use teachtree_frames::frames::{ColumnKey, Frames};
use teachtree_language::graph::{AbstractValue, Graph, Leaf, Target, reachable_leaves};
use teachtree_language::rules::{ChannelId, Hand, Label, Labels, RelabelKind, Repetition, Rules, TreeScope};
use teachtree_logs::issue::{Issue, IssueKind};

/// The primitives that rules can detect in a log ([`Rules::observability`](super::Rules::observability)).
#[derive(Clone, Debug, PartialEq)]
pub struct Observability {
    /// By track: each hand of the log, left first, then both.
    pub tracks: Vec<TrackObservability>,
    /// What is wrong with the log, and how it is treated.
    pub issues: Vec<Issue>,
}

/// The primitives that rules can detect in a track of a log.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct TrackObservability {
    /// The track.
    pub track: TrackId,
    /// The primitives that can be detected.
    #[serde(rename = "can")]
    pub detectable: Vec<String>,
    /// The primitives that cannot, by reason.
    #[serde(rename = "cannot")]
    pub undetectable: Vec<Undetectable>,
    /// The primitives that no leaf gives in the track, and that relabeling can make there.
    #[serde(skip)]
    pub relabeled: Vec<String>,
}

/// Primitives that the rules cannot detect in a log.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Undetectable {
    /// Why: what the log lacks, such as `the scene has no socket`.
    #[serde(rename = "of")]
    pub reason: String,
    /// The primitives.
    pub primitives: Vec<String>,
}

/// Returns the primitives that the trees can detect in the track of each hand, and in that of both.
pub fn tracks(graph: &Graph, frames: &Frames, contents: &LogContents) -> Vec<TrackObservability> {
    tracks_with(graph, frames, &silent(frames, contents))
}

/// What the trees can detect if nothing is silent but the channels that the log and its scene lack: a channel that is measured and constant may be so because
/// nothing happened.
pub fn tracks_of_contents(graph: &Graph, frames: &Frames, contents: &LogContents) -> Vec<TrackObservability> {
    let mut silent = silent(frames, contents);
    silent.retain(|_, channel| channel.is_lacking);
    tracks_with(graph, frames, &silent)
}

fn tracks_with(graph: &Graph, frames: &Frames, silent: &SilentChannels) -> Vec<TrackObservability> {
    let sides: Vec<Side> = frames.layout.hands.iter().map(|hand| hand.side).collect();
    let mut tracks: Vec<TrackObservability> =
        sides.iter().map(|side| track(graph, frames, silent, TreeScope::EachHand, Some(*side))).collect();
    if sides.len() > 1 && graph.trees.iter().any(|tree| tree.scope == TreeScope::BothHands) {
        tracks.push(track(graph, frames, silent, TreeScope::BothHands, None));
    }
    tracks
}

/// The primitives that cannot be detected, as issues of the log.
pub fn issues(tracks: &[TrackObservability], frames: &Frames) -> Vec<Issue> {
    let at = |time: Option<&f64>| time.copied().unwrap_or_default();
    let (start_s, end_s) = (at(frames.time.first()), at(frames.time.last()));
    let issue = |track: &TrackObservability, lack: &Undetectable| Issue {
        kind: IssueKind::UNDETECTABLE,
        start_s,
        end_s,
        channel: track.track.to_string(),
        message: format!("{} cannot be detected: {}", lack.primitives.join(", "), lack.reason),
    };
    tracks
        .iter()
        .flat_map(|track| track.undetectable.iter().map(|lack| issue(track, lack)).collect::<Vec<_>>())
        .collect()
}

/// The tasks that no hand can show in a log with these contents.
pub fn unmeasured_tasks(rules: &Rules, graph: &Graph, frames: &Frames, contents: &LogContents) -> Vec<UnmeasuredTask> {
    let tracks = tracks_of_contents(graph, frames, contents);
    let hands: Vec<TrackId> = tracks.iter().map(|track| track.track).filter(|track| track.side().is_some()).collect();
    let mut undetectable: Vec<Undetected> = Vec::new();
    for track in &tracks {
        undetectable.extend(track.undetectable.iter().map(|it| (track.track, &it.primitives[..], it.reason.as_str())));
    }
    outcome::unmeasured(rules, &hands, &undetectable)
}

/// What a tree can detect: with all silent channels taken as such together, and one by one to find the reasons.
fn track(
    graph: &Graph,
    frames: &Frames,
    silent: &SilentChannels,
    scope: TreeScope,
    side: Option<Side>,
) -> TrackObservability {
    let fingers = |whose: Option<Side>| -> Vec<Finger> {
        let hands = frames.layout.hands.iter().filter(|hand| whose.is_none_or(|side| hand.side == side));
        hands.flat_map(|hand| hand.fingers.iter().copied()).collect()
    };
    let whose: Vec<Option<Side>> = Side::BOTH.into_iter().map(Some).chain([None]).collect();
    let lacks = |of: Option<Side>| {
        let lacks = lacking(&fingers(of))?;
        Some(match of {
            Some(other) if of != side => format!("the {other} hand {lacks}"),
            _ => format!("the hand {lacks}"),
        })
    };
    let lacking: BTreeMap<Option<Side>, String> = whose.into_iter().filter_map(|of| Some((of, lacks(of)?))).collect();
    // In a log of one hand, what rules ask of the other one is zero.
    let absent = |of: Option<Side>| of.filter(|side| frames.layout.hands.iter().all(|hand| hand.side != *side));
    let no_hand = Side::BOTH.map(|side| format!("the log has no {side} hand"));
    let known = |silenced: &dyn Fn(&str) -> bool| {
        let has = |pick: FingerPick, hand: Hand| {
            let of = hand.side(side);
            !lacking.get(&of).is_some_and(|reason| silenced(reason))
                || fingers(of).iter().any(|finger| pick.picks(*finger))
        };
        let said = |channel: ChannelId, hand: Hand| {
            let side = hand.side(side);
            if let Some(side) = absent(side)
                && no_hand.iter().zip(Side::BOTH).any(|(reason, of)| of == side && silenced(reason))
            {
                let is_array = frames.channels.get(channel.0 as usize).is_some_and(|channel| channel.axis.is_some());
                return if is_array { AbstractValue::Empty } else { AbstractValue::FALSE };
            }
            let found = silent.get(&(channel.0, side));
            found.filter(|it| silenced(&it.reason)).map_or(AbstractValue::Unknown, |it| it.value)
        };
        reachable_leaves(graph, scope, said, has)
    };
    let all = reachable_leaves(graph, scope, |_, _| AbstractValue::Unknown, |_, _| true);
    let can = known(&|_| true);
    let absent =
        no_hand.iter().zip(Side::BOTH).filter(|(_, side)| absent(Some(*side)).is_some()).map(|(reason, _)| reason);
    let reasons = silent.values().map(|it| &it.reason).chain(lacking.values()).chain(absent);
    let reasons: BTreeSet<&str> = reasons.map(String::as_str).collect();
    let mut left: BTreeSet<Label> = all.difference(&can).copied().collect();
    let mut cannot = vec![];
    let names = |labels: &BTreeSet<Label>| labels.iter().map(|label| graph.label_name(*label).to_string()).collect();
    for of in &reasons {
        let lost: BTreeSet<Label> = left.difference(&known(&|other| other == *of)).copied().collect();
        if !lost.is_empty() {
            left.retain(|label| !lost.contains(label));
            cannot.push(Undetectable { reason: (*of).to_string(), primitives: names(&lost) });
        }
    }
    // What no single lack explains: as few together as do.
    let mut together: BTreeMap<Vec<&str>, BTreeSet<Label>> = BTreeMap::new();
    for label in left {
        let mut needed: Vec<&str> = reasons.iter().copied().collect();
        for of in &reasons {
            let fewer: Vec<&str> = needed.iter().copied().filter(|other| other != of).collect();
            if !known(&|other| fewer.contains(&other)).contains(&label) {
                needed = fewer;
            }
        }
        together.entry(needed).or_default().insert(label);
    }
    // What stands in the tree, but asks for what the hand model says is never so.
    let never: BTreeSet<Label> = leaves(graph, scope).difference(&all).copied().collect();
    if !never.is_empty() {
        let reason = "the hand model says that nothing measures it".into();
        cannot.push(Undetectable { reason, primitives: names(&never) });
    }
    let several = |(of, labels): (Vec<&str>, BTreeSet<Label>)| Undetectable {
        reason: of.join(" and "),
        primitives: names(&labels),
    };
    cannot.extend(together.into_iter().map(several));
    TrackObservability {
        track: side.map_or(TrackId::Both, TrackId::Hand),
        detectable: names(&can),
        undetectable: cannot,
        relabeled: vec![],
    }
}

/// Adds to tracks the primitives that relabeling can make in them of those that can be detected. The lane of a hand has the labels of its own tree and of that over
/// both hands; the track of both has what rules make of the labels of its tree.
pub fn add_relabeled(rules: &Rules, tracks: &mut [TrackObservability]) {
    let detectable = |track: &TrackObservability| -> BTreeSet<Label> {
        rules.labels().filter(|label| track.detectable.contains(&rules.label_name(*label))).collect()
    };
    let (of_hands, of_both): (Vec<&TrackObservability>, Vec<&TrackObservability>) =
        tracks.iter().partition(|track| track.track.side().is_some());
    let of_both: BTreeSet<Label> = of_both.into_iter().flat_map(detectable).collect();
    let given: BTreeSet<Label> = of_hands.iter().flat_map(|track| detectable(track)).chain(of_both.clone()).collect();
    let mut lanes: Vec<BTreeSet<Label>> =
        of_hands.iter().map(|track| detectable(track).union(&of_both).copied().collect()).collect();
    let mut coordinated = of_both;
    // A rule may need what another one makes.
    loop {
        let mut has_changed = false;
        for rule in &rules.relabels {
            let Some(becomes) = rule.kind.becomes() else { continue };
            for at in 0..lanes.len() {
                if !can_rewrite(&rule.kind, &lanes, at) {
                    continue;
                }
                has_changed |= lanes[at].insert(becomes);
                let is_of_both = !given.contains(&becomes) && has_any(&rule.kind.rewrites(), &coordinated);
                has_changed |= is_of_both && coordinated.insert(becomes);
            }
        }
        if !has_changed {
            break;
        }
    }
    let mut lanes = lanes.into_iter();
    for track in tracks {
        let labels = if track.track.side().is_some() { lanes.next().unwrap_or_default() } else { coordinated.clone() };
        let made = labels.difference(&given).map(|label| rules.label_name(*label));
        let is_lost = |name: &String| track.undetectable.iter().any(|lack| lack.primitives.contains(name));
        track.relabeled = made.filter(|name| !is_lost(name)).collect();
    }
}

/// Whether a rule can change a label in a lane: what it rewrites and what that stands between can be there.
fn can_rewrite(kind: &RelabelKind, lanes: &[BTreeSet<Label>], at: usize) -> bool {
    let Some((lane, becomes)) = lanes.get(at).zip(kind.becomes()) else { return false };
    let rewritten: Labels = { kind.rewrites() }.into_iter().filter(|label| *label != becomes).collect();
    let stands =
        |(before, after): &(Labels, Labels), lane: &BTreeSet<Label>| has_any(before, lane) && has_any(after, lane);
    has_any(&rewritten, lane)
        && match kind {
            RelabelKind::Between { between, .. } => stands(between, lane),
            RelabelKind::BetweenInHands { what, one, other, .. } => {
                let others = { lanes.iter().enumerate() }.filter(|(other, _)| *other != at).map(|(_, lane)| lane);
                let fits = |theirs: &BTreeSet<Label>, [ours, others]: [&(Labels, Labels); 2]| {
                    stands(ours, lane) && stands(others, theirs) && has_any(what, theirs)
                };
                { others }.any(|theirs| fits(theirs, [one, other]) || fits(theirs, [other, one]))
            }
            RelabelKind::Become { .. } => true,
            RelabelKind::Sequence { elements, .. } => {
                elements.iter().all(|(labels, repeat)| *repeat == Repetition::ZeroOrMore || has_any(labels, lane))
            }
            RelabelKind::Separate { .. } => false,
        }
}

/// Whether a lane can have a label that one of the patterns stands for.
fn has_any(patterns: &[Label], lane: &BTreeSet<Label>) -> bool {
    patterns.iter().any(|pattern| lane.iter().any(|label| pattern.covers(*label)))
}

/// What a hand lacks that rules pick of its fingers; of a hand without any finger its channels say so.
fn lacking(fingers: &[Finger]) -> Option<&'static str> {
    let has = |pick: FingerPick| fingers.iter().any(|finger| pick.picks(*finger));
    match fingers {
        [] => None,
        _ if !has(FingerPick::Tips) => Some("has a palm and no fingertips"),
        _ if !has(FingerPick::One(Finger::Thumb)) => Some("has no thumb"),
        _ if !has(FingerPick::Opposing) => Some("has no opposing fingertips with contacts or forces"),
        _ if !has(FingerPick::One(Finger::Palm)) => Some("has no palm"),
        _ => None,
    }
}

/// The labels that stand in the trees.
fn leaves(graph: &Graph, scope: TreeScope) -> BTreeSet<Label> {
    let trees = graph.trees.iter().filter(|tree| tree.scope == scope);
    let targets = trees
        .flat_map(|tree| tree.decision.tests.iter().flat_map(|test| [test.yes, test.no]).chain([tree.decision.root]));
    let label = |target| match target {
        Target::Leaf(Leaf::Primitive(label)) => Some(label),
        _ => None,
    };
    targets.filter_map(label).collect()
}

/// A channel that is missing or constant in a log.
struct SilentChannel {
    /// Why, in words.
    reason: String,
    value: AbstractValue,
    /// Whether the log or its scene lacks what the channel is made of.
    is_lacking: bool,
}

/// Channels of a hand or of none that are missing or constant in a log.
type SilentChannels = BTreeMap<(u32, Option<Side>), SilentChannel>;

/// The channels that are missing or constant in a log.
fn silent(frames: &Frames, contents: &LogContents) -> SilentChannels {
    let mut silent = BTreeMap::new();
    let sides = frames.layout.hands.iter().map(|hand| Some(hand.side)).chain([None]);
    for side in sides {
        for (index, channel) in (0_u32..).zip(&frames.channels) {
            if channel.per_hand != side.is_some() {
                continue;
            }
            let first = ColumnKey { channel: index, side, slot: 0, component: 0 };
            let last = ColumnKey { slot: u32::MAX, component: u32::MAX, ..first };
            let mut columns = frames.columns.range(first..=last).map(|(_, values)| values).peekable();
            if columns.peek().is_none() {
                if let (Some(_), Some((family, _))) = (channel.axis, channel.name.split_once('.')) {
                    let reason = match family {
                        "contacts" => contents.contacts_lack(),
                        _ => format!("the log has no {family}"),
                    };
                    silent
                        .insert((index, side), SilentChannel { reason, value: AbstractValue::Empty, is_lacking: true });
                }
                continue;
            }
            let mut values = columns.flatten().copied();
            let Some(first) = values.next() else { continue };
            // What is measured may stand still by chance; a number that is worked out from the scene does not.
            let fixed = first == 0.0 || channel.absent == Fallback::Derived && channel.shape.components().len() == 1;
            if fixed && values.all(|value| value == first) {
                let lack = contents.lack(channel, side).filter(|_| first == 0.0);
                let is_lacking = lack.is_some();
                let state = if first == 0.0 { "zero" } else { "constant" };
                let reason = lack.unwrap_or_else(|| match (channel.name.as_str(), side) {
                    ("target", Some(side)) => always_one_target(frames, side, first),
                    ("target.fixed", _) if first == 0.0 => "no object is `fixed_to` the hand".into(),
                    ("target.fixed", _) => "the target is always `fixed_to` the hand".into(),
                    (name, Some(side)) if contents.is_set_by_binding(name, side) => {
                        format!("the binding sets `{side}.{name}` to {first}")
                    }
                    (name, _) => format!("`{name}` is {state} in the whole log"),
                });
                let value = AbstractValue::Constant(first);
                silent.insert((index, side), SilentChannel { reason, value, is_lacking });
            }
        }
    }
    silent
}

/// That a hand has one target in the whole log, in words: what it handles never changes.
fn always_one_target(frames: &Frames, side: Side, target: f64) -> String {
    let name = if target < 0.0 { None } else { frames.objects.get(target as usize) };
    match (name, frames.objects.len()) {
        (Some(name), 1) if frames.layout.hands.len() > 1 => {
            format!("`{name}` is the only object, so both hands always have the same target")
        }
        (Some(name), 1) => format!("`{name}` is the only object, so it is always the target"),
        (Some(name), _) => format!("`{name}` is always the target of the {side} hand"),
        (None, _) => format!("the {side} hand has no target"),
    }
}
