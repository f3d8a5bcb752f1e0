//! Goals: what a hand can be made to do, one step after the other. A goal says what is to become of the object; how the hand gets
//! there, what it feels under way and how operators differ in it is the performer's business.

use super::{Failure, Perturbation};
use serde::Deserialize;
use teachtree_base::quantity::{Angle, AngularSpeed, Force, Length, Quantity, Speed, Time};

/// No script has more steps, its repetitions written out.
const MAX_STEPS: usize = 1000;

/// One step: a goal, and the phase of the demonstration that begins with it.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// Logged as the event `phase_started`.
    pub phase: Option<String>,
    /// What to do.
    pub goal: Goal,
    /// The perturbation that begins with it; nothing that a script says.
    pub perturbation: Option<Perturbation>,
    /// The failure that begins with it; scripts do not contain it.
    pub failure: Option<Failure>,
    /// Whether a perturbation added it.
    pub added: bool,
    /// Its number in the script as it is written, from 0.
    pub written: usize,
}

impl Step {
    /// A step that a perturbation or a failure adds.
    pub(super) const fn added(goal: Goal) -> Self {
        Self { phase: None, goal, perturbation: None, failure: None, added: true, written: 0 }
    }
}

/// What a hand can be made to do.
#[derive(Clone, Debug, PartialEq)]
pub enum Goal {
    /// Bring the opened fingers to a grip, or somewhere beside it.
    Reach(Reach),
    /// Close the fingers of the grip until they feel a force.
    Close(Close),
    /// Move the hand as it is, with what it holds or pushes, by some way.
    Carry(Carry),
    /// Bring the held object to a place.
    Bring(Bring),
    /// Put the held object into a socket.
    Insert(Insert),
    /// Pull the held object out of a socket.
    Withdraw(Withdraw),
    /// Turn the hand with the held object.
    Turn(Turn),
    /// Press the held object against something.
    Press(Press),
    /// Take the fingers off the object.
    Open(Open),
    /// Stay.
    Hold(Time),
    /// Loosen the grip until the object slips, and catch it, or not.
    Slip(Slip),
    /// Press the held object on the rim beside a socket.
    Jam(Jam),
    /// Move into a body of the environment.
    Collide(Collide),
    /// Stay until the other hand begins the phase of this name.
    Wait(String),
    /// Move along with the other hand.
    Cooperation(Cooperation),
}

/// Brings the opened fingers to a grip by a minimum-jerk motion.
#[derive(Clone, Debug, PartialEq, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Reach {
    /// The grip.
    pub grip: String,
    /// How far the fingertips stay off the surface.
    #[serde(default = "opened")]
    pub opened: Length,
    /// How far from the grip the hand stops: a keyframe of the way.
    #[serde(default)]
    pub offset: [Length; 3],
    /// Largest speed of the hand.
    #[serde(default = "reaching")]
    pub speed: Speed,
}

/// Closes the fingers of the grip until each feels its share of a force, and keeps the squeeze from then on.
#[derive(Clone, Debug, PartialEq, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Close {
    /// Force of the thumb; the fingers on the other side share as much. Without a thumb, the force of each finger.
    pub force: Force,
    /// Speed of the fingertips against the palm.
    #[serde(default = "closing")]
    pub speed: Speed,
    /// Whether the hand ignores that it may hold nothing: fingers without an object meet each other, and the hand does not keep a squeeze.
    #[serde(default)]
    pub unchecked: bool,
}

/// Moves the hand along a straight line.
#[derive(Clone, Debug, PartialEq, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Carry {
    /// The direction; its length does not matter.
    pub along: [f64; 3],
    /// How far, at most.
    pub distance: Length,
    /// Speed under way. The hand slows down before what it sees itself touching.
    #[serde(default = "carrying")]
    pub speed: Speed,
    /// What ends it before the distance is used up.
    #[serde(default)]
    pub until: Option<StopContact>,
    /// What the object is held against under way.
    #[serde(default)]
    pub press: Option<WallPress>,
}

/// What ends a [`Carry`].
#[derive(Clone, Debug, PartialEq, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StopContact {
    /// The object of the grip touches this body.
    pub contact: String,
    /// Or is seen to be within this distance of it.
    #[serde(default)]
    pub within: Length,
}

/// Holds the object against a body while it moves along it: by the force that the fingers feel while it touches, by seeking it again when not.
#[derive(Clone, Debug, PartialEq, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WallPress {
    /// The body.
    pub against: String,
    /// The direction towards it.
    pub toward: [f64; 3],
    /// The force of the fingers on the object in that direction.
    pub force: Force,
    /// How far the hand wavers from its line, towards the body or away from it.
    #[serde(default)]
    pub waver: Length,
}

/// Brings the object of the grip to a place by a minimum-jerk motion through the air.
#[derive(Clone, Debug, PartialEq, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Bring {
    /// Where the object's origin comes to be, reference frame.
    pub to: [Length; 3],
    /// Largest speed of the hand.
    #[serde(default = "bringing")]
    pub speed: Speed,
}

/// Puts the object of the grip into a socket: down along its axis, searching on the rim for the hole, giving way to what is felt from the side.
#[derive(Clone, Debug, PartialEq, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Insert {
    /// The socket.
    pub socket: String,
    /// How deep.
    pub depth: Length,
    /// Speed along the axis.
    #[serde(default = "inserting")]
    pub speed: Speed,
}

/// Pulls the object of the grip out of a socket.
#[derive(Clone, Debug, PartialEq, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Withdraw {
    /// The socket.
    pub socket: String,
    /// How far above the rim.
    pub above: Length,
    /// Speed along the axis.
    #[serde(default = "inserting")]
    pub speed: Speed,
}

/// Turns the hand with the object of the grip about an axis through the object's origin.
#[derive(Clone, Debug, PartialEq, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Turn {
    /// How far, counter-clockwise as seen against the axis.
    pub angle: Angle,
    /// Largest angular speed.
    pub speed: AngularSpeed,
    /// The direction of the axis in the world; by default upward.
    #[serde(default = "upward")]
    pub about: [f64; 3],
}

const fn upward() -> [f64; 3] {
    [0.0, 0.0, 1.0]
}

/// Moves the object of the grip until it meets something, and presses it against that.
#[derive(Clone, Debug, PartialEq, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Press {
    /// The direction.
    pub toward: [f64; 3],
    /// The force of the fingers on the object in that direction. The fingers squeeze at least as hard.
    pub force: Force,
    /// How long, from the first touch on.
    pub time: Time,
    /// How far it is to what is pressed, at most.
    #[serde(default = "opened")]
    pub distance: Length,
}

/// Takes the fingers off the object.
#[derive(Clone, Debug, PartialEq, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Open {
    /// How far off the surface.
    #[serde(default = "opened")]
    pub by: Length,
    /// Largest speed of the fingertips.
    #[serde(default = "closing")]
    pub speed: Speed,
}

/// Loosens the grip.
#[derive(Clone, Debug, PartialEq, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Slip {
    /// The object is caught when it has slipped this far.
    pub distance: Length,
}

/// Presses the object of the grip on the rim beside a socket, as an operator who misses the hole.
#[derive(Clone, Debug, PartialEq, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Jam {
    /// The socket.
    pub socket: String,
    /// Distance of the plug point from the axis of the socket; its direction is drawn.
    pub beside: Length,
    /// Force of the fingers on the object along the axis.
    pub force: Force,
    /// Duration of the press.
    pub time: Time,
    /// Speed along the axis until the rim is met.
    #[serde(default = "inserting")]
    pub speed: Speed,
}

/// Moves the held object horizontally into a body of the environment; an empty hand moves its nearest fingertip into the body. The hand notices the
/// contact late, stops and retreats.
#[derive(Clone, Debug, PartialEq, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Collide {
    /// The body.
    pub with: String,
    /// Distance that the hand moves after the contact.
    #[serde(default = "overshooting")]
    pub overshoot: Length,
    /// Time until the retreat.
    #[serde(default = "noticing")]
    pub pause: Time,
    /// Length of the retreat.
    #[serde(default = "opened")]
    pub back: Length,
    /// Largest speed.
    #[serde(default = "bringing")]
    pub speed: Speed,
}

/// Moves along with the other hand, which leads, and takes over a part of what is to be carried or pushed: until the other hand begins a phase, or
/// for a time.
#[derive(Clone, Debug, PartialEq, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cooperation {
    /// The share of the object's weight that this hand comes to carry, 0 to 1.
    #[serde(default)]
    pub share: f64,
    /// A force of the fingers on the object besides.
    #[serde(default)]
    pub force: Force,
    /// Its direction.
    #[serde(default)]
    pub toward: [f64; 3],
    /// The phase of the other hand that ends it.
    #[serde(default)]
    pub until: Option<String>,
    /// How long it takes when no phase ends it.
    #[serde(default)]
    pub time: Option<Time>,
}

/// A step as it is written: `{phase: lift, carry: {…}}`, exactly one goal; or `{repeat: {times: 3, steps: […]}}`.
#[derive(Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct StepText {
    phase: Option<String>,
    reach: Option<Reach>,
    close: Option<Close>,
    carry: Option<Carry>,
    bring: Option<Bring>,
    insert: Option<Insert>,
    withdraw: Option<Withdraw>,
    turn: Option<Turn>,
    press: Option<Press>,
    open: Option<Open>,
    hold: Option<Time>,
    slip: Option<Slip>,
    jam: Option<Jam>,
    collide: Option<Collide>,
    wait: Option<String>,
    together: Option<Cooperation>,
    repeat: Option<Repeat>,
}

#[derive(Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
struct Repeat {
    times: usize,
    steps: Steps,
}

/// The steps of a script, repetitions written out.
#[derive(Clone, Debug, PartialEq, Deserialize, schemars::JsonSchema)]
#[schemars(with = "Vec<StepText>")]
#[serde(try_from = "Vec<StepText>")]
struct Steps(Vec<Step>);

/// Reads the steps of a script.
pub(super) fn steps<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<Vec<Step>, D::Error> {
    Steps::deserialize(deserializer).map(|Steps(steps)| steps)
}

impl TryFrom<Vec<StepText>> for Steps {
    type Error = String;

    fn try_from(texts: Vec<StepText>) -> Result<Self, String> {
        let mut steps = Vec::with_capacity(texts.len());
        for (written, text) in texts.into_iter().enumerate() {
            let before = steps.len();
            text.write_out(&mut steps)?;
            // What is repeated is found where the repetition stands.
            steps[before..].iter_mut().for_each(|step| step.written = written);
            if steps.len() > MAX_STEPS {
                return Err(format!("more than {MAX_STEPS} steps, {} of them in one repetition", steps.len() - before));
            }
        }
        Ok(Self(steps))
    }
}

impl StepText {
    /// Appends what this step is.
    fn write_out(self, steps: &mut Vec<Step>) -> Result<(), String> {
        const WANTED: &str = "expected one of reach, close, carry, bring, insert, withdraw, turn, press, open, hold, slip, jam, collide, wait, together, repeat";
        let goals = [
            self.reach.map(Goal::Reach),
            self.close.map(Goal::Close),
            self.carry.map(Goal::Carry),
            self.bring.map(Goal::Bring),
            self.insert.map(Goal::Insert),
            self.withdraw.map(Goal::Withdraw),
            self.turn.map(Goal::Turn),
            self.press.map(Goal::Press),
            self.open.map(Goal::Open),
            self.hold.map(Goal::Hold),
            self.slip.map(Goal::Slip),
            self.jam.map(Goal::Jam),
            self.collide.map(Goal::Collide),
            self.wait.map(Goal::Wait),
            self.together.map(Goal::Cooperation),
        ];
        let mut goals = goals.into_iter().flatten();
        match (goals.next(), goals.next(), self.repeat) {
            (Some(goal), None, None) => {
                let phase = self.phase;
                steps.push(Step { phase, goal, perturbation: None, failure: None, added: false, written: 0 });
            }
            (None, _, Some(Repeat { times, steps: Steps(repeated) })) => {
                if times.saturating_mul(repeated.len()) > MAX_STEPS {
                    return Err(format!("{times} times {} steps, expected at most {MAX_STEPS} in all", repeated.len()));
                }
                let begin = steps.len();
                steps.extend(std::iter::repeat_n(repeated, times).flatten());
                if let (Some(first), Some(phase)) = (steps.get_mut(begin), self.phase) {
                    first.phase = Some(phase);
                }
            }
            (None, _, None) => return Err(format!("a step without a goal, {WANTED}")),
            (Some(_), ..) => return Err(format!("a step with two goals, {WANTED}")),
        }
        Ok(())
    }
}

const fn opened() -> Length {
    Quantity(0.030)
}

const fn reaching() -> Speed {
    Quantity(0.300)
}

const fn closing() -> Speed {
    Quantity(0.080)
}

const fn carrying() -> Speed {
    Quantity(0.100)
}

const fn bringing() -> Speed {
    Quantity(0.200)
}

const fn inserting() -> Speed {
    Quantity(0.030)
}

const fn overshooting() -> Length {
    Quantity(0.008)
}

const fn noticing() -> Time {
    Quantity(0.150)
}
