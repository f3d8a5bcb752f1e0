//! The bank: for every condition of the vocabulary the frames of all recordings on which it holds, as bits. The engine evaluates the conditions, so they mean
//! what they mean in a rule file.

use super::objective::{Span, Truth};
use super::quantities::{Declarations, Family, Number, Sensors, Source, families, has_other, numbers, spelled};
use super::{Demonstration, LabeledSpan};
use rayon::prelude::*;
use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::ops::Range;
use teachtree_base::error::{ErrorKind, InputError};
use teachtree_base::hands::{Side, TrackId};
use teachtree_engine::inspect::Inspector;
use teachtree_engine::runs::{Leaves, Run, append};
use teachtree_language::rules::{Expr, Label, PrimitiveId};
use teachtree_language::{Request, Rules, load};

/// Thresholds of a number, at most.
const THRESHOLDS: usize = 10;
/// Intervals between the quantiles of its values on labeled frames, from which thresholds are chosen.
const QUANTILES: usize = 60;
/// How far thresholds are apart, of the range of the quantiles. Otherwise most thresholds of a hand that mostly rests would be noise.
const SPACING: f64 = 0.03;
/// The outermost quantiles.
const OUTER: f64 = 0.04;
/// Values of a number that are kept of a track for quantiles, at most.
const SAMPLES: usize = 4000;
/// The most memory that bits of conditions may take, bytes.
const MOST_BYTES: usize = 1 << 30;

/// A condition of the vocabulary.
#[derive(Clone, Debug)]
pub(crate) struct Atom {
    /// As it is written in a declaration of a hand.
    pub text: String,
    /// Atoms of one family differ in a threshold or duration only, and are in its order.
    pub family: usize,
}

/// A gap-free stretch of a track with labels.
#[derive(Clone, Debug)]
pub(crate) struct Track {
    pub group: usize,
    /// The words of the bank with its frames.
    pub words: Range<usize>,
    pub frames: usize,
    pub rate_hz: f64,
    pub truth: Truth,
    /// The result of the present rules.
    pub present: Option<Vec<Run>>,
    /// The same with fitted params.
    pub refitted: Option<Vec<Run>>,
}

/// Atoms and tracks.
#[derive(Clone, Debug)]
pub(crate) struct Bank {
    pub atoms: Vec<Atom>,
    pub tracks: Vec<Track>,
    /// How many hands a condition is asked of: both of a track of both hands.
    pub slots: usize,
    pub words: usize,
    pub labels: usize,
    rows: Vec<Vec<u64>>,
}

impl Bank {
    /// The bits of an atom for a hand; those after the end of a track are zero.
    pub fn row(&self, atom: usize, slot: usize) -> &[u64] {
        &self.rows[atom * self.slots + slot]
    }

    /// Whether an atom has these bits; `known` has the atoms by the digest of their bits. If none has, the next atom is known by them.
    fn has(&self, rows: &[Vec<u64>], known: &mut HashMap<u64, Vec<usize>>) -> bool {
        let mut digest = DefaultHasher::new();
        rows.hash(&mut digest);
        let alike = known.entry(digest.finish()).or_default();
        let has_rows = |atom: &usize| (0..self.slots).all(|slot| self.row(*atom, slot) == rows[slot]);
        let is_known = alike.iter().any(has_rows);
        alike.extend((!is_known).then_some(self.atoms.len()));
        is_known
    }

    /// Evaluates the vocabulary on all recordings.
    ///
    /// # Errors
    /// When a recording cannot be evaluated, or all of them are too long.
    pub fn new(demonstrations: &[Demonstration], labels: usize, both: bool) -> Result<Self, InputError> {
        let two_hands = demonstrations.iter().all(|demonstration| demonstration.hands.len() > 1);
        let slots = if both { 2 } else { 1 };
        let vocabulary = Vocabulary::new(demonstrations, two_hands, slots)?;
        let own: Vec<Vec<TrackBits>> =
            demonstrations.par_iter().map(|one| vocabulary.track_bits(one)).collect::<Result<_, _>>()?;
        let mut bank = Self { atoms: Vec::new(), tracks: Vec::new(), slots, words: 0, labels, rows: Vec::new() };
        let mut all: Vec<TrackBits> = own.into_iter().flatten().collect();
        for one in &mut all {
            let words = one.track.frames.div_ceil(64);
            one.track.words = bank.words..bank.words + words;
            bank.words += words;
        }
        let mut known: HashMap<u64, Vec<usize>> = HashMap::new();
        for (family, other, conditions) in vocabulary.by_family() {
            for at in conditions {
                let row = |slot: usize| -> Vec<u64> {
                    all.iter().flat_map(|one| one.row(at, slot, other).iter().copied()).collect()
                };
                let rows: Vec<Vec<u64>> = (0..slots).map(row).collect();
                let is_constant =
                    |full: bool| all.iter().all(|one| (0..slots).all(|slot| one.is_constant(at, slot, other, full)));
                if !is_constant(false) && !is_constant(true) && !bank.has(&rows, &mut known) {
                    let text = spelled(&vocabulary.conditions[at].0, other, &vocabulary.conditions[at].1);
                    bank.atoms.push(Atom { text, family: 2 * family + usize::from(other) });
                    bank.rows.extend(rows);
                }
            }
        }
        bank.tracks = all.into_iter().map(|one| one.track).collect();
        Ok(bank)
    }
}

/// The bits of a track: for each condition those of the left and the right hand, or of the only hand.
struct TrackBits {
    track: Track,
    /// The hands in which a condition is asked: their positions in `bits`.
    asked: Vec<usize>,
    hands: usize,
    bits: Vec<Vec<u64>>,
}

impl TrackBits {
    fn row(&self, condition: usize, slot: usize, other: bool) -> &[u64] {
        let hand = self.asked[slot];
        let hand = if other { self.hands - 1 - hand } else { hand };
        &self.bits[condition * self.hands + hand]
    }

    fn is_constant(&self, condition: usize, slot: usize, other: bool, full: bool) -> bool {
        let ones: usize = self.row(condition, slot, other).iter().map(|word| word.count_ones() as usize).sum();
        ones == if full { self.track.frames } else { 0 }
    }
}

/// The conditions with the thresholds that suit the recordings.
struct Vocabulary {
    rules: Rules,
    families: Vec<Family>,
    /// Template and step of each condition.
    conditions: Vec<(String, String)>,
    /// The conditions of each family.
    of_family: Vec<Range<usize>>,
    two_hands: bool,
    both: bool,
}

impl Vocabulary {
    fn new(demonstrations: &[Demonstration], two_hands: bool, slots: usize) -> Result<Self, InputError> {
        let mut measured = Sensors { two_hands, sources: vec![Source::Hand] };
        for source in Source::OPTIONAL {
            let channels = loaded(&source.declarations().text(std::iter::empty()))?.channels;
            let is_measured = |one: &Demonstration| {
                (one.frames)(&channels).is_ok_and(|frames| source != Source::Objects || !frames.objects.is_empty())
            };
            measured.sources.extend(demonstrations.par_iter().all(is_measured).then_some(source));
        }
        let declarations = Declarations::all(&measured);
        let numbers = numbers(&measured);
        let signal = |(at, text): (usize, String)| format!("signal atom_{at} = {text}");
        let texts = numbers.iter().map(|number| spelled(&number.template, false, ""));
        let rules = loaded(&declarations.text(texts.enumerate().map(signal)))?;
        let sampled: Vec<Samples> =
            demonstrations.par_iter().map(|one| sampled(&rules, &numbers, one)).collect::<Result<_, _>>()?;
        let thresholds: Vec<Vec<f64>> = numbers
            .iter()
            .enumerate()
            .map(|(at, number)| thresholds(sampled.iter().flat_map(|one| &one.values[at]).copied(), number))
            .collect();
        let families = families(&numbers, &measured);
        let (mut conditions, mut of_family) = (Vec::new(), Vec::new());
        for family in &families {
            let start = conditions.len();
            let steps = family.steps.texts(&numbers, &thresholds);
            conditions.extend(steps.into_iter().map(|step| (family.template.clone(), step)));
            of_family.push(start..conditions.len());
        }
        let frames: usize = sampled.iter().map(|one| one.frames).sum();
        let rows = conditions.len() * if two_hands { 4 } else { 1 };
        let bytes = rows.saturating_mul(frames / 8);
        if bytes > MOST_BYTES {
            let message = format!("{frames} frames of {} conditions need {} MB", conditions.len(), bytes >> 20);
            return Err(InputError::new("the recordings", format!("{message}, expected at most {}", MOST_BYTES >> 20))
                .help("leave recordings out, or bind them at a lower rate: `resample: 20 Hz`"));
        }
        let texts = conditions.iter().map(|(template, step)| spelled(template, false, step));
        let rules = loaded(&declarations.text(texts.enumerate().map(signal)))?;
        Ok(Self { rules, families, conditions, of_family, two_hands, both: slots > 1 })
    }

    /// Families in the order of preference: those of the hand itself before those of the other one.
    fn by_family(&self) -> impl Iterator<Item = (usize, bool, Range<usize>)> {
        let roles: &[bool] = if self.two_hands { &[false, true] } else { &[false] };
        let all =
            roles.iter().flat_map(|other| self.families.iter().zip(0..).map(move |(family, at)| (family, at, *other)));
        all.filter(|(family, _, other)| !other || has_other(&family.template))
            .map(|(_, at, other)| (at, other, self.of_family[at].clone()))
    }

    fn track_bits(&self, demonstration: &Demonstration) -> Result<Vec<TrackBits>, InputError> {
        let frames = (demonstration.frames)(&self.rules.channels)?;
        let hands: Vec<Side> = frames.layout.hands.iter().map(|hand| hand.side).collect();
        let asked = asked(&self.rules, self.conditions.len(), &hands)?;
        let mut found = Vec::new();
        for stretch in &frames.stretches {
            let time = frames.time.get(stretch.clone()).unwrap_or(&[]);
            let spans = |found: &[LabeledSpan]| spans(found, time, frames.layout.rate_hz);
            let tracks: Vec<(&super::LabeledTrack, Truth)> = demonstration
                .tracks
                .iter()
                .map(|track| (track, Truth::new(spans(&track.spans))))
                .filter(|(_, truth)| !truth.spans.is_empty())
                .collect();
            if tracks.is_empty() {
                continue;
            }
            let leaves = Leaves { frames: stretch.clone(), ..Leaves::default() };
            let columns = Inspector::new(&self.rules, &frames, &leaves).truths(&asked)?;
            let bits: Vec<Vec<u64>> = columns.iter().map(|column| column.words(0, stretch.len())).collect();
            for (track, truth) in tracks {
                let sides = match track.who {
                    TrackId::Both if self.both => Side::BOTH.to_vec(),
                    TrackId::Both => hands.clone(),
                    TrackId::Hand(side) => vec![side],
                };
                let positions = sides.iter().map(|side| hands.iter().position(|hand| hand == side));
                let positions: Option<Vec<usize>> = positions.collect();
                let asked =
                    positions.ok_or_else(|| lacks_hand(&demonstration.name, &demonstration.hands, track.who))?;
                let of_stretch = |found: Option<&Vec<LabeledSpan>>| found.map(|it| runs(&spans(it), stretch.len()));
                let (present, refitted) = (of_stretch(track.present.as_ref()), of_stretch(track.refitted.as_ref()));
                let (group, rate_hz) = (demonstration.group, frames.layout.rate_hz);
                let track = Track { group, words: 0..0, frames: stretch.len(), rate_hz, truth, present, refitted };
                found.push(TrackBits { track, asked, hands: hands.len(), bits: bits.clone() });
            }
        }
        Ok(found)
    }
}

pub(crate) fn lacks_hand(recording: &str, hands: &[Side], who: TrackId) -> InputError {
    let hands: Vec<&str> = hands.iter().map(|side| side.name()).collect();
    let message = format!("has labels of the track `{who}`, and the recording measures {}", hands.join(" and "));
    InputError::new(recording, message).help("name another track with --track, or bind the columns of that hand")
}

/// The expressions of the numbered signals for each hand.
fn asked<'r>(rules: &'r Rules, count: usize, hands: &[Side]) -> Result<Vec<(&'r Expr, Option<Side>)>, InputError> {
    let first = rules.signals.iter().position(|signal| signal.name == "atom_0").unwrap_or(rules.signals.len());
    let signals = rules.signals.get(first..first + count);
    let signals = signals.filter(|signals| signals.iter().zip(0..).all(|(it, at)| it.name == format!("atom_{at}")));
    let signals = signals.ok_or_else(|| internal("a condition is not a signal".into()))?;
    Ok(signals.iter().flat_map(|signal| hands.iter().map(|side| (&signal.expr, Some(*side)))).collect())
}

fn internal(message: String) -> InputError {
    InputError::new("teachtree learn", message).or_kind(ErrorKind::Internal)
}

fn loaded(text: &str) -> Result<Rules, InputError> {
    let loaded = load(&Request { texts: vec![("conditions".into(), text.into())], ..Request::default() });
    let why = || loaded.diagnostics.first().map_or_else(String::new, |found| found.message.clone());
    loaded.rules.clone().ok_or_else(|| internal(format!("the conditions do not compile: {}", why())))
}

/// The values of numbers on labeled frames of a recording.
struct Samples {
    values: Vec<Vec<f64>>,
    frames: usize,
}

fn sampled(rules: &Rules, numbers: &[Number], demonstration: &Demonstration) -> Result<Samples, InputError> {
    let frames = (demonstration.frames)(&rules.channels)?;
    let hands: Vec<Side> = frames.layout.hands.iter().map(|hand| hand.side).collect();
    let asked = asked(rules, numbers.len(), &hands)?;
    let mut sampled = Samples { values: vec![Vec::new(); numbers.len()], frames: frames.len };
    for stretch in &frames.stretches {
        for track in &demonstration.tracks {
            let time = frames.time.get(stretch.clone()).unwrap_or(&[]);
            let spans = spans(&track.spans, time, frames.layout.rate_hz);
            let labeled: usize = spans.iter().map(|span| span.end - span.start).sum();
            if labeled == 0 {
                continue;
            }
            let leaves = Leaves { frames: stretch.clone(), ..Leaves::default() };
            let columns = Inspector::new(rules, &frames, &leaves).columns(&asked)?;
            let chosen = || {
                let all = spans.iter().flat_map(|span| span.start..span.end);
                all.step_by(labeled.div_ceil(SAMPLES))
            };
            for (column, (at, side)) in
                columns.iter().zip((0..numbers.len()).flat_map(|at| hands.iter().map(move |side| (at, *side))))
            {
                if track.who.side().is_none_or(|own| own == side) {
                    sampled.values[at].extend(chosen().map(|frame| column.number(0, frame)));
                }
            }
        }
    }
    Ok(sampled)
}

/// Quantiles of the values that are apart, rounded to two digits in the unit of the number; none of a number that does not change.
fn thresholds(values: impl Iterator<Item = f64>, number: &Number) -> Vec<f64> {
    let mut values: Vec<f64> = values.filter(|value| value.is_finite()).collect();
    values.sort_by(f64::total_cmp);
    let (Some(first), Some(last)) = (values.first(), values.last()) else { return Vec::new() };
    if first == last {
        return Vec::new();
    }
    let quantile = |at: usize| {
        let part = OUTER + (1.0 - 2.0 * OUTER) * at as f64 / QUANTILES as f64;
        values[(part * (values.len() - 1) as f64).round() as usize]
    };
    let least = SPACING * (quantile(QUANTILES) - quantile(0));
    let mut all: Vec<f64> = (0..=QUANTILES).map(quantile).collect();
    // Of values near each other the greatest one: that of noise is above the noise.
    all.sort_by(|one, other| other.abs().total_cmp(&one.abs()));
    let mut apart: Vec<f64> = Vec::new();
    for value in all {
        if apart.iter().all(|other| (other - value).abs() >= least) {
            apart.push(value);
        }
    }
    apart.sort_by(f64::total_cmp);
    let count = apart.len().min(THRESHOLDS);
    let chosen = (0..count).map(|at| apart[at * (apart.len() - 1) / (count - 1).max(1)]);
    let mut found: Vec<f64> = chosen.filter_map(|value| rounded(value * number.unit.per_si)).collect();
    found.dedup();
    found
}

/// A number to two digits, as people write it; `None` where that needs a power of ten.
pub(crate) fn rounded(value: f64) -> Option<f64> {
    let value: f64 = format!("{value:.1e}").parse().ok()?;
    // Zero has no sign.
    (value == 0.0 || (1e-4..1e7).contains(&value.abs())).then_some(value + 0.0)
}

/// Spans of time as frames of a stretch, counted from its beginning: those whose middle they contain. `time` has the times of the frames, s.
pub(crate) fn spans(spans: &[LabeledSpan], time: &[f64], rate_hz: f64) -> Vec<Span> {
    let half = 0.5 / rate_hz;
    let frame = |at_s: f64| time.partition_point(|time| time + half < at_s);
    let mut found: Vec<Span> = spans
        .iter()
        .map(|span| Span { start: frame(span.start_s), end: frame(span.end_s), label: span.label })
        .filter(|span| span.start < span.end)
        .collect();
    found.sort_by_key(|span| span.start);
    found
}

/// Spans as runs that leave no frame out.
pub(crate) fn runs(spans: &[Span], frames: usize) -> Vec<Run> {
    let mut runs = Vec::new();
    let mut end = 0;
    for span in spans {
        append(&mut runs, Run { start: end, end: span.start.max(end), label: None });
        append(&mut runs, Run { start: span.start.max(end), end: span.end.max(end), label: Some(label(span.label)) });
        end = span.end.max(end);
    }
    append(&mut runs, Run { start: end, end: frames.max(end), label: None });
    runs
}

/// The label at a position of the list as the engine has it.
pub(crate) fn label(at: usize) -> Label {
    Label { primitive: PrimitiveId(u32::try_from(at).unwrap_or(u32::MAX)), side: None }
}
