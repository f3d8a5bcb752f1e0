//! The known name nearest to an unknown one, for `did you mean`.

/// Longer names are not compared: they are not typing errors, and the comparison takes the product of the lengths.
const LONGEST: usize = 100;

/// The known word that is nearest to `word`, if one is near: at most a third of its letters are wrong, and at least one is right.
pub fn nearest<'n>(word: &str, known: impl IntoIterator<Item = &'n str>) -> Option<&'n str> {
    if word.len() > LONGEST {
        return None;
    }
    let bound = (word.chars().count() / 3).max(1);
    known
        .into_iter()
        .filter(|near| near.len().abs_diff(word.len()) <= bound && near.len() <= LONGEST)
        .filter(|near| *near != word)
        .map(|near| (distance(word, near), near))
        .filter(|(distance, near)| {
            *distance <= bound && *distance < near.chars().count() && *distance < word.chars().count()
        })
        .min()
        .map(|(_, near)| near)
}

/// Letters to add, drop, change, or swap with their neighbor; a change of case is none.
fn distance(one: &str, two: &str) -> usize {
    let one: Vec<char> = one.to_lowercase().chars().collect();
    let two: Vec<char> = two.to_lowercase().chars().collect();
    let width = two.len() + 1;
    let mut rows: Vec<usize> = vec![0; width * (one.len() + 1)];
    let at = |row: usize, column: usize| row * width + column;
    for row in 0..=one.len() {
        for column in 0..=two.len() {
            let get = |row: usize, column: usize| rows.get(at(row, column)).copied().unwrap_or(0);
            let letter = |row: usize| one.get(row.wrapping_sub(1));
            let other = |column: usize| two.get(column.wrapping_sub(1));
            let best = if row == 0 || column == 0 {
                row + column
            } else {
                let change = get(row - 1, column - 1) + usize::from(letter(row) != other(column));
                let mut best = change.min(get(row - 1, column) + 1).min(get(row, column - 1) + 1);
                if row > 1 && column > 1 && letter(row) == other(column - 1) && letter(row - 1) == other(column) {
                    best = best.min(get(row - 2, column - 2) + 1);
                }
                best
            };
            if let Some(cell) = rows.get_mut(at(row, column)) {
                *cell = best;
            }
        }
    }
    rows.last().copied().unwrap_or(0)
}
