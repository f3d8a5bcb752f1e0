//! Column patterns of a binding: `-F_R_f1_<object>_<xyz> [mN]` stands for a column for each object and each component.

use super::linear::LinearForm;
use serde::{Deserialize, Deserializer, de};
use std::fmt;
use teachtree_base::channels::Shape;
use teachtree_base::quantity::{self, Length};
use teachtree_base::units::{Dimension, compound_of_log};

/// The columns of a channel: one pattern, or one for each component.
#[derive(Clone, Debug, PartialEq)]
pub enum Columns {
    /// `R_f1_p<xyz> [mm]`
    Pattern(Pattern),
    /// `[q3, q0, q1, q2]`
    List(Vec<Pattern>),
    /// `{mean: [left <XYZ>, right <XYZ>]}`: the point in the middle of several markers.
    Mean(Vec<Pattern>),
    /// `{at: [0 mm, 0 mm, 155 mm], of: right.palm}`: a point that moves with a frame.
    OffsetPoint(OffsetPoint),
    /// `{link: arm.hand, at: [0 mm, 0 mm, 103 mm]}`: a link of a robot whose joints the log has.
    Link(LinkPoint),
    /// `{between: [right.thumb, right.index], less: 12 mm}`: how far two points are apart.
    PointDistance(PointDistance),
}

/// A point in a frame whose pose the log has.
#[derive(Clone, Debug, PartialEq)]
pub struct OffsetPoint {
    /// Its position in that frame, m.
    pub at: [f64; 3],
    /// The frame: what `.position` and `.rotation` stand after.
    pub of: String,
}

/// A point of a link.
#[derive(Clone, Debug, PartialEq)]
pub struct LinkPoint {
    /// The robot.
    pub robot: String,
    /// The link.
    pub link: String,
    /// The position of the point in the frame of the link, m.
    pub at: [f64; 3],
}

/// The distance of two points.
#[derive(Clone, Debug, PartialEq)]
pub struct PointDistance {
    /// The points: what `.position` stands after.
    pub between: [String; 2],
    /// The subtracted length, m.
    pub less: f64,
    /// Makes a flag: the distance is less than this, m.
    pub below: Option<f64>,
}

/// The quantity that columns form together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Representation {
    /// One column.
    Scalar,
    /// x y z
    Vector,
    /// w x y z
    Quaternion,
    /// Roll, pitch and yaw: turns about the fixed axes x, y and z, in this order.
    Angles,
    /// The axis of a rotation, as long as its angle.
    RotationVector,
    /// A rotation matrix, row by row.
    Matrix,
}

impl Representation {
    /// The names of the columns after the name of the channel. Columns that are not of a quaternion are temporary.
    pub fn components(self) -> &'static [&'static str] {
        match self {
            Self::Scalar => Shape::Scalar.components(),
            Self::Vector => Shape::Vec3.components(),
            Self::Quaternion => Shape::Rotation.components(),
            Self::Angles => &["roll", "pitch", "yaw"],
            Self::RotationVector => &["rotvec_x", "rotvec_y", "rotvec_z"],
            Self::Matrix => &["m00", "m01", "m02", "m10", "m11", "m12", "m20", "m21", "m22"],
        }
    }

    /// The shape of what they make.
    pub fn shape(self) -> Shape {
        match self {
            Self::Scalar => Shape::Scalar,
            Self::Vector => Shape::Vec3,
            Self::Quaternion | Self::Angles | Self::RotationVector | Self::Matrix => Shape::Rotation,
        }
    }
}

/// A column, or several that differ in an object and a component.
#[derive(Clone, Debug, PartialEq)]
pub struct Pattern {
    /// As written in the binding.
    pub written: String,
    /// The name as text and placeholders.
    pub name: Template,
    /// The unit in brackets; by default that of the header, else SI.
    pub unit: Option<String>,
    /// -1 when the pattern begins with `-`.
    pub sign: f64,
    /// `* 0.1 + 3` after the name.
    pub linear: Option<LinearForm>,
    /// The name with scale and offset, which may also be the name of a column, such as `Marker - 2`.
    pub title: Template,
    /// Whether logs may lack it: `?` at the end.
    pub optional: bool,
    /// Makes a flag of the number.
    pub threshold: Option<Threshold>,
    /// A constant value in SI with its dimension, instead of a column: `= 20 mm`.
    pub constant: Option<(f64, Dimension)>,
}

/// `> 0.2` or `< 30 mm` behind a column: when the flag is true.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Threshold {
    /// Whether the number has to be above the limit, or below it.
    pub above: bool,
    /// The limit, SI.
    pub limit: f64,
    /// The dimension of the limit and the column.
    pub dimension: Dimension,
}

impl Threshold {
    /// The flag that a number makes; a number that was not measured makes none.
    pub fn flag(self, value: f64) -> f64 {
        if value.is_nan() { value } else { f64::from(u8::from((value > self.limit) == self.above)) }
    }

    fn parse(above: bool, text: &str) -> Result<Self, String> {
        let (limit, dimension) = number_with_unit(text)?;
        Ok(Self { above, limit, dimension })
    }
}

/// A number with its unit, SI, and what it measures.
fn number_with_unit(text: &str) -> Result<(f64, Dimension), String> {
    let text = text.trim();
    // The unit begins after the number.
    let unit = text.trim_start_matches(|c: char| c.is_ascii_digit() || matches!(c, '.' | '-' | '+' | 'e' | ' '));
    let (_, dimension) = compound_of_log(unit).map_err(|part| format!("`{part}` in `{text}` is not a known unit"))?;
    Ok((quantity::parse(text, dimension)?, dimension))
}

/// A name with placeholders.
#[derive(Clone, Debug, PartialEq)]
pub struct Template(Vec<TemplatePart>);

#[derive(Clone, Debug, PartialEq)]
enum TemplatePart {
    Text(String),
    /// `<object>`
    Object,
    /// `<other>`: another object.
    Other,
    /// `<xyz>`, `<wxyz>`, `<rpy>`, `<rotvec>`, with the texts that stand for the components; `<xyz=0 1 2>` lists them.
    Component(Representation, Vec<String>),
}

/// The values of the placeholders.
#[derive(Clone, Copy, Debug, Default)]
pub struct PlaceholderValues<'a> {
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
        Self(vec![TemplatePart::Text(name.to_string())])
    }

    /// The text before the first placeholder.
    pub fn start(&self) -> &str {
        match self.0.first() {
            Some(TemplatePart::Text(text)) => text,
            _ => "",
        }
    }

    /// Reads a name with placeholders.
    ///
    /// # Errors
    /// The unknown placeholder.
    pub fn parse(text: &str) -> Result<Self, String> {
        let mut pieces = vec![];
        let mut rest = text;
        while let Some((head, tail)) = rest.split_once('<') {
            let (placeholder, after) =
                tail.split_once('>').ok_or_else(|| format!("`<` in `{text}` is not closed by `>`"))?;
            if !head.is_empty() {
                pieces.push(TemplatePart::Text(head.to_string()));
            }
            pieces.push(Self::placeholder(placeholder)?);
            rest = after;
        }
        if !rest.is_empty() {
            pieces.push(TemplatePart::Text(rest.to_string()));
        }
        if pieces.is_empty() {
            return Err("found nothing, expected the name of a column".into());
        }
        Ok(Self(pieces))
    }

    fn placeholder(text: &str) -> Result<TemplatePart, String> {
        let (name, texts) = text.split_once('=').map_or((text, None), |(name, texts)| (name, Some(texts)));
        let (representation, order) = match name.trim() {
            "object" => return Ok(TemplatePart::Object),
            "other" => return Ok(TemplatePart::Other),
            "xyz" | "XYZ" => (Representation::Vector, "xyz"),
            "wxyz" | "WXYZ" | "xyzw" | "XYZW" => (Representation::Quaternion, "wxyz"),
            "rpy" | "RPY" => (Representation::Angles, "rpy"),
            "rotvec" | "ROTVEC" => (Representation::RotationVector, "xyz"),
            other => {
                return Err(format!(
                    "`<{other}>` is not a placeholder, expected <object>, <other>, <xyz>, <wxyz>, <rpy> or <rotvec>"
                ));
            }
        };
        let letters: Vec<String> = match texts {
            // The placeholder says the order in which the texts are given, `<xyzw=3 4 5 6>`.
            Some(texts) => {
                let texts: Vec<&str> = texts.split([' ', ',']).filter(|text| !text.is_empty()).collect();
                if texts.len() != order.len() {
                    return Err(format!("`<{text}>` gives {} texts for {} components", texts.len(), order.len()));
                }
                let written = if representation == Representation::RotationVector { order } else { name };
                let place = |component: char| {
                    written.to_lowercase().find(component).and_then(|at| texts.get(at)).map(ToString::to_string)
                };
                order.chars().filter_map(place).collect()
            }
            None if name.starts_with(char::is_uppercase) => {
                order.chars().map(|letter| letter.to_uppercase().to_string()).collect()
            }
            None => order.chars().map(String::from).collect(),
        };
        Ok(TemplatePart::Component(representation, letters))
    }

    /// The name with the placeholders filled.
    pub fn fill(&self, filling: PlaceholderValues) -> String {
        let text = |piece: &TemplatePart| match piece {
            TemplatePart::Text(text) => text.clone(),
            TemplatePart::Object => filling.object.to_string(),
            TemplatePart::Other => filling.other.to_string(),
            TemplatePart::Component(_, texts) => texts.get(filling.component).cloned().unwrap_or_default(),
        };
        self.0.iter().map(text).collect()
    }

    /// Whether the name matches with filled placeholders. `<object>` and `<other>` stand for one of `objects`.
    pub fn fits(&self, name: &str, objects: &[&str]) -> bool {
        Self::rest_fits(&self.0, name, objects)
    }

    fn rest_fits(pieces: &[TemplatePart], name: &str, objects: &[&str]) -> bool {
        let Some((piece, rest)) = pieces.split_first() else { return name.is_empty() };
        let fits = |text: &str| name.strip_prefix(text).is_some_and(|name| Self::rest_fits(rest, name, objects));
        match piece {
            TemplatePart::Text(text) => fits(text),
            TemplatePart::Object | TemplatePart::Other => objects.iter().any(|object| fits(object)),
            TemplatePart::Component(_, texts) => texts.iter().any(|text| fits(text)),
        }
    }

    /// Whether `<object>` occurs.
    pub fn has_object(&self) -> bool {
        self.0.contains(&TemplatePart::Object)
    }

    /// Whether `<other>` occurs.
    pub fn has_other(&self) -> bool {
        self.0.contains(&TemplatePart::Other)
    }

    /// Returns the value of the component placeholder, if there is one.
    pub fn representation(&self) -> Option<Representation> {
        self.0.iter().find_map(|piece| match piece {
            TemplatePart::Component(representation, _) => Some(*representation),
            _ => None,
        })
    }
}

impl Columns {
    /// The patterns.
    pub fn patterns(&self) -> &[Pattern] {
        match self {
            Self::Pattern(pattern) => std::slice::from_ref(pattern),
            Self::List(patterns) | Self::Mean(patterns) => patterns,
            Self::OffsetPoint(_) | Self::Link(_) | Self::PointDistance(_) => &[],
        }
    }

    /// The patterns of a component, which all count, and how much each does.
    pub fn component(&self, component: usize) -> (&[Pattern], f64) {
        match self {
            Self::Pattern(pattern) => (std::slice::from_ref(pattern), 1.0),
            Self::List(patterns) => (patterns.get(component).map(std::slice::from_ref).unwrap_or_default(), 1.0),
            Self::Mean(patterns) => (patterns, 1.0 / patterns.len() as f64),
            Self::OffsetPoint(_) | Self::Link(_) | Self::PointDistance(_) => (&[], 1.0),
        }
    }

    /// Returns the quantity that the columns form for a channel of this shape, as far as their form shows.
    pub fn representation(&self, wanted: Option<Shape>) -> Representation {
        match self {
            Self::Pattern(pattern) => pattern.name.representation().unwrap_or(Representation::Scalar),
            Self::Mean(patterns) => {
                patterns.first().and_then(|pattern| pattern.name.representation()).unwrap_or(Representation::Scalar)
            }
            Self::OffsetPoint(_) | Self::Link(_) => Representation::Vector,
            Self::PointDistance(_) => Representation::Scalar,
            Self::List(patterns) => match patterns.len() {
                9 => Representation::Matrix,
                4 => Representation::Quaternion,
                3 if wanted == Some(Shape::Rotation) => Representation::Angles,
                3 => Representation::Vector,
                _ => Representation::Scalar,
            },
        }
    }
}

impl Pattern {
    /// Reads a pattern.
    ///
    /// # Errors
    /// The text that is not a pattern.
    pub fn parse(text: &str) -> Result<Self, String> {
        if let Some(value) = text.trim_start().strip_prefix('=') {
            let of = Self::of(Template::text(text));
            return Ok(Self { constant: Some(number_with_unit(value)?), ..of });
        }
        let written = text.to_string();
        let (text, threshold) = match (text.split_once(" > "), text.split_once(" < ")) {
            (Some((text, limit)), _) => (text, Some(Threshold::parse(true, limit)?)),
            (None, Some((text, limit))) => (text, Some(Threshold::parse(false, limit)?)),
            (None, None) => (text, None),
        };
        let (text, optional) = text.trim_end().strip_suffix('?').map_or((text, false), |text| (text, true));
        let (name, unit) = teachtree_logs::names::split_unit(text);
        let (name, sign) = name.strip_prefix('-').map_or((name, 1.0), |name| (name, -1.0));
        let title = Template::parse(name.trim())?;
        let (name, linear) = LinearForm::split(name)?;
        let (name, unit) = (Template::parse(name)?, unit.map(str::to_string));
        Ok(Self { written, name, unit, sign, linear, title, optional, threshold, constant: None })
    }

    /// The column of exactly this name.
    pub(super) fn of(name: Template) -> Self {
        let (written, unit, linear, title) = (name.fill(PlaceholderValues::default()), None, None, name.clone());
        Self { written, name, unit, sign: 1.0, linear, title, optional: false, threshold: None, constant: None }
    }

    /// The opposite flag, as a binding has it; `None` of a constant.
    pub fn turned(&self) -> Option<String> {
        let (from, to) = match self.threshold {
            None if self.constant.is_some() => return None,
            None => return Some(format!("{} < 0.5", self.written)),
            Some(threshold) if threshold.above => (" > ", " < "),
            Some(_) => (" < ", " > "),
        };
        Some(self.written.replacen(from, to, 1))
    }

    /// Returns the column, converted by this form into a unit; unchanged if it has its own conversion or unit.
    pub(super) fn converted(self, form: LinearForm, unit: &str) -> Self {
        if self.unit.is_some() || self.linear.is_some() || self.threshold.is_some() || self.constant.is_some() {
            return self;
        }
        // No column has the whole text as its name.
        let title =
            format!("{} * {} + {} [{unit}]", self.name.fill(PlaceholderValues::default()), form.scale, form.offset);
        Self { unit: Some(unit.to_string()), linear: Some(form), title: Template::text(&title), ..self }
    }

    /// Whether it matches the column of this name. `<object>` and `<other>` stand for one of `objects`.
    pub fn fits(&self, name: &str, objects: &[&str]) -> bool {
        self.name.fits(name, objects) || self.title.fits(name, objects)
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
                f.write_str(
                    "a column such as `R_f1_p<xyz> [mm]`, a list of columns, `{mean: […]}`, `{at: […], of: …}`, `{link: …}` or `{between: […]}`",
                )
            }
            fn visit_str<E: de::Error>(self, text: &str) -> Result<Columns, E> {
                Pattern::parse(text).map(Columns::Pattern).map_err(E::custom)
            }
            fn visit_u64<E: de::Error>(self, column: u64) -> Result<Columns, E> {
                self.visit_str(&column.to_string())
            }
            fn visit_map<A: de::MapAccess<'de>>(self, mut items: A) -> Result<Columns, A::Error> {
                let wanted = || {
                    de::Error::custom(
                        "expected `{mean: [left <xyz>, right <xyz>]}`, with two columns or more, `{at: [0 mm, 0 mm, 155 mm], of: right.palm}`, \
                         `{link: arm.hand, at: [0 mm, 0 mm, 103 mm]}` or `{between: [right.thumb, right.index], less: 12 mm}`",
                    )
                };
                let (mut mean, mut at, mut of, mut link) = (None, None, None, None);
                let (mut between, mut less, mut below) = (None, None, None);
                while let Some(key) = items.next_key::<String>()? {
                    match key.as_str() {
                        "mean" if mean.is_none() => mean = Some(items.next_value::<Vec<Pattern>>()?),
                        "at" if at.is_none() => at = Some(items.next_value::<[Length; 3]>()?.map(|part| part.0)),
                        "of" if of.is_none() => of = Some(items.next_value::<String>()?),
                        "link" if link.is_none() => link = Some(items.next_value::<String>()?),
                        "between" if between.is_none() => between = Some(items.next_value::<[String; 2]>()?),
                        "less" if less.is_none() => less = Some(items.next_value::<Length>()?.0),
                        "below" if below.is_none() => below = Some(items.next_value::<Length>()?.0),
                        _ => return Err(wanted()),
                    }
                }
                if let Some(between) = between {
                    let alone = mean.is_none() && at.is_none() && of.is_none() && link.is_none();
                    let span = PointDistance { between, less: less.unwrap_or_default(), below };
                    return if alone { Ok(Columns::PointDistance(span)) } else { Err(wanted()) };
                }
                match (mean, at, of, link) {
                    _ if less.is_some() || below.is_some() => Err(wanted()),
                    (Some(patterns), None, None, None) if patterns.len() >= 2 => Ok(Columns::Mean(patterns)),
                    (None, Some(at), Some(of), None) => Ok(Columns::OffsetPoint(OffsetPoint { at, of })),
                    (None, at, None, Some(link)) => {
                        let (robot, link) = link.split_once('.').ok_or_else(|| {
                            de::Error::custom(format!("found `{link}`, expected a robot and its link: `arm.{link}`"))
                        })?;
                        let (robot, link) = (robot.to_string(), link.to_string());
                        Ok(Columns::Link(LinkPoint { robot, link, at: at.unwrap_or_default() }))
                    }
                    _ => Err(wanted()),
                }
            }
            fn visit_seq<A: de::SeqAccess<'de>>(self, mut items: A) -> Result<Columns, A::Error> {
                let mut patterns = vec![];
                while let Some(pattern) = items.next_element()? {
                    patterns.push(pattern);
                }
                match patterns.len() {
                    3 | 4 | 9 => Ok(Columns::List(patterns)),
                    found => Err(de::Error::custom(format!(
                        "found a list of {found} columns, expected 3 (x y z; roll pitch yaw), 4 (w x y z) or 9 (a rotation matrix, row by row)"
                    ))),
                }
            }
        }
        deserializer.deserialize_any(Visitor)
    }
}

impl schemars::JsonSchema for Pattern {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Column".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({
            "description": "A column by its title, such as `force_x [mN]`, `-az`, `adc * 0.1 - 3 [N]`, `grip > 0.5`, `touch?` or `palm = 0 mm`; by its number in a table without header.",
            "anyOf": [{ "type": "string" }, { "type": "integer", "minimum": 0 }]
        })
    }
}

impl schemars::JsonSchema for Columns {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Columns".into()
    }

    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        use serde_json::{Value, json};
        let column = generator.subschema_for::<Pattern>();
        let (length, position) = (generator.subschema_for::<Length>(), generator.subschema_for::<[Length; 3]>());
        let keys = |keys: Value, needed: &[&str]| json!({ "type": "object", "properties": keys, "required": needed, "additionalProperties": false });
        let list = |count: usize| schemars::json_schema!({ "type": "array", "items": column, "minItems": count, "maxItems": count });
        schemars::json_schema!({
            "description": "A column such as `R_f1_p<xyz> [mm]`; a list of 3 (x y z; roll pitch yaw), 4 (w x y z) or 9 columns (a rotation matrix, row by row); the mean of columns; a point that is fixed to a hand or a body, or to a link of a robot; the gap between two fingertips.",
            "anyOf": [
                column, list(3), list(4), list(9),
                keys(json!({ "mean": { "type": "array", "items": column, "minItems": 2 } }), &["mean"]),
                keys(json!({ "at": position, "of": { "type": "string" } }), &["at", "of"]),
                keys(json!({ "link": { "type": "string" }, "at": position }), &["link"]),
                keys(json!({ "between": { "type": "array", "items": { "type": "string" }, "minItems": 2, "maxItems": 2 }, "less": length, "below": length }), &["between"])
            ]
        })
    }
}
