//! Titles over several lines, as of motion capture: lines above the titles name groups of columns, such as bodies, and are parts of the names.

use std::collections::BTreeSet;

/// The lines above the titles, the nearest first.
#[derive(Default)]
pub(super) struct GroupRows(Vec<Vec<String>>);

impl GroupRows {
    /// Takes the lines above the titles, the nearest first, as long as they have several cells and no more than the titles.
    pub fn new<'a>(lines: impl Iterator<Item = Vec<&'a str>>, width: usize) -> Self {
        let is_row = |cells: &Vec<&str>| cells.len() > 1 && cells.len() <= width;
        Self(lines.take_while(is_row).map(|cells| cells.into_iter().map(str::to_string).collect()).collect())
    }

    /// Whether columns have one title, and these lines make their names different.
    pub fn distinguish(&self, titles: Vec<&str>) -> bool {
        let titles: Vec<String> = titles.into_iter().map(str::to_string).collect();
        let composed = self.compose(titles.clone());
        composed != titles && is_unique(&composed)
    }

    /// Composes names, `cube.Position.X`, if several columns have one title. Uses the fewest lines that make all names different, and returns the titles if none
    /// do.
    pub fn compose(&self, titles: Vec<String>) -> Vec<String> {
        let (titles, rows) = self.filled(titles);
        let mut names = titles.clone();
        for row in rows {
            if is_unique(&names) {
                return names;
            }
            let Some(groups) = groups(row, &titles) else { continue };
            for (name, group) in
                names.iter_mut().zip(groups).filter(|(name, group)| !group.is_empty() && name.as_str() != *group)
            {
                *name = format!("{group}.{name}");
            }
        }
        if is_unique(&names) { names } else { titles }
    }
}

impl GroupRows {
    /// Fills empty titles from the lines above, as where the index of a table of pandas is named below its columns, or a marker above its coordinates. Returns the
    /// other lines too.
    fn filled(&self, mut titles: Vec<String>) -> (Vec<String>, Vec<&Vec<String>>) {
        let mut others = vec![];
        for row in &self.0 {
            let fills = |(title, cell): &(&String, &String)| title.is_empty() && !cell.is_empty();
            let filled = titles.iter().zip(row).filter(fills).count();
            let is_filler = filled > 0 && row.len() == titles.len();
            // A line that has most of the titles names no groups.
            if !is_filler || 2 * filled <= titles.len() {
                others.push(row);
            }
            if is_filler {
                let empty = titles.iter_mut().zip(row).filter(|(title, _)| title.is_empty());
                empty.for_each(|(title, cell)| title.clone_from(cell));
            }
        }
        (titles, others)
    }
}

/// Whether all names that are not empty differ.
fn is_unique(names: &[String]) -> bool {
    let mut known = BTreeSet::new();
    names.iter().filter(|name| !name.is_empty()).all(|name| known.insert(name))
}

/// The group of each column: the last cell before it. A first cell above a title that occurs once is the name of the line itself, such as `Name`. `None` if the line
/// tells no columns apart, names each of them, or has identifiers.
fn groups<'r>(row: &'r [String], titles: &[String]) -> Option<Vec<&'r str>> {
    let first = row.iter().position(|cell| !cell.is_empty())?;
    let is_title_line = row.len() == titles.len() && row.iter().all(|cell| !cell.is_empty()) && is_unique(row);
    if is_title_line {
        return None;
    }
    let count = |title: &String| titles.iter().filter(|other| *other == title).count();
    let is_label = titles.get(first).is_some_and(|title| count(title) < 2);
    if is_label && row.get(first).is_some_and(|label| label.eq_ignore_ascii_case("id")) {
        return None;
    }
    let mut group = "";
    let groups: Vec<&str> = (0..titles.len())
        .map(|at| {
            if let Some(cell) = row.get(at).filter(|cell| !(cell.is_empty() || is_label && at == first)) {
                group = cell;
            }
            group
        })
        .collect();
    let names: BTreeSet<&str> = groups.iter().copied().filter(|group| !group.is_empty()).collect();
    (names.len() > 1).then_some(groups)
}
