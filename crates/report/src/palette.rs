//! One color for what a hand does in a primitive, the same in terminals and pages.
//!
//! The colors are light enough for dark letters on them (contrast at least 4.5 : 1) and stand on light and dark backgrounds. Families:
//! free motion gray, grasps green, carrying blue and teal, insertion violet, contact warm.

use teachtree_base::hands::Side;
use teachtree_base::meaning::Meaning;

/// A color, red green blue.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Color(pub u8, pub u8, pub u8);

/// The letters on every color of a primitive.
pub const INK: Color = Color(0x16, 0x19, 0x1f);

/// What tasks are drawn in, by turns.
pub const TASKS: [Color; 2] = [Color(0xb9, 0xc4, 0xd6), Color(0xdd, 0xe3, 0xec)];

/// The color of a primitive: that of what the hand does, where it says so.
pub fn color(primitive: &str, does: Option<Meaning>) -> Color {
    does.map_or_else(|| spare(primitive), |meaning| of_meaning(meaning, side_of(primitive)))
}

/// The hand in the name of a sided primitive: `…(left)`.
fn side_of(primitive: &str) -> Option<Side> {
    Side::from_name(primitive.split_once('(')?.1.strip_suffix(')')?)
}

const fn of_meaning(meaning: Meaning, side: Option<Side>) -> Color {
    match (meaning, side) {
        (Meaning::Free, _) => Color(0xc8, 0xcd, 0xd4),
        (Meaning::Approach, _) => Color(0xa6, 0xb4, 0xc8),
        (Meaning::Close, _) => Color(0x74, 0xc4, 0x76),
        (Meaning::Carry, _) => Color(0x6b, 0xae, 0xf0),
        (Meaning::Hold, _) => Color(0x7f, 0xd6, 0xe8),
        (Meaning::Slide, _) => Color(0xf5, 0xd0, 0x4c),
        (Meaning::Insert, _) => Color(0xa9, 0x8c, 0xee),
        (Meaning::Extract, _) => Color(0xcd, 0xb2, 0xf7),
        (Meaning::Open, _) => Color(0xd8, 0xcf, 0xbb),
        (Meaning::Place, _) => Color(0x4f, 0xc0, 0xb2),
        (Meaning::Turn, _) => Color(0xee, 0x8f, 0xc4),
        (Meaning::Press, _) => Color(0xf4, 0x82, 0x71),
        (Meaning::Follow, _) => Color(0xf7, 0xa1, 0x4a),
        (Meaning::Push, _) => Color(0xc9, 0x9a, 0x70),
        (Meaning::Trace, _) => Color(0xbd, 0xb7, 0x4b),
        (Meaning::Share, None) => Color(0xb5, 0xd9, 0x5b),
        (Meaning::Share, Some(Side::Left)) => Color(0x8c, 0xcf, 0x9f),
        (Meaning::Share, Some(Side::Right)) => Color(0xcb, 0xe6, 0xa3),
        (Meaning::Pass, _) => Color(0xff, 0xb3, 0xd1),
        (Meaning::Fit, _) => Color(0x8f, 0xa8, 0xff),
    }
}

/// Colors for primitives that do not say what a hand does.
const SPARE: &[Color] = &[
    Color(0x7f, 0xd6, 0xe8),
    Color(0xe8, 0xb0, 0x8f),
    Color(0xa8, 0xd8, 0xb9),
    Color(0xd6, 0xa3, 0xb8),
    Color(0xb8, 0xc4, 0x7a),
    Color(0xa0, 0xb8, 0xe0),
];

fn spare(primitive: &str) -> Color {
    // A name has the same color in every report, whatever else is in it.
    let sum = primitive.bytes().fold(0_usize, |sum, byte| (sum * 31 + usize::from(byte)) % 9973);
    SPARE.get(sum % SPARE.len()).copied().unwrap_or(INK)
}

impl Color {
    /// `#rrggbb`.
    pub fn hex(self) -> String {
        format!("#{:02x}{:02x}{:02x}", self.0, self.1, self.2)
    }

    /// The nearest color of the 6 × 6 × 6 cube that every color terminal has.
    pub fn terminal(self) -> u8 {
        // The levels of the cube are 0, 95, 135, 175, 215, 255.
        let level = |part: u8| match part {
            0..48 => 0,
            48..115 => 1,
            _ => (part - 35) / 40,
        };
        16 + 36 * level(self.0) + 6 * level(self.1) + level(self.2)
    }
}
