//! Images that are small enough to have columns: arrays of bytes with the name of an image, or with as many rows and columns as a small image.

use super::parts::{Part, Quantity};
use super::words;
use crate::inspect::ColumnReport;
use std::collections::{BTreeMap, BTreeSet};

/// Words for images.
const IMAGES: [&str; 8] = ["image", "images", "img", "rgb", "rgbd", "depth", "pixel", "pixels"];
/// An array without such a word has at least this number of rows and of columns: objects with their coordinates have fewer.
const LEAST: usize = 8;

/// The largest value of a byte; flags are at most 1.
const BYTE: f64 = 255.0;
const FLAG: f64 = 1.0;

/// An array by its sheet and its name.
type ArrayName = (String, String);

/// Leaves out the columns of images; the first one of each stands for all.
pub fn leave_out(parts: &mut Vec<Part>) {
    let mut arrays: BTreeMap<ArrayName, Vec<&ColumnReport>> = BTreeMap::new();
    for part in &*parts {
        for column in &part.members {
            if let Some(array) = array(part, column) {
                arrays.entry(array).or_default().push(column);
            }
        }
    }
    let is_image = |columns: &Vec<&ColumnReport>| {
        columns.iter().all(|column| is_bytes(column)) && columns.iter().any(|column| column.max > FLAG)
    };
    let is_large = |(_, array): &ArrayName, columns: &[&ColumnReport]| {
        words::has(&words::words(array), &IMAGES) || long_axes(columns) > 1
    };
    let mut images: BTreeMap<ArrayName, usize> = arrays
        .into_iter()
        .filter(|(name, columns)| is_large(name, columns) && is_image(columns))
        .map(|(name, columns)| (name, columns.len()))
        .collect();
    parts.retain_mut(|part| {
        let Some(name) = part.members.first().and_then(|column| array(part, column)) else { return true };
        let Some(count) = images.get_mut(&name) else { return true };
        let is_first = *count > 0;
        if is_first {
            part.quantity = Quantity::Other;
            part.left_out = Some(format!("an image, as all {count} columns of {}", name.1));
            *count = 0;
        }
        is_first
    });
}

/// The array of a column with at least two indices: `camera` of `camera[0][3]`.
fn array(part: &Part, column: &ColumnReport) -> Option<ArrayName> {
    let (array, indices) = column.name.split_once('[')?;
    indices.contains("][").then(|| (part.sheet.name.clone(), array.to_string()))
}

/// Number of the axes of an array along which it has at least the rows of a small image.
fn long_axes(columns: &[&ColumnReport]) -> usize {
    let mut axes: Vec<BTreeSet<&str>> = vec![];
    for column in columns {
        for (axis, index) in column.name.split('[').skip(1).enumerate() {
            if axis == axes.len() {
                axes.push(BTreeSet::new());
            }
            axes[axis].insert(index);
        }
    }
    axes.iter().filter(|indices| indices.len() >= LEAST).count()
}

/// Whether all values are whole numbers that fit in a byte.
fn is_bytes(column: &ColumnReport) -> bool {
    column.min >= 0.0 && column.max <= BYTE && column.samples.iter().all(|value| value.fract() == 0.0)
}
