//! What a hand may do in a primitive: the closed set of words after `does`. docs/robot.md lists what the robot does for each.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// What is known of primitives by their names as they are shown: `Grasp`, `MainGrasp(left)`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Primitives {
    /// What a hand does in each, and the primitive that it is a kind of.
    pub known: BTreeMap<String, (Option<Meaning>, Option<String>)>,
}

impl Primitives {
    /// What a hand does in a primitive, where that is said.
    pub fn does(&self, name: &str) -> Option<Meaning> {
        self.known.get(name)?.0
    }

    /// The nearest of the names that are `named` which a primitive is, or is a kind of; its own where none is.
    pub fn counts_for<'a>(&'a self, name: &'a str, named: impl Fn(&str) -> bool) -> &'a str {
        let above = |name: &&'a str| self.known.get(*name)?.1.as_deref();
        // Kinds are never in a circle; the bound is for names that are.
        std::iter::successors(Some(name), above).take(self.known.len() + 1).find(|one| named(one)).unwrap_or(name)
    }
}

/// What a hand does in a primitive.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Meaning {
    /// Moves without touching anything.
    #[default]
    Free,
    /// Comes near an object.
    Approach,
    /// Closes around an object.
    Close,
    /// Lets go.
    Open,
    /// Moves a held object through the air.
    Carry,
    /// Keeps an object where it is.
    Hold,
    /// Sets a held object down.
    Place,
    /// Moves a held object along its support.
    Slide,
    /// Turns an object about an axis.
    Turn,
    /// Moves a held object into another one.
    Insert,
    /// Moves a held object out of another one.
    Extract,
    /// Presses a held object onto another one.
    Press,
    /// Moves a held object along another one, in contact.
    Follow,
    /// Moves an object without a grasp.
    Push,
    /// Moves an object without a grasp along another one.
    Trace,
    /// Holds an object together with the other hand.
    Share,
    /// Gives an object to the other hand, or takes it.
    Pass,
    /// Brings the held objects of both hands together.
    Fit,
}

impl Meaning {
    /// All of them, in the order of docs/robot.md.
    pub const ALL: [Self; 18] = [
        Self::Free,
        Self::Approach,
        Self::Close,
        Self::Open,
        Self::Carry,
        Self::Hold,
        Self::Place,
        Self::Slide,
        Self::Turn,
        Self::Insert,
        Self::Extract,
        Self::Press,
        Self::Follow,
        Self::Push,
        Self::Trace,
        Self::Share,
        Self::Pass,
        Self::Fit,
    ];

    /// The word after `does`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Free => "free",
            Self::Approach => "approach",
            Self::Close => "close",
            Self::Open => "open",
            Self::Carry => "carry",
            Self::Hold => "hold",
            Self::Place => "place",
            Self::Slide => "slide",
            Self::Turn => "turn",
            Self::Insert => "insert",
            Self::Extract => "extract",
            Self::Press => "press",
            Self::Follow => "follow",
            Self::Push => "push",
            Self::Trace => "trace",
            Self::Share => "share",
            Self::Pass => "pass",
            Self::Fit => "fit",
        }
    }

    /// What the hand does, in words.
    pub const fn doc(self) -> &'static str {
        match self {
            Self::Free => "moves without touching anything",
            Self::Approach => "comes near an object",
            Self::Close => "closes around an object",
            Self::Open => "lets go",
            Self::Carry => "moves a held object through the air",
            Self::Hold => "keeps an object where it is",
            Self::Place => "sets a held object down",
            Self::Slide => "moves a held object along its support",
            Self::Turn => "turns an object about an axis",
            Self::Insert => "moves a held object into another one",
            Self::Extract => "moves a held object out of another one",
            Self::Press => "presses a held object onto another one",
            Self::Follow => "moves a held object along another one, in contact",
            Self::Push => "moves an object without a grasp",
            Self::Trace => "moves an object without a grasp along another one",
            Self::Share => "holds an object together with the other hand",
            Self::Pass => "gives an object to the other hand, or takes it",
            Self::Fit => "brings the held objects of both hands together",
        }
    }

    /// The meaning with this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|meaning| meaning.name() == name)
    }

    /// Whether the hand touches nothing.
    pub const fn is_free(self) -> bool {
        matches!(self, Self::Free | Self::Approach)
    }

    /// Whether the hand holds an object.
    pub const fn holds(self) -> bool {
        !self.is_free() && !self.pushes() && !matches!(self, Self::Open)
    }

    /// Whether the hand moves an object that it does not hold.
    pub const fn pushes(self) -> bool {
        matches!(self, Self::Push | Self::Trace)
    }
}
