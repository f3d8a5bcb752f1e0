//! The signals of the paper's Figure 5: frames in, curves in the units that people read out (docs/sources.md, C23 to C25).

use teachtree_analysis as analysis;
use teachtree_base::channels::{Axis, ChannelSpec, DerivedChannel, Fallback, Shape, derived};
use teachtree_base::hands::{Finger, Side};
use teachtree_base::units::Dimension;
use teachtree_frames::frames::{ColumnKey, Frames};
use teachtree_language::rules::Rules;

/// The channels that the report draws.
pub const CHANNELS: &[&str] = &[
    "fingers.position",
    "fingers.force",
    "target",
    "target.position",
    "target.velocity",
    "contacts.force",
    "contacts.normal",
];

/// A contact whose normal points at least this much up carries (45°; docs/sources.md, A3).
const CARRIES: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// The channels to make frames with, so that they serve the rules, the tasks and the report: those of the rules first, in their order.
///
/// A raw channel that no rule reads is not required: where a log lacks it, its column is not a number, and the report says so.
pub fn channels(rules: &Rules) -> Vec<ChannelSpec> {
    let mut channels = analysis::channels(rules);
    for name in CHANNELS {
        if !channels.iter().any(|channel| channel.name == *name) {
            channels.push(derived(name).map_or_else(|| of_fingers(name), DerivedChannel::spec));
        }
    }
    channels
}

fn of_fingers(name: &str) -> ChannelSpec {
    ChannelSpec {
        name: name.into(),
        per_hand: true,
        axis: Some(Axis::Fingers),
        shape: Shape::Vec3,
        dimension: if name.ends_with("force") { Dimension::FORCE } else { Dimension::LENGTH },
        absent: Fallback::Constant(f64::NAN),
    }
}

/// Curves that share an axis.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Panel {
    /// What is drawn.
    pub title: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// The least length of the axis, so that noise about zero is not blown up.
    pub least: f64,
    /// The curves, or what the recording lacks for them.
    pub curves: Result<Vec<Curve>, &'static str>,
}

/// A value for each frame; NaN for a missing value.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Curve {
    /// Its name, when the panel has several.
    pub name: &'static str,
    /// The values.
    pub values: Vec<f64>,
}

/// The contacts of one finger.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Touch {
    /// The name of the finger.
    pub finger: &'static str,
    /// For each frame whether it touches.
    pub touches: Vec<bool>,
}

/// The columns of one hand.
pub(super) struct Signals<'a> {
    frames: &'a Frames,
    side: Side,
}

/// Three columns.
type Vector<'a> = [&'a [f64]; 3];

impl<'a> Signals<'a> {
    /// The signals of a hand.
    pub fn new(frames: &'a Frames, side: Side) -> Self {
        Self { frames, side }
    }

    /// The panels, from top to bottom.
    pub fn panels(&self) -> Vec<Panel> {
        let panel = |title, unit, least, curves| Panel { title, unit, least, curves };
        vec![
            panel("|P̄| hand to target", "mm", 20.0, self.distance().ok_or("fingers.position and target.position")),
            panel("F·up of the hand", "N", 0.5, self.force(|[_, _, z]| z).ok_or("fingers.force")),
            panel("|F| of the hand", "N", 0.5, self.force(norm).ok_or("fingers.force")),
            panel("speed of the target", "mm/s", 20.0, self.speed().ok_or("target.velocity")),
            panel("contacts of the target", "N", 0.5, self.contacts().ok_or("contacts.force and contacts.normal")),
        ]
    }

    /// The contacts of each finger; empty if no rule reads them.
    pub fn touches(&self) -> Vec<Touch> {
        let Some(hand) = self.frames.layout.hand(self.side) else { return Vec::new() };
        let touch = |(slot, finger): (u32, &Finger)| {
            let touches = self.column("fingers.contact", slot, 0)?.iter().map(|touches| *touches > 0.5).collect();
            Some(Touch { finger: finger.name(), touches })
        };
        (0..).zip(&hand.fingers).filter_map(touch).collect()
    }

    /// The distance between the mean of the fingertips and the origin of the target.
    fn distance(&self) -> Option<Vec<Curve>> {
        let tips = self.slots("fingers.position");
        let target = self.vector("target.position", 0)?;
        let known = self.column("target", 0, 0);
        one(self.curve(|frame| {
            if known.is_some_and(|target| target.get(frame).is_some_and(|target| *target < 0.0)) {
                return f64::NAN;
            }
            let measured = tips.iter().map(|tip| at(*tip, frame)).filter(|tip| tip.iter().all(|part| part.is_finite()));
            let (sum, count) = measured.fold(([0.0; 3], 0.0), |(sum, count), tip| (add(sum, tip), count + 1.0));
            let target = at(target, frame);
            norm(std::array::from_fn(|axis| sum[axis] / count - target[axis])) * 1e3
        }))
    }

    /// The sum of the forces of the fingertips on the object.
    fn force(&self, of: impl Fn([f64; 3]) -> f64) -> Option<Vec<Curve>> {
        let forces = self.slots("fingers.force");
        one(self.curve(|frame| match forces.is_empty() {
            true => f64::NAN,
            false => of(forces.iter().map(|force| at(*force, frame)).fold([0.0; 3], add)),
        }))
    }

    fn speed(&self) -> Option<Vec<Curve>> {
        let velocity = self.vector("target.velocity", 0)?;
        one(self.curve(|frame| norm(at(velocity, frame)) * 1e3))
    }

    /// The forces of what carries the target and of what stands beside it.
    fn contacts(&self) -> Option<Vec<Curve>> {
        let forces = self.slots("contacts.force");
        let normals = self.slots("contacts.normal");
        let sum = |carrying: bool| {
            self.curve(|frame| {
                let pairs = forces.iter().zip(&normals);
                let those = pairs.filter(|(_, normal)| (at(**normal, frame)[2] > CARRIES) == carrying);
                those.map(|(force, _)| norm(at(*force, frame))).sum()
            })
        };
        let curves = vec![Curve { name: "support", values: sum(true) }, Curve { name: "wall", values: sum(false) }];
        (!forces.is_empty() && forces.len() == normals.len()).then_some(curves)
    }

    fn curve(&self, value: impl Fn(usize) -> f64) -> Vec<f64> {
        (0..self.frames.len).map(value).collect()
    }

    fn column(&self, name: &str, slot: u32, component: u32) -> Option<&'a [f64]> {
        let channel = self.frames.channel(name)?;
        self.frames.column(ColumnKey { channel, side: Some(self.side), slot, component })
    }

    fn vector(&self, name: &str, slot: u32) -> Option<Vector<'a>> {
        Some([self.column(name, slot, 0)?, self.column(name, slot, 1)?, self.column(name, slot, 2)?])
    }

    fn slots(&self, name: &str) -> Vec<Vector<'a>> {
        (0..).map_while(|slot| self.vector(name, slot)).collect()
    }
}

/// The quantities of the paper's Figure 14: pushing and carrying forces of each hand, and the number of its fingers in contact, on one axis.
pub(super) fn of_both(frames: &Frames) -> Vec<Panel> {
    let force = |of: fn([f64; 3]) -> f64| {
        let curve = |side: Side| {
            let curve = Signals::new(frames, side).force(of)?.pop()?;
            Some(Curve { name: side.name(), ..curve })
        };
        Side::BOTH.into_iter().map(curve).collect::<Option<Vec<Curve>>>().ok_or("fingers.force")
    };
    let fingers = |side: Side| {
        let touches = Signals::new(frames, side).touches();
        let count = |frame| touches.iter().filter(|finger| finger.touches.get(frame) == Some(&true)).count() as f64;
        Curve { name: side.name(), values: (0..frames.len).map(count).collect() }
    };
    let touching = Side::BOTH.into_iter().map(fingers).collect();
    vec![
        Panel { title: "|F| of the hands", unit: "N", least: 0.5, curves: force(norm) },
        Panel { title: "F·up of the hands", unit: "N", least: 0.5, curves: force(|[_, _, z]| z) },
        Panel { title: "fingers that touch", unit: "", least: 1.0, curves: Ok(touching) },
    ]
}

/// A panel of one curve, if it has any value.
fn one(values: Vec<f64>) -> Option<Vec<Curve>> {
    values.iter().any(|value| value.is_finite()).then(|| vec![Curve { name: "", values }])
}

fn at(vector: Vector, frame: usize) -> [f64; 3] {
    vector.map(|axis| axis.get(frame).copied().unwrap_or(f64::NAN))
}

fn add(one: [f64; 3], other: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|axis| one[axis] + other[axis])
}

fn norm([x, y, z]: [f64; 3]) -> f64 {
    (x * x + y * y + z * z).sqrt()
}
