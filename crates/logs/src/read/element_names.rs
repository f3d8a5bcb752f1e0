//! Elements of arrays by their names: `poses[2].position.x` is also `poses.cube.position.x` in a row in which `poses[2].name` is `cube`.
//!
//! The place of an element differs from message to message where bodies are lost and found. An element is named by a field of its own, or by the element at
//! the same place of an array of names beside it. A name that two elements of a row have names neither of them.

use super::formats::rosmsg::MAX_ARRAY;
use super::memory_table::{Cells, InMemoryTable};
use indexmap::IndexMap;
use std::collections::{BTreeMap, BTreeSet};
use teachtree_base::error::InputError;

/// The fields that name an element; the first one that the elements have counts.
const OWN: [&str; 4] = ["name", "label", "child_frame_id", "id"];
/// The arrays that name the elements of those beside them.
const BESIDE: [&str; 6] = ["name", "names", "label", "labels", "ids", "id"];

/// The place of an element in an array: `poses`, 2 and `.position.x` of `poses[2].position.x`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ElementPlace<'a> {
    /// The array.
    pub array: &'a str,
    /// The place, counted from 0.
    pub at: usize,
    /// The field.
    pub field: &'a str,
}

impl<'a> ElementPlace<'a> {
    /// The place that a title names; the outer one of arrays in arrays.
    pub fn of(title: &'a str) -> Option<Self> {
        let (array, rest) = title.split_once('[')?;
        let (at, field) = rest.split_once(']')?;
        let is_place = !array.is_empty() && at.bytes().all(|byte| byte.is_ascii_digit());
        is_place.then_some(())?;
        Some(Self { array, at: at.parse().ok()?, field })
    }

    /// The titles that may name the element, the first one that a log has counts.
    pub fn names(self) -> impl Iterator<Item = String> + 'a {
        let Self { array, at, field } = self;
        let own = OWN.iter().filter(move |_| !field.is_empty()).map(move |name| format!("{array}[{at}].{name}"));
        let parent = array.rfind('.').map_or("", |dot| array.get(..=dot).unwrap_or_default());
        let beside = BESIDE.iter().map(move |name| format!("{parent}{name}[{at}]"));
        own.chain(beside)
    }

    /// The title with the name of the element.
    pub fn named(self, name: &str) -> String {
        format!("{}.{name}{}", self.array, self.field)
    }

    /// Whether it is a name, not a named element.
    pub fn is_name(self) -> bool {
        let last = self.array.rsplit('.').next().unwrap_or_default();
        self.field.strip_prefix('.').is_some_and(|field| OWN.contains(&field))
            || self.field.is_empty() && BESIDE.contains(&last)
    }
}

/// The named elements of a table.
#[derive(Clone, Debug, Default)]
pub struct ElementNames {
    /// Number of columns that were examined.
    seen: usize,
    /// The columns of elements with the columns of their names, by array.
    arrays: BTreeMap<String, Vec<NamedColumn>>,
    /// The titles that names gave.
    given: BTreeSet<String>,
    /// The names so far, by array: at most [`MAX_ARRAY`], since numbers of detections may never end.
    known: BTreeMap<String, BTreeSet<String>>,
}

/// A column of an element.
#[derive(Clone, Debug)]
struct NamedColumn {
    at: usize,
    field: String,
    column: usize,
    /// The column of the name.
    name: usize,
}

/// A value with the title that a name gives.
enum NamedValue {
    Number(String, f64),
    Text(String, String),
}

impl ElementNames {
    /// Puts the values of named elements into the last row of a table once more, under the titles that names give and as far as these are `wanted`.
    ///
    /// # Errors
    /// There are too many columns.
    pub fn put(&mut self, table: &mut InMemoryTable, wanted: impl Fn(&str) -> bool) -> Result<(), InputError> {
        for value in self.of_last_row(table.columns(), table.rows(), wanted) {
            match value {
                NamedValue::Number(title, number) => table.put(&title, number)?,
                NamedValue::Text(title, text) => table.put_text(&title, &text)?,
            };
        }
        Ok(())
    }

    fn of_last_row(
        &mut self,
        columns: &IndexMap<String, Cells>,
        rows: usize,
        wanted: impl Fn(&str) -> bool,
    ) -> Vec<NamedValue> {
        self.look(columns);
        let cells = |column: usize| columns.get_index(column).map(|(_, cells)| cells).filter(|it| it.rows() == rows);
        let mut found = vec![];
        for (array, fields) in &self.arrays {
            let filled: Vec<(&NamedColumn, &Cells)> =
                fields.iter().filter_map(|field| Some((field, cells(field.column)?))).collect();
            let names: BTreeMap<usize, String> =
                filled.iter().filter_map(|(field, _)| Some((field.at, name(cells(field.name)?)?))).collect();
            let is_unique = |name: &String| names.values().filter(|other| *other == name).count() == 1;
            let known = self.known.entry(array.clone()).or_default();
            for (field, cells) in filled {
                let Some(name) = names.get(&field.at).filter(|name| is_unique(name)) else { continue };
                let title = ElementPlace { array, at: field.at, field: &field.field }.named(name);
                if !wanted(&title) || !known.contains(name) && known.len() >= MAX_ARRAY {
                    continue;
                }
                known.insert(name.clone());
                self.given.insert(title.clone());
                found.extend(match cells {
                    Cells::Texts(texts) => texts.last().map(|text| NamedValue::Text(title, text.clone())),
                    numbers => numbers.numbers().and_then(<[f64]>::last).map(|value| NamedValue::Number(title, *value)),
                });
            }
        }
        found
    }

    /// Looks at the columns that have come.
    fn look(&mut self, columns: &IndexMap<String, Cells>) {
        if self.seen == columns.len() {
            return;
        }
        self.seen = columns.len();
        self.arrays.clear();
        for (column, title) in columns.keys().enumerate().filter(|(_, title)| !self.given.contains(*title)) {
            let Some(place) = ElementPlace::of(title).filter(|place| !place.is_name()) else { continue };
            let Some(name) = place.names().find_map(|name| columns.get_index_of(&name)) else { continue };
            let named = NamedColumn { at: place.at, field: place.field.to_string(), column, name };
            self.arrays.entry(place.array.to_string()).or_default().push(named);
        }
    }
}

/// The name that the last row of a column says: a text, or a whole number.
fn name(cells: &Cells) -> Option<String> {
    match cells {
        Cells::Texts(texts) => texts.last().map(|text| text.trim().to_string()).filter(|text| !text.is_empty()),
        numbers => {
            let number = numbers.numbers()?.last()?;
            (number.fract() == 0.0).then(|| format!("{number:.0}"))
        }
    }
}
