//! Teleoperation in the virtual environment: takes the inputs of hands, step by step, and returns a recording as [`teach`](super::teach) does.
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
/// Number of steps without contact after which hands have released an object.
const LET_GO_STEPS: usize = 300;
/// Maximum number of saved states that are kept.
const MOST_SAVED: usize = 64;
/// Decimals of SI values in recordings, as those of the shipped operators.
const DECIMALS: u8 = 6;

/// The virtual environment of a teleoperator.
pub struct TeleopWorld {
    scene: Scene,
    /// The weight of each body, N; 0 for a body that is not an object.
    weights: Vec<f64>,
    state: State,
    initial: State,
    recorder: Option<Recorder>,
    /// The targets of `undo`: the states before objects were touched, and the state before the next touch.
    saved: Vec<Snapshot>,
    before: Option<Snapshot>,
    /// Number of steps since an object was touched.
    free: usize,
}

/// The state on which the next step depends.
#[derive(Clone)]
struct State {
    world: World,
    hands: Vec<TeleopHand>,
}

/// A saved state, and the number of rows recorded before it.
struct Snapshot {
    state: State,
    rows: usize,
}

impl TeleopWorld {
    /// Returns the scene at rest, with the opened hands above it.
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

    /// Returns the current observation.
    pub fn observation(&self) -> &Observation {
        self.state.world.observation()
    }

    /// Returns the target of a led palm, reference frame.
    pub fn palm(&self, hand: usize) -> Option<&Isometry3<f64>> {
        self.state.hands.get(hand).map(TeleopHand::palm)
    }

    /// Sets the input of a hand from the next step on, and returns whether it was accepted. Inputs with another number of fingertips, or with positions that
    /// are not finite or farther than 5 m, are ignored.
    pub fn set_input(&mut self, hand: usize, input: HandInput) -> bool {
        self.state.hands.get_mut(hand).is_some_and(|hand| hand.take(input))
    }

    /// Whether a hand has had no input for [`WATCHDOG_STEPS`].
    pub fn is_silent(&self, hand: usize) -> bool {
        self.state.hands.get(hand).is_none_or(TeleopHand::is_silent)
    }

    /// Returns the forces of bodies on the fingertips of a hand, N, reference frame, each at most [`MOST_FORCE_N`].
    pub fn felt(&self, hand: usize) -> Vec<Vector3<f64>> {
        let force = |tip: &super::TipState| {
            let force: Vector3<f64> = -tip.touches.iter().map(|touch| touch.force).sum::<Vector3<f64>>();
            force * (MOST_FORCE_N / force.norm()).min(1.0)
        };
        self.observation().hands.get(hand).map_or_else(Vec::new, |hand| hand.tips.iter().map(force).collect())
    }

    /// Returns the forces that a device displays on the fingertips of a hand, N, reference frame; zero for a hand without inputs.
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

    /// Keeps the states for `undo`.
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

    /// Drops the states for `undo`.
    fn forget(&mut self) {
        self.saved.clear();
        self.before = Some(self.save());
        self.free = LET_GO_STEPS;
    }

    /// Begins a new recording and drops the rows before.
    pub fn start(&mut self) {
        let measured = MeasurementSpec { decimals: Some(DECIMALS), contact_flags: true, ..MeasurementSpec::default() };
        let seen = self.state.world.observation();
        self.recorder = Some(Recorder::new(&self.scene, seen, &measured, &ForceNoise::default(), 0));
        self.forget();
    }

    /// Ends the recording. Returns `None` if it has no rows.
    pub fn stop(&mut self) -> Option<RawRecording> {
        let recorder = self.recorder.take()?;
        self.forget();
        (recorder.len() > 0).then(|| RawRecording { recorder, scene: self.scene.clone() })
    }

    /// Returns to the state before an object was last touched, in the recording too. Hands keep their poses of that state until their next inputs.
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

    /// Returns to the initial state and drops the current recording.
    pub fn reset(&mut self) {
        self.state = self.initial.clone();
        self.recorder = None;
        self.forget();
    }

    /// Whether a recording is running.
    pub const fn is_recording(&self) -> bool {
        self.recorder.is_some()
    }

    /// Returns the number of recorded rows: one for each step.
    pub fn recorded(&self) -> usize {
        self.recorder.as_ref().map_or(0, Recorder::len)
    }

    /// Returns the titles of the recorded columns with units, as in a log.
    pub fn columns(&self) -> Vec<String> {
        let names = self.recorder.as_ref().map_or(&[][..], Recorder::names);
        let title = |(name, dimension): &(String, teachtree_base::units::Dimension)| match dimension.si_unit() {
            unit if unit.is_empty() => name.clone(),
            unit => format!("{name} [{unit}]"),
        };
        std::iter::once("time [s]".to_string()).chain(names.iter().map(title)).collect()
    }

    /// Returns a recorded row, in the order of [`columns`](Self::columns).
    pub fn row(&self, row: usize) -> Option<Vec<f64>> {
        let (time, values) = self.recorder.as_ref()?.row(row)?;
        Some(std::iter::once(time).chain(values).collect())
    }
}

/// The recorded rows. The ground truth is computed later, because it takes too long for the thread that advances the world.
pub struct RawRecording {
    recorder: Recorder,
    scene: Scene,
}

impl RawRecording {
    /// Returns the duration, s.
    pub fn seconds(&self) -> f64 {
        self.recorder.len() as f64 * STEP_S
    }

    /// Returns the recording, as [`teach`](super::teach) does.
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
