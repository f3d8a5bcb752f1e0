//! Elements of arrays that are bound by their place although they have names: whether the place keeps its element.
//!
//! When one body is lost, another one takes its place in the array, and nothing in its numbers shows that.

use super::header::{BoundColumn, Header};
use std::collections::BTreeMap;
use teachtree_base::short_number::ShortNumber;
use teachtree_logs::issue::{Issue, IssueKind};
use teachtree_logs::read::element_names::ElementPlace;

/// A bound place in an array.
pub struct BoundPlace {
    /// The title of the first bound column.
    title: String,
    /// The column of the name.
    pub name: usize,
}

/// Returns the bound places whose elements have names.
pub(super) fn of(bound: &[BoundColumn], header: &Header) -> Vec<BoundPlace> {
    let mut places: Vec<BoundPlace> = vec![];
    for column in bound.iter().flat_map(|bound| &bound.terms).filter_map(|term| term.column) {
        let title = header.title(column);
        let Some(place) = ElementPlace::of(title).filter(|place| !place.is_name()) else { continue };
        let Some(name) = place.names().find_map(|name| header.find(&name, None).ok().flatten()) else { continue };
        if places.iter().all(|known| known.name != name) {
            places.push(BoundPlace { title: title.to_string(), name });
        }
    }
    places
}

/// The names that were found at bound places so far.
#[derive(Default)]
pub struct PlaceWatch {
    /// The first name at each place, by title; `None` once another one was found.
    first: BTreeMap<String, Option<String>>,
}

impl PlaceWatch {
    /// Looks at the names of rows, `texts` by column; returns an issue for each place whose element changes for the first time.
    pub fn look(&mut self, places: &[BoundPlace], time: &[f64], texts: &[Vec<String>]) -> Vec<Issue> {
        let mut issues = vec![];
        for place in places {
            let names = texts.get(place.name).into_iter().flatten().zip(time).filter(|(name, _)| !name.is_empty());
            for (name, stamp) in names {
                let first = self.first.entry(place.title.clone()).or_insert_with(|| Some(name.clone()));
                let Some(other) = first.take_if(|first| *first != *name) else { continue };
                let end_s = time.last().copied().unwrap_or(*stamp);
                issues.push(changed(place, &other, name, *stamp, end_s));
            }
        }
        issues
    }
}

fn changed(place: &BoundPlace, first: &str, then: &str, start_s: f64, end_s: f64) -> Issue {
    let named = ElementPlace::of(&place.title).map(|of| of.named(first)).unwrap_or_default();
    let message = format!(
        "is bound by its index, whose element is `{first}` at first and `{then}` at {} s; bind it by its name, `{named}`",
        ShortNumber((start_s * 1e3).round() / 1e3)
    );
    Issue { kind: IssueKind::CHANGED_ELEMENT, start_s, end_s, channel: place.title.clone(), message }
}
