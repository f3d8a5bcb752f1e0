//! Column patterns of a binding: `-F_R_f1_<object>_<xyz> [mN]` stands for a column for each object and each component.

use crate::base::channels::Shape;
use crate::base::quantity;
use crate::base::units::{Dimension, compound};
use serde::{Deserialize, Deserializer, de};
use std::fmt;

/// The columns of a channel: one pattern, or one for each component in the order x y z or w x y z.
#[derive(Clone, Debug, PartialEq)]
pub enum Columns {
    /// `R_f1_p<xyz> [mm]`
    Pattern(Pattern),
    /// `[q3, q0, q1, q2]`
    List(Vec<Pattern>),
}

/// A column, or several that differ in an object and a component.
#[derive(Clone, Debug, PartialEq)]
pub struct Pattern {
    /// The name as text and placeholders.
    pub name: Template,
    /// The unit in brackets; the header's own when left out, SI when that has none either.
    pub unit: Option<String>,
    /// -1 when the pattern begins with `-`.
    pub sign: f64,
    /// Makes a flag of the number.
    pub threshold: Option<Threshold>,
}

/// `> 0.2` or `< 30 mm` behind a column: when the flag is true.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Threshold {
    /// Whether the number has to be above the limit, or below it.
    pub above: bool,
    /// The limit, SI.
    pub limit: f64,
    /// What the limit, and so the column, measures.
    pub dimension: Dimension,
}

impl Threshold {
    /// The flag that a number makes; a number that was not measured makes none.
    pub fn flag(self, value: f64) -> f64 {
        if value.is_nan() { value } else { f64::from(u8::from((value > self.limit) == self.above)) }
    }

    fn parse(above: bool, text: &str) -> Result<Self, String> {
        let text = text.trim();
        // The unit begins behind the number.
        let unit = text.trim_start_matches(|c: char| c.is_ascii_digit() || matches!(c, '.' | '-' | '+' | 'e' | ' '));
        let (_, dimension) = compound(unit).map_err(|part| format!("`{part}` in `{text}` is no unit that I know"))?;
        let limit = quantity::parse(text, dimension)?;
        Ok(Self { above, limit, dimension })
    }
}

/// A name with placeholders.
#[derive(Clone, Debug, PartialEq)]
pub struct Template(Vec<Piece>);

#[derive(Clone, Debug, PartialEq)]
enum Piece {
    Text(String),
    /// `<object>`
    Object,
    /// `<other>`: another object.
    Other,
    /// `<xyz>`, `<wxyz>`, with the texts that stand for the components; `<xyz=0 1 2>` says them.
    Component(Shape, Vec<String>),
}

/// What the placeholders stand for.
#[derive(Clone, Copy, Debug, Default)]
pub struct Filling<'a> {
    /// `<object>`
    pub object: &'a str,
    /// `<other>`
    pub other: &'a str,
    /// Which component.
    pub component: usize,
}

impl Template {
    /// A name without placeholders.
    pub fn text(name: &str) -> Self {
        Self(vec![Piece::Text(name.to_string())])
    }

    /// Reads a name with placeholders.
    ///
    /// # Errors
    /// What was found instead of a placeholder that is known.
    pub fn parse(text: &str) -> Result<Self, String> {
        let mut pieces = vec![];
        let mut rest = text;
        while let Some((head, tail)) = rest.split_once('<') {
            let (placeholder, after) =
                tail.split_once('>').ok_or_else(|| format!("`<` in `{text}` is not closed by `>`"))?;
            if !head.is_empty() {
                pieces.push(Piece::Text(head.to_string()));
            }
            pieces.push(Self::placeholder(placeholder)?);
            rest = after;
        }
        if !rest.is_empty() {
            pieces.push(Piece::Text(rest.to_string()));
        }
        if pieces.is_empty() {
            return Err("found nothing, wanted the name of a column".into());
        }
        Ok(Self(pieces))
    }

    fn placeholder(text: &str) -> Result<Piece, String> {
        let (name, texts) = text.split_once('=').map_or((text, None), |(name, texts)| (name, Some(texts)));
        let shape = match name.trim() {
            "object" => return Ok(Piece::Object),
            "other" => return Ok(Piece::Other),
            "xyz" | "XYZ" => Shape::Vec3,
            "wxyz" | "WXYZ" | "xyzw" | "XYZW" => Shape::Rotation,
            other => return Err(format!("`<{other}>` is no placeholder, wanted <object>, <other>, <xyz> or <wxyz>")),
        };
        let letters: Vec<String> = match texts {
            // The placeholder says the order in which the texts are given, `<xyzw=3 4 5 6>`.
            Some(texts) => {
                let texts: Vec<&str> = texts.split([' ', ',']).filter(|text| !text.is_empty()).collect();
                if texts.len() != shape.components().len() {
                    return Err(format!(
                        "`<{text}>` gives {} texts for {} components",
                        texts.len(),
                        shape.components().len()
                    ));
                }
                let place = |component: &&str| {
                    name.to_lowercase().find(*component).and_then(|at| texts.get(at)).map(ToString::to_string)
                };
                shape.components().iter().filter_map(place).collect()
            }
            None if name.starts_with(char::is_uppercase) => {
                shape.components().iter().map(|letter| letter.to_uppercase()).collect()
            }
            None => shape.components().iter().map(ToString::to_string).collect(),
        };
        Ok(Piece::Component(shape, letters))
    }

    /// The name with the placeholders filled.
    pub fn fill(&self, filling: Filling) -> String {
        let text = |piece: &Piece| match piece {
            Piece::Text(text) => text.clone(),
            Piece::Object => filling.object.to_string(),
            Piece::Other => filling.other.to_string(),
            Piece::Component(_, texts) => texts.get(filling.component).cloned().unwrap_or_default(),
        };
        self.0.iter().map(text).collect()
    }

    /// Whether `<object>` occurs.
    pub fn has_object(&self) -> bool {
        self.0.contains(&Piece::Object)
    }

    /// Whether `<other>` occurs.
    pub fn has_other(&self) -> bool {
        self.0.contains(&Piece::Other)
    }

    /// What the component placeholder stands for, if there is one.
    pub fn shape(&self) -> Option<Shape> {
        self.0.iter().find_map(|piece| match piece {
            Piece::Component(shape, _) => Some(*shape),
            _ => None,
        })
    }
}

impl Columns {
    /// The patterns.
    pub fn patterns(&self) -> &[Pattern] {
        match self {
            Self::Pattern(pattern) => std::slice::from_ref(pattern),
            Self::List(patterns) => patterns,
        }
    }

    /// The pattern of a component.
    pub fn component(&self, component: usize) -> Option<&Pattern> {
        match self {
            Self::Pattern(pattern) => Some(pattern),
            Self::List(patterns) => patterns.get(component),
        }
    }

    /// What the columns make together, as far as their form tells.
    pub fn shape(&self) -> Shape {
        match self {
            Self::Pattern(pattern) => pattern.name.shape().unwrap_or(Shape::Scalar),
            Self::List(patterns) if patterns.len() == 4 => Shape::Rotation,
            Self::List(patterns) if patterns.len() == 3 => Shape::Vec3,
            Self::List(_) => Shape::Scalar,
        }
    }
}

impl Pattern {
    /// Reads a pattern.
    ///
    /// # Errors
    /// What was found that is no pattern.
    pub fn parse(text: &str) -> Result<Self, String> {
        let (text, threshold) = match (text.split_once(" > "), text.split_once(" < ")) {
            (Some((text, limit)), _) => (text, Some(Threshold::parse(true, limit)?)),
            (None, Some((text, limit))) => (text, Some(Threshold::parse(false, limit)?)),
            (None, None) => (text, None),
        };
        let (name, unit) = super::super::names::split_unit(text);
        let (name, sign) = name.strip_prefix('-').map_or((name, 1.0), |name| (name, -1.0));
        Ok(Self { name: Template::parse(name.trim())?, unit: unit.map(str::to_string), sign, threshold })
    }
}

impl<'de> Deserialize<'de> for Pattern {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        /// Tables without header call their columns by number.
        struct Visitor;
        impl de::Visitor<'_> for Visitor {
            type Value = Pattern;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a column")
            }
            fn visit_str<E: de::Error>(self, text: &str) -> Result<Pattern, E> {
                Pattern::parse(text).map_err(E::custom)
            }
            fn visit_u64<E: de::Error>(self, column: u64) -> Result<Pattern, E> {
                self.visit_str(&column.to_string())
            }
        }
        deserializer.deserialize_any(Visitor)
    }
}

impl<'de> Deserialize<'de> for Columns {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Visitor;
        impl<'de> de::Visitor<'de> for Visitor {
            type Value = Columns;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a column such as `R_f1_p<xyz> [mm]`, or a list of columns")
            }
            fn visit_str<E: de::Error>(self, text: &str) -> Result<Columns, E> {
                Pattern::parse(text).map(Columns::Pattern).map_err(E::custom)
            }
            fn visit_u64<E: de::Error>(self, column: u64) -> Result<Columns, E> {
                self.visit_str(&column.to_string())
            }
            fn visit_seq<A: de::SeqAccess<'de>>(self, mut items: A) -> Result<Columns, A::Error> {
                let mut patterns = vec![];
                while let Some(pattern) = items.next_element()? {
                    patterns.push(pattern);
                }
                match patterns.len() {
                    3 | 4 => Ok(Columns::List(patterns)),
                    found => Err(de::Error::custom(format!(
                        "found a list of {found} columns, wanted 3 (x y z) or 4 (w x y z)"
                    ))),
                }
            }
        }
        deserializer.deserialize_any(Visitor)
    }
}
