//! Random logs, with random rule sets for them.

mod rule_generator;

use crate::numbers::Random;
use rule_generator::RuleGenerator;
use std::collections::BTreeMap;
use teachtree_base::channels::{Axis, ChannelSpec, DISTANCE_KNOWN, Fallback, Shape};
use teachtree_base::hands::{Finger, Side};
use teachtree_base::units::Dimension;
use teachtree_frames::frames::{ColumnKey, Frames, HandLayout, Layout};
use teachtree_language::rules::Rules;

/// A rule set and a log from a seed; `depth` bounds expressions and branches.
pub fn case(seed: u64, depth: u32) -> (Rules, Frames) {
    let mut random = Random::new(seed);
    let channels = channels();
    let frames = frames(&mut random, &channels);
    let rules = Rules { channels, ..Rules::default() };
    let rules = RuleGenerator { random, rules, depth, compared: None, unit: 1.0, more: 0.0 }.make();
    (rules, frames)
}

/// The same with numbers that need rounding, in columns as in rules; counts are compared with what is nearly a whole number.
pub fn case_of_rough_numbers(seed: u64, depth: u32) -> (Rules, Frames) {
    const UNIT: f64 = 0.3;
    let mut random = Random::new(seed);
    let channels = channels();
    let mut frames = frames(&mut random, &channels);
    for (key, column) in &mut frames.columns {
        if matches!(channels[key.channel as usize].shape, Shape::Scalar | Shape::Vec3) {
            column.iter_mut().for_each(|value| *value *= UNIT);
        }
    }
    let rules = Rules { channels, ..Rules::default() };
    let rules = RuleGenerator { random, rules, depth, compared: None, unit: UNIT, more: 1e-9 }.make();
    (rules, frames)
}

/// The same with conditions that have to do with each other: the same few numbers are compared again and again.
pub fn case_of_few_numbers(seed: u64, depth: u32) -> (Rules, Frames) {
    let mut random = Random::new(seed);
    let channels = channels();
    let frames = frames(&mut random, &channels);
    let compared = Some(Vec::new());
    let rules = Rules { channels, ..Rules::default() };
    let rules = RuleGenerator { random, rules, depth, compared, unit: 1.0, more: 0.0 }.make();
    (rules, frames)
}

fn channels() -> Vec<ChannelSpec> {
    let spec = |name: &str, per_hand, axis, shape| ChannelSpec {
        name: name.into(),
        per_hand,
        axis,
        shape,
        dimension: Dimension::NONE,
        absent: Fallback::Refused,
    };
    vec![
        spec("fingers.position", true, Some(Axis::Fingers), Shape::Vec3),
        spec("fingers.force", true, Some(Axis::Fingers), Shape::Vec3),
        spec("fingers.contact", true, Some(Axis::Fingers), Shape::Bool),
        spec("target", true, None, Shape::Object),
        spec("target.velocity", true, None, Shape::Vec3),
        spec("target.rotation", true, None, Shape::Rotation),
        spec("target.depth", true, None, Shape::Scalar),
        spec("contacts.force", true, Some(Axis::Contacts), Shape::Vec3),
        spec("contacts.handled", true, Some(Axis::Contacts), Shape::Bool),
        spec("load", true, None, Shape::Scalar),
        spec("target.over_socket", true, None, Shape::Bool),
        spec("closing", false, None, Shape::Scalar),
        spec("targets.contact", false, None, Shape::Bool),
        spec(DISTANCE_KNOWN, true, None, Shape::Bool),
    ]
}

fn frames(random: &mut Random, channels: &[ChannelSpec]) -> Frames {
    let most = if random.chance(2) { 1200 } else { 150 };
    let len = 20 + random.below(most);
    let mut layout = Layout { rate_hz: 100.0, hands: Vec::new() };
    let which = random.below(3);
    for side in Side::BOTH.into_iter().filter(|side| which == 2 || side.index() == which) {
        let fingers: Vec<Finger> = Finger::ALL.into_iter().filter(|_| random.chance(50)).collect();
        let contacts = (0..random.below(3)).map(|at| format!("body{at}")).collect();
        let knows_distance = fingers.len().is_multiple_of(2);
        layout.hands.push(HandLayout { side, fingers, contacts, knows_distance });
    }
    let mut columns = BTreeMap::new();
    for (spec, channel) in channels.iter().zip(0..) {
        let whose: Vec<(Option<Side>, usize)> = if spec.per_hand {
            let slots = |hand: &HandLayout| match spec.axis {
                None => 1,
                Some(Axis::Fingers) => hand.fingers.len(),
                Some(Axis::Contacts) => hand.contacts.len(),
            };
            layout.hands.iter().map(|hand| (Some(hand.side), slots(hand))).collect()
        } else {
            vec![(None, 1)]
        };
        for (side, slots) in whose {
            for (slot, component) in
                (0..slots).flat_map(|slot| (0..spec.shape.components().len()).map(move |c| (slot, c)))
            {
                let key = ColumnKey { channel, side, slot: slot as u32, component: component as u32 };
                let known = side.and_then(|side| layout.hand(side)).is_some_and(|hand| hand.knows_distance);
                if spec.name == DISTANCE_KNOWN {
                    columns.insert(key, vec![f64::from(u8::from(known)); len]);
                    continue;
                }
                let values = column(random, spec.shape, len);
                // Half of the columns are as a sensor of 32 bits gives them.
                let of_sensor = |value: &f64| f64::from(*value as f32);
                columns.insert(key, if random.chance(50) { values.iter().map(of_sensor).collect() } else { values });
            }
        }
    }
    let mut stretches = Vec::new();
    let mut start = 0;
    while start < len {
        let end = if random.chance(60) { len } else { (start + 1 + random.below(60)).min(len) };
        stretches.push(start..end);
        start = end;
    }
    let time = (0..len).map(|frame| frame as f64 / 100.0).collect();
    let channels = channels.to_vec();
    let objects = vec!["one".into(), "two".into()];
    Frames { layout, channels, columns, len, time, stretches, objects, ..Frames::default() }
}

/// Values that stand for a while and then jump, so that every operator sees quiet and restless stretches.
fn column(random: &mut Random, shape: Shape, len: usize) -> Vec<f64> {
    let restless = 2 + random.below(40);
    let mut value = 0.0;
    (0..len)
        .map(|frame| {
            if frame == 0 || random.below(restless) == 0 {
                value = match shape {
                    Shape::Bool => random.below(2) as f64,
                    Shape::Object => random.below(3) as f64 - 1.0,
                    _ => (random.below(9) as f64 - 4.0) * 0.5,
                };
            }
            value
        })
        .collect()
}
