//! The messages of a page or a device, as JSON texts (docs/teaching.md).

use nalgebra::{Isometry3, Point3, Vector3};
use serde::Deserialize;
use serde_json::{Value, json};
use teachtree_base::hands::Side;
use teachtree_base::pose::{directed, pose_array};
use teachtree_world::HandInput;

/// Maximum number of fingertips of a message.
const MAX_TIPS: usize = 16;

/// A received message.
#[derive(Debug, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case", deny_unknown_fields)]
pub enum Message {
    /// The target of a led palm.
    Palm {
        /// The hand.
        hand: Hand,
        /// The epoch of the world that the sender has seen, as in `state`.
        epoch: Option<u64>,
        /// x y z, m, and w x y z.
        palm: [f64; 7],
        #[serde(default)]
        closes: bool,
        #[serde(default = "usual_squeeze")]
        squeeze: f64,
        #[serde(default)]
        presses: bool,
    },
    /// The tracked fingertips of a hand.
    Tips {
        hand: Hand,
        epoch: Option<u64>,
        /// x y z, m, in the order of the scene.
        tips: Vec<[f64; 3]>,
        /// x y z, m, and w x y z.
        palm: Option<[f64; 7]>,
    },
    /// Requests forces at this period.
    Forces {
        every_ms: u64,
    },
    Start,
    Stop,
    Undo,
    Reset,
    /// Runs the robot on a recording, by default the last one.
    Robot {
        take: Option<usize>,
    },
}

/// A hand in a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Hand {
    Left,
    Right,
}

impl Hand {
    /// The side.
    pub const fn side(self) -> Side {
        match self {
            Self::Left => Side::Left,
            Self::Right => Side::Right,
        }
    }
}

const fn usual_squeeze() -> f64 {
    1.5
}

impl Message {
    /// Reads a message.
    ///
    /// # Errors
    /// The reason why the text is not a message.
    pub fn read(text: &str) -> Result<Self, String> {
        serde_json::from_str(text).map_err(|error| format!("no message: {error}"))
    }
}

/// Returns the input of a led palm; `None` for invalid numbers.
pub fn palm_input(palm: &[f64; 7], closes: bool, squeeze: f64, presses: bool) -> Option<HandInput> {
    Some(HandInput::Palm { palm: pose(palm)?, closes, squeeze, presses })
}

/// Returns the input of tracked fingertips; `None` for invalid numbers.
pub fn tips_input(tips: &[[f64; 3]], palm: Option<&[f64; 7]>) -> Option<HandInput> {
    let palm = match palm {
        Some(palm) => Some(pose(palm)?),
        None => None,
    };
    let tips = (tips.len() <= MAX_TIPS).then(|| tips.iter().map(|tip| Point3::from(*tip)).collect())?;
    Some(HandInput::Tips { tips, palm })
}

fn pose([x, y, z, a, b, c, d]: &[f64; 7]) -> Option<Isometry3<f64>> {
    let turn = directed([*a, *b, *c, *d], 1e-6)?;
    Some(Isometry3::from_parts(Vector3::new(*x, *y, *z).into(), turn))
}

/// Rounds a number to the displayed precision: 10 µm, 10 µN.
fn short(number: f64) -> f64 {
    (number * 1e5).round() / 1e5 + 0.0
}

/// A vector.
pub fn vector(vector: &Vector3<f64>) -> Value {
    vector.iter().map(|part| short(*part)).collect()
}

/// A pose as seven numbers.
pub fn pose_json(pose: &Isometry3<f64>) -> Value {
    pose_array(pose).iter().map(|part| short(*part)).collect()
}

/// Returns the answer to a refused message.
pub fn error(message: &str) -> String {
    json!({ "type": "error", "message": message }).to_string()
}
