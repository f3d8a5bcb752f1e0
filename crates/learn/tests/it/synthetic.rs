//! Synthetic recordings: hands that reach, close a gripper, lift, and put down.

use std::collections::BTreeMap;
use teachtree_base::channels::{Axis, ChannelSpec, Fallback};
use teachtree_base::error::InputError;
use teachtree_base::hands::{Finger, Side, TrackId};
use teachtree_frames::frames::{ColumnKey, Frames, HandLayout, Layout};
use teachtree_learn::{Demonstration, LabeledSpan, LabeledTrack};

pub const RATE_HZ: f64 = 20.0;

/// Numbers from 0 to 1, the same every time.
pub struct SplitMix64(pub u64);

impl SplitMix64 {
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f64 / (1_u64 << 24) as f64
    }

    pub fn below(&mut self, most: usize) -> usize {
        ((self.next() * most as f64) as usize).min(most - 1)
    }
}

/// The signals of a hand.
#[derive(Clone, Default)]
pub struct HandSignals {
    pub height: Vec<f64>,
    pub closed: Vec<bool>,
}

/// A recording of some hands with labels by frame.
#[derive(Clone)]
pub struct Synthetic {
    pub group: usize,
    pub who: TrackId,
    pub hands: BTreeMap<Side, HandSignals>,
    pub labels: Vec<Option<usize>>,
    pub present: Option<Vec<usize>>,
    /// Where the recording has a gap.
    pub gap: Option<usize>,
    /// Whether `gripper.closed` is measured.
    pub has_gripper: bool,
}

impl Synthetic {
    /// A hand that repeats: low and open (0), low and closed (1), high and closed (2).
    pub fn cycles(seed: u64, group: usize) -> Self {
        let mut chance = SplitMix64(seed.wrapping_mul(7919) + 1);
        let mut hand = HandSignals::default();
        let mut labels = Vec::new();
        for _ in 0..6 {
            for (label, height, closed) in [(0, 0.0, false), (1, 0.0, true), (2, 0.08, true)] {
                let frames = 20 + chance.below(40);
                labels.extend(std::iter::repeat_n(Some(label), frames));
                hand.closed.extend(std::iter::repeat_n(closed, frames));
                hand.height.extend((0..frames).map(|_| height + 0.01 * chance.next()));
            }
        }
        let hands = BTreeMap::from([(Side::Right, hand)]);
        Self { group, who: TrackId::Hand(Side::Right), hands, labels, present: None, gap: None, has_gripper: true }
    }

    /// A hand that climbs four stairs; on the upper two (1), the gripper is closed. The heights say the same; those of a person of another
    /// `size` than 1 are that many times as high. Of one cycle of all others, the gripper is not measured.
    pub fn stairs(seed: u64, group: usize, size: f64) -> Self {
        let mut made = Self::cycles(seed, group);
        let mut chance = SplitMix64(seed.wrapping_mul(613) + 11);
        let hand = made.hands.get_mut(&Side::Right).unwrap();
        (hand.height, hand.closed, made.labels) = (Vec::new(), Vec::new(), Vec::new());
        for cycle in 0..6 {
            for (height, label) in [(0.0, 0), (0.03, 0), (0.05, 1), (0.08, 1)] {
                let frames = 30 + chance.below(10);
                let closed = label == 1 && (cycle != 2 || size < 1.0);
                made.labels.extend(std::iter::repeat_n(Some(label), frames));
                hand.closed.extend(std::iter::repeat_n(closed, frames));
                hand.height.extend((0..frames).map(|_| size * height + 0.001 * chance.next()));
            }
        }
        made
    }

    /// A hand that holds; when it picks up, nothing says.
    pub fn of_chance_ends(seed: u64, group: usize) -> Self {
        let mut chance = SplitMix64(seed.wrapping_mul(31) + 5);
        let mut made = Self::cycles(seed, group);
        made.hands.get_mut(&Side::Right).unwrap().height.iter_mut().for_each(|height| *height = 0.01 * chance.next());
        for held in made.labels.chunk_by_mut(|one, other| (*one == Some(0)) == (*other == Some(0))) {
            let end = (held.len() as f64 * (0.1 + 0.8 * chance.next())) as usize;
            if held[0] != Some(0) {
                held[..end].fill(Some(1));
                held[end..].fill(Some(2));
            }
        }
        made
    }

    /// The same of both hands together: each cycle is of a random hand, and the other one rests.
    pub fn of_both(seed: u64, group: usize) -> Self {
        let mut chance = SplitMix64(seed.wrapping_mul(104_729) + 3);
        let mut made = Self { who: TrackId::Both, ..Self::cycles(seed, group) };
        let one = made.hands.remove(&Side::Right).unwrap();
        let (mut left, mut right) = (HandSignals::default(), HandSignals::default());
        let mut is_left = false;
        for (at, label) in made.labels.iter().enumerate() {
            if *label == Some(0) && (at == 0 || made.labels[at - 1] != Some(0)) {
                is_left = chance.next() < 0.5;
            }
            let (active, resting) = if is_left { (&mut left, &mut right) } else { (&mut right, &mut left) };
            active.height.push(one.height[at]);
            active.closed.push(one.closed[at]);
            resting.height.push(0.02 + 0.001 * chance.next());
            resting.closed.push(false);
        }
        made.hands = BTreeMap::from([(Side::Left, left), (Side::Right, right)]);
        made
    }

    /// A hand with labels that have nothing to do with its signals, and gaps.
    pub fn of_noise_of_one_hand(seed: u64, group: usize) -> Self {
        Self::cycles(seed, group).with_noise(seed)
    }

    /// The same of both hands together.
    pub fn of_noise_of_both(seed: u64, group: usize) -> Self {
        Self::of_both(seed, group).with_noise(seed)
    }

    fn with_noise(self, seed: u64) -> Self {
        let mut chance = SplitMix64(seed + 17);
        let mut made = self;
        let len = made.labels.len();
        made.labels.clear();
        while made.labels.len() < len {
            let label = (chance.next() < 0.8).then(|| chance.below(3));
            made.labels.extend(std::iter::repeat_n(label, 1 + chance.below(50)));
        }
        made.labels.truncate(len);
        made.gap = (chance.next() < 0.5).then(|| 1 + chance.below(len - 1));
        made
    }

    pub fn frames(&self, channels: &[ChannelSpec]) -> Frames {
        let fingers = vec![Finger::Thumb, Finger::Index];
        let hand = |side: &Side| HandLayout {
            side: *side,
            fingers: fingers.clone(),
            contacts: Vec::new(),
            knows_distance: false,
        };
        let layout = Layout { rate_hz: RATE_HZ, hands: self.hands.keys().map(hand).collect() };
        let len = self.labels.len();
        let mut columns = BTreeMap::new();
        for (spec, channel) in channels.iter().zip(0..) {
            let sides: Vec<Option<&Side>> =
                if spec.per_hand { self.hands.keys().map(Some).collect() } else { vec![None] };
            let slots: u32 = match spec.axis {
                None => 1,
                Some(Axis::Fingers) => 2,
                Some(Axis::Contacts) => 0,
            };
            for side in sides {
                for (slot, component) in
                    (0..slots).flat_map(|slot| (0..spec.shape.components().len() as u32).map(move |c| (slot, c)))
                {
                    let signals = side.map(|side| &self.hands[side]);
                    let values = match (spec.name.as_str(), component, signals) {
                        ("fingers.position", 2, Some(hand)) => hand.height.clone(),
                        ("gripper.closed", _, Some(hand)) if self.has_gripper => {
                            hand.closed.iter().map(|c| f64::from(u8::from(*c))).collect()
                        }
                        _ => vec![0.0; len],
                    };
                    columns.insert(ColumnKey { channel, side: side.copied(), slot, component }, values);
                }
            }
        }
        let bounds = self.gap.map_or_else(|| vec![0, len], |gap| vec![0, gap, len]);
        let stretches = bounds.windows(2).map(|pair| pair[0]..pair[1]).collect();
        let time = (0..len).map(|frame| frame as f64 / RATE_HZ).collect();
        Frames { layout, channels: channels.to_vec(), columns, len, time, stretches, ..Frames::default() }
    }

    pub fn demonstration(&self) -> Demonstration<'_> {
        let spans = |labels: &[Option<usize>]| {
            let mut spans: Vec<LabeledSpan> = Vec::new();
            for (frame, label) in labels.iter().enumerate() {
                let (start_s, end_s) = (frame as f64 / RATE_HZ, (frame + 1) as f64 / RATE_HZ);
                let Some(label) = *label else { continue };
                match spans.last_mut() {
                    Some(last) if last.label == label && (last.end_s - start_s).abs() < 1e-9 => last.end_s = end_s,
                    _ => spans.push(LabeledSpan { label, start_s, end_s }),
                }
            }
            spans
        };
        let present = self.present.as_ref().map(|labels| {
            let labels: Vec<Option<usize>> = labels.iter().copied().map(Some).collect();
            spans(&labels)
        });
        Demonstration {
            name: format!("recording of group {}", self.group),
            group: self.group,
            hands: self.hands.keys().copied().collect(),
            frames: Box::new(|channels| match channels.iter().find(|channel| reads_contacts(channel)) {
                // As a log of positions alone is refused by rules that read contacts.
                Some(_) if self.who == TrackId::Both => Err(InputError::new("a log", "has no `fingers.contact`")),
                None if !self.has_gripper && channels.iter().any(|channel| channel.name == "gripper.closed") => {
                    Err(InputError::new("a log", "has no `gripper.closed`"))
                }
                _ => Ok(self.frames(channels)),
            }),
            tracks: vec![LabeledTrack { who: self.who, spans: spans(&self.labels), present, refitted: None }],
        }
    }
}

/// Whether rules read the contacts of fingers.
fn reads_contacts(channel: &ChannelSpec) -> bool {
    channel.name == "fingers.contact" && matches!(channel.absent, Fallback::NormAbove { needed: true, .. })
}
