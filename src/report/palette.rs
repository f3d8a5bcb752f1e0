//! One colour for each primitive, the same in terminals and pages.
//!
//! The colours are light enough for dark letters on them (contrast at least 4.5 : 1) and stand on light and dark backgrounds. Families:
//! free motion grey, grasps green, carrying blue and teal, insertion violet, contact warm.

/// A colour, red green blue.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Color(pub u8, pub u8, pub u8);

/// The letters on every colour of a primitive.
pub const INK: Color = Color(0x16, 0x19, 0x1f);

/// What tasks are drawn in, by turns.
pub const TASKS: [Color; 2] = [Color(0xb9, 0xc4, 0xd6), Color(0xdd, 0xe3, 0xec)];

const PRIMITIVES: &[(&str, Color)] = &[
    ("Move", Color(0xc8, 0xcd, 0xd4)),
    ("Approach", Color(0xa6, 0xb4, 0xc8)),
    ("Grasp", Color(0x74, 0xc4, 0x76)),
    ("Translate", Color(0x6b, 0xae, 0xf0)),
    ("Slide", Color(0xf5, 0xd0, 0x4c)),
    ("Insert", Color(0xa9, 0x8c, 0xee)),
    ("Pullout", Color(0xcd, 0xb2, 0xf7)),
    ("Release", Color(0xd8, 0xcf, 0xbb)),
    ("Place", Color(0x4f, 0xc0, 0xb2)),
    ("Turn", Color(0xee, 0x8f, 0xc4)),
    ("Press", Color(0xf4, 0x82, 0x71)),
    ("Follow", Color(0xf7, 0xa1, 0x4a)),
    ("Push", Color(0xc9, 0x9a, 0x70)),
    ("Trace", Color(0xbd, 0xb7, 0x4b)),
    ("EqualGrasp", Color(0xb5, 0xd9, 0x5b)),
    ("MainGrasp(left)", Color(0x8c, 0xcf, 0x9f)),
    ("MainGrasp(right)", Color(0xcb, 0xe6, 0xa3)),
    ("Pass", Color(0xff, 0xb3, 0xd1)),
    ("Fit", Color(0x8f, 0xa8, 0xff)),
];

/// Colours for primitives that the chapter does not have.
const SPARE: &[Color] = &[
    Color(0x7f, 0xd6, 0xe8),
    Color(0xe8, 0xb0, 0x8f),
    Color(0xa8, 0xd8, 0xb9),
    Color(0xd6, 0xa3, 0xb8),
    Color(0xb8, 0xc4, 0x7a),
    Color(0xa0, 0xb8, 0xe0),
];

/// The colour of a primitive.
pub fn color(primitive: &str) -> Color {
    let known = PRIMITIVES.iter().find(|(name, _)| *name == primitive).map(|(_, color)| *color);
    known.unwrap_or_else(|| {
        // A name has the same colour in every report, whatever else is in it.
        let sum = primitive.bytes().fold(0_usize, |sum, byte| (sum * 31 + usize::from(byte)) % 9973);
        SPARE.get(sum % SPARE.len()).copied().unwrap_or(INK)
    })
}

impl Color {
    /// `#rrggbb`.
    pub fn hex(self) -> String {
        format!("#{:02x}{:02x}{:02x}", self.0, self.1, self.2)
    }

    /// The nearest colour of the 6 × 6 × 6 cube that every colour terminal has.
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
