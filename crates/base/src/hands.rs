//! Names of hands, tracks and fingers.

use serde::{Deserialize, Serialize};
use std::fmt;

/// A hand: left or right.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Side {
    /// The left hand.
    Left,
    /// The right hand.
    Right,
}

impl Side {
    /// Both sides, left first, which is the order of all lists by hand.
    pub const BOTH: [Self; 2] = [Self::Left, Self::Right];

    /// `left` or `right`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Left => "left",
            Self::Right => "right",
        }
    }

    /// The side with this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::BOTH.into_iter().find(|side| side.name() == name)
    }

    /// The other hand.
    #[must_use]
    pub const fn other(self) -> Self {
        match self {
            Self::Left => Self::Right,
            Self::Right => Self::Left,
        }
    }

    /// 0 for left, 1 for right.
    pub const fn index(self) -> usize {
        self as usize
    }
}

impl fmt::Display for Side {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// The identity of a track.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum TrackId {
    /// The track of a hand.
    Hand(Side),
    /// The track of the coordination of both hands.
    Both,
}

impl TrackId {
    /// The hand, if it is one hand's.
    pub const fn side(self) -> Option<Side> {
        match self {
            Self::Hand(side) => Some(side),
            Self::Both => None,
        }
    }

    /// `left`, `right`, `both`.
    #[doc(hidden)]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Hand(side) => side.name(),
            Self::Both => "both",
        }
    }

    /// The track with this name.
    #[doc(hidden)]
    pub fn from_name(name: &str) -> Option<Self> {
        if name == Self::Both.name() { Some(Self::Both) } else { Side::from_name(name).map(Self::Hand) }
    }
}

impl fmt::Display for TrackId {
    /// `left`, `right`, `both`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl Serialize for TrackId {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

/// A slot of the array `fingers`: five fingertips, and the palm where a log measures its contact.
///
/// A gripper is a hand with `Thumb` and `Index`; a wrist force sensor is a hand with one finger.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Finger {
    /// The thumb. `tcp`, the tool center point of a robot, is read as the thumb too.
    #[serde(alias = "tcp")]
    Thumb,
    /// The index finger.
    Index,
    /// The middle finger.
    Middle,
    /// The ring finger.
    Ring,
    /// The little finger.
    Little,
    /// The palm: it counts as touch, never as grasp. `wrist`, a force sensor at the wrist, is read as the palm too.
    #[serde(alias = "wrist")]
    Palm,
}

impl Finger {
    /// All slots in their order.
    pub const ALL: [Self; 6] = [Self::Thumb, Self::Index, Self::Middle, Self::Ring, Self::Little, Self::Palm];

    /// The name in channel names and rules.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Thumb => "thumb",
            Self::Index => "index",
            Self::Middle => "middle",
            Self::Ring => "ring",
            Self::Little => "little",
            Self::Palm => "palm",
        }
    }

    /// The finger with this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|finger| finger.name() == name)
    }
}

impl fmt::Display for Finger {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// The selection of fingers from an array over fingers: `touches[thumb]`, `touches[opposing]`, `fingers.position[tips]`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum FingerPick {
    /// One finger; the result is a single value. A finger that the log lacks reads as false or zero.
    One(Finger),
    /// Index, middle, ring and little: the fingers that oppose the thumb.
    Opposing,
    /// All fingertips, without the palm.
    Tips,
}

impl FingerPick {
    /// Whether the selection contains `finger`.
    pub fn picks(self, finger: Finger) -> bool {
        match self {
            Self::One(one) => one == finger,
            Self::Opposing => !matches!(finger, Finger::Thumb | Finger::Palm),
            Self::Tips => finger != Finger::Palm,
        }
    }
}
