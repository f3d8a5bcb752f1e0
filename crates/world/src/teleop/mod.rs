//! The virtual environment as a person works in it: what hands ask for goes in, step by step, and a recording comes out as [`teach`](super::teach) makes it.
//!
//! Nothing here has a clock: the same inputs at the same steps give the same bytes. A step is 1 ms.

mod hand;

pub use hand::{FARTHEST_M, HandInput, MOST_FORCE_N, WATCHDOG_STEPS};

use super::demonstration::SETTLING;
use super::operator::{ForceNoise, MeasurementSpec};
use super::recorder::Recorder;
use super::simulation::{Fingertips, HandState, HandTarget, Observation, STEP_S, World};
use super::truth::TruthOptions;
use hand::TeleopHand;
use nalgebra::Isometry3;
use nalgebra::Vector3;
use teachtree_base::error::InputError;
use teachtree_base::hands::Side;
use teachtree_base::recording::Recording;
use teachtree_base::scene::{Role, Scene};

/// Maximum number of steps of a recording.
pub const MOST_STEPS: usize = 300_000;
/// Hands that touch no object for this many steps have let go of it.
const LET_GO_STEPS: usize = 300;
/// Maximum number of saved states that are kept.
const MOST_SAVED: usize = 64;
/// Decimals of SI values in recordings, as those of the shipped operators.
const DECIMALS: u8 = 6;

/// The virtual environment of a person.
pub struct TeleopWorld {
    scene: Scene,
    /// Of each body, N; 0 if it is not an object.
    weights: Vec<f64>,
    state: State,
    initial: State,
    recorder: Option<Recorder>,
    /// Where `undo` leads: the moments before objects were touched, and that before the next touch.
    saved: Vec<Snapshot>,
    before: Option<Snapshot>,
    /// For how long no object has been touched, in steps.
    free: usize,
}

/// What the next step depends on.
#[derive(Clone)]
struct State {
    world: World,
    hands: Vec<TeleopHand>,
}

/// A state to go back to, and how many rows had been recorded.
struct Snapshot {
    state: State,
    rows: usize,
}

impl TeleopWorld {
    /// The scene at rest, its hands opened above it.
    ///
    /// # Errors
    /// A scene that cannot be simulated, or has no hands.
    pub fn new(scene: &Scene) -> Result<Self, InputError> {
        if scene.hands.is_empty() {
            let error = InputError::new("hands", "the scene has no hand, expected one or two");
            return Err(error.help("add `hands: {right: {fingers: [thumb, index, middle]}}` to the scene"));
        }
        let mut world = World::new(scene, Fingertips::default())?;
        let hands: Vec<TeleopHand> =
            scene.hands.iter().map(|(side, hand)| TeleopHand::new(scene, *side, hand)).collect();
        let mut state = State { hands, world: world.clone() };
        let still = state.targets(&[]);
        for _ in 0..SETTLING {
            world.step(&still);
        }
        state.world = world;
        let gravity = scene.gravity().norm();
        let weight = |body: &teachtree_base::scene::Body| body.mass.map_or(0.0, |mass| mass.0 * gravity);
        let weights = scene.bodies.values().map(|body| if body.role == Role::Object { weight(body) } else { 0.0 });
        let mut teleop = Self {
            scene: scene.clone(),
            weights: weights.collect(),
            initial: state.clone(),
            state,
            recorder: None,
            saved: Vec::new(),
            before: None,
            free: 0,
        };
        teleop.forget();
        Ok(teleop)
    }

    /// The scene.
    pub const fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The hands, in the order of the scene.
    pub fn sides(&self) -> impl Iterator<Item = Side> {
        self.scene.hands.keys().copied()
    }

    /// What is felt and seen now.
    pub fn observation(&self) -> &Observation {
        self.state.world.observation()
    }

    /// Where the palm of a hand has been led, reference frame.
    pub fn palm(&self, hand: usize) -> Option<&Isometry3<f64>> {
        self.state.hands.get(hand).map(TeleopHand::palm)
    }

    /// Asks a hand for something from the next step on; whether it is taken: another number of fingertips, and places that are not finite or farther than
    /// 5 m, are not.
    pub fn set_input(&mut self, hand: usize, input: HandInput) -> bool {
        self.state.hands.get_mut(hand).is_some_and(|hand| hand.take(input))
    }

    /// Whether a hand has not been asked for anything for [`WATCHDOG_STEPS`].
    pub fn is_silent(&self, hand: usize) -> bool {
        self.state.hands.get(hand).is_none_or(TeleopHand::is_silent)
    }

    /// What bodies do to the fingertips of a hand, N, reference frame, each at most [`MOST_FORCE_N`].
    pub fn felt(&self, hand: usize) -> Vec<Vector3<f64>> {
        let force = |tip: &super::TipState| {
            let force: Vector3<f64> = -tip.touches.iter().map(|touch| touch.force).sum::<Vector3<f64>>();
            force * (MOST_FORCE_N / force.norm()).min(1.0)
        };
        self.observation().hands.get(hand).map_or_else(Vec::new, |hand| hand.tips.iter().map(force).collect())
    }

    /// The forces to display on the fingertips of a hand by a device, N, reference frame: what they feel, and none when the hand is silent.
    pub fn displayed(&self, hand: usize) -> Vec<Vector3<f64>> {
        let felt = self.felt(hand);
        if self.is_silent(hand) { vec![Vector3::zeros(); felt.len()] } else { felt }
    }

    /// Advances by a step, and records it.
    pub fn step(&mut self) -> &Observation {
        if let Some(recorder) = &mut self.recorder
            && recorder.len() < MOST_STEPS
        {
            recorder.record(self.state.world.observation());
        }
        let targets = self.state.targets(&self.weights);
        self.state.world.step(&targets);
        self.watch();
        self.state.world.observation()
    }

    /// Keeps the moments to which `undo` leads.
    fn watch(&mut self) {
        let seen = self.state.world.observation();
        let is_object =
            |body: usize| self.scene.bodies.get_index(body).is_some_and(|(_, body)| body.role == Role::Object);
        let mut touches = seen.hands.iter().flat_map(|hand| &hand.tips).flat_map(|tip| &tip.touches);
        if touches.any(|touch| is_object(touch.body)) {
            self.free = 0;
            if let Some(before) = self.before.take() {
                if self.saved.len() == MOST_SAVED {
                    self.saved.remove(0);
                }
                self.saved.push(before);
            }
        } else {
            self.free += 1;
            if self.free == LET_GO_STEPS && self.before.is_none() {
                self.before = Some(self.save());
            }
        }
    }

    fn save(&self) -> Snapshot {
        Snapshot { state: self.state.clone(), rows: self.recorded() }
    }

    /// Nothing before now can be undone.
    fn forget(&mut self) {
        self.saved.clear();
        self.before = Some(self.save());
        self.free = LET_GO_STEPS;
    }

    /// Begins a recording, without what was recorded before.
    pub fn start(&mut self) {
        let measured = MeasurementSpec { decimals: Some(DECIMALS), contact_flags: true, ..MeasurementSpec::default() };
        let seen = self.state.world.observation();
        self.recorder = Some(Recorder::new(&self.scene, seen, &measured, &ForceNoise::default(), 0));
        self.forget();
    }

    /// Ends the recording. `None` where nothing was recorded.
    pub fn stop(&mut self) -> Option<RawRecording> {
        let recorder = self.recorder.take()?;
        self.forget();
        (recorder.len() > 0).then(|| RawRecording { recorder, scene: self.scene.clone() })
    }

    /// Goes back to the moment before an object was touched last, in the recording too; hands stay where they were then until they are asked anew.
    pub fn undo(&mut self) {
        let Some(Snapshot { state, rows }) = self.saved.pop().or_else(|| self.before.take()) else { return };
        self.state = state;
        self.state.hands.iter_mut().for_each(TeleopHand::let_be);
        if let Some(recorder) = &mut self.recorder {
            recorder.truncate(rows);
        }
        self.free = LET_GO_STEPS;
        self.before = Some(self.save());
    }

    /// Goes back to the beginning; what was being recorded is lost.
    pub fn reset(&mut self) {
        self.state = self.initial.clone();
        self.recorder = None;
        self.forget();
    }

    /// Whether a recording goes on.
    pub const fn is_recording(&self) -> bool {
        self.recorder.is_some()
    }

    /// How many rows have been recorded: one a step.
    pub fn recorded(&self) -> usize {
        self.recorder.as_ref().map_or(0, Recorder::len)
    }

    /// The titles of the columns of a row that is recorded, with units: as in a log.
    pub fn columns(&self) -> Vec<String> {
        let names = self.recorder.as_ref().map_or(&[][..], Recorder::names);
        let title = |(name, dimension): &(String, teachtree_base::units::Dimension)| match dimension.si_unit() {
            unit if unit.is_empty() => name.clone(),
            unit => format!("{name} [{unit}]"),
        };
        std::iter::once("time [s]".to_string()).chain(names.iter().map(title)).collect()
    }

    /// A row that was recorded, in the order of [`columns`](Self::columns).
    pub fn row(&self, row: usize) -> Option<Vec<f64>> {
        let (time, values) = self.recorder.as_ref()?.row(row)?;
        Some(std::iter::once(time).chain(values).collect())
    }
}

/// What was recorded. The ground truth in the recording takes a while, so that it is not made where the world is stepped.
pub struct RawRecording {
    recorder: Recorder,
    scene: Scene,
}

impl RawRecording {
    /// How long it is, s.
    pub fn seconds(&self) -> f64 {
        self.recorder.len() as f64 * STEP_S
    }

    /// The recording, as [`teach`](super::teach) makes it.
    pub fn recording(self) -> Recording {
        self.recorder.finish(&self.scene, Vec::new(), [None, None], &TruthOptions::default())
    }
}

impl State {
    fn targets(&mut self, weights: &[f64]) -> Vec<HandTarget> {
        let Self { world, hands } = self;
        let weight = |hand: &HandState| {
            let touched = hand.tips.iter().flat_map(|tip| &tip.touches).map(|touch| touch.body);
            touched.filter_map(|body| weights.get(body)).copied().fold(0.0, f64::max)
        };
        let felt = &world.observation().hands;
        hands.iter_mut().zip(felt).map(|(hand, felt)| hand.target(felt, weight(felt))).collect()
    }
}
