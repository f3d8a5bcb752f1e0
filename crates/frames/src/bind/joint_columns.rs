//! The columns of a robot's joints in a binding: a column for each joint, or one text with `<joint>` or `<index>` for all.

use super::{Columns, Pattern};
use indexmap::IndexMap;
use serde::{Deserialize, Deserializer, de};
use std::fmt;

/// The columns of the joints, as a binding names them.
#[derive(Clone, Debug)]
pub enum JointColumns {
    /// A column for each joint.
    Each(IndexMap<String, Columns>),
    /// `observation.state.<joint>.pos`
    All(String),
}

impl JointColumns {
    /// The columns of these joints, in this order.
    ///
    /// # Errors
    /// The text has neither `<joint>` nor `<index>`, or is not a column.
    pub fn of<'a>(&self, joints: impl Iterator<Item = &'a str>) -> Result<IndexMap<String, Columns>, String> {
        let text = match self {
            Self::Each(columns) => return Ok(columns.clone()),
            Self::All(text) => text,
        };
        if !text.contains("<joint>") && !text.contains("<index>") {
            return Err(format!(
                "found `{text}` for all joints, expected `<joint>` or `<index>` in it, such as `observation.state.<joint>.pos`, or a column for each joint"
            ));
        }
        let column = |(index, joint): (usize, &str)| {
            let name = text.replace("<joint>", joint).replace("<index>", &index.to_string());
            Ok((joint.to_string(), Columns::Pattern(Pattern::parse(&name)?)))
        };
        joints.enumerate().map(column).collect()
    }
}

impl<'de> Deserialize<'de> for JointColumns {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Visitor;
        impl<'de> de::Visitor<'de> for Visitor {
            type Value = JointColumns;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a column for each joint, or one text with `<joint>` or `<index>`")
            }
            fn visit_str<E: de::Error>(self, text: &str) -> Result<JointColumns, E> {
                Ok(JointColumns::All(text.to_string()))
            }
            fn visit_map<A: de::MapAccess<'de>>(self, items: A) -> Result<JointColumns, A::Error> {
                let columns = IndexMap::deserialize(de::value::MapAccessDeserializer::new(items))?;
                Ok(JointColumns::Each(columns))
            }
        }
        deserializer.deserialize_any(Visitor)
    }
}

impl schemars::JsonSchema for JointColumns {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "JointColumns".into()
    }

    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        let columns = generator.subschema_for::<IndexMap<String, Columns>>();
        schemars::json_schema!({
            "description": "A column for each joint that moves, or one text for all, such as `observation.state.<joint>.pos` or `joint_positions[<index>] [rad]`.",
            "anyOf": [columns, { "type": "string" }]
        })
    }
}
