//! Issues of a log, by name, place and time.

use serde::{Serialize, Serializer};
use std::fmt;
use teachtree_base::field_names::FieldNames;

/// An interval in which the log could not be trusted.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Issue {
    /// What is wrong.
    pub kind: IssueKind,
    /// Start, s.
    pub start_s: f64,
    /// End, s.
    pub end_s: f64,
    /// The channel, or empty for all.
    pub channel: String,
    /// The finding and its treatment.
    pub message: String,
}

impl Issue {
    /// Returns the issue with the names of channels as the user writes them.
    #[must_use]
    pub fn spelled(self, spelling: &FieldNames) -> Self {
        let [channel, message] = [&self.channel, &self.message].map(|text| spelling.shown(text).into_owned());
        Self { channel, message, ..self }
    }

    /// Lets the times of the issue count from a later one, s.
    pub fn count_from(&mut self, zero_s: f64) {
        self.start_s -= zero_s;
        self.end_s -= zero_s;
    }
}

/// The kind of an issue in an interval of a log. Its name can be compared with a text: `issue.kind == "gap"`. docs/logs.md lists the kinds.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct IssueKind(&'static str);

macro_rules! kinds {
    ($($name:ident $text:literal $doc:literal),* $(,)?) => {
        impl IssueKind {
            $(#[doc(hidden)] #[doc = $doc] pub const $name: Self = Self($text);)*

            /// All kinds.
            pub const ALL: &[Self] = &[$(Self::$name),*];

            /// What is wrong with a log that has one, a sentence.
            pub fn about(self) -> &'static str {
                [$((Self::$name, $doc)),*].into_iter().find(|(kind, _)| *kind == self).map_or("", |(_, about)| about)
            }
        }
    };
}

kinds! {
    AMBIGUOUS_CONTACT_LEVEL "ambiguous_contact_level" "The forces fall into three groups, and two of them may be those of contact.",
    ASSUMED_INSERTION "assumed_insertion" "Nothing in the log shows that an object is in a socket.",
    BIASED "biased" "The bias of a force sensor was subtracted.",
    CHANGED_ELEMENT "changed_element" "An element of an array is bound by its place, and another one takes that place.",
    CHANGED_OFFSET "changed_offset" "The offset of a force sensor changes during the log.",
    CONTRADICTED_OUTCOME "contradicted_outcome" "A field of the log says that the task succeeded, and the outcome is a failure, or the reverse.",
    CONSTANT_FLAG "constant_flag" "A contact lasts as long as the log, or a gripper never opens or closes.",
    DIFFERENT_CLOCKS "different_clocks" "Topics have stamps of different clocks.",
    DIFFERENT_FRAMES "different_frames" "Poses are in different frames.",
    DISCONNECTED "disconnected" "The connection to the source of a live log broke or was restored.",
    DISTANT_TOOL_POINT "distant_tool_point" "The tool point stays far from the held object.",
    DUPLICATE_STAMP "duplicate_stamp" "Rows repeat the stamp of the row before.",
    GAP "gap" "Rows are missing.",
    HANGING_OBJECT "hanging_object" "An object hangs in the air at rest.",
    HELD_POSE "held_pose" "A pose is repeated from row to row, since it is measured less often.",
    IMPLAUSIBLE_FORCE "implausible_force" "The sign of a force contradicts the contact of the finger.",
    IMPLAUSIBLE_POSITION "implausible_position" "A finger touches and is far from every object.",
    IMPLAUSIBLE_ROTATION "implausible_rotation" "A rotation is not a unit quaternion, or its components are in another order.",
    IMPLAUSIBLE_UNIT "implausible_unit" "A position is in another unit than it is read in.",
    IMPLAUSIBLE_VELOCITY "implausible_velocity" "The velocity of a body contradicts its pose in the whole log.",
    IMPOSSIBLE_JUMP "impossible_jump" "A sample is farther from its neighbors than anything can move.",
    INCONSISTENT_HOLD "inconsistent_hold" "An object does not move with the hand that holds it.",
    MISPLACED_SOCKET "misplaced_socket" "Objects are inserted beside a socket, or lack the point that enters it.",
    MISSING_BODY "missing_body" "A held object is pressed on a body that the scene lacks.",
    MISSING_CHANNEL "missing_channel" "The log lacks a channel.",
    MISSING_CHUNK "missing_chunk" "A Zarr store or an HDF5 file lacks chunks of an array.",
    MISSING_ROW "missing_row" "A missing row was interpolated.",
    NO_CONTACT_LEVEL "no_contact_level" "The forces show no level from which on a finger is in contact.",
    NO_SUPPORT "no_support" "No channel shows the support of an object.",
    NOISY_POSITION "noisy_position" "The samples of a position scatter; slow motion cannot be distinguished from this noise.",
    NOT_A_NUMBER "not_a_number" "Samples were not measured.",
    OVERLAPPING_BODIES "overlapping_bodies" "The shapes of bodies overlap while they rest.",
    OVERRUN "overrun" "Rows of a live log came faster than they could be analyzed.",
    RELABELING_STOPPED "relabeling_stopped" "Rules were still changing labels after the maximum number of rounds.",
    REVERSED_FLAG "reversed_flag" "A gripper is closed while its flag is open.",
    STUCK_SENSOR "stuck_sensor" "A sensor repeats its value.",
    TRUNCATED "truncated" "The file ends in the middle of a record.",
    UNDETECTABLE "undetectable" "The log lacks a channel by which a primitive is detected.",
    UNKNOWN_PLACE "unknown_place" "The log does not show the position of a body.",
    UNKNOWN_WEIGHT "unknown_weight" "The log does not show the weight of a tool.",
    LEARNED_CLOSING "learned_closing" "The opening below which a gripper counts as closed is learned from the log.",
    LEARNED_WEIGHT "learned_weight" "What a tool weighs and the bias of its sensor are learned from the log and subtracted.",
    UNEVEN_STEP "uneven_step" "The steps of the stamps differ.",
    UNREAD_PART "unread_part" "A part of a robot description is ignored or replaced.",
    UNREADABLE_ROW "unreadable_row" "A line of a live log is not a row.",
    UNKNOWN_CHANNEL "unknown_channel" "A column has an unknown name.",
}

impl IssueKind {
    /// The name, as outputs have it: `stuck_sensor`.
    pub const fn name(self) -> &'static str {
        self.0
    }

    /// Whether the binding, the scene or a sensor contradicts the recording, so that its labels may be wrong until that is mended.
    pub fn is_of_setup(self) -> bool {
        [
            Self::CHANGED_ELEMENT,
            Self::CHANGED_OFFSET,
            Self::CONSTANT_FLAG,
            Self::CONTRADICTED_OUTCOME,
            Self::DIFFERENT_CLOCKS,
            Self::DIFFERENT_FRAMES,
            Self::DISTANT_TOOL_POINT,
            Self::HANGING_OBJECT,
            Self::IMPLAUSIBLE_FORCE,
            Self::IMPLAUSIBLE_POSITION,
            Self::IMPLAUSIBLE_ROTATION,
            Self::IMPLAUSIBLE_UNIT,
            Self::IMPLAUSIBLE_VELOCITY,
            Self::INCONSISTENT_HOLD,
            Self::MISPLACED_SOCKET,
            Self::MISSING_BODY,
            Self::OVERLAPPING_BODIES,
            Self::REVERSED_FLAG,
        ]
        .contains(&self)
    }

    /// The kind of this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|kind| kind.0 == name)
    }
}

impl PartialEq<str> for IssueKind {
    fn eq(&self, name: &str) -> bool {
        self.0 == name
    }
}

impl PartialEq<&str> for IssueKind {
    fn eq(&self, name: &&str) -> bool {
        self.0 == *name
    }
}

impl fmt::Display for IssueKind {
    /// The name.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.0)
    }
}

impl fmt::Debug for IssueKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.0)
    }
}

impl Serialize for IssueKind {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.0)
    }
}
